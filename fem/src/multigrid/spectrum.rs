//! The largest eigenvalue of a matrix over its diagonal blocks.

use nalgebra::SMatrix;

use super::block_rows::{Dense, for_each_entry, times};
use super::sweeps::Sweeps;
use crate::vector::dot;

/// Steps of Lanczos iteration.
const STEPS: usize = 5;

/// Squares below this are round-off: the vectors so far span an invariant space.
const ROUND_OFF: f64 = 1e-20;

/// Largest eigenvalue of `D^-1 A` by a fixed number of Lanczos steps in the inner product of `D` from a fixed start; too
/// small by some percents. One, if there is nothing to work on.
pub(crate) fn largest_eigenvalue<const B: usize>(a: &Sweeps<B>) -> f64 {
    let inverse = a.inverse_diagonal();
    let n = inverse.len();
    // D v of this step and of the one before
    let entry = |i: usize, b: usize| pseudo_random((i * B + b) as u64);
    let mut d_v: Vec<[f64; B]> = (0..n).map(|i| std::array::from_fn(|b| entry(i, b))).collect();
    let mut d_before = vec![[0.0; B]; n];
    let (mut v, mut next) = (d_before.clone(), d_before.clone());
    let mut t = SMatrix::<f64, STEPS, STEPS>::zeros();
    apply(inverse, &d_v, &mut v);
    let mut beta = dot(v.as_flattened(), d_v.as_flattened()).sqrt();
    for k in 0..STEPS {
        if beta * beta <= ROUND_OFF || beta.is_nan() {
            break;
        }
        for vector in [&mut v, &mut d_v] {
            vector.as_flattened_mut().iter_mut().for_each(|x| *x /= beta);
        }
        if k > 0 {
            t[(k, k - 1)] = beta;
            t[(k - 1, k)] = beta;
        }
        a.multiply(&v, &d_v, &mut next);
        let alpha = dot(v.as_flattened(), next.as_flattened());
        t[(k, k)] = alpha;
        let old = if k > 0 { beta } else { 0.0 };
        for ((next, v), before) in next.iter_mut().zip(&d_v).zip(&d_before) {
            (0..B).for_each(|b| next[b] -= alpha * v[b] + old * before[b]);
        }
        std::mem::swap(&mut d_before, &mut d_v);
        std::mem::swap(&mut d_v, &mut next);
        apply(inverse, &d_v, &mut v);
        beta = dot(v.as_flattened(), d_v.as_flattened()).sqrt();
    }
    let largest = t.symmetric_eigenvalues().max();
    if largest > 0.0 { largest } else { 1.0 }
}

fn apply<const B: usize>(d: &[Dense<B, B>], x: &[[f64; B]], y: &mut [[f64; B]]) {
    for_each_entry(
        y,
        #[inline(always)]
        |i, y| *y = times(&d[i], &x[i]),
    );
}

/// Numbers between -1 and 1 (SplitMix64, Steele, Lea and Flood 2014).
fn pseudo_random(index: u64) -> f64 {
    let mut z = (index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
