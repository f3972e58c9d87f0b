//! Smoothed aggregation multigrid with the rigid motions of the body (Vanek, Mandel and Brezina, Computing 56, 1996): a
//! preconditioner with which the iterations of conjugate gradients hardly depend on the size of the mesh.
//!
//! On each level rows that are strongly bound form aggregates (`aggregates`, `strength`), whose rigid motions (`motions`) are
//! the unknowns of the next level. The way back is smoothed (`prolongator`), and makes the matrix of the next level
//! (`galerkin`). A cycle (`hierarchy`, `level`) sweeps up and down (`sweeps`) on every level but the last (`coarsest`), which
//! is solved.
//!
//! Aggregates and prolongations are made for one pattern, one set of fixed dofs and the values then; new values of the matrix
//! only refill the coarse matrices. After a change of the pattern the aggregates that it did not touch are kept.

mod aggregates;
mod block_rows;
mod coarsest;
mod galerkin;
mod hierarchy;
mod level;
mod motions;
mod prolongator;
mod spectrum;
mod strength;
mod sweeps;

use self::aggregates::Aggregates;
use self::hierarchy::Hierarchy;
use self::level::Unknowns;
use self::motions::Motions;
use crate::vector::first_not_finite;
use crate::{BlockMatrix, FemError};

/// What the multigrid preconditioner has done so far.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct MultigridWork {
    /// Levels, the finest included.
    pub levels: usize,
    /// Aggregates of the finest level.
    pub aggregates: usize,
    /// How many of these were taken over when the levels were last set up: all that a cut left alone.
    pub aggregates_kept: usize,
    /// How often the levels were set up: for a new pattern, new fixed dofs, or when iterations had doubled.
    pub set_ups: usize,
    /// How often only the values were refilled.
    pub refills: usize,
}

/// The preconditioner.
#[derive(Debug, Default)]
pub(crate) struct Multigrid {
    positions: Vec<[f64; 3]>,
    levels: Option<Levels>,
    /// Of the matrix that the levels were set up for.
    stamp: u64,
    fixed: Vec<bool>,
    /// Iterations of the first solve after that.
    iterations: Option<usize>,
    outdated: bool,
    work: MultigridWork,
}

/// Six motions an aggregate, or three for bodies in a plane.
#[derive(Debug)]
enum Levels {
    Solid(Hierarchy<6>),
    Planar(Hierarchy<3>),
}

impl Multigrid {
    /// Where the vertices are, one position a row; used when levels are set up.
    pub(crate) fn set_positions(&mut self, positions: impl IntoIterator<Item = [f64; 3]>) {
        self.positions.clear();
        self.positions.extend(positions);
    }

    /// What has been done so far.
    pub(crate) fn work(&self) -> MultigridWork {
        self.work
    }

    /// Takes over the values of a matrix; sets up the levels if there are none for its pattern and fixed dofs.
    ///
    /// # Errors
    /// [`FemError::Length`] or [`FemError::NotFinite`] for the positions, [`FemError::NotPositiveDefinite`].
    pub(crate) fn refresh(&mut self, a: &BlockMatrix, fixed: &[bool]) -> Result<(), FemError> {
        let fits = self.stamp == a.pattern.stamp() && self.fixed == fixed && !self.outdated;
        let done = match &mut self.levels {
            Some(Levels::Solid(levels)) if fits => levels.refresh(a),
            Some(Levels::Planar(levels)) if fits => levels.refresh(a),
            _ => return self.set_up(a, fixed),
        };
        self.work.refills += 1;
        done.ok_or(NOT_DEFINITE)
    }

    fn set_up(&mut self, a: &BlockMatrix, fixed: &[bool]) -> Result<(), FemError> {
        self.check_positions(a.rows())?;
        let exist: Vec<[bool; 3]> = fixed.as_chunks::<3>().0.iter().map(|f| f.map(|f| !f)).collect();
        let old = self.levels.take();
        let before = old.as_ref().map(Levels::aggregates);
        let planar = self.planar(&exist);
        // rotations are about the first vertex that moves: far from the origin digits would be lost
        let origin = exist
            .iter()
            .position(|e| *e != [false; 3])
            .map_or([0.0; 3], |i| self.positions[i]);
        let positions: Vec<[f64; 3]> = self
            .positions
            .iter()
            .map(|p| std::array::from_fn(|k| p[k] - origin[k]))
            .collect();
        let motions = Motions::of_vertices(&positions, |i| exist[i]);
        let unknowns = Unknowns { exist, motions };
        let levels = match planar {
            false => Hierarchy::of(a, unknowns, before).map(Levels::Solid),
            true => Hierarchy::of(a, unknowns, before).map(Levels::Planar),
        };
        let levels = levels.ok_or(NOT_DEFINITE)?;
        self.work = MultigridWork {
            levels: levels.count(),
            aggregates: levels.aggregates().len(),
            aggregates_kept: levels.aggregates().kept(),
            set_ups: self.work.set_ups + 1,
            refills: self.work.refills,
        };
        self.levels = Some(levels);
        self.stamp = a.pattern.stamp();
        self.fixed.clear();
        self.fixed.extend_from_slice(fixed);
        self.iterations = None;
        self.outdated = false;
        Ok(())
    }

