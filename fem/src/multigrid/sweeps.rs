//! The smoother: Gauss-Seidel sweeps by blocks.

use nalgebra::SMatrix;

use super::block_rows::{BlockRows, Dense, Single, SquareRows, add_times, double, for_each_entry, single, times};
use crate::vectorised::vectorised;

/// A pivot below this fraction of its diagonal entry is round-off.
const LEAST_PIVOT: f64 = 1e-14;

/// A symmetric matrix as the sweeps read it: both triangles without the diagonal in single precision, and inverses of the
/// diagonal blocks. A sweep up and a sweep down are each other's transpose, so that a cycle with one before and one after the
/// coarse correction is symmetric.
#[derive(Clone, Debug)]
pub(crate) struct Sweeps<const B: usize> {
    lower: BlockRows<Single<B, B>>,
    upper: BlockRows<Single<B, B>>,
    /// Zero at unknowns that do not exist.
    inverse_diagonal: Vec<Dense<B, B>>,
}

impl<const B: usize> Sweeps<B> {
    /// For matrices of this pattern, without values.
    pub(crate) fn of_pattern(a: &impl SquareRows<B>) -> Self {
        let part = |above: bool| {
            let list = move |i: usize, out: &mut Vec<u32>, (): &mut ()| {
                let (cols, _) = a.row(i);
                let (from, to) = if above {
                    (right_of(cols, i), cols.len())
                } else {
                    (0, left_of(cols, i))
                };
                out.extend_from_slice(&cols[from..to]);
            };
            BlockRows::filled(a.rows(), [[0.0; B]; B], || (), list)
        };
        Sweeps {
            lower: part(false),
            upper: part(true),
            inverse_diagonal: vec![[[0.0; B]; B]; a.rows()],
        }
    }

    /// Takes over the values of a matrix on the unknowns that `exist`; `None` if a diagonal block is not safely positive
    /// definite there.
    #[must_use]
    pub(crate) fn refresh(&mut self, a: &impl SquareRows<B>, exist: impl Fn(usize) -> [bool; B] + Sync) -> Option<()> {
        let lower = |i: usize, _: &[u32], out: &mut [Single<B, B>]| copy(&a.row(i).1[..out.len()], out);
        self.lower.for_each_row(lower);
        let upper = |i: usize, _: &[u32], out: &mut [Single<B, B>]| {
            let blocks = a.row(i).1;
            copy(&blocks[blocks.len() - out.len()..], out);
        };
        self.upper.for_each_row(upper);
        for (i, inverse) in self.inverse_diagonal.iter_mut().enumerate() {
            let (cols, blocks) = a.row(i);
            if let Some(block) = blocks.get(left_of(cols, i)) {
                *inverse = inverse_of(block, &exist(i))?;
            }
        }
        Some(())
    }

    /// Inverses of the diagonal blocks, zero at unknowns that do not exist.
    pub(crate) fn inverse_diagonal(&self) -> &[Dense<B, B>] {
        &self.inverse_diagonal
    }

    /// `y := A x` where `D x` is known, for `x` zero at unknowns that do not exist; there `y` means nothing.
    pub(crate) fn multiply(&self, x: &[[f64; B]], d_x: &[[f64; B]], y: &mut [[f64; B]]) {
        for_each_entry(
            y,
            #[inline(always)]
            |i, y| {
                let (below, above) = (row_times(&self.lower, i, x), row_times(&self.upper, i, x));
                *y = std::array::from_fn(|b| d_x[i][b] + below[b] + above[b]);
            },
        );
    }

    /// One sweep up from zero: `x := (D + L)^-1 b`.
    pub(crate) fn up_from_zero(&self, b: &[[f64; B]], x: &mut [[f64; B]]) {
        vectorised(
            #[inline(always)]
            || {
                for i in 0..b.len() {
                    let below = row_times(&self.lower, i, x);
                    let rest: [f64; B] = std::array::from_fn(|k| b[i][k] - below[k]);
                    x[i] = times(&self.inverse_diagonal[i], &rest);
                }
            },
        );
    }

    /// `r := b - A x` after [`Self::up_from_zero`], which is `-U x`; at unknowns that do not exist it means nothing.
    pub(crate) fn residual_after_up(&self, x: &[[f64; B]], r: &mut [[f64; B]]) {
        for_each_entry(
            r,
            #[inline(always)]
            |i, r| *r = row_times(&self.upper, i, x).map(|sum| -sum),
        );
    }

    /// One sweep down: `x := x + (D + U)^-1 (b - A x)`.
    pub(crate) fn down(&self, b: &[[f64; B]], x: &mut [[f64; B]]) {
        vectorised(
            #[inline(always)]
            || {
                for i in (0..b.len()).rev() {
                    let (below, above) = (row_times(&self.lower, i, x), row_times(&self.upper, i, x));
                    let rest: [f64; B] = std::array::from_fn(|k| b[i][k] - below[k] - above[k]);
                    x[i] = times(&self.inverse_diagonal[i], &rest);
                }
            },
        );
    }
}

/// Row times vector, from the right to the left: a sweep down then reads memory in one direction.
#[inline(always)]
fn row_times<const B: usize>(a: &BlockRows<Single<B, B>>, i: usize, x: &[[f64; B]]) -> [f64; B] {
    let (cols, blocks) = a.row(i);
    let mut sum = [0.0; B];
    for (&j, block) in cols.iter().zip(blocks).rev() {
        add_times(&mut sum, &double(block), &x[j as usize]);
    }
    sum
}

fn left_of(cols: &[u32], i: usize) -> usize {
    cols.partition_point(|&j| (j as usize) < i)
}

fn right_of(cols: &[u32], i: usize) -> usize {
    cols.partition_point(|&j| (j as usize) <= i)
}

#[inline(always)]
fn copy<const B: usize>(from: &[Dense<B, B>], to: &mut [Single<B, B>]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = single(from));
}

/// Inverse of a symmetric block on the unknowns that exist, zero elsewhere.
fn inverse_of<const B: usize>(block: &Dense<B, B>, exist: &[bool; B]) -> Option<Dense<B, B>> {
    let both = |r: usize, c: usize| exist[r] && exist[c];
    let masked = SMatrix::<f64, B, B>::from_fn(|r, c| match both(r, c) {
        true => block[r][c],
        false => f64::from(u8::from(r == c)),
    });
    let root = masked.cholesky()?;
    let pivot = |k: usize| root.l_dirty()[(k, k)].powi(2);
    if !(0..B).all(|k| pivot(k) > LEAST_PIVOT * masked[(k, k)]) {
        return None;
    }
    let inverse = root.inverse();
    let entry = |r: usize, c: usize| if both(r, c) { inverse[(r, c)] } else { 0.0 };
    Some(std::array::from_fn(|r| std::array::from_fn(|c| entry(r, c))))
}
