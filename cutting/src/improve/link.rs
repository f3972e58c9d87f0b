//! When the ends of an edge may become one vertex without a change of topology (G4).
//!
//! The link condition `Lk(a) n Lk(b) = Lk(ab)` (Dey, Edelsbrunner, Guha and Nekhayev 1999), of the cells together with a cone
//! over each of: the boundary, the sheet, and the seams of the sheet. The cones are what forbids to close a hole, to tear a
//! ligament of one cell, to pull a vertex off its surface, or to join two parts of the front.

use kerfem_mesh::{FacetKey, VertexId};

use super::hold::{Hold, others};
use crate::workspace::Workspace;

/// Apexes of the cones.
const BOUNDARY: u32 = u32::MAX;
const SHEET: u32 = u32::MAX - 1;
const SEAM: u32 = u32::MAX - 2;
/// Pads simplices of less than three vertices.
const NOTHING: u32 = u32::MAX - 3;

/// Up to three vertices, ascending, padded.
type Simplex = [u32; 3];

/// Whether the edge between `a` and `b` may vanish.
pub(super) fn condition<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId, hold: [&Hold; 2]) -> bool {
    let links = [link(ws, a, hold[0]), link(ws, b, hold[1])];
    let of_edge = link_of_edge(ws, a, b, hold[0]);
    let both = links[0].iter().filter(|s| links[1].binary_search(s).is_ok());
    both.eq(of_edge.iter()) && ws.mesh().fans_of_edge(a, b).len() == 1 && !brings_sheet_to_boundary(ws, hold, &of_edge)
}

/// Whether a vertex, edge or facet of the sheet would come to be one with one of the boundary where sheet and boundary do not
/// meet now.
fn brings_sheet_to_boundary<const N: usize>(ws: &Workspace<'_, N>, hold: [&Hold; 2], link_of_edge: &[Simplex]) -> bool {
    // whether the join of an end with a simplex (nothing, a vertex, an edge) belongs to sheet and boundary
    let belongs = |k: usize, simplex: &[u32]| {
        let has = |facet: &FacetKey| simplex.iter().all(|v| facet.0.contains(v));
        let boundary = hold[k].boundary.iter().any(|s| has(&ws.mesh().facet_key(*s)));
        [hold[k].sheet.iter().any(has), boundary]
    };
    let meets = |simplex: &[u32]| {
        let [[sheet_a, boundary_a], [sheet_b, boundary_b]] = [0, 1].map(|k| belongs(k, simplex));
        let meet_now = sheet_a && boundary_a || sheet_b && boundary_b;
        (sheet_a || sheet_b) && (boundary_a || boundary_b) && !meet_now
    };
    let real = |s: &&Simplex| s.iter().all(|v| *v <= NOTHING);
    meets(&[])
        || link_of_edge.iter().filter(real).any(|s| {
            let vertices: Vec<u32> = s.iter().copied().filter(|v| *v != NOTHING).collect();
            meets(&vertices)
        })
}

fn link<const N: usize>(ws: &Workspace<'_, N>, v: VertexId, hold: &Hold) -> Vec<Simplex> {
    let mut out = Vec::new();
    for &c in ws.mesh().cells_of_vertex(v) {
        let corners = ws.mesh().cell(c);
        push(&mut out, corners.iter().filter(|w| **w != v).map(|w| w.0));
    }
    for side in &hold.boundary {
        let key = ws.mesh().facet_key(*side);
        push(&mut out, others(&key, v).chain([BOUNDARY]));
    }
    for facet in &hold.sheet {
        push(&mut out, others(facet, v).chain([SHEET]));
    }
    for (end, _) in &hold.seam {
        push(&mut out, [end.0, SEAM].into_iter());
    }
    sorted(out)
}

fn link_of_edge<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId, hold: &Hold) -> Vec<Simplex> {
    let mut out = Vec::new();
    for c in ws.mesh().cells_of_edge(a, b) {
        let corners = ws.mesh().cell(c);
        push(&mut out, corners.iter().filter(|w| **w != a && **w != b).map(|w| w.0));
    }
    for side in &hold.boundary {
        let key = ws.mesh().facet_key(*side);
        if key.0.contains(&b.0) {
            push(&mut out, others(&key, a).filter(|w| *w != b.0).chain([BOUNDARY]));
        }
    }
    for facet in hold.sheet.iter().filter(|f| f.0.contains(&b.0)) {
        push(&mut out, others(facet, a).filter(|w| *w != b.0).chain([SHEET]));
    }
    if hold.seam.iter().any(|(end, _)| *end == b) {
        push(&mut out, [SEAM].into_iter());
    }
    sorted(out)
}

/// Adds a simplex of one to three vertices and all its faces.
fn push(out: &mut Vec<Simplex>, vertices: impl Iterator<Item = u32>) {
    let all: Vec<u32> = vertices.collect();
    for chosen in 1..1usize << all.len() {
        let mut simplex = [NOTHING; 3];
        let some = (0..all.len()).filter(|i| chosen >> i & 1 == 1).map(|i| all[i]);
        for (own, v) in simplex.iter_mut().zip(some) {
            *own = v;
        }
        simplex.sort_unstable();
        out.push(simplex);
    }
}

