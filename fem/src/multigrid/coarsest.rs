//! The coarsest level: solved directly.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::{Conj, Mat, MatMut, Par};

use super::block_rows::{BlockRows, Dense};

/// A pivot below this fraction of its diagonal entry is round-off: the matrix is singular.
const LEAST_PIVOT: f64 = 1e-12;

/// Dense Cholesky factor (faer) of a matrix on the unknowns that exist.
#[derive(Debug)]
pub(crate) struct Coarsest {
    /// The unknowns that exist, in flat numbers.
    unknowns: Vec<usize>,
    factor: Mat<f64>,
}

impl Coarsest {
    /// For matrices with these unknowns, without values.
    pub(crate) fn of_unknowns<const M: usize>(exist: &[[bool; M]]) -> Self {
        let unknowns: Vec<usize> = (0..M * exist.len()).filter(|d| exist[d / M][d % M]).collect();
        let n = unknowns.len();
        Coarsest {
            unknowns,
            factor: Mat::zeros(n, n),
        }
    }

    /// Number of unknowns.
    pub(crate) fn len(&self) -> usize {
        self.unknowns.len()
    }

    /// Factors a matrix; `None` if it is not safely positive definite.
    #[must_use]
    pub(crate) fn refresh<const M: usize>(&mut self, a: &BlockRows<Dense<M, M>>) -> Option<()> {
        let n = self.unknowns.len();
        let mut diagonal = vec![0.0; n];
        self.factor.fill(0.0);
        for (k, d) in self.unknowns.iter().enumerate() {
            let (cols, blocks) = a.row(d / M);
            // the lower triangle is read
            for (l, e) in self.unknowns.iter().enumerate().take(k + 1) {
                if let Ok(at) = cols.binary_search(&((e / M) as u32)) {
                    self.factor[(k, l)] = blocks[at][d % M][e % M];
                }
            }
            diagonal[k] = self.factor[(k, k)];
        }
        let need = llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        llt::factor::cholesky_in_place(
            self.factor.as_mut(),
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(need)),
            Default::default(),
        )
        .ok()?;
        let safe = |k: usize| self.factor[(k, k)].powi(2) > LEAST_PIVOT * diagonal[k];
        (0..n).all(safe).then_some(())
    }

    /// `x := A^-1 b`, zero at unknowns that do not exist; `scratch` is memory for [`Self::len`] numbers.
    pub(crate) fn solve<const M: usize>(&self, b: &[[f64; M]], x: &mut [[f64; M]], scratch: &mut [f64]) {
        let (b, x) = (b.as_flattened(), x.as_flattened_mut());
        scratch.iter_mut().zip(&self.unknowns).for_each(|(s, &d)| *s = b[d]);
        llt::solve::solve_in_place_with_conj(
            self.factor.as_ref(),
            Conj::No,
            MatMut::from_column_major_slice_mut(scratch, self.len(), 1),
            Par::Seq,
            MemStack::new(&mut []),
        );
        x.fill(0.0);
        scratch.iter().zip(&self.unknowns).for_each(|(s, &d)| x[d] = *s);
    }
}
