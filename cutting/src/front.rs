//! The front: where the border of a sweep runs inside the body.
//!
//! Wherever the border pierces a facet (in the plane: wherever an end of the sweep lies in a cell), a vertex comes to lie: a
//! corner that is closer than `d` is snapped onto the border, or an edge that is closer than `d` is split, or the facet is.
//! Where the border has a corner inside a tetrahedron, such as the tip of a blade, a vertex comes to lie too. The cut ends at
//! these vertices; none of them is doubled, because the cells around it stay connected ahead of the front.

use kerfem_mesh::nearest::{on_segment, on_triangle};
use kerfem_mesh::{FacetSide, Point, VertexId, predicates::contains};

use crate::snap;
use crate::split;
use crate::sweep::Piece;
use crate::workspace::{Workspace, barycentric};

/// A facet that several border segments pierce needs one round for each.
const ROUNDS: usize = 8;

struct Piercing {
    corners: [VertexId; 3],
    weights: [f64; 3],
    point: Point,
}

/// Puts vertices where the border of the piece turns inside a tetrahedron and where it pierces facets; `snap` is `d` over the
/// local size.
pub(crate) fn place<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, snap: f64) {
    if N == 4 {
        piece.corners().iter().for_each(|c| place_corner(ws, *c, snap));
    }
    for _ in 0..ROUNDS {
        let found = piercings(ws, piece, snap);
        if found.is_empty() {
            return;
        }
        snap_corners(ws, piece, &found, snap);
        for piercing in &found {
            if ws.crumbles() {
                return;
            }
            // it may have been split meanwhile
            if !split::cells_with(ws, piercing.corners).is_empty() && !served(ws, piercing, snap) {
                insert(ws, piercing, snap);
            }
        }
    }
}

fn piercings<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, snap: f64) -> Vec<Piercing> {
    let mut out: Vec<Piercing> = Vec::new();
    for corners in triangles(ws) {
        let p = corners.map(|v| ws.position(v));
        for weights in piece.border_piercings(p) {
            let point = p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2];
            out.push(Piercing {
                corners,
                weights,
                point,
            });
        }
    }
    out.retain(|x| !served(ws, x, snap));
    out.sort_by(|x, y| x.corners.cmp(&y.corners).then(x.weights[0].total_cmp(&y.weights[0])));
    out
}

/// What the border of a sweep may pierce: the facets of the tetrahedra near the sweep, or the planar cells themselves. Corners
/// are sorted, so that rounding does not depend on which cell a facet is seen from.
fn triangles<const N: usize>(ws: &Workspace<'_, N>) -> Vec<[VertexId; 3]> {
    let mut out = Vec::new();
    for &cell in &ws.region {
        if N == 3 {
            let mut corners = [0, 1, 2].map(|k| ws.mesh().cell(cell)[k]);
            corners.sort_unstable();
            out.push(corners);
            continue;
        }
        for local in 0..N as u8 {
            let behind = ws.mesh().neighbors(cell)[local as usize];
            if behind.some().is_none_or(|n| n > cell || !ws.region.contains(&n)) {
                out.push(ws.mesh().facet_key(FacetSide { cell, local }).0.map(VertexId));
            }
        }
    }
    out
}

/// Whether a corner that the cut goes through, or an edge between two of them, already stands for the piercing.
fn served<const N: usize>(ws: &Workspace<'_, N>, x: &Piercing, snap: f64) -> bool {
    let on: Vec<VertexId> = x.corners.into_iter().filter(|v| ws.on.contains(v)).collect();
    let stands = |v: VertexId, foot: Point| (foot - x.point).norm() <= ws.reach(v, snap);
    on.iter().enumerate().any(|(i, &v)| {
        stands(v, ws.position(v))
            || on[..i]
                .iter()
                .any(|&w| stands(v, on_segment(&x.point, &[ws.position(v), ws.position(w)]).0))
    })
}

fn snap_corners<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, found: &[Piercing], snap: f64) {
    let mut candidates: Vec<(f64, VertexId, usize)> = Vec::new();
    for (i, x) in found.iter().enumerate() {
        let near = x
            .corners
            .into_iter()
            .map(|v| ((ws.position(v) - x.point).norm(), v))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance, v)) = near
            && distance <= ws.reach(v, snap)
        {
            candidates.push((distance, v, i));
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    for (_, v, i) in candidates {
        if !ws.on.contains(&v)
            && let Some(target) = piece.nearest_on_border(&ws.position(v))
        {
            let exact = to_front(ws, v, target.point, &found[i]);
            ws.take(v, exact);
        }
    }
}

