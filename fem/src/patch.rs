//! The cells of one material around a vertex, deforming as one: what the cure of [`Locking`] averages over.
//!
//! A patch is like an element with more corners: its gradients are the averages, by volume, of those of its cells, and its
//! volume is the part of theirs that belongs to the vertex. So the same formulas give its energy, forces and tangent.

use kerfem_mesh::{CellId, SimplexMesh};

use crate::corotated::{self, TwistBlocks, twists_of_cells};
use crate::element::{CornerBlocks, Element, Vec3, displacement_gradient};
use crate::evaluate::{Model, Tangent};
use crate::locking::{Locking, law_of_patches};
use crate::material::{Lame, Material};
use crate::rotation::rotations_of_cells;
use crate::rows::cells_of_row;
use crate::small::{Block, IDENTITY, add, times};

/// The patch of a vertex in one material.
#[derive(Clone, Debug)]
pub(crate) struct Patch<const N: usize> {
    pub(crate) material: Material,
    lame: Lame,
    /// An `N`th of the volume of the cells (m³).
    volume: f64,
    /// Corners of the cells, ascending; the vertex itself is one.
    pub(crate) vertices: Vec<u32>,
    /// Their averaged gradients (1/m); they add up to zero.
    gradients: Vec<Vec3>,
}

/// What a patch says at given displacements.
#[derive(Clone, Debug, Default)]
pub(crate) struct PatchState {
    /// First Piola-Kirchhoff stress times volume (N m), row-major.
    stress: Block,
    /// Of the tangent: `R` times the gradients, the Lamé parameters times volume and scale, and likewise the twist.
    rotated: Vec<Vec3>,
    lame: Lame,
    twist: [f64; 6],
}

/// The patches of a vertex in the materials that are cured, in the order of their first cells.
pub(crate) fn patches_of_vertex<'a, const N: usize>(
    mesh: &SimplexMesh<N>,
    v: u32,
    locking: Locking,
    cell: impl Fn(CellId) -> (&'a Element<N>, &'a Material),
) -> Vec<Patch<N>> {
    let cells = cells_of_row(mesh, v as usize).iter().map(|&c| (c, cell(c)));
    let cured = cells.filter(|(_, (_, material))| locking.cures::<N>(material));
    let mut materials: Vec<Material> = Vec::new();
    for (_, (_, material)) in cured.clone() {
        if !materials.contains(material) {
            materials.push(*material);
        }
    }
    let of_material = |m: &Material| {
        let m = *m;
        Patch::new(
            mesh,
            m,
            cured
                .clone()
                .filter(move |(_, (_, own))| **own == m)
                .map(|(c, (e, _))| (c, e)),
        )
    };
    materials.iter().map(of_material).collect()
}

impl<const N: usize> Patch<N> {
    fn new<'a>(
        mesh: &SimplexMesh<N>,
        material: Material,
        cells: impl Iterator<Item = (CellId, &'a Element<N>)> + Clone,
    ) -> Self {
        let mut vertices: Vec<u32> = cells.clone().flat_map(|(c, _)| mesh.cell(c)).map(|w| w.0).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut gradients = vec![[0.0; 3]; vertices.len()];
        let mut volume = 0.0;
        for (c, element) in cells {
            volume += element.volume;
            for (w, g) in mesh.cell(c).into_iter().zip(&element.gradients) {
                let sum = &mut gradients[vertices.partition_point(|&x| x < w.0)];
                for axis in 0..3 {
                    sum[axis] += element.volume * g[axis];
                }
            }
        }
        gradients.as_flattened_mut().iter_mut().for_each(|g| *g /= volume);
        Patch {
            lame: law_of_patches::<N>(&material),
            material,
            volume: volume / N as f64,
            vertices,
            gradients,
        }
    }

    /// Place of a vertex of the patch among its vertices.
    #[inline]
    pub(crate) fn place(&self, v: u32) -> usize {
        self.vertices.partition_point(|&w| w < v)
    }

    /// Displacement gradient, row-major, at displacements `u` (m) of all vertices.
    #[inline]
    fn displacement_gradient(&self, u: &[Vec3]) -> Block {
        displacement_gradient::<N>(&self.gradients, |b| u[self.vertices[b] as usize])
    }

    /// Deformation gradient and its rotation, row-major.
    #[inline]
    fn deformation(&self, u: &[Vec3]) -> (Block, Block) {
        let mut f = self.displacement_gradient(u);
        for axis in 0..3 {
            f[4 * axis] += 1.0;
        }
        let [r] = rotations_of_cells::<N, 1>(&[f]);
        (f, r)
    }

