//! Momentum through a change that moves vertices (DESIGN invariant 4).
//!
//! Of which mass, says [`inertia`]; about the origin, at current positions. Splitting cells keeps the momenta of the consistent
//! mass; moving a vertex does not, since the velocity field is sampled anew. [`restore`] gives back what was lost by the smallest change of velocities in the norm of
//! the lumped mass, piece by piece.

use std::collections::{BTreeMap, BTreeSet};

use kerfem_fem::{Assembler, Material};
use kerfem_mesh::{Barycentric, CellId, EDGES, MOST_NODES, MeshChange, Midpoints, Point, SimplexMesh, VertexId};
use nalgebra::{Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::MassKind;
use crate::conditions::FixedDofs;
use crate::state::{OldValues, State, nodal, set_nodal};

/// Eigenvalues of the 6x6 system below this fraction of the largest belong to motions that the free vertices cannot make.
const RANK: f64 = 1e-11;

/// Deficits below this fraction of the momentum in the vertices concerned are rounding.
const ROUNDING: f64 = 1e-14;

/// Relative difference of volumes up to which they are the same.
const SAME_VOLUME: f64 = 1e-9;

/// What a correction did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Correction {
    /// Norm of the velocity change in the lumped mass (sqrt(J)).
    pub(crate) size: f64,
    /// Whether the free vertices of every piece could take up all of the difference.
    pub(crate) complete: bool,
}

/// The mass that momenta are of, as far as cells have it in common.
#[derive(Clone, Debug)]
pub(crate) struct Inertia {
    /// The mass matrix of a cell of mass one, by nodes.
    shares: [[f64; MOST_NODES]; MOST_NODES],
    /// Whether a vertex weighs what its row of the consistent mass adds up to, and not its lumped mass.
    consistent: bool,
}

/// The mass that momenta are of. Of order 1 the lumped and the consistent mass give the same linear momentum, and angular momentum
/// is that of the consistent one, which dividing cells does not change. Of order 2 both are those of the mass that the body moves
/// with.
pub(crate) fn inertia<const N: usize>(assembler: &Assembler<N>, kind: MassKind) -> Inertia {
    let is_quadratic = assembler.midpoints().is_some();
    let lumped = is_quadratic && kind == MassKind::Lumped;
    Inertia {
        shares: assembler.mass_shares(lumped),
        consistent: is_quadratic && !lumped,
    }
}

impl Inertia {
    /// What a vertex adds to linear momentum (kg) with a unit of velocity.
    fn mass<const N: usize>(&self, assembler: &Assembler<N>, v: VertexId) -> f64 {
        match self.consistent {
            true => assembler.consistent_mass().row_sum(v),
            false => assembler.lumped_mass()[v.index()],
        }
    }

    /// What a node gets of a field over a cell of mass one.
    fn weigh(&self, node: usize, field: &Field) -> Vector3<f64> {
        let of_node = |b: usize| field[b] * self.shares[node][b];
        (0..MOST_NODES).map(of_node).sum()
    }
}

/// Values at the nodes of a cell; zero where it has none.
type Field = [Vector3<f64>; MOST_NODES];

/// Fields over a cell: rest positions of its corners, position and velocity at its nodes.
struct Sample<const N: usize> {
    rest: [Point; N],
    x: Field,
    v: Field,
}

impl<const N: usize> Sample<N> {
    /// Fields over a cell from displacement and velocity at its nodes.
    fn of(
        assembler: &Assembler<N>,
        rest: [Point; N],
        values: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>,
    ) -> Self {
        let places = node_places(assembler, &rest);
        let (mut x, mut v) = (Field::default(), Field::default());
        for (k, (u, velocity)) in values.enumerate() {
            (x[k], v[k]) = (places[k] + u, velocity);
        }
        Sample { rest, x, v }
    }