fn sorted(mut simplices: Vec<Simplex>) -> Vec<Simplex> {
    simplices.sort_unstable();
    simplices.dedup();
    simplices
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::{FacetKey, Point, TetMesh, VertexId, generate};

    use crate::improve::Limits;
    use crate::improve::collapse::collapse;
    use crate::workspace::Workspace;
    use crate::{Borders, Sweep};

    /// Boxes on a side.
    const N: usize = 5;

    /// A vertex of the grid.
    type Corner = [usize; 3];

    /// A box whose inner vertices are shaken, and the place of each vertex in its grid.
    fn shaken(seed: u64) -> (TetMesh, Vec<Corner>) {
        let mesh = generate::box_tets([1.0; 3], [N; 3], [0.0; 3]);
        let grid = |v: VertexId| {
            let p = mesh.rest_position(v) * N as f64;
            [p.x, p.y, p.z].map(|x| x.round() as usize)
        };
        let corners: Vec<Corner> = mesh.vertex_ids().map(grid).collect();
        let shake = |v: VertexId, k: usize| 0.03 * (seed as f64 + 37.0 * v.0 as f64 + 11.0 * k as f64).sin();
        let place = |v: VertexId| match mesh.is_boundary_vertex(v) {
            true => mesh.rest_position(v),
            false => mesh.rest_position(v) + Point::from_fn(|k, _| shake(v, k)),
        };
        let places = mesh.vertex_ids().map(place).collect();
        let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
        (TetMesh::new(places, cells).unwrap(), corners)
    }

    /// How many of some edges may collapse, if nothing but topology forbids it: the sheet may go anywhere.
    fn collapsible(is_sheet: impl Fn([Corner; 3]) -> bool, is_tried: impl Fn(Corner, Corner) -> bool) -> usize {
        let sheet_points = [[-9.0, -9.0], [9.0, -9.0], [0.0, 9.0]].map(|[x, y]| Point::new(x, y, 0.5));
        let sweep = Sweep::new(sheet_points.to_vec(), vec![[0, 1, 2]]).unwrap().0;
        let limits = Limits {
            piece: Some(&sweep.pieces()[0]),
            is_fixed: false,
            sheet: 1e3,
            floor: 0.3,
        };
        let mut count = 0;
        for seed in 0..20 {
            let (mut mesh, corners) = shaken(seed);
            let positions = mesh.rest_positions().to_vec();
            let at = |v: VertexId| corners[v.index()];
            let sides = mesh
                .cell_ids()
                .flat_map(|cell| (0..4).map(move |local| kerfem_mesh::FacetSide { cell, local }));
            let inside = sides
                .filter(|s| mesh.other_side(*s).is_some())
                .map(|s| mesh.facet_key(s));
            let sheet: Vec<FacetKey> = inside.filter(|f| is_sheet(f.0.map(|v| at(VertexId(v))))).collect();
            let neighbors = |a: VertexId| mesh.vertex_neighbors(a).into_iter().map(move |b| [a, b]);
            let edges: Vec<[VertexId; 2]> = (mesh.vertex_ids().flat_map(neighbors))
                .filter(|[a, b]| is_tried(at(*a), at(*b)))
                .collect();
            let mut ws = Workspace::new(&mut mesh, &positions, Borders::NONE);
            ws.exchange_sheet(&[], &sheet);
            for edge in edges {
                let save = ws.savepoint();
                count += usize::from(collapse(&mut ws, &limits, edge, Some(1e-6)).is_some());
                ws.restore(save);
            }
        }
        count
    }

    fn all_at_2(corners: &[Corner]) -> bool {
        corners.iter().all(|c| c[2] == 2)
    }

    fn is_inner(c: Corner) -> bool {
        c.iter().all(|k| (1..N).contains(k))
    }

    /// F13: a bridge of one facet through the cut is not closed.
    #[test]
    fn a_hole_in_the_sheet_stays() {
        let hole = [[2, 2, 2], [3, 2, 2], [3, 3, 2]];
        let is_hole = |f: [Corner; 3]| f.iter().all(|c| hole.contains(c));
        let of_hole = |a: Corner, b: Corner| hole.contains(&a) && hole.contains(&b);
        assert_eq!(collapsible(|f| all_at_2(&f) && !is_hole(f), of_hole), 0);
        assert!(collapsible(|f| all_at_2(&f), of_hole) > 0);
    }

    /// F13: two cuts that end an edge from each other do not become one.
    #[test]
    fn fronts_do_not_meet() {
        let over_gap = |a: Corner, b: Corner| is_inner(a) && is_inner(b) && all_at_2(&[a, b]) && a[0] == 2 && b[0] == 3;
        let beside_gap = |f: [Corner; 3]| f.iter().all(|c| c[0] <= 2) || f.iter().all(|c| c[0] >= 3);
        assert_eq!(collapsible(|f| all_at_2(&f) && beside_gap(f), over_gap), 0);
        assert!(collapsible(|f| all_at_2(&f), over_gap) > 0);
    }

    /// F13: a layer of one cell between a cut and the boundary is not torn.
    #[test]
    fn a_sheet_keeps_off_the_boundary() {
        let is_sheet = |f: [Corner; 3]| f.iter().all(|c| c[2] == 1 && is_inner(*c));
        let to_boundary = |a: Corner, b: Corner| is_inner(a) && a[2] == 1 && b[2] == 0;
        assert_eq!(collapsible(is_sheet, to_boundary), 0);
        assert!(collapsible(|_| false, to_boundary) > 0);
    }

    /// F13: two sheets an edge apart do not touch.
    #[test]
    fn leaves_of_a_sheet_stay_apart() {
        let is_sheet = |f: [Corner; 3]| all_at_2(&f) || f.iter().all(|c| c[2] == 3);
        let between = |a: Corner, b: Corner| is_inner(a) && a[2] == 2 && b[2] == 3;
        assert_eq!(collapsible(is_sheet, between), 0);
        assert!(collapsible(|_| false, between) > 0);
    }
}