/// Moves a front vertex onto the border where that loses nothing: interior ones to `target`, boundary ones to the piercing
/// itself if it lies on the boundary. Whether it is there now.
fn to_front<const N: usize>(ws: &mut Workspace<'_, N>, v: VertexId, target: Point, x: &Piercing) -> bool {
    if !ws.mesh().is_boundary_vertex(v) {
        return snap::move_interior(ws, v, target);
    }
    let on_boundary = N == 4 && split::cells_with(ws, x.corners).len() == 1;
    let parents = [0, 1, 2].map(|k| (x.corners[k], x.weights[k]));
    on_boundary && snap::move_on_boundary(ws, v, &parents)
}

fn insert<const N: usize>(ws: &mut Workspace<'_, N>, x: &Piercing, snap: f64) {
    let p = x.corners.map(|v| ws.position(v));
    let nearest = (0..3)
        .map(|k| {
            let (i, j) = (k, (k + 1) % 3);
            let (foot, t) = on_segment(&x.point, &[p[i], p[j]]);
            ((foot - x.point).norm(), i, j, t)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((distance, i, j, t)) = nearest else { return };
    let (a, b) = (x.corners[i], x.corners[j]);
    if distance > ws.reach(a, snap).min(ws.reach(b, snap)) {
        let v = split::split_triangle(ws, x.corners, x.weights);
        ws.take(v, true);
        return;
    }
    let length = (p[j] - p[i]).norm();
    for (v, along) in [(a, t * length), ((b), (1.0 - t) * length)] {
        if along <= 0.5 * ws.reach(v, snap) {
            ws.take(v, false);
            return;
        }
    }
    for v in split::split_edge(ws, a, b, t) {
        let exact = !ws.mesh().is_boundary_vertex(v) && snap::move_interior(ws, v, x.point);
        ws.take(v, exact);
    }
}

/// Puts a vertex at a corner of the border, if it lies in the body: one that is closer than `d`, else one on a facet or edge
/// that is, else one inside the cell.
fn place_corner<const N: usize>(ws: &mut Workspace<'_, N>, corner: Point, snap: f64) {
    let Some(cell) = ws
        .region
        .iter()
        .copied()
        .find(|c| contains(&ws.cell_positions(*c), corner))
    else {
        return;
    };
    let mut corners = ws.mesh().cell(cell);
    corners.sort_unstable();
    let distance = |v: VertexId| (ws.position(v) - corner).norm();
    if corners
        .iter()
        .any(|&v| ws.on.contains(&v) && distance(v) <= ws.reach(v, snap))
    {
        return;
    }
    let nearest = corners
        .into_iter()
        .map(|v| (distance(v), v))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((distance, v)) = nearest
        && distance <= ws.reach(v, snap)
    {
        let exact = !ws.mesh().is_boundary_vertex(v) && snap::move_interior(ws, v, corner);
        ws.take(v, exact || distance <= ws.reach(v, 0.0));
        return;
    }
    let facet = (0..N)
        .map(|gone| {
            let facet = [0, 1, 2].map(|k| corners[k + usize::from(k >= gone)]);
            let foot = on_triangle(&corner, &facet.map(|v| ws.position(v)));
            ((foot - corner).norm(), facet, foot)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((distance, facet, foot)) = facet
        && distance
            <= facet
                .map(|v| ws.reach(v, snap))
                .into_iter()
                .fold(f64::INFINITY, f64::min)
    {
        let weights = weights_of(&facet.map(|v| ws.position(v)), foot);
        let on_facet = Piercing {
            corners: facet,
            weights,
            point: corner,
        };
        insert(ws, &on_facet, snap);
        return;
    }
    let corners = ws.mesh().cell(cell);
    let weights = barycentric(&corners.map(|v| ws.position(v)), corner);
    let v = split::split_cell(ws, cell, weights);
    ws.take(v, true);
}

/// Barycentric weights of a point of a triangle.
fn weights_of([a, b, c]: &[Point; 3], p: Point) -> [f64; 3] {
    let normal = (b - a).cross(&(c - a));
    let part = |q: Point, r: Point| (q - p).cross(&(r - p)).dot(&normal) / normal.norm_squared();
    let (u, v) = (part(*b, *c), part(*c, *a));
    [u, v, 1.0 - u - v]
}