    /// The fields continued to other corners.
    fn continued(&self, assembler: &Assembler<N>, rest: [Point; N]) -> Sample<N> {
        let coordinates = Barycentric::of(&self.rest);
        let weights = |p: &Point| match self.rest.iter().position(|q| q == p) {
            Some(k) => std::array::from_fn(|i| f64::from(u8::from(i == k))),
            None => coordinates.as_ref().map_or([1.0 / N as f64; N], |b| b.at(p)),
        };
        let at = |field: &Field, w: &[f64; N]| -> Vector3<f64> {
            field
                .iter()
                .zip(assembler.shapes(w))
                .map(|(value, shape)| value * shape)
                .sum()
        };
        let corners = rest.each_ref().map(weights);
        let middle = |[i, j]: [usize; 2]| std::array::from_fn(|k| (corners[i][k] + corners[j][k]) / 2.0);
        let edges = if assembler.midpoints().is_some() {
            Midpoints::<N>::EDGES
        } else {
            0
        };
        let nodes = corners.iter().copied().chain(EDGES.into_iter().take(edges).map(middle));
        let (mut x, mut v) = (Field::default(), Field::default());
        for (k, w) in nodes.enumerate() {
            (x[k], v[k]) = (at(&self.x, &w), at(&self.v, &w));
        }
        Sample { rest, x, v }
    }

    /// Linear and angular momentum (about `center`) for a material.
    fn momentum(&self, inertia: &Inertia, material: &Material, center: &Vector3<f64>) -> Vector6<f64> {
        let mass = material.density() * material.volume_of_cell(&self.rest);
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for (node, x) in self.x.iter().enumerate() {
            let own = inertia.weigh(node, &self.v);
            linear += own;
            angular += (x - center).cross(&own);
        }
        stack(&(linear * mass), &(angular * mass))
    }
}

/// Rest positions of the nodes of a cell with given corners.
fn node_places<const N: usize>(assembler: &Assembler<N>, rest: &[Point; N]) -> [Point; MOST_NODES] {
    let mut places = [Point::zeros(); MOST_NODES];
    places[..N].copy_from_slice(rest);
    if assembler.midpoints().is_some() {
        for (k, [i, j]) in EDGES.into_iter().enumerate().take(Midpoints::<N>::EDGES) {
            places[N + k] = (rest[i] + rest[j]) / 2.0;
        }
    }
    places
}

fn stack(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Gives each connected piece of touched cells the linear and angular momentum it had before `change`, by changing
/// velocities of its free dofs as little as possible. A piece that lacks no more than rounding is left alone: splits keep
/// momentum, but a new vertex may have been moved off the edge it came from.
pub(crate) fn restore<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    inertia: &Inertia,
    fixed: &FixedDofs<N>,
    change: &MeshChange<N>,
    old: &OldValues,
    state: &mut State,
) -> Correction {
    let mut correction = Correction {
        size: 0.0,
        complete: true,
    };
    let touched = Touched::new(mesh, change);
    let center = touched.center(mesh, &state.u);
    let deficits = touched.deficits(mesh, assembler, inertia, change, old, state, &center);
    for (piece, deficit) in deficits.iter().enumerate() {
        let vertices = touched.nodes_of(mesh, assembler, piece);
        if is_rounding(mesh, assembler, &vertices, deficit, &center, state) {
            continue;
        }
        let (size, complete) = correct(mesh, assembler, inertia, fixed, &vertices, deficit, &center, state);
        correction.size = correction.size.hypot(size);
        correction.complete &= complete;
    }
    correction
}

/// Whether a deficit is no more than the rounding of the sums it comes from.
fn is_rounding<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    vertices: &[VertexId],
    deficit: &Vector6<f64>,
    center: &Vector3<f64>,
    state: &State,
) -> bool {
    let (mut linear, mut angular) = (0.0, 0.0);
    for &v in vertices {
        let momentum = assembler.lumped_mass()[v.index()] * nodal(&state.v, v).norm();
        linear += momentum;
        angular += momentum * (mesh.rest_position(v) + nodal(&state.u, v) - center).norm();
    }
    deficit.fixed_rows::<3>(0).norm() <= ROUNDING * linear && deficit.fixed_rows::<3>(3).norm() <= ROUNDING * angular
}

