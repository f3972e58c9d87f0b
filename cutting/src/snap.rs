//! Moving a vertex onto the sweep (METHODS S9), only where nothing is lost.

use kerfem_mesh::{
    CellId, Point, VertexId,
    predicates::{orient2d, orient3d, orientation},
    quality,
};

use crate::workspace::{Workspace, barycentric, combine};

/// A move may not bring the worst cell around the vertex below this radius ratio, unless it was lower before.
const QUALITY_FLOOR: f64 = 0.3;

/// Of the local volume: how far off its plane a boundary facet may come to lie, and of the local area: how much the boundary
/// may grow or shrink (DESIGN invariant 3). Volume alone says nothing of a small facet beside large cells.
const TOLERANCE: f64 = 1e-13;

/// Moves an interior vertex to `target` (cutting frame) if a cell around it contains that place, no cell inverts and the
/// worst one stays good. The rest position follows by the barycentric coordinates in the containing cell.
pub(crate) fn move_interior<const N: usize>(ws: &mut Workspace<'_, N>, v: VertexId, target: Point) -> bool {
    let star = ws.mesh().cells_of_vertex(v).to_vec();
    match parents_within(ws, &star, target) {
        // where the weights say, in both frames: those of a flat cell are rough
        Some(parents) => {
            let place = combine(&parents, |u| ws.position(u));
            try_move(ws, v, place, &parents, &star)
        }
        None => false,
    }
}

/// A place (cutting frame) as a combination of the corners of the cell that contains it, if one of these does.
pub(crate) fn parents_within<const N: usize>(
    ws: &Workspace<'_, N>,
    cells: &[CellId],
    target: Point,
) -> Option<Vec<(VertexId, f64)>> {
    let holding = cells.iter().filter_map(|&c| {
        let mut corners = ws.mesh().cell(c);
        corners.sort_unstable();
        Some((corners, inside(&corners.map(|u| ws.position(u)), target)?))
    });
    // deepest inside, ties by corners: the order of cells must not matter
    let depth = |w: &[f64; N]| w.iter().copied().fold(f64::INFINITY, f64::min);
    let best = holding.max_by(|a, b| depth(&a.1).total_cmp(&depth(&b.1)).then(a.0.cmp(&b.0)));
    best.map(|(corners, weights)| corners.into_iter().zip(weights).collect())
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
    let target = combine(parents, |u| ws.position(u));
    keeps_boundary(ws, v, &star, place) && try_move(ws, v, target, parents, &star)
}

/// Whether every boundary facet at a vertex with these cells stays in its plane if the vertex goes to a place (at rest), and the
/// original boundary and the lips of cuts both stay as large as they are: they may lie in one plane.
pub(crate) fn keeps_boundary<const N: usize>(
    ws: &Workspace<'_, N>,
    v: VertexId,
    star: &[CellId],
    place: Point,
) -> bool {
    let volume = volume_of(ws, star);
    let (mut old, mut new) = ([Vec::new(), Vec::new()], [Vec::new(), Vec::new()]);
    for side in ws.mesh().boundary_facets_of_vertex(v) {
        let corners = ws.mesh().facet_corners(side);
        let facet = corners.map(|u| ws.mesh().rest_position(u));
        if !is_in_plane::<N>(&facet, place, volume) {
            return false;
        }
        let label = ws.mesh().facet_labels(side.cell)[side.local as usize];
        let kind = usize::from(label.some().is_some());
        old[kind].push(facet);
        new[kind].push(corners.map(|u| if u == v { place } else { ws.mesh().rest_position(u) }));
    }
    (0..2).all(|kind| are_as_large::<N>(&old[kind], &new[kind]))
}

/// Whether some facets are as large, together, as those that take their place.
pub(crate) fn are_as_large<const N: usize>(old: &[[Point; 3]], new: &[[Point; 3]]) -> bool {
    let size = |facets: &[[Point; 3]]| -> f64 { facets.iter().map(|f| quality::facet_normal::<N>(f).norm()).sum() };
    (size(old) - size(new)).abs() <= TOLERANCE * size(old)
}

/// Rest volume of some cells.
pub(crate) fn volume_of<const N: usize>(ws: &Workspace<'_, N>, cells: &[CellId]) -> f64 {
    cells
        .iter()
        .map(|&c| quality::cell_volume(&ws.mesh().cell_rest_positions(c)))
        .sum()
}

/// Whether a place lies in the plane of a facet, so closely that cells of the given volume notice nothing.
pub(crate) fn is_in_plane<const N: usize>(facet: &[Point; 3], place: Point, volume: f64) -> bool {
    let off = match N {
        4 => orient3d(facet[0], facet[1], facet[2], place) / 6.0,
        _ => orient2d(facet[0], facet[1], place) / 2.0,
    };
    off.abs() <= TOLERANCE * volume
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
    let save = ws.savepoint();
    let before = ws.worst_quality(star);
    ws.put_vertex(v, target, parents);
    let positive = star.iter().all(|&c| {
        let (rest, now) = (ws.mesh().cell_rest_positions(c), ws.cell_positions(c));
        [rest, now].iter().all(|p| orientation(p) > 0.0)
    });
    if positive && ws.worst_quality(star) >= before.min(QUALITY_FLOOR) {
        star.iter().for_each(|c| ws.enter_region(*c));
        return true;
    }
    ws.restore(save);
    false
}

/// Barycentric coordinates of `x` in a cell, if it lies inside (or within rounding of it).
fn inside<const N: usize>(p: &[Point; N], x: Point) -> Option<[f64; N]> {
    if quality::cell_volume(p) == 0.0 {
        return None;
    }
    let w = barycentric(p, x);
    w.iter().all(|&w| w >= -1e-12).then_some(w)
}
