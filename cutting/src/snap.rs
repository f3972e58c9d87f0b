//! Moving a vertex onto the sweep (METHODS S9), only where nothing is lost.

use kerfem_mesh::{
    CellId, Point, VertexId,
    predicates::{orient2d, orient3d, orientation},
    quality,
};

use crate::workspace::{Workspace, combine};

/// A move may not bring the worst cell around the vertex below this radius ratio, unless it was lower before.
const QUALITY_FLOOR: f64 = 0.3;

/// Of the local volume: how far off its plane a boundary facet may come to lie (DESIGN invariant 3).
const VOLUME_TOLERANCE: f64 = 1e-13;

/// Moves an interior vertex to `target` (cutting frame) if a cell around it contains that place, no cell inverts and the
/// worst one stays good. The rest position follows by the barycentric coordinates in the containing cell.
pub(crate) fn move_interior<const N: usize>(ws: &mut Workspace<'_, N>, v: VertexId, target: Point) -> bool {
    let star = ws.mesh().cells_of_vertex(v).to_vec();
    let inside = star.iter().filter_map(|&c| {
        let mut corners = ws.mesh().cell(c);
        corners.sort_unstable();
        Some((corners, barycentric(&corners.map(|u| ws.position(u)), target)?))
    });
    // deepest inside, ties by corners: the order of cells must not matter
    let depth = |w: &[f64; N]| w.iter().copied().fold(f64::INFINITY, f64::min);
    let best = inside.max_by(|a, b| depth(&a.1).total_cmp(&depth(&b.1)).then(a.0.cmp(&b.0)));
    let Some((corners, weights)) = best else { return false };
    let parents: Vec<(VertexId, f64)> = corners.into_iter().zip(weights).collect();
    try_move(ws, v, target, &parents, &star)
}

/// Moves a boundary vertex to a combination of vertices of its boundary facets, if that keeps every boundary facet in its
/// plane: only within a coplanar patch or along a straight crease.
pub(crate) fn move_on_boundary<const N: usize>(
    ws: &mut Workspace<'_, N>,
    v: VertexId,
    parents: &[(VertexId, f64)],
) -> bool {
    let star = ws.mesh().cells_of_vertex(v).to_vec();
    let place = combine(parents, |u| ws.mesh().rest_position(u));
    let volume: f64 = star
        .iter()
        .map(|&c| quality::cell_volume(&ws.mesh().cell_rest_positions(c)))
        .sum();
    let stays = ws.mesh().boundary_facets_of_vertex(v).all(|side| {
        let p = ws.mesh().facet_corners(side).map(|u| ws.mesh().rest_position(u));
        let off = match N {
            4 => orient3d(p[0], p[1], p[2], place) / 6.0,
            _ => orient2d(p[0], p[1], place) / 2.0,
        };
        off.abs() <= VOLUME_TOLERANCE * volume
    });
    let target = combine(parents, |u| ws.position(u));
    stays && try_move(ws, v, target, parents, &star)
}

fn try_move<const N: usize>(
    ws: &mut Workspace<'_, N>,
    v: VertexId,
    target: Point,
    parents: &[(VertexId, f64)],
    star: &[CellId],
) -> bool {
    if !ws.may_move(v) {
        return false;
    }
    let save = ws.savepoint_of(v);
    let before = ws.worst_quality(star);
    ws.put_vertex(v, target, parents);
    let positive = star.iter().all(|&c| {
        let (rest, now) = (ws.mesh().cell_rest_positions(c), ws.cell_positions(c));
        [rest, now].iter().all(|p| orientation(p) > 0.0)
    });
    if positive && ws.worst_quality(star) >= before.min(QUALITY_FLOOR) {
        ws.region.extend(star.iter().copied());
        return true;
    }
    ws.restore_vertex(v, save);
    false
}

/// Barycentric coordinates of `x` in a cell, if it lies inside (or within rounding of it).
fn barycentric<const N: usize>(p: &[Point; N], x: Point) -> Option<[f64; N]> {
    let all = quality::cell_volume(p);
    if all == 0.0 {
        return None;
    }
    let w = std::array::from_fn(|k| {
        let mut q = *p;
        q[k] = x;
        quality::cell_volume(&q) / all
    });
    w.iter().all(|&w: &f64| w >= -1e-12).then_some(w)
}
