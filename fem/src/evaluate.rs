//! Energy, forces and tangents of a body at given displacements.

use std::sync::{MutexGuard, PoisonError};

use kerfem_mesh::{CellId, SimplexMesh};
use nalgebra::Matrix3;

use crate::corotated::{self, CellTangent};
use crate::element::{Element, Vec3, matrix};
use crate::parallel::{BATCH, for_each_batch, for_each_batch_of_two, for_each_slot};
use crate::patch::{Patch, PatchState, patches_around};
use crate::rotation::rotations_of_cells;
use crate::rows::{add_patches_to_row, cells_of_row, corner_of, corner_values, tangent_row};
use crate::small::{Block, IDENTITY, add};
use crate::{Assembler, BlockMatrix, Plane, quadratic};

/// How strain is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Model {
    /// Small displacements: `sym(F - I)`. Wrong under rotation.
    Linear,
    /// Small strains in a frame that turns with each cell: `S - I` with `F = R S`.
    Corotated,
}

/// The second derivative of the energy that a matrix holds. For [`Model::Linear`] both are the stiffness at rest.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tangent {
    /// `R Ke R^T` with the rotation held fixed: for one semi-implicit step.
    Warped,
    /// The exact Hessian of the corotated energy: for Newton's method, which it makes converge quadratically. May be
    /// indefinite where cells are compressed.
    Exact,
    /// [`Tangent::Exact`], cell by cell projected to be positive semidefinite: for Newton's method far from the solution.
    Projected,
}

/// Factors of the two parts of a system matrix, `stiffness * K + mass * M` with the lumped mass.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scales {
    /// Factor of the tangent stiffness.
    pub stiffness: f64,
    /// Factor of the lumped mass.
    pub mass: f64,
}

/// Memory reused between evaluations, by cell slot.
#[derive(Debug, Default)]
pub(crate) struct Scratch<const N: usize> {
    tangents: Vec<CellTangent<N>>,
    forces: Vec<[Vec3; N]>,
    energies: Vec<f64>,
    /// By vertex slot.
    patches: Vec<Vec<PatchState>>,
    patch_energies: Vec<f64>,
    quadratic: quadratic::Scratch<N>,
}

impl<const N: usize> Assembler<N> {
    /// Elastic energy (J) at displacements `u` (m, 3 per vertex slot), summed in the order of the cells, then of the
    /// patches if locking is cured.
    ///
    /// # Panics
    /// If `u` has the wrong length.
    pub fn energy(&self, mesh: &SimplexMesh<N>, model: Model, u: &[f64]) -> f64 {
        let u = self.as_vectors(u);
        let mut scratch = self.scratch();
        if let Some(order2) = &self.quadratic {
            return order2.energy(mesh, &self.elements, model, u, &mut scratch.quadratic);
        }
        let Scratch {
            energies,
            patch_energies,
            ..
        } = &mut *scratch;
        energies.resize(self.elements.len(), 0.0);
        match model {
            Model::Linear => for_each_slot(energies, |c, energy| {
                let c = CellId(c as u32);
                let e = &self.elements[c.index()];
                *energy = match mesh.has_cell(c) {
                    true => e
                        .lame
                        .linear_energy(e.volume, &e.displacement_gradient(&corner_values(mesh, c, u))),
                    false => 0.0,
                };
            }),
            Model::Corotated => for_each_batch(
                energies,
                #[inline(always)]
                |first, energies| {
                    let (elements, f) = self.deformation_gradients(mesh, first, u);
                    let r = rotations_of_cells::<N, _>(&f);
                    for (l, energy) in energies.iter_mut().enumerate() {
                        *energy = corotated::energy(&elements[l].lame, elements[l].volume, &f[l], &r[l]);
                    }
                },
            ),
        }
        patch_energies.resize(self.patches.len(), 0.0);
        for_each_slot(patch_energies, |v, energy| {
            *energy = self.patches[v].iter().map(|p| p.energy(model, u)).sum();
        });
        energies.iter().sum::<f64>() + patch_energies.iter().sum::<f64>()
    }

