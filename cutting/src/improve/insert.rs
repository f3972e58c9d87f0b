//! A new vertex where nothing else helps: the cells around an edge are taken out, and their hull is joined to a vertex in
//! its middle.

use kerfem_mesh::{CellId, Point, VertexId};

use super::FLAT;
use crate::snap::parents_within;
use crate::workspace::{Place, Workspace, facet_of};

/// Halvings of the step in the search for the best place.
const HALVINGS: usize = 5;
/// A new vertex must make the worst cell better by this fraction: it costs cells.
const GAIN: f64 = 0.3;

/// Splits an edge inside the body at a place that makes all cells clearly better than the worst one was; the new cells.
pub(super) fn insert<const N: usize>(ws: &mut Workspace<'_, N>, [a, b]: [VertexId; 2]) -> Option<Vec<CellId>> {
    let cells: Vec<CellId> = ws.mesh().cells_of_edge(a, b).collect();
    // the first corner is the one that the new vertex replaces
    let mut hull: Vec<[VertexId; N]> = Vec::new();
    for &c in &cells {
        let corners = ws.mesh().cell(c);
        for (k, end) in corners.iter().enumerate() {
            if *end == a || *end == b {
                let mut own = corners;
                if k > 0 {
                    // two exchanges keep the orientation
                    own.swap(0, k);
                    own.swap(N - 2, N - 1);
                }
                hull.push(own);
            } else if ws.mesh().neighbors(c)[k].some().is_none() || ws.sheet.contains(&facet_of(&corners, k)) {
                return None; // the edge lies on the boundary or on the sheet
            }
        }
    }
    if !ws.are_of_one_group(&cells) {
        return None;
    }
    let wanted = (ws.worst_quality(&cells) * (1.0 + GAIN)).max(FLAT);
    let quality = |place: &Place| {
        let of = |corners: &[VertexId; N]| ws.quality_with(corners, Some((corners[0], place)));
        hull.iter().map(of).fold(f64::INFINITY, f64::min)
    };
    let at = |now: Point| {
        let place = Place::of(ws, parents_within(ws, &cells, now)?);
        Some((quality(&place), place))
    };
    let mut best = at((ws.position(a) + ws.position(b)) / 2.0)?;
    let mut step = (ws.position(b) - ws.position(a)).norm() / 2.0;
    for _ in 0..HALVINGS {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let tried = at(best.1.now + Point::ith(axis, sign * step));
                if let Some(tried) = tried.filter(|t| t.0 > best.0) {
                    best = tried;
                }
            }
        }
        step /= 2.0;
    }
    if best.0 <= wanted {
        return None;
    }
    let v = ws.add_vertex(&best.1.parents);
    let new: Vec<[VertexId; N]> = (hull.iter())
        .map(|corners| std::array::from_fn(|k| if k == 0 { v } else { corners[k] }))
        .collect();
    Some(ws.retile(&cells, &new, None, &[]))
}