/// The cells that a change touched, and their connected pieces.
struct Touched {
    cells: Vec<CellId>,
    piece: Vec<usize>,
    pieces: usize,
    /// The old cell that each touched cell lies in, if it is new.
    parents: BTreeMap<CellId, CellId>,
}

impl Touched {
    fn new<const N: usize>(mesh: &SimplexMesh<N>, change: &MeshChange<N>) -> Self {
        let parents: BTreeMap<CellId, CellId> = change.cells_added.iter().map(|c| (c.id, c.parent)).collect();
        let mut cells: Vec<CellId> = parents.keys().copied().collect();
        cells.extend(change.vertices_moved.iter().flat_map(|m| mesh.cells_of_vertex(m.id)));
        cells.sort_unstable();
        cells.dedup();
        let (piece, pieces) = mesh.pieces_among(&cells, |_| true);
        Touched {
            cells,
            piece,
            pieces,
            parents,
        }
    }

    fn center<const N: usize>(&self, mesh: &SimplexMesh<N>, u: &[f64]) -> Vector3<f64> {
        let first = self.cells.first().map_or(Vector3::zeros(), |c| {
            let v = mesh.cell(*c)[0];
            mesh.rest_position(v) + nodal(u, v)
        });
        let corners = self.cells.iter().flat_map(|c| mesh.cell(*c));
        let sum = corners
            .map(|v| mesh.rest_position(v) + nodal(u, v) - first)
            .sum::<Vector3<f64>>();
        first + sum / (N * self.cells.len().max(1)) as f64
    }

    fn nodes_of<const N: usize>(&self, mesh: &SimplexMesh<N>, assembler: &Assembler<N>, piece: usize) -> Vec<VertexId> {
        let cells = self.cells.iter().zip(&self.piece).filter(|(_, p)| **p == piece);
        let mut vertices: Vec<VertexId> = cells.flat_map(|(c, _)| assembler.nodes(mesh, *c)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// Whether the touched cells fill the same space as before: cells were put together anew, none was taken out for good.
    fn fills_what_was_filled<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        change: &MeshChange<N>,
        moved: &BTreeMap<VertexId, Point>,
    ) -> bool {
        let volume = kerfem_mesh::quality::cell_volume::<N>;
        let old_place = |v: VertexId| moved.get(&v).copied().unwrap_or(mesh.rest_position(v));
        let removed: f64 = change.cells_removed.iter().map(|c| volume(&c.rest_positions)).sum();
        let kept = self.cells.iter().filter(|c| !self.parents.contains_key(c));
        let before: f64 = removed + kept.map(|c| volume(&mesh.cell(*c).map(old_place))).sum::<f64>();
        let after: f64 = (self.cells.iter()).map(|c| volume(&mesh.cell_rest_positions(*c))).sum();
        (before - after).abs() <= SAME_VOLUME * before
    }

    /// What each piece lacks. A piece should have the momentum of the old fields over its cells (each continued linearly
    /// from the old cell it comes from); what these leave of the true sum over the old cells is shared out by mass.
    #[allow(clippy::too_many_arguments)]
    fn deficits<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
        inertia: &Inertia,
        change: &MeshChange<N>,
        old: &OldValues,
        state: &State,
        center: &Vector3<f64>,
    ) -> Vec<Vector6<f64>> {
        let moved: BTreeMap<VertexId, Point> = change
            .vertices_moved
            .iter()
            .map(|m| (m.id, m.old_rest_position))
            .collect();
        let now = |v: VertexId| (nodal(&state.u, v), nodal(&state.v, v));
        let earlier = |v: VertexId| old.get(&v).copied().unwrap_or_else(|| now(v));
        let on_edges = |c: CellId| {
            let all = assembler.midpoints().map_or(&[] as &[VertexId], |m| m.of_cell(c));
            all.iter().copied()
        };
        let removed: BTreeMap<CellId, Sample<N>> = (change.cells_removed.iter())
            .map(|c| {
                let nodes = c.corners.into_iter().chain(on_edges(c.id));
                (c.id, Sample::of(assembler, c.rest_positions, nodes.map(earlier)))
            })
            .collect();

        let mut before = Vector6::zeros();
        // where cells were taken out and not replaced, the momentum of those without heirs is gone too
        let heirs: BTreeSet<CellId> = self.parents.values().copied().collect();
        let all_is_filled = self.fills_what_was_filled(mesh, change, &moved);
        for (id, sample) in removed.iter().filter(|(id, _)| all_is_filled || heirs.contains(id)) {
            before += sample.momentum(inertia, assembler.material(*id), center);
        }
        let mut lacking = vec![Vector6::zeros(); self.pieces];
        let mut masses = vec![0.0; self.pieces];
        for (&cell, &piece) in self.cells.iter().zip(&self.piece) {
            let material = assembler.material(cell);
            let (corners, rest) = (mesh.cell(cell), mesh.cell_rest_positions(cell));
            let present = Sample::of(assembler, rest, assembler.nodes(mesh, cell).map(now));
            let wanted = match self.parents.get(&cell).and_then(|p| removed.get(p)) {
                Some(parent) => parent.continued(assembler, rest).momentum(inertia, material, center),
                None => {
                    let old_rest = corners.map(|v| moved.get(&v).copied().unwrap_or(mesh.rest_position(v)));
                    let own = Sample::of(assembler, old_rest, assembler.nodes(mesh, cell).map(earlier));
                    before += own.momentum(inertia, material, center);
                    own.continued(assembler, rest).momentum(inertia, material, center)
                }
            };
            before -= wanted;
            lacking[piece] += wanted - present.momentum(inertia, material, center);
            masses[piece] += material.density() * material.volume_of_cell(&rest);
        }
        let total: f64 = masses.iter().sum();
        for (deficit, mass) in lacking.iter_mut().zip(&masses) {
            *deficit += before * (mass / total);
        }
        lacking
    }
}

