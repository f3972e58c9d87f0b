//! Order 2: quadratic displacements (P2) on straight-sided simplices.
//!
//! Stiffness, forces and energies are sums over the points of the rule of degree 2 (four in a tetrahedron, three in a triangle).
//! That is exact for the linear model. For the corotated model it is the definition: the strain is measured at these points,
//! `E = sum over points of V/n (mu |F - R|² + lambda/2 tr²(S - I))`, each with the rotation `R` of its own `F`. Every point is
//! thus an [`Element`] with the gradients of all nodes, and what holds for a linear cell holds for it: the force is the exact
//! gradient of the energy, and rotations give none.
//!
//! The consistent mass is exact; the lumped one scales its diagonal to the mass of the cell (Hinton, Rock, Zienkiewicz 1976), so
//! it is positive, which row sums are not at corners.

use kerfem_mesh::{CellId, EDGES, MOST_NODES, Midpoints, SimplexMesh, VertexId};
use nalgebra::DMatrix;

use crate::corotated::{self, CellTangent};
use crate::element::{Element, Vec3, displacement_gradient};
use crate::evaluate::Tangent;
use crate::parallel::{for_each_batch_of_two, for_each_slot};
use crate::pattern::Pattern;
use crate::rotation::rotations_of_cells;
use crate::rows::each_once;
use crate::small::{Block, IDENTITY, add};
use crate::{BlockMatrix, FemError, Model};

/// Values at the nodes of a cell; a triangle has fewer.
pub(crate) type Nodal<T> = [T; MOST_NODES];

/// A point of the rule, as if it were a linear cell with more corners.
type PointElement = Element<MOST_NODES>;

/// Memory reused between evaluations, by cell slot.
#[derive(Debug)]
pub(crate) struct Scratch<const N: usize> {
    tangents: Vec<[CellTangent<MOST_NODES>; N]>,
    forces: Vec<Nodal<Vec3>>,
    energies: Vec<f64>,
}

impl<const N: usize> Default for Scratch<N> {
    fn default() -> Self {
        Scratch {
            tangents: Vec::new(),
            forces: Vec::new(),
            energies: Vec::new(),
        }
    }
}

/// The nodes of a mesh of order 2 and the places of their blocks.
#[derive(Clone, Debug)]
pub(crate) struct Quadratic<const N: usize> {
    pub(crate) midpoints: Midpoints<N>,
    /// By cell slot, `[a][b]`: the place of the block of node `b` in the row of node `a`.
    pub(crate) slots: Vec<Nodal<Nodal<u16>>>,
}

impl<const N: usize> Quadratic<N> {
    const NODES: usize = Midpoints::<N>::NODES;

    pub(crate) fn cells_of_row<'a>(&'a self, mesh: &'a SimplexMesh<N>, i: usize) -> &'a [CellId] {
        self.midpoints.cells_of(mesh, VertexId(i as u32))
    }

    fn node_of(&self, mesh: &SimplexMesh<N>, c: CellId, i: usize) -> usize {
        let nodes = self.midpoints.nodes(mesh, c);
        nodes.iter().position(|v| v.index() == i).unwrap_or(0)
    }

    fn values(&self, mesh: &SimplexMesh<N>, c: CellId, u: &[Vec3]) -> Nodal<Vec3> {
        let mut out = [[0.0; 3]; MOST_NODES];
        let nodes = self.midpoints.nodes(mesh, c);
        for (out, v) in out.iter_mut().zip(&nodes[..Self::NODES]) {
            *out = u[v.index()];
        }
        out
    }

    /// Columns of the row of a node, ascending.
    pub(crate) fn row_pattern(&self, mesh: &SimplexMesh<N>, i: u32) -> Result<Vec<u32>, FemError> {
        let mut columns = Vec::new();
        for &c in self.cells_of_row(mesh, i as usize) {
            let nodes = self.midpoints.nodes(mesh, c);
            columns.extend(nodes[..Self::NODES].iter().map(|v| v.0));
        }
        each_once(i, columns)
    }

    /// Finds the places of the blocks of all cells.
    pub(crate) fn place_all(&mut self, mesh: &SimplexMesh<N>, pattern: &Pattern) {
        let mut slots = std::mem::take(&mut self.slots);
        slots.resize(mesh.cell_slots(), Default::default());
        for_each_slot(&mut slots, |c, slots| {
            let c = CellId(c as u32);
            if mesh.has_cell(c) {
                for a in 0..Self::NODES {
                    slots[a] = self.places(mesh, pattern, c, a);
                }
            }
        });
        self.slots = slots;
    }

    /// Finds the places of the blocks in one row.
    pub(crate) fn place_row(&mut self, mesh: &SimplexMesh<N>, pattern: &Pattern, i: usize) {
        for c in self.cells_of_row(mesh, i).to_vec() {
            let a = self.node_of(mesh, c, i);
            self.slots[c.index()][a] = self.places(mesh, pattern, c, a);
        }
    }

