//! Rigid motions: what the coarse levels must be able to represent.

use super::block_rows::{Dense, add_transposed_product};

/// Rigid motions of a body in space: translations along x, y, z, then rotations about axes in these directions.
pub(crate) const MOTIONS: usize = 6;

/// What is left of a motion of this fraction of its size depends on the motions before it.
const INDEPENDENT: f64 = 1e-6;

/// The rigid motions of a body (rotations about the origin) as the unknowns of each row take part in them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motions<const B: usize> {
    /// By row: unknown, then motion.
    pub(crate) values: Vec<Dense<B, MOTIONS>>,
    /// Where each row is.
    pub(crate) centers: Vec<[f64; 3]>,
}

impl Motions<3> {
    /// Of displacements at `positions`; unknowns that do not `exist` take no part.
    pub(crate) fn of_vertices(positions: &[[f64; 3]], exist: impl Fn(usize) -> [bool; 3]) -> Self {
        let values = positions.iter().enumerate().map(|(i, &[x, y, z])| {
            let mut rows = [
                [1.0, 0.0, 0.0, 0.0, z, -y],
                [0.0, 1.0, 0.0, -z, 0.0, x],
                [0.0, 0.0, 1.0, y, -x, 0.0],
            ];
            for (row, exists) in rows.iter_mut().zip(exist(i)) {
                if !exists {
                    *row = [0.0; MOTIONS];
                }
            }
            rows
        });
        Motions {
            values: values.collect(),
            centers: positions.to_vec(),
        }
    }
}

impl<const B: usize> Motions<B> {
    /// The motions of a row with rotations about `center`.
    #[inline(always)]
    pub(crate) fn about(&self, i: usize, center: &[f64; 3]) -> Dense<B, MOTIONS> {
        about(&self.values[i], center)
    }
}

/// Motions with rotations about `c` instead of the origin.
#[inline(always)]
fn about<const B: usize>(motions: &Dense<B, MOTIONS>, c: &[f64; 3]) -> Dense<B, MOTIONS> {
    let mut out = *motions;
    for row in &mut out {
        let [x, y, z] = [row[0], row[1], row[2]];
        // e_k x (p - c) = e_k x p - e_k x c
        row[3] -= c[1] * z - c[2] * y;
        row[4] -= c[2] * x - c[0] * z;
        row[5] -= c[0] * y - c[1] * x;
    }
    out
}

/// `B^T B`, summed over rows.
pub(crate) fn gram<'a, const B: usize>(
    rows: impl IntoIterator<Item = &'a Dense<B, MOTIONS>>,
) -> Dense<MOTIONS, MOTIONS> {
    let mut sum = [[0.0; MOTIONS]; MOTIONS];
    for row in rows {
        add_transposed_product(&mut sum, row, row);
    }
    sum
}

/// `L D L^T` of a Gram matrix of motions. Where a motion depends on those before it, `D` and the column of `L` are zero.
#[derive(Debug)]
pub(crate) struct GramFactor {
    l: Dense<MOTIONS, MOTIONS>,
    d: [f64; MOTIONS],
}

impl GramFactor {
    /// Factors `G`; a motion is dependent if what is left of it is below the fraction `tolerance` of the largest motion of
    /// its kind (translations and rotations have different units).
    pub(crate) fn of(g: &Dense<MOTIONS, MOTIONS>, tolerance: f64) -> Self {
        let largest = |kind: usize| (3 * kind..3 * kind + 3).map(|k| g[k][k]).fold(0.0, f64::max);
        let least = [0, 1].map(|kind| tolerance * tolerance * largest(kind));
        let (mut l, mut d) = ([[0.0; MOTIONS]; MOTIONS], [0.0; MOTIONS]);
        for k in 0..MOTIONS {
            let left = |r: usize, l: &Dense<MOTIONS, MOTIONS>| -> f64 {
                g[r][k] - (0..k).map(|m| l[r][m] * l[k][m] * d[m]).sum::<f64>()
            };
            let pivot = left(k, &l);
            if pivot > least[k / 3] {
                for r in k + 1..MOTIONS {
                    l[r][k] = left(r, &l) / pivot;
                }
                d[k] = pivot;
            }
        }
        GramFactor { l, d }
    }

    /// Whether a motion is independent of those before it.
    pub(crate) fn independent(&self, k: usize) -> bool {
        self.d[k] > 0.0
    }

    /// Solves `x G = rhs`; `x` is zero at dependent motions.
    pub(crate) fn solve(&self, rhs: &[f64; MOTIONS]) -> [f64; MOTIONS] {
        let (l, mut x) = (&self.l, *rhs);
        for k in 0..MOTIONS {
            for m in 0..k {
                x[k] -= l[k][m] * x[m];
            }
        }
        for k in 0..MOTIONS {
            x[k] = if self.independent(k) { x[k] / self.d[k] } else { 0.0 };
        }
        for k in (0..MOTIONS).rev() {
            for r in k + 1..MOTIONS {
                x[k] -= l[r][k] * x[r];
            }
            if !self.independent(k) {
                x[k] = 0.0;
            }
        }
        x
    }

    /// `row L^-T D^-1/2`: rows of orthonormal columns, zero at dependent motions.
    fn orthonormal(&self, row: &[f64; MOTIONS]) -> [f64; MOTIONS] {
        let mut q = *row;
        for k in 0..MOTIONS {
            for m in 0..k {
                q[k] -= self.l[k][m] * q[m];
            }
        }
        for k in 0..MOTIONS {
            q[k] = if self.independent(k) {
                q[k] / self.d[k].sqrt()
            } else {
                0.0
            };
        }
        q
    }
}

/// Makes the columns orthonormal (Cholesky QR, twice); which of them were independent. Others become zero.
pub(crate) fn orthonormalise<const B: usize>(rows: &mut [Dense<B, MOTIONS>]) -> [bool; MOTIONS] {
    let mut independent = [true; MOTIONS];
    for tolerance in [INDEPENDENT, 0.0] {
        let factor = GramFactor::of(&gram(rows.iter()), tolerance);
        rows.as_flattened_mut()
            .iter_mut()
            .for_each(|row| *row = factor.orthonormal(row));
        independent = std::array::from_fn(|k| independent[k] && factor.independent(k));
    }
    independent
}