/// Changes the velocities of the free dofs of `vertices` by the smallest amount (lumped mass norm) that adds `deficit`.
///
/// The change of dof `d` is `phi_d . lambda`, where `m_d phi_d` is the derivative of linear and angular momentum by that
/// velocity, and `(sum of m_d phi_d phi_d^T) lambda = deficit`: a rigid field, up to the difference between the masses.
#[allow(clippy::too_many_arguments)]
fn correct<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    inertia: &Inertia,
    fixed: &FixedDofs<N>,
    vertices: &[VertexId],
    deficit: &Vector6<f64>,
    center: &Vector3<f64>,
    state: &mut State,
) -> (f64, bool) {
    let mass = |v: VertexId| assembler.lumped_mass()[v.index()];
    let arms: Vec<Vector3<f64>> = vertices
        .iter()
        .map(|&v| lever(mesh, assembler, inertia, v, &state.u, center) / mass(v))
        .collect();
    let ratios: Vec<f64> = vertices.iter().map(|&v| inertia.mass(assembler, v) / mass(v)).collect();
    let length = arms.iter().map(|a| a.norm()).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    // angular rows are divided by a length so that all rows have the same unit
    let phi = |k: usize, axis: usize| {
        let e = Vector3::ith(axis, 1.0);
        stack(&(e * ratios[k]), &(arms[k].cross(&e) / length))
    };
    let free = |v: VertexId, axis: usize| !fixed.is_fixed(v, axis);
    let mut gram = Matrix6::zeros();
    for (k, &v) in vertices.iter().enumerate() {
        for axis in (0..3).filter(|&a| free(v, a)) {
            let row = phi(k, axis);
            gram += mass(v) * row * row.transpose();
        }
    }
    let wanted = Vector6::from_fn(|i, _| if i < 3 { deficit[i] } else { deficit[i] / length });
    let eigen = SymmetricEigen::new(gram);
    let largest = eigen.eigenvalues.max();
    let mut lambda = Vector6::zeros();
    for (k, &value) in eigen.eigenvalues.iter().enumerate() {
        if value > RANK * largest {
            let mode = eigen.eigenvectors.column(k);
            lambda += mode * (mode.dot(&wanted) / value);
        }
    }
    let mut size = 0.0;
    for (k, &v) in vertices.iter().enumerate() {
        let mut velocity = nodal(&state.v, v);
        for axis in (0..3).filter(|&a| free(v, a)) {
            let change = phi(k, axis).dot(&lambda);
            velocity[axis] += change;
            size += mass(v) * change * change;
        }
        set_nodal(&mut state.v, v, &velocity);
    }
    let missed = (gram * lambda - wanted).norm();
    (size.sqrt(), missed <= 1e-10 * wanted.norm())
}