    fn places(&self, mesh: &SimplexMesh<N>, pattern: &Pattern, c: CellId, a: usize) -> Nodal<u16> {
        let nodes = self.midpoints.nodes(mesh, c);
        let cols = pattern.cols(nodes[a].index());
        nodes.map(|v| cols.partition_point(|&w| w < v.0) as u16)
    }

    /// `row :=` sum over the cells of the node, ascending, of the stiffness blocks at rest.
    pub(crate) fn stiffness_row(&self, mesh: &SimplexMesh<N>, elements: &[Element<N>], i: usize, row: &mut [Block]) {
        row.fill([0.0; 9]);
        for &c in self.cells_of_row(mesh, i) {
            let a = self.node_of(mesh, c, i);
            let places = &self.slots[c.index()][a];
            for point in points(&elements[c.index()]) {
                let blocks = point.rest_blocks(a);
                for b in 0..Self::NODES {
                    add(
                        &mut row[places[b] as usize],
                        &in_plane::<N>(blocks.block(&point.gradients[b])),
                    );
                }
            }
        }
    }

    /// `row :=` the same sum of the tangent.
    fn tangent_row(
        &self,
        mesh: &SimplexMesh<N>,
        tangents: &[[CellTangent<MOST_NODES>; N]],
        tangent: Tangent,
        i: usize,
        row: &mut [Block],
    ) {
        row.fill([0.0; 9]);
        for &c in self.cells_of_row(mesh, i) {
            let a = self.node_of(mesh, c, i);
            let places = &self.slots[c.index()][a];
            for point in &tangents[c.index()] {
                let (warped, twist) = (point.warped_blocks(a), point.twist_blocks(a));
                for b in 0..Self::NODES {
                    let to = &mut row[places[b] as usize];
                    add(to, &in_plane::<N>(warped.block(point.rotated(b))));
                    if tangent != Tangent::Warped {
                        add(to, &twist.block(point.rotated(b)));
                    }
                }
            }
        }
    }

    /// Row of the consistent mass.
    pub(crate) fn mass_row(&self, mesh: &SimplexMesh<N>, elements: &[Element<N>], i: usize, row: &mut [f64]) {
        row.fill(0.0);
        for &c in self.cells_of_row(mesh, i) {
            let a = self.node_of(mesh, c, i);
            let mass = elements[c.index()].mass;
            for b in 0..Self::NODES {
                row[self.slots[c.index()][a][b] as usize] += mass * mass_share::<N>(a, b);
            }
        }
    }

    pub(crate) fn lumped_mass(&self, mesh: &SimplexMesh<N>, elements: &[Element<N>], i: usize) -> f64 {
        let shares = lumped_shares::<N>();
        let share = |c: &CellId| elements[c.index()].mass * shares[self.node_of(mesh, *c, i)];
        self.cells_of_row(mesh, i).iter().map(share).sum()
    }

    /// Energy (J) at displacements `u`, summed in the order of the cells.
    pub(crate) fn energy(
        &self,
        mesh: &SimplexMesh<N>,
        elements: &[Element<N>],
        model: Model,
        u: &[Vec3],
        scratch: &mut Scratch<N>,
    ) -> f64 {
        let energies = &mut scratch.energies;
        energies.resize(elements.len(), 0.0);
        for_each_slot(energies, |slot, energy| {
            let state = self.state(mesh, elements, model, slot, u);
            *energy = state.map_or(0.0, |state| state.energy(model));
        });
        energies.iter().sum()
    }

    /// `f :=` the gradient of the energy (N).
    pub(crate) fn internal_force(
        &self,
        mesh: &SimplexMesh<N>,
        elements: &[Element<N>],
        model: Model,
        u: &[Vec3],
        scratch: &mut Scratch<N>,
        f: &mut [Vec3],
    ) {
        let forces = &mut scratch.forces;
        forces.resize(elements.len(), Nodal::default());
        for_each_slot(forces, |slot, forces| {
            if let Some(state) = self.state(mesh, elements, model, slot, u) {
                *forces = state.forces(model);
            }
        });
        self.gather(mesh, forces, f);
    }

