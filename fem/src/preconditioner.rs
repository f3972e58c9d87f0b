//! Preconditioners for conjugate gradients.

use crate::block_ic0::BlockIc0;
use crate::multigrid::Multigrid;
use crate::parts::Rows;
use crate::small::{self, Block, IDENTITY, masked_diagonal};
use crate::solver::PreconditionerKind;
use crate::{BlockMatrix, FemError};

/// An approximate inverse of a matrix on its free dofs; fixed dofs are passed through.
#[derive(Debug)]
pub(crate) enum Preconditioner {
    /// The identity.
    None,
    /// Inverse of the diagonal.
    Jacobi(Vec<f64>),
    /// Inverse of the diagonal blocks.
    BlockJacobi(Vec<Block>),
    /// Incomplete block factorisation.
    BlockIc0(BlockIc0),
    /// Smoothed aggregation multigrid.
    Multigrid(Box<Multigrid>),
}

impl Preconditioner {
    /// Of a kind, without values.
    pub(crate) fn new(kind: PreconditionerKind) -> Self {
        match kind {
            PreconditionerKind::None => Preconditioner::None,
            PreconditionerKind::Jacobi => Preconditioner::Jacobi(Vec::new()),
            PreconditionerKind::BlockJacobi => Preconditioner::BlockJacobi(Vec::new()),
            PreconditionerKind::BlockIc0 => Preconditioner::BlockIc0(BlockIc0::default()),
            PreconditionerKind::Multigrid => Preconditioner::Multigrid(Box::default()),
        }
    }

    /// Takes over the values of a matrix.
    ///
    /// # Errors
    /// [`FemError::NotPositiveDefinite`] if a diagonal block is not; for multigrid also if its positions do not fit.
    pub(crate) fn refresh(&mut self, a: &BlockMatrix, fixed: &[bool]) -> Result<(), FemError> {
        match self {
            Preconditioner::None => Ok(()),
            Preconditioner::Jacobi(inverse) => {
                inverse.resize(fixed.len(), 1.0);
                for (i, inverse) in inverse.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                    let block = diagonal(a, i, fixed);
                    for axis in 0..3 {
                        let d = block[4 * axis];
                        if !(d > 0.0 && d.is_finite()) {
                            return Err(indefinite());
                        }
                        inverse[axis] = 1.0 / d;
                    }
                }
                Ok(())
            }
            Preconditioner::BlockJacobi(inverse) => {
                inverse.resize(a.rows(), IDENTITY);
                for (i, inverse) in inverse.iter_mut().enumerate() {
                    let h = small::inverse_cholesky(&diagonal(a, i, fixed)).ok_or(indefinite())?;
                    // (G G^T)^-1 = H^T H
                    for r in 0..3 {
                        for c in 0..3 {
                            inverse[3 * r + c] = h[r] * h[c] + h[3 + r] * h[3 + c] + h[6 + r] * h[6 + c];
                        }
                    }
                }
                Ok(())
            }
            Preconditioner::BlockIc0(factor) => factor.refresh(a, fixed),
            Preconditioner::Multigrid(levels) => levels.refresh(a, fixed),
        }
    }

    /// `z :=` approximate solution for `r`, both of some rows that no others are coupled to; of all if it takes a body whole.
    pub(crate) fn apply(&self, rows: Rows<'_>, r: &[f64], z: &mut [f64]) {
        match self {
            Preconditioner::None => z.copy_from_slice(r),
            Preconditioner::Jacobi(inverse) => {
                let inverse = inverse.as_chunks::<3>().0;
                let r = r.as_chunks::<3>().0;
                for (k, (z, r)) in z.as_chunks_mut::<3>().0.iter_mut().zip(r).enumerate() {
                    let d = &inverse[rows.row(k)];
                    *z = [r[0] * d[0], r[1] * d[1], r[2] * d[2]];
                }
            }
            Preconditioner::BlockJacobi(inverse) => {
                let r = r.as_chunks::<3>().0;
                for (k, (z, r)) in z.as_chunks_mut::<3>().0.iter_mut().zip(r).enumerate() {
                    *z = small::times(&inverse[rows.row(k)], r);
                }
            }
            Preconditioner::BlockIc0(factor) => factor.apply(rows, r, z),
            Preconditioner::Multigrid(levels) => levels.apply(r, z),
        }
    }

    /// Whether it can be applied to all rows only.
    pub(crate) fn takes_all(&self) -> bool {
        matches!(self, Preconditioner::Multigrid(_))
    }

    /// Hears how many iterations a solve took.
    pub(crate) fn note_iterations(&mut self, iterations: usize) {
        if let Preconditioner::Multigrid(levels) = self {
            levels.note_iterations(iterations);
        }
    }
}

fn indefinite() -> FemError {
    FemError::NotPositiveDefinite {
        found_by: "a diagonal block",
    }
}

/// Diagonal block of row `i` with fixed dofs replaced by the identity.
pub(crate) fn diagonal(a: &BlockMatrix, i: usize, fixed: &[bool]) -> Block {
    let block = a.pattern.find(i, i).map_or([0.0; 9], |k| a.values[k]);
    masked_diagonal(&block, &fixed[3 * i..3 * i + 3])
}