/// Row of the mass of a vertex times current positions relative to `center` (kg m).
fn lever<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    inertia: &Inertia,
    v: VertexId,
    u: &[f64],
    center: &Vector3<f64>,
) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for &c in assembler.cells_of_node(mesh, v) {
        let material = assembler.material(c);
        let mass = material.density() * material.volume_of_cell(&mesh.cell_rest_positions(c));
        let mut x = Field::default();
        let mut node = 0;
        for (k, w) in assembler.nodes(mesh, c).enumerate() {
            x[k] = mesh.rest_position(w) + nodal(u, w) - center;
            node = if w == v { k } else { node };
        }
        sum += inertia.weigh(node, &x) * mass;
    }
    sum
}

/// Linear momentum (kg m/s).
pub(crate) fn linear<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    inertia: &Inertia,
    v: &[f64],
) -> Vector3<f64> {
    let vertices = mesh.vertex_ids();
    vertices.map(|w| inertia.mass(assembler, w) * nodal(v, w)).sum()
}

/// The sum of `m |v|` over the vertices (kg m/s): what momenta are compared with.
pub(crate) fn scale<const N: usize>(assembler: &Assembler<N>, v: &[f64]) -> f64 {
    let masses = assembler.lumped_mass().iter().enumerate();
    masses.map(|(i, m)| *m * nodal(v, VertexId(i as u32)).norm()).sum()
}