    fn check_positions(&self, rows: usize) -> Result<(), FemError> {
        if self.positions.len() != rows {
            return Err(FemError::Length {
                what: "the positions that multigrid needs",
                expected: rows,
                found: self.positions.len(),
            });
        }
        match first_not_finite(self.positions.as_flattened()) {
            None => Ok(()),
            Some(index) => Err(FemError::NotFinite {
                what: "the positions",
                index,
            }),
        }
    }

    /// Whether all that moves lies in a plane of constant z and stays there.
    fn planar(&self, exist: &[[bool; 3]]) -> bool {
        let mut moving = exist
            .iter()
            .zip(&self.positions)
            .filter(|(e, _)| **e != [false; 3])
            .peekable();
        let height = moving.peek().map(|(_, p)| p[2]);
        moving.all(|(e, p)| !e[2] && Some(p[2]) == height)
    }

    /// `z :=` approximate solution for `r`, zero at fixed dofs.
    pub(crate) fn apply(&self, r: &[f64], z: &mut [f64]) {
        match &self.levels {
            Some(Levels::Solid(levels)) => levels.apply(r, z),
            Some(Levels::Planar(levels)) => levels.apply(r, z),
            None => z.copy_from_slice(r),
        }
    }

    /// Keeps count of the iterations of a solve: when they have doubled, the levels are set up anew for the next.
    pub(crate) fn note_iterations(&mut self, iterations: usize) {
        let first = *self.iterations.get_or_insert(iterations);
        self.outdated = iterations > 2 * first + PATIENCE;
    }
}

/// So many more iterations do not count.
const PATIENCE: usize = 5;

const NOT_DEFINITE: FemError = FemError::NotPositiveDefinite { found_by: "multigrid" };

impl Levels {
    fn aggregates(&self) -> &Aggregates {
        match self {
            Levels::Solid(levels) => levels.aggregates(),
            Levels::Planar(levels) => levels.aggregates(),
        }
    }

    fn count(&self) -> usize {
        match self {
            Levels::Solid(levels) => levels.levels(),
            Levels::Planar(levels) => levels.levels(),
        }
    }
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::generate;

    use super::*;
    use crate::{Assembler, Material};

    #[test]
    fn a_cycle_is_symmetric_and_positive_and_leaves_fixed_dofs_alone() {
        let mesh = generate::box_tets([4.0, 1.0, 1.0], [36, 9, 9], [0.0; 3]);
        let assembler = Assembler::new(&mesh, |_| Material::new(1.0, 0.4, 1.0).unwrap()).unwrap();
        let a = assembler.stiffness();
        let n = 3 * a.rows();
        let fixed: Vec<bool> = (0..n)
            .map(|d| mesh.rest_positions()[d / 3].x == 0.0 || d % 41 == 0)
            .collect();
        let mut levels = Multigrid::default();
        levels.set_positions(mesh.rest_positions().iter().map(|p| (*p).into()));
        levels.refresh(a, &fixed).unwrap();
        assert!(levels.work().levels >= 3, "{:?}", levels.work());
        let vector = |k: usize| -> Vec<f64> {
            let entry = |d: usize| {
                if fixed[d] {
                    0.0
                } else {
                    ((k * d + 3 * k) % 17) as f64 - 8.0
                }
            };
            (0..n).map(entry).collect()
        };
        let cycle = |r: &[f64]| {
            let mut z = vec![f64::NAN; n];
            levels.apply(r, &mut z);
            z
        };
        let dot = crate::vector::dot;
        for k in 1..6 {
            let (r, s) = (vector(k), vector(k + 7));
            let (z, w) = (cycle(&r), cycle(&s));
            let (a, b) = (dot(&s, &z), dot(&r, &w));
            let size = (dot(&r, &z) * dot(&s, &w)).sqrt();
            assert!((a - b).abs() < 1e-10 * size, "{a} {b} {size}");
            assert!(dot(&r, &z) > 0.0);
            assert!((0..n).all(|d| !fixed[d] || z[d] == 0.0));
        }
    }
}
