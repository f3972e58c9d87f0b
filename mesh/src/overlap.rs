//! How much of space a body takes twice (METHODS F32).

use std::collections::{BTreeSet, VecDeque};

use crate::quality::cell_volume;
use crate::{Aabb, BoxTree, CellId, FacetLabel, FacetSide, Point, SimplexMesh, VertexId};

/// Of the smaller of two cells: what they share beyond rounding.
const SHARED: f64 = 1e-9;

/// Volume (m³; of a planar mesh area, m²) in which cells lie over others at `positions` (m, by vertex slot): once for each
/// two cells that share a place. It is found from the cut faces on, wherever cells that overlap lead; bodies without a cut, and
/// surfaces in space, have none. Inverted cells count for nothing.
pub fn overlap<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point]) -> f64 {
    if N == 3 && !mesh.is_planar() {
        return 0.0;
    }
    let place = |c: CellId| mesh.cell(c).map(|v: VertexId| positions[v.index()]);
    let is_lip = |s: &FacetSide| mesh.facet_labels(s.cell)[s.local as usize] == FacetLabel::NONE;
    let mut met: BTreeSet<CellId> = mesh.boundary_facets().filter(is_lip).map(|s| s.cell).collect();
    if met.is_empty() {
        return 0.0;
    }
    let tree = BoxTree::of_cells(mesh, positions);
    let mut waiting: VecDeque<CellId> = met.iter().copied().collect();
    let mut done = BTreeSet::new();
    let mut sum = 0.0;
    while let Some(a) = waiting.pop_front() {
        let mut near = BTreeSet::new();
        tree.query(&Aabb::around(place(a)), |c| {
            near.insert(CellId(c));
        });
        for b in near {
            if b == a || mesh.neighbors(a).contains(&b) || !done.insert([a.min(b), a.max(b)]) {
                continue;
            }
            let shared = shared_volume(place(a), place(b));
            if shared > SHARED * cell_volume(&place(a)).min(cell_volume(&place(b))) {
                sum += shared;
                let around = [a, b].into_iter().flat_map(|c| mesh.neighbors(c)).chain([b]);
                waiting.extend(around.filter(|c| *c != CellId::NONE && met.insert(*c)));
            }
        }
    }
    sum
}

/// Volume that two simplices share; nothing if one of them is inverted or flat.
fn shared_volume<const N: usize>(a: [Point; N], b: [Point; N]) -> f64 {
    let whole = cell_volume(&b);
    if whole <= 0.0 || cell_volume(&a) <= 0.0 {
        return 0.0;
    }
    let mut parts = vec![a];
    for k in 0..N {
        // the barycentric coordinate k of b, by its volume
        let inside = |p: Point| {
            let mut moved = b;
            moved[k] = p;
            cell_volume(&moved)
        };
        parts = parts.into_iter().flat_map(|p| clipped(p, p.map(inside))).collect();
    }
    parts.iter().map(|p| cell_volume(p).abs()).sum()
}

/// The part of a simplex in which a linear function, known at its corners, is positive, as simplices: it is a prism over the
/// corners inside, divided along its staircases.
fn clipped<const N: usize>(corners: [Point; N], values: [f64; N]) -> Vec<[Point; N]> {
    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..N).partition(|&k| values[k] > 0.0);
    if inside.is_empty() {
        return Vec::new();
    }
    // row: a corner inside; column 0: itself, others: where the edge to a corner outside leaves
    let at = |row: usize, column: usize| {
        let i = inside[row];
        let Some(o) = column.checked_sub(1).map(|c| outside[c]) else {
            return corners[i];
        };
        corners[i] + (corners[o] - corners[i]) * (values[i] / (values[i] - values[o]))
    };
    let staircases = (0..1_usize << (N - 1)).filter(|steps| steps.count_ones() as usize == outside.len());
    let along = |steps: usize| {
        std::array::from_fn(|k| {
            let right = (steps & ((1 << k) - 1)).count_ones() as usize;
            at(k - right, right)
        })
    };
    staircases.map(along).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Edit, generate};

    fn tet(shift: f64) -> [Point; 4] {
        [Point::zeros(), Point::x(), Point::y(), Point::z()].map(|p| p + Point::repeat(shift))
    }

    #[test]
    fn simplices_share_what_they_should() {
        assert!((shared_volume(tet(0.0), tet(0.0)) - 1.0 / 6.0).abs() < 1e-15);
        // the corner of the second sees the first from inside: a tetrahedron of side 1 - 3 s
        for s in [0.05, 0.1, 0.3] {
            let side: f64 = 1.0 - 3.0 * s;
            let [a, b] = [tet(0.0), tet(s)];
            assert!((shared_volume(a, b) - side.powi(3) / 6.0).abs() < 1e-15);
            assert!((shared_volume(b, a) - side.powi(3) / 6.0).abs() < 1e-15);
        }
        assert_eq!(shared_volume(tet(0.0), tet(0.34)), 0.0);
        let triangle =
            |x: f64, y: f64| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[a, b]| Point::new(a + x, b + y, 0.0));
        assert!((shared_volume(triangle(0.0, 0.0), triangle(0.25, 0.25)) - 0.125).abs() < 1e-15);
        assert!((shared_volume(triangle(0.0, 0.0), triangle(0.0, 0.0)) - 0.5).abs() < 1e-15);
    }

    /// Two bodies that a cut left, pushed into each other and apart.
    #[test]
    fn halves_overlap_by_how_far_they_are_pushed() {
        let mut mesh = generate::box_tets([2.0, 1.0, 1.0], [4, 2, 3], [0.0; 3]);
        let right: Vec<CellId> = mesh
            .cell_ids()
            .filter(|c| mesh.cell_rest_positions(*c).iter().sum::<Point>().x / 4.0 > 1.0)
            .collect();
        // the right half on vertices of its own
        let mut edit = Edit::new(&mut mesh);
        let mut own = std::collections::BTreeMap::new();
        for c in right {
            let (corners, labels) = (edit.mesh().cell(c), edit.mesh().facet_labels(c));
            let moved = corners.map(|v| {
                let p = edit.mesh().rest_position(v);
                *own.entry(v).or_insert_with(|| edit.add_vertex(p, &vec![(v, 1.0)]))
            });
            edit.remove_cell(c);
            edit.add_cell(moved, c, labels);
        }
        let _ = edit.commit();
        let pushed = |by: Point| {
            let is_right = |v: &VertexId| own.values().any(|w| w == v);
            let places: Vec<Point> = (0..mesh.vertex_slots() as u32)
                .map(|v| mesh.rest_positions()[v as usize] + if is_right(&VertexId(v)) { by } else { Point::zeros() })
                .collect();
            overlap(&mesh, &places)
        };
        assert_eq!(mesh.pieces().1, 2);
        assert_eq!(pushed(Point::zeros()), 0.0);
        assert_eq!(pushed(Point::x() * 0.1), 0.0);
        for by in [0.01, 0.3, 0.9] {
            let found = pushed(Point::new(-by, 0.25, 0.0));
            assert!((found - 0.75 * by).abs() < 1e-12, "{by}: {found}");
        }
        // no cut, no overlap
        let whole = generate::box_tets([1.0; 3], [2; 3], [0.0; 3]);
        assert_eq!(overlap(&whole, whole.rest_positions()), 0.0);
    }
}