    /// Elastic energy (J).
    pub(crate) fn energy(&self, model: Model, u: &[Vec3]) -> f64 {
        match model {
            Model::Linear => self.lame.linear_energy(self.volume, &self.displacement_gradient(u)),
            Model::Corotated => {
                let (f, r) = self.deformation(u);
                corotated::energy(&self.lame, self.volume, &f, &r)
            }
        }
    }

    /// First Piola-Kirchhoff stress (Pa) and the rotation, both row-major.
    pub(crate) fn stress(&self, model: Model, u: &[Vec3]) -> (Block, Block) {
        match model {
            Model::Linear => (self.lame.linear_stress(&self.displacement_gradient(u)), IDENTITY),
            Model::Corotated => {
                let (f, r) = self.deformation(u);
                (corotated::stress(&self.lame, &f, &r), r)
            }
        }
    }

    /// Brings the stress of a state to displacements `u`.
    pub(crate) fn set_stress(&self, model: Model, u: &[Vec3], state: &mut PatchState) {
        state.stress = self.stress(model, u).0.map(|s| s * self.volume);
    }

    /// Brings stress and tangent of a state to displacements `u`, the tangent times `scale`, of the corotated model.
    pub(crate) fn linearize(&self, tangent: Tangent, u: &[Vec3], scale: f64, state: &mut PatchState) {
        let (f, r) = self.deformation(u);
        let scale = scale * self.volume;
        state.stress = corotated::stress(&self.lame, &f, &r).map(|s| s * self.volume);
        state.rotated.clear();
        state.rotated.extend(self.gradients.iter().map(|g| times(&r, g)));
        state.lame = self.lame.times(scale);
        state.twist = match tangent {
            Tangent::Warped => [0.0; 6],
            Tangent::Exact | Tangent::Projected => {
                let [twist] = twists_of_cells::<N, 1>(&[self.lame], &[f], &[r], tangent == Tangent::Projected);
                twist.map(|t| t * scale)
            }
        };
    }

    /// Adds to `f` the force (N) on the vertex at a place.
    #[inline]
    pub(crate) fn add_force(&self, state: &PatchState, place: usize, f: &mut Vec3) {
        let force = times(&state.stress, &self.gradients[place]);
        for axis in 0..3 {
            f[axis] += force[axis];
        }
    }

    /// Adds the blocks of the vertex at a place to its row, at rest.
    pub(crate) fn add_rest_blocks(&self, place: usize, cols: &[u32], row: &mut [Block]) {
        let Lame { lambda, mu } = self.lame.times(self.volume);
        let blocks = CornerBlocks::<N>::new(lambda, mu, &self.gradients[place]);
        self.add_blocks(&self.gradients, cols, row, |g| blocks.block(g));
    }

    /// Adds the blocks of the vertex at a place to its row.
    pub(crate) fn add_tangent_blocks(
        &self,
        state: &PatchState,
        tangent: Tangent,
        place: usize,
        cols: &[u32],
        row: &mut [Block],
    ) {
        let own = &state.rotated[place];
        let warped = CornerBlocks::<N>::new(state.lame.lambda, state.lame.mu, own);
        if tangent == Tangent::Warped {
            self.add_blocks(&state.rotated, cols, row, |h| warped.block(h));
        } else {
            let twist = TwistBlocks::new(&state.twist, own);
            self.add_blocks(&state.rotated, cols, row, |h| {
                let mut block = warped.block(h);
                add(&mut block, &twist.block(h));
                block
            });
        }
    }

    /// Adds a block for each vertex; `cols` has them all, ascending as they are.
    #[inline(always)]
    fn add_blocks(&self, vectors: &[Vec3], cols: &[u32], row: &mut [Block], block: impl Fn(&Vec3) -> Block) {
        let mut places = cols.iter().zip(row);
        for (v, h) in self.vertices.iter().zip(vectors) {
            if let Some((_, to)) = places.find(|(w, _)| *w == v) {
                add(to, &block(h));
            }
        }
    }
}

/// The patches that have the vertex `i` as a corner, in a fixed order: the vertex whose patch it is, which of its patches, and
/// the place of `i` in it.
pub(crate) fn patches_around<const N: usize>(
    patches: &[Vec<Patch<N>>],
    i: usize,
) -> impl Iterator<Item = (usize, usize, usize)> {
    let own = patches.get(i).into_iter().flatten();
    own.flat_map(move |p| {
        let material = &p.material;
        p.vertices.iter().filter_map(move |&j| {
            let of_j = &patches[j as usize];
            let k = of_j.iter().position(|q| q.material == *material)?;
            Some((j as usize, k, of_j[k].place(i as u32)))
        })
    })
}
