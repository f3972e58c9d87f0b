//! The front: where the border of a sweep runs inside the body.
//!
//! Wherever the border pierces a facet, a vertex comes to lie: a corner of the facet that is closer than `d` is snapped
//! onto the border, or an edge that is closer than `d` is split, or the facet is. The cut ends at these vertices; none of
//! them is doubled, because the cells around it stay connected ahead of the front.

use kerfem_mesh::{FacetSide, Point, VertexId};

use crate::snap;
use crate::split;
use crate::sweep::{Piece, nearest_on_segment};
use crate::workspace::Workspace;

/// A facet that several border segments pierce needs one round for each.
const ROUNDS: usize = 8;

struct Piercing {
    corners: [VertexId; 3],
    weights: [f64; 3],
    point: Point,
}

/// Puts vertices where the border of the piece pierces facets; `snap` is `d` over the local size.
pub(crate) fn place(ws: &mut Workspace<'_>, piece: &Piece, snap: f64) {
    for _ in 0..ROUNDS {
        let found = piercings(ws, piece, snap);
        if found.is_empty() {
            return;
        }
        snap_corners(ws, piece, &found, snap);
        for piercing in &found {
            if let Some(side) = facet(ws, piercing.corners)
                && !served(ws, piercing, snap)
            {
                insert(ws, side, piercing, snap);
            }
        }
    }
}

fn piercings(ws: &mut Workspace<'_>, piece: &Piece, snap: f64) -> Vec<Piercing> {
    let mut out: Vec<Piercing> = Vec::new();
    for &cell in &ws.region {
        for local in 0..4u8 {
            let side = FacetSide { cell, local };
            let behind = ws.mesh().neighbors(cell)[local as usize];
            if behind.some().is_some_and(|n| n < cell && ws.region.contains(&n)) {
                continue;
            }
            // sorted, so that rounding does not depend on which cell the facet is seen from
            let corners = ws.mesh().facet_key(side).0.map(VertexId);
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
    }
    out.retain(|x| !served(ws, x, snap));
    out.sort_by(|x, y| x.corners.cmp(&y.corners).then(x.weights[0].total_cmp(&y.weights[0])));
    out
}

/// The facet with these corners, if it has not been split meanwhile.
fn facet(ws: &Workspace<'_>, corners: [VertexId; 3]) -> Option<FacetSide> {
    ws.mesh().cells_of_vertex(corners[0]).iter().find_map(|&cell| {
        let own = ws.mesh().cell(cell);
        let apex = (0..4).find(|&k| !corners.contains(&own[k]))?;
        corners.iter().all(|v| own.contains(v)).then_some(FacetSide {
            cell,
            local: apex as u8,
        })
    })
}

/// Whether a corner that the cut goes through, or an edge between two of them, already stands for the piercing.
fn served(ws: &Workspace<'_>, x: &Piercing, snap: f64) -> bool {
    let on: Vec<VertexId> = x.corners.into_iter().filter(|v| ws.on.contains(v)).collect();
    let stands = |v: VertexId, foot: Point| (foot - x.point).norm() <= ws.reach(v, snap);
    on.iter().enumerate().any(|(i, &v)| {
        stands(v, ws.position(v))
            || on[..i]
                .iter()
                .any(|&w| stands(v, nearest_on_segment(&x.point, &[ws.position(v), ws.position(w)]).0))
    })
}

fn snap_corners(ws: &mut Workspace<'_>, piece: &Piece, found: &[Piercing], snap: f64) {
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
fn to_front(ws: &mut Workspace<'_>, v: VertexId, target: Point, x: &Piercing) -> bool {
    if !ws.mesh().is_boundary_vertex(v) {
        return snap::move_interior(ws, v, target);
    }
    let on_boundary =
        facet(ws, x.corners).is_some_and(|s| ws.mesh().neighbors(s.cell)[s.local as usize].some().is_none());
    let parents = [0, 1, 2].map(|k| (x.corners[k], x.weights[k]));
    on_boundary && snap::move_on_boundary(ws, v, &parents)
}

fn insert(ws: &mut Workspace<'_>, side: FacetSide, x: &Piercing, snap: f64) {
    let p = x.corners.map(|v| ws.position(v));
    let nearest = (0..3)
        .map(|k| {
            let (i, j) = (k, (k + 1) % 3);
            let (foot, t) = nearest_on_segment(&x.point, &[p[i], p[j]]);
            ((foot - x.point).norm(), i, j, t)
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((distance, i, j, t)) = nearest else { return };
    let (a, b) = (x.corners[i], x.corners[j]);
    if distance > ws.reach(a, snap).min(ws.reach(b, snap)) {
        let v = split::split_facet(ws, side, x.corners, x.weights);
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
    let v = split::split_edge(ws, a, b, t);
    let exact = !ws.mesh().is_boundary_vertex(v) && snap::move_interior(ws, v, x.point);
    ws.take(v, exact);
}
