//! All levels of a matrix, and one cycle through them.

use std::sync::{Mutex, PoisonError};

use super::aggregates::Aggregates;
use super::coarsest::Coarsest;
use super::level::{Level, Unknowns};
use crate::BlockMatrix;

/// A level with at most so many rows is solved directly.
const COARSEST: usize = 100;

/// Levels of a block matrix, with `M` unknowns a row from the second on.
#[derive(Debug)]
pub(crate) struct Hierarchy<const M: usize> {
    fine: Level<3, M>,
    /// Of the finest level.
    aggregates: Aggregates,
    coarse: Vec<Level<M, M>>,
    /// Solves the last matrix, unless there is nothing to couple its rows.
    coarsest: Option<Coarsest>,
    vectors: Mutex<Vectors<M>>,
}

/// Memory of a cycle.
#[derive(Debug, Default)]
struct Vectors<const M: usize> {
    residual: Vec<[f64; 3]>,
    coarse: Vec<CoarseVectors<M>>,
    coarsest: Vec<f64>,
}

/// Right-hand side, solution and residual of a coarse level.
#[derive(Debug)]
struct CoarseVectors<const M: usize> {
    b: Vec<[f64; M]>,
    x: Vec<[f64; M]>,
    r: Vec<[f64; M]>,
}

impl<const M: usize> Hierarchy<M> {
    /// Sets up the levels; see [`Aggregates::of`] for what is taken over from aggregates of an earlier matrix. `None` if a
    /// diagonal block or the coarsest matrix is not positive definite.
    pub(crate) fn of(a: &BlockMatrix, unknowns: Unknowns<3>, before: Option<&Aggregates>) -> Option<Self> {
        let (fine, mut next, aggregates) = Level::of(a, unknowns, before)?;
        let mut coarse: Vec<Level<M, M>> = Vec::new();
        let mut coarsest = None;
        let mut vectors = Vectors {
            residual: vec![[0.0; 3]; a.rows()],
            ..Vectors::default()
        };
        while let Some(unknowns) = next.take() {
            let rows = unknowns.exist.len();
            vectors.coarse.push(CoarseVectors {
                b: vec![[0.0; M]; rows],
                x: vec![[0.0; M]; rows],
                r: vec![[0.0; M]; rows],
            });
            let Some(matrix) = coarse.last().map_or(fine.coarse_matrix(), Level::coarse_matrix) else {
                break;
            };
            if rows <= COARSEST {
                let mut direct = Coarsest::of_unknowns(&unknowns.exist);
                direct.refresh(matrix)?;
                vectors.coarsest = vec![0.0; direct.len()];
                coarsest = Some(direct);
            } else {
                let (level, unknowns, _) = Level::of(matrix, unknowns, None)?;
                coarse.push(level);
                next = unknowns;
            }
        }
        Some(Hierarchy {
            fine,
            aggregates,
            coarse,
            coarsest,
            vectors: Mutex::new(vectors),
        })
    }

    /// Takes over the values of a matrix with the same pattern; aggregates and prolongations stay. `None` as in [`Self::of`].
    #[must_use]
    pub(crate) fn refresh(&mut self, a: &BlockMatrix) -> Option<()> {
        self.fine.refresh(a)?;
        for k in 0..self.coarse.len() {
            let (above, below) = self.coarse.split_at_mut(k);
            let matrix = above.last().map_or(self.fine.coarse_matrix(), Level::coarse_matrix)?;
            below[0].refresh(matrix)?;
        }
        if let Some(coarsest) = &mut self.coarsest {
            let matrix = self
                .coarse
                .last()
                .map_or(self.fine.coarse_matrix(), Level::coarse_matrix)?;
            coarsest.refresh(matrix)?;
        }
        Some(())
    }

    /// Aggregates of the finest level.
    pub(crate) fn aggregates(&self) -> &Aggregates {
        &self.aggregates
    }

    /// Number of levels.
    pub(crate) fn levels(&self) -> usize {
        1 + self.coarse.len() + usize::from(self.coarsest.is_some())
    }

    /// One V-cycle from zero: `z :=` approximate solution for `r`; a symmetric positive definite operation.
    pub(crate) fn apply(&self, r: &[f64], z: &mut [f64]) {
        // its content means nothing between calls, so a panic elsewhere does no harm
        let mut vectors = self.vectors.lock().unwrap_or_else(PoisonError::into_inner);
        let Vectors {
            residual,
            coarse,
            coarsest,
        } = &mut *vectors;
        let (b, x) = (r.as_chunks::<3>().0, z.as_chunks_mut::<3>().0);
        self.fine
            .descend(b, x, residual, coarse.first_mut().map(|v| v.b.as_mut_slice()));
        for (k, level) in self.coarse.iter().enumerate() {
            let (own, below) = coarse.split_at_mut(k + 1);
            let own = &mut own[k];
            let below = below.first_mut().map(|v| v.b.as_mut_slice());
            level.descend(&own.b, &mut own.x, &mut own.r, below);
        }
        if let (Some(direct), Some(own)) = (&self.coarsest, coarse.last_mut()) {
            direct.solve(&own.b, &mut own.x, coarsest);
        }
        for (k, level) in self.coarse.iter().enumerate().rev() {
            let (own, below) = coarse.split_at_mut(k + 1);
            let own = &mut own[k];
            level.ascend(below.first().map(|v| v.x.as_slice()), &own.b, &mut own.x);
        }
        self.fine.ascend(coarse.first().map(|v| v.x.as_slice()), b, x);
    }
}