    /// Rows of `scale` times the tangent of the corotated model, each followed by `finish`; and `force`, if given, as
    /// [`Self::internal_force`].
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn linearize(
        &self,
        mesh: &SimplexMesh<N>,
        elements: &[Element<N>],
        tangent: Tangent,
        u: &[Vec3],
        scale: f64,
        scratch: &mut Scratch<N>,
        out: &mut BlockMatrix,
        force: Option<&mut [Vec3]>,
        finish: impl Fn(usize, &[u32], &mut [Block]) + Sync + Send,
    ) {
        let Scratch { tangents, forces, .. } = scratch;
        tangents.resize(elements.len(), [CellTangent::default(); N]);
        forces.resize(elements.len(), Nodal::default());
        let (model, with_force) = (Model::Corotated, force.is_some());
        for_each_batch_of_two(tangents, forces, |first, tangents, forces| {
            for (l, (tangents, forces)) in tangents.iter_mut().zip(forces).enumerate() {
                if let Some(state) = self.state(mesh, elements, model, first + l, u) {
                    *tangents = state.tangents(tangent, scale);
                    if with_force {
                        *forces = state.forces(model);
                    }
                }
            }
        });
        if let Some(force) = force {
            self.gather(mesh, forces, force);
        }
        let tangents = &*tangents;
        out.pattern.for_each_row(&mut out.values, |i, cols, row| {
            self.tangent_row(mesh, tangents, tangent, i, row);
            finish(i, cols, row);
        });
    }

    /// What the points of the cell in a slot have to say at displacements `u` (m); none of an empty slot.
    #[inline]
    fn state(
        &self,
        mesh: &SimplexMesh<N>,
        elements: &[Element<N>],
        model: Model,
        slot: usize,
        u: &[Vec3],
    ) -> Option<CellState<N>> {
        let c = CellId(slot as u32);
        let of_cell = || CellState::of(&elements[slot], model, &self.values(mesh, c, u));
        mesh.has_cell(c).then(of_cell)
    }

    /// Displacement gradient in the middle of a cell, row-major.
    pub(crate) fn gradient_in_the_middle(
        &self,
        mesh: &SimplexMesh<N>,
        element: &Element<N>,
        c: CellId,
        u: &[Vec3],
    ) -> [f64; 9] {
        gradient_of_nodes::<N>(&node_gradients(element, &[1.0 / N as f64; N]), &self.values(mesh, c, u))
    }

    fn gather(&self, mesh: &SimplexMesh<N>, forces: &[Nodal<Vec3>], f: &mut [Vec3]) {
        for_each_slot(f, |i, f| {
            *f = [0.0; 3];
            for &c in self.cells_of_row(mesh, i) {
                let force = forces[c.index()][self.node_of(mesh, c, i)];
                for axis in 0..3 {
                    f[axis] += force[axis];
                }
            }
        });
    }
}

/// What the points of a cell have to say at some displacements.
struct CellState<const N: usize> {
    points: [PointElement; N],
    /// Displacement gradients.
    h: [[f64; 9]; N],
    /// Deformation gradients and their rotations; of the linear model the identity.
    f: [[f64; 9]; N],
    r: [[f64; 9]; N],
}

impl<const N: usize> CellState<N> {
    fn of(element: &Element<N>, model: Model, u: &Nodal<Vec3>) -> Self {
        let points = points(element);
        let h = points.each_ref().map(|p| gradient_of_nodes::<N>(&p.gradients, u));
        let mut f = h;
        for f in &mut f {
            add(f, &IDENTITY);
        }
        let r = match model {
            Model::Linear => [IDENTITY; N],
            Model::Corotated => rotations_of_cells::<N, N>(&f),
        };
        CellState { points, h, f, r }
    }

    fn energy(&self, model: Model) -> f64 {
        let of_point = |q: usize| match model {
            Model::Linear => self.points[q].lame.linear_energy(self.points[q].volume, &self.h[q]),
            Model::Corotated => corotated::energy(&self.points[q].lame, self.points[q].volume, &self.f[q], &self.r[q]),
        };
        (0..N).map(of_point).sum()
    }

    fn forces(&self, model: Model) -> Nodal<Vec3> {
        let mut sum: Nodal<Vec3> = Nodal::default();
        for (q, point) in self.points.iter().enumerate() {
            let stress = match model {
                Model::Linear => point.lame.linear_stress(&self.h[q]),
                Model::Corotated => corotated::stress(&point.lame, &self.f[q], &self.r[q]),
            };
            let forces = point.corner_forces(&stress);
            for (to, from) in sum.as_flattened_mut().iter_mut().zip(forces.as_flattened()) {
                *to += from;
            }
        }
        sum
    }

    fn tangents(&self, tangent: Tangent, scale: f64) -> [CellTangent<MOST_NODES>; N] {
        let twists = match tangent {
            Tangent::Warped => [[0.0; 6]; N],
            Tangent::Exact | Tangent::Projected => {
                let lame = self.points.each_ref().map(|p| p.lame);
                corotated::twists_of_cells::<N, N>(&lame, &self.f, &self.r, tangent == Tangent::Projected)
            }
        };
        std::array::from_fn(|q| match tangent {
            Tangent::Warped => CellTangent::warped(&self.points[q], &self.r[q], scale),
            Tangent::Exact | Tangent::Projected => CellTangent::exact(&self.points[q], &self.r[q], &twists[q], scale),
        })
    }
}

