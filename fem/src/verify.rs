//! Comparison with a fresh assembly.

use kerfem_mesh::{Midpoints, SimplexMesh};

use crate::Assembler;

/// How far the matrices are from a fresh assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verification {
    /// Largest difference of an entry of K, relative to the largest entry.
    pub stiffness_max_relative_difference: f64,
    /// Largest difference of an entry of the consistent or lumped mass, relative to the largest entry of each.
    pub mass_max_relative_difference: f64,
    /// Whether both have the same blocks.
    pub pattern_equal: bool,
}

impl<const N: usize> Assembler<N> {
    /// Compares with a fresh assembly of the same mesh; the differences must be exactly zero. If the mesh can not be
    /// assembled (a cell is inverted), they are infinite.
    pub fn verify(&self, mesh: &SimplexMesh<N>) -> Verification {
        let midpoints = self
            .midpoints()
            .map(|m| Midpoints::restored(mesh, &m.edges()))
            .transpose();
        let fresh = midpoints.map(|m| Assembler::of_order(mesh, m, self.locking(), |c| *self.material(c)));
        let Ok(Ok(fresh)) = fresh else {
            return Verification {
                stiffness_max_relative_difference: f64::INFINITY,
                mass_max_relative_difference: f64::INFINITY,
                pattern_equal: false,
            };
        };
        let (own, other) = (&self.stiffness, &fresh.stiffness);
        let pattern_equal = own.rows() == other.rows()
            && (0..own.rows()).all(|i| own.row(i).0 == other.row(i).0)
            && mesh
                .cell_ids()
                .all(|c| self.slots.get(c.index()) == fresh.slots.get(c.index()));
        if !pattern_equal {
            return Verification {
                stiffness_max_relative_difference: f64::INFINITY,
                mass_max_relative_difference: f64::INFINITY,
                pattern_equal,
            };
        }
        let (mut stiffness, mut mass) = (Difference::default(), Difference::default());
        for i in 0..own.rows() {
            stiffness.add(own.row(i).1.as_flattened(), other.row(i).1.as_flattened());
            mass.add(&self.mass[own.pattern.range(i)], &fresh.mass[other.pattern.range(i)]);
        }
        let mut lumped = Difference::default();
        lumped.add(&self.lumped, &fresh.lumped);
        Verification {
            stiffness_max_relative_difference: stiffness.relative(),
            mass_max_relative_difference: mass.relative().max(lumped.relative()),
            pattern_equal,
        }
    }
}

/// Largest difference and largest entry of two lists of numbers.
#[derive(Default)]
struct Difference {
    difference: f64,
    entry: f64,
}

impl Difference {
    fn add(&mut self, a: &[f64], b: &[f64]) {
        for (a, b) in a.iter().zip(b) {
            self.difference = self.difference.max((a - b).abs());
            self.entry = self.entry.max(b.abs());
            if a.is_nan() || b.is_nan() {
                self.difference = f64::INFINITY;
            }
        }
    }

    fn relative(&self) -> f64 {
        if self.difference == 0.0 {
            0.0
        } else {
            self.difference / self.entry
        }
    }
}