    /// `f := dEnergy/du` (N) at displacements `u` (m), both 3 per vertex slot: what the body exerts against being deformed,
    /// so equilibrium is `f = external load`.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn internal_force(&self, mesh: &SimplexMesh<N>, model: Model, u: &[f64], f: &mut [f64]) {
        let u = self.as_vectors(u);
        let mut scratch = self.scratch();
        if let Some(order2) = &self.quadratic {
            let f = self.as_vectors_mut(f);
            return order2.internal_force(mesh, &self.elements, model, u, &mut scratch.quadratic, f);
        }
        let Scratch { forces, patches, .. } = &mut *scratch;
        forces.resize(self.elements.len(), [[0.0; 3]; N]);
        match model {
            Model::Linear => for_each_slot(forces, |c, forces| {
                let c = CellId(c as u32);
                if mesh.has_cell(c) {
                    let e = &self.elements[c.index()];
                    let h = e.displacement_gradient(&corner_values(mesh, c, u));
                    *forces = e.corner_forces(&e.lame.linear_stress(&h));
                }
            }),
            Model::Corotated => for_each_batch(
                forces,
                #[inline(always)]
                |first, forces| {
                    let (elements, f) = self.deformation_gradients(mesh, first, u);
                    let r = rotations_of_cells::<N, _>(&f);
                    for (l, forces) in forces.iter_mut().enumerate() {
                        *forces = elements[l].corner_forces(&corotated::stress(&elements[l].lame, &f[l], &r[l]));
                    }
                },
            ),
        }
        self.for_each_patch(patches, |patch, state| patch.set_stress(model, u, state));
        self.gather_forces(mesh, forces, patches, f);
    }

    /// `out :=` tangent stiffness at displacements `u` (N/m). `out` comes from [`Self::new_matrix`] and is filled in place;
    /// if the pattern has changed since, it is first brought up to date as by [`Self::follow`].
    ///
    /// # Panics
    /// If `u` has the wrong length.
    pub fn tangent(&self, mesh: &SimplexMesh<N>, model: Model, tangent: Tangent, u: &[f64], out: &mut BlockMatrix) {
        let scales = Scales {
            stiffness: 1.0,
            mass: 0.0,
        };
        self.linearize(mesh, model, tangent, u, scales, out, None);
    }

    /// Matrix and force of one step in one pass over the cells: `out := scales.stiffness * K(u) + scales.mass * M_lumped`
    /// as [`Self::tangent`], and `force`, if given, as [`Self::internal_force`]. Allocates nothing once warm.
    ///
    /// # Panics
    /// If a length is wrong.
    #[allow(clippy::too_many_arguments)]
    pub fn linearize(
        &self,
        mesh: &SimplexMesh<N>,
        model: Model,
        tangent: Tangent,
        u: &[f64],
        scales: Scales,
        out: &mut BlockMatrix,
        force: Option<&mut [f64]>,
    ) {
        self.follow(out);
        match (model, &self.quadratic) {
            (Model::Linear, _) => {
                if let Some(force) = force {
                    self.internal_force(mesh, model, u, force);
                }
                let from = &self.stiffness;
                out.pattern.for_each_row(&mut out.values, |i, cols, row| {
                    let (_, blocks) = from.row(i);
                    for (to, from) in row.as_flattened_mut().iter_mut().zip(blocks.as_flattened()) {
                        *to = scales.stiffness * from;
                    }
                    self.add_mass(i, cols, scales.mass, row);
                });
            }
            (Model::Corotated, Some(order2)) => {
                let (elements, scale) = (&self.elements, scales.stiffness);
                let (u, force) = (self.as_vectors(u), force.map(|f| self.as_vectors_mut(f)));
                let scratch = &mut self.scratch().quadratic;
                let finish = |i: usize, cols: &[u32], row: &mut [Block]| self.add_mass(i, cols, scales.mass, row);
                order2.linearize(mesh, elements, tangent, u, scale, scratch, out, force, finish);
            }
            (Model::Corotated, None) => self.linearize_corotated(mesh, tangent, u, scales, out, force),
        }
    }

    fn linearize_corotated(
        &self,
        mesh: &SimplexMesh<N>,
        tangent: Tangent,
        u: &[f64],
        scales: Scales,
        out: &mut BlockMatrix,
        force: Option<&mut [f64]>,
    ) {
        let u = self.as_vectors(u);
        let mut scratch = self.scratch();
        let Scratch {
            tangents,
            forces,
            patches,
            ..
        } = &mut *scratch;
        tangents.resize(self.elements.len(), CellTangent::default());
        forces.resize(self.elements.len(), [[0.0; 3]; N]);
        let with_force = force.is_some();
        for_each_batch_of_two(
            tangents,
            forces,
            #[inline(always)]
            |first, tangents, forces| {
                let (elements, f) = self.deformation_gradients(mesh, first, u);
                let r = rotations_of_cells::<N, _>(&f);
                let twists = match tangent {
                    Tangent::Warped => [[0.0; 6]; BATCH],
                    Tangent::Exact | Tangent::Projected => corotated::twists_of_cells::<N, _>(
                        &elements.each_ref().map(
                            #[inline(always)]
                            |e| e.lame,
                        ),
                        &f,
                        &r,
                        tangent == Tangent::Projected,
                    ),
                };
                for (l, (state, forces)) in tangents.iter_mut().zip(forces).enumerate() {
                    let e = &elements[l];
                    *state = match tangent {
                        Tangent::Warped => CellTangent::warped(e, &r[l], scales.stiffness),
                        Tangent::Exact | Tangent::Projected => {
                            CellTangent::exact(e, &r[l], &twists[l], scales.stiffness)
                        }
                    };
                    if with_force {
                        *forces = e.corner_forces(&corotated::stress(&e.lame, &f[l], &r[l]));
                    }
                }
            },
        );
        self.for_each_patch(patches, |patch, state| {
            patch.linearize(tangent, u, scales.stiffness, state)
        });
        let (tangents, slots, states) = (&*tangents, &self.slots, &*patches);
        out.pattern.for_each_row(
            &mut out.values,
            #[inline(always)]
            |i, cols, row| {
                tangent_row(mesh, tangents, slots, tangent, i, row);
                add_patches_to_row(&self.patches, states, tangent, i, cols, row);
                self.add_mass(i, cols, scales.mass, row);
            },
        );
        if let Some(force) = force {
            self.gather_forces(mesh, forces, patches, force);
        }
    }

    /// Calls `f` for every patch and its state, in parallel.
    fn for_each_patch(&self, states: &mut Vec<Vec<PatchState>>, f: impl Fn(&Patch<N>, &mut PatchState) + Sync + Send) {
        states.resize_with(self.patches.len(), Vec::new);
        for_each_slot(states, |v, states| {
            states.resize_with(self.patches[v].len(), PatchState::default);
            self.patches[v]
                .iter()
                .zip(states)
                .for_each(|(patch, state)| f(patch, state));
        });
    }

    /// A batch of cells and their deformation gradients; nothing and the identity in empty slots.
    #[inline(always)]
    fn deformation_gradients(
        &self,
        mesh: &SimplexMesh<N>,
        first: usize,
        u: &[Vec3],
    ) -> ([Element<N>; BATCH], [[f64; 9]; BATCH]) {
        let mut elements = [Element::default(); BATCH];
        let mut f = [IDENTITY; BATCH];
        for l in 0..BATCH {
            let c = CellId((first + l) as u32);
            if mesh.has_cell(c) {
                elements[l] = self.elements[c.index()];
                f[l] = elements[l].deformation_gradient(&corner_values(mesh, c, u));
            }
        }
        (elements, f)
    }

    fn add_mass(&self, i: usize, cols: &[u32], factor: f64, row: &mut [[f64; 9]]) {
        if factor != 0.0
            && let Ok(k) = cols.binary_search(&(i as u32))
        {
            for axis in 0..3 {
                row[k][4 * axis] += factor * self.lumped[i];
            }
        }
    }

    fn gather_forces(&self, mesh: &SimplexMesh<N>, forces: &[[Vec3; N]], states: &[Vec<PatchState>], f: &mut [f64]) {
        for_each_slot(self.as_vectors_mut(f), |i, f| {
            *f = [0.0; 3];
            for &c in cells_of_row(mesh, i) {
                let force = forces[c.index()][corner_of(mesh, c, i)];
                for axis in 0..3 {
                    f[axis] += force[axis];
                }
            }
            for (j, k, place) in patches_around(&self.patches, i) {
                self.patches[j][k].add_force(&states[j][k], place, f);
            }
        });
    }

    /// Deformation gradient `F = I + du/dX` of a cell at displacements `u` (m); of order 2 in its middle.
    ///
    /// # Panics
    /// If there is no such cell or `u` has the wrong length.
    pub fn deformation_gradient(&self, mesh: &SimplexMesh<N>, c: CellId, u: &[f64]) -> Matrix3<f64> {
        let mut f = self.displacement_gradient(mesh, c, u);
        add(&mut f, &IDENTITY);
        matrix(&f)
    }

    /// Stress of a cell (Pa), symmetric, with the law of linear elasticity `2 mu e + lambda tr(e) I`: of the linear model
    /// with `e = sym(F - I)`; of the corotated one with `e = S - I`, turned by `R` into the deformed frame. In plane strain with
    /// the stress along z, in plane stress that is zero. Where locking is cured it is that of the cell alone, plus the mean of those of
    /// the patches of its corners.
    ///
    /// # Panics
    /// If there is no such cell or `u` has the wrong length.
    pub fn cauchy_like_stress(&self, mesh: &SimplexMesh<N>, model: Model, c: CellId, u: &[f64]) -> Matrix3<f64> {
        let e = &self.elements[c.index()];
        let all = self.as_vectors(u);
        let h = self.displacement_gradient(mesh, c, u);
        let turned = |stress: &[f64; 9], r: &[f64; 9]| {
            let s = matrix(stress) * matrix(r).transpose();
            (s + s.transpose()) / 2.0
        };
        let mut stress = match model {
            Model::Linear => matrix(&e.lame.linear_stress(&h)),
            Model::Corotated => {
                let mut f = h;
                add(&mut f, &IDENTITY);
                let [r] = rotations_of_cells::<N, 1>(&[f]);
                turned(&corotated::stress(&e.lame, &f, &r), &r)
            }
        };
        for v in mesh.cell(c) {
            let own = self.patches.get(v.index()).into_iter().flatten();
            if let Some(patch) = own.into_iter().find(|p| p.material == *self.material(c)) {
                let (s, r) = patch.stress(model, all);
                stress += turned(&s, &r) / N as f64;
            }
        }
        if N == 3 && self.material(c).plane() == Plane::Stress {
            stress[(2, 2)] = 0.0;
        }
        stress
    }

    /// `du/dX` of a cell, of order 2 in its middle, row-major.
    fn displacement_gradient(&self, mesh: &SimplexMesh<N>, c: CellId, u: &[f64]) -> [f64; 9] {
        let (e, u) = (&self.elements[c.index()], self.as_vectors(u));
        match &self.quadratic {
            Some(order2) => order2.gradient_in_the_middle(mesh, e, c, u),
            None => e.displacement_gradient(&corner_values(mesh, c, u)),
        }
    }

    fn as_vectors_mut<'f>(&self, f: &'f mut [f64]) -> &'f mut [Vec3] {
        assert_eq!(f.len(), 3 * self.stiffness.rows(), "length of f");
        f.as_chunks_mut().0
    }

    fn as_vectors<'u>(&self, u: &'u [f64]) -> &'u [Vec3] {
        assert_eq!(u.len(), 3 * self.stiffness.rows(), "length of u");
        u.as_chunks().0
    }

    fn scratch(&self) -> MutexGuard<'_, Scratch<N>> {
        // its content means nothing between calls, so a panic elsewhere does no harm
        self.scratch.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
