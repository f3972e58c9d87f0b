//! Sums over vectors with a fixed order of additions.

/// Partial sums; a compiler can keep them in vector registers.
const LANES: usize = 8;

/// `a . b`, of equal lengths.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for k in 0..LANES {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Euclidean norm.
pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Index of the first entry that is NaN or infinite.
pub(crate) fn first_not_finite(a: &[f64]) -> Option<usize> {
    a.iter().position(|x| !x.is_finite())
}