/// The points of the rule of degree 2 in a cell, with equal weights.
fn points<const N: usize>(element: &Element<N>) -> [PointElement; N] {
    // (5 - sqrt 5) / 20 in a tetrahedron, 1/6 in a triangle: the coordinates by the other corners
    let far = if N == 4 { (5.0 - 5f64.sqrt()) / 20.0 } else { 1.0 / 6.0 };
    std::array::from_fn(|q| {
        let near = 1.0 - (N - 1) as f64 * far;
        let w = std::array::from_fn(|i| if i == q { near } else { far });
        Element {
            gradients: node_gradients(element, &w),
            volume: element.volume / N as f64,
            lame: element.lame,
            mass: element.mass / N as f64,
        }
    })
}

/// Gradients (1/m) of the quadratic shape functions at barycentric coordinates.
fn node_gradients<const N: usize>(element: &Element<N>, w: &[f64; N]) -> Nodal<Vec3> {
    let g = &element.gradients;
    let mut out = Nodal::default();
    for i in 0..N {
        out[i] = g[i].map(|x| (4.0 * w[i] - 1.0) * x);
    }
    for (k, [i, j]) in EDGES.into_iter().enumerate().take(Midpoints::<N>::EDGES) {
        out[N + k] = std::array::from_fn(|axis| 4.0 * (w[i] * g[j][axis] + w[j] * g[i][axis]));
    }
    out
}

/// [`displacement_gradient`] of nodal displacements (m).
#[inline]
fn gradient_of_nodes<const N: usize>(gradients: &Nodal<Vec3>, u: &Nodal<Vec3>) -> [f64; 9] {
    displacement_gradient::<N>(&gradients[..Midpoints::<N>::NODES], |b| u[b])
}

/// A block without what lies across the plane, for a triangle.
#[inline(always)]
fn in_plane<const N: usize>(mut block: Block) -> Block {
    if N == 3 {
        block[8] = 0.0;
    }
    block
}

/// Ends of the edge that a node is the middle of.
fn edge_of<const N: usize>(a: usize) -> Option<[usize; 2]> {
    a.checked_sub(N).map(|k| EDGES[k])
}

/// Entry of the consistent mass matrix of a cell, as a share of its mass.
pub(crate) fn mass_share<const N: usize>(a: usize, b: usize) -> f64 {
    let shared = |p: [usize; 2], q: [usize; 2]| p.iter().filter(|i| q.contains(i)).count();
    match (N, edge_of::<N>(a), edge_of::<N>(b)) {
        (4, None, None) => (if a == b { 6.0 } else { 1.0 }) / 420.0,
        (4, Some(e), None) | (4, None, Some(e)) => (if e.contains(&a.min(b)) { -4.0 } else { -6.0 }) / 420.0,
        (4, Some(p), Some(q)) => [8.0, 16.0, 32.0][shared(p, q)] / 420.0,
        (_, None, None) => (if a == b { 6.0 } else { -1.0 }) / 180.0,
        (_, Some(e), None) | (_, None, Some(e)) => (if e.contains(&a.min(b)) { 0.0 } else { -4.0 }) / 180.0,
        (_, Some(p), Some(q)) => [0.0, 16.0, 32.0][shared(p, q)] / 180.0,
    }
}

/// Shares of the mass of a cell that its nodes carry when lumped: in proportion to the diagonal of the consistent mass.
pub(crate) fn lumped_shares<const N: usize>() -> Nodal<f64> {
    let mut shares = Nodal::default();
    let nodes = &mut shares[..Midpoints::<N>::NODES];
    for (a, share) in nodes.iter_mut().enumerate() {
        *share = mass_share::<N>(a, a);
    }
    let trace: f64 = nodes.iter().sum();
    nodes.iter_mut().for_each(|share| *share /= trace);
    shares
}

/// Largest eigenvalue (1/s²) of the rest stiffness of a cell against its own lumped mass.
pub(crate) fn largest_eigenvalue<const N: usize>(element: &Element<N>) -> f64 {
    let nodes = Midpoints::<N>::NODES;
    let roots = lumped_shares::<N>().map(|share| (element.mass * share).sqrt());
    let mut matrix = DMatrix::<f64>::zeros(3 * nodes, 3 * nodes);
    for point in points(element) {
        for a in 0..nodes {
            let blocks = point.rest_blocks(a);
            for b in 0..nodes {
                let block = in_plane::<N>(blocks.block(&point.gradients[b]));
                for (ij, entry) in block.into_iter().enumerate() {
                    matrix[(3 * a + ij / 3, 3 * b + ij % 3)] += entry / (roots[a] * roots[b]);
                }
            }
        }
    }
    matrix.symmetric_eigenvalues().max()
}