/// Angular momentum (kg m²/s) about the origin.
#[cfg(test)]
pub(crate) fn angular<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    inertia: &Inertia,
    state: &State,
) -> Vector3<f64> {
    let cells = mesh.cell_ids().map(|c| {
        let values = assembler
            .nodes(mesh, c)
            .map(|w| (nodal(&state.u, w), nodal(&state.v, w)));
        let sample = Sample::of(assembler, mesh.cell_rest_positions(c), values);
        let both = sample.momentum(inertia, assembler.material(c), &Vector3::zeros());
        Vector3::new(both[3], both[4], both[5])
    });
    cells.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kerfem_mesh::{Edit, TetMesh};

    use crate::Scene;
    use crate::input::MeshInput;

    struct Body {
        mesh: TetMesh,
        assembler: Assembler,
        fixed: FixedDofs,
        state: State,
    }

    /// A cube in uneven motion, with the given extra sections.
    fn body(sections: &str) -> Body {
        let text = format!(
            "name = 'cube'\n[mesh]\nbox = {{ size = [1, 1, 1], cells = [3, 3, 3] }}\n[material]\nyoung = 1\n\
             poisson = 0.3\ndensity = 2\n{sections}"
        );
        let scene = Scene::parse(&text, "cube.toml").unwrap();
        let input = MeshInput::read(&scene.mesh, &scene.source).unwrap();
        let material = Material::new(1.0, 0.3, 2.0).unwrap();
        let fixed = FixedDofs::new(&scene, &input).unwrap();
        let mesh = input.mesh;
        let mut state = State::at_rest(mesh.vertex_slots());
        for (i, (u, v)) in state.u.iter_mut().zip(&mut state.v).enumerate() {
            *u = 0.05 * (7.0 * i as f64).sin();
            *v = (3.0 * i as f64).cos();
        }
        Body {
            assembler: Assembler::new(&mesh, |_| material).unwrap(),
            mesh,
            fixed,
            state,
        }
    }

    fn inside(mesh: &TetMesh) -> VertexId {
        mesh.vertex_ids().find(|v| !mesh.is_boundary_vertex(*v)).unwrap()
    }

    fn follow(body: &mut Body, change: &MeshChange<4>) -> Correction {
        let old = body.state.apply(&body.mesh, change);
        body.fixed.follow(&body.mesh, None, change);
        body.assembler.update(&body.mesh, change).unwrap();
        let inertia = inertia(&body.assembler, MassKind::Lumped);
        restore(
            &body.mesh,
            &body.assembler,
            &inertia,
            &body.fixed,
            change,
            &old,
            &mut body.state,
        )
    }

    fn momenta(b: &Body) -> (Vector3<f64>, Vector3<f64>) {
        let inertia = inertia(&b.assembler, MassKind::Lumped);
        (
            linear(&b.mesh, &b.assembler, &inertia, &b.state.v),
            angular(&b.mesh, &b.assembler, &inertia, &b.state),
        )
    }

    #[test]
    fn a_moved_vertex_gets_its_momentum_back() {
        let mut b = body("");
        let v = inside(&b.mesh);
        let w = b.mesh.vertex_neighbors(v)[0];
        let (p, l) = momenta(&b);
        let mut edit = Edit::new(&mut b.mesh);
        let place = edit.mesh().rest_position(v) * 0.8 + edit.mesh().rest_position(w) * 0.2;
        edit.move_vertex(v, place, &vec![(w, 0.2), (v, 0.8)]);
        let change = edit.commit();
        let correction = follow(&mut b, &change);
        let (q, m) = momenta(&b);
        assert!(correction.complete && correction.size > 0.0);
        assert!(
            (p - q).norm() < 1e-13 * scale(&b.assembler, &b.state.v),
            "{}",
            (p - q).norm()
        );
        assert!(
            (l - m).norm() < 1e-13 * scale(&b.assembler, &b.state.v),
            "{}",
            (l - m).norm()
        );
    }

    #[test]
    fn only_free_dofs_are_corrected() {
        let mut b = body("[[fixed]]\nwhere = 'z < 0.5'\naxes = 'x'");
        let v = inside(&b.mesh);
        let w = b.mesh.vertex_neighbors(v)[3];
        let before = b.state.v.clone();
        let mut edit = Edit::new(&mut b.mesh);
        let place = edit.mesh().rest_position(v) * 0.9 + edit.mesh().rest_position(w) * 0.1;
        edit.move_vertex(v, place, &vec![(w, 0.1), (v, 0.9)]);
        let change = edit.commit();
        follow(&mut b, &change);
        let changed = |d: &usize| b.state.v[*d] != before[*d] && d / 3 != v.index();
        let changed: Vec<usize> = (0..before.len()).filter(changed).collect();
        assert!(!changed.is_empty());
        assert!(changed.iter().all(|d| !b.fixed.mask()[*d]));
    }

    #[test]
    fn a_split_changes_nothing() {
        let mut b = body("");
        let v = inside(&b.mesh);
        let w = b.mesh.vertex_neighbors(v)[1];
        let (p, l) = momenta(&b);
        let before = b.state.v.clone();
        let mut edit = Edit::new(&mut b.mesh);
        let place = (edit.mesh().rest_position(v) + edit.mesh().rest_position(w)) / 2.0;
        let ring: Vec<CellId> = edit.mesh().cells_of_edge(v, w).collect();
        let middle = edit.add_vertex(place, &vec![(v, 0.5), (w, 0.5)]);
        for c in ring {
            let corners = edit.mesh().cell(c);
            edit.remove_cell(c);
            for gone in [v, w] {
                let labels = [kerfem_mesh::FacetLabel::NONE; 4];
                edit.add_cell(corners.map(|k| if k == gone { middle } else { k }), c, labels);
            }
        }
        let change = edit.commit();
        let correction = follow(&mut b, &change);
        let (q, m) = momenta(&b);
        assert_eq!(correction.size, 0.0);
        assert_eq!(b.state.v[..before.len()], before);
        assert!((p - q).norm() < 1e-13 && (l - m).norm() < 1e-13);
    }
}
