//! Edge collapse (G3, G4, Y5): one end of an edge moves onto the other, and the cells between them vanish.

use kerfem_mesh::{CellId, FacetKey, FacetSide, VertexId};

use super::hold::{Freedom, Hold, keeps_front, keeps_sheet, places};
use super::{FLAT, Limits, link};
use crate::snap::keeps_boundary;
use crate::workspace::Workspace;

/// Moves `a` onto `b`; the new cells, or `None` if that is not possible: if a cell would not be better than `wanted` (`None`:
/// than the worst one was), topology would change (the link condition), `a` would leave its surface or its front, or has
/// conditions of its own.
pub(super) fn collapse<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    [a, b]: [VertexId; 2],
    wanted: Option<f64>,
) -> Option<Vec<CellId>> {
    let star = ws.mesh().cells_of_vertex(a).to_vec();
    let wanted = wanted.unwrap_or_else(|| ws.worst_quality(&star)).max(FLAT);
    let onto = |v: VertexId| if v == a { b } else { v };
    let new: Vec<[VertexId; N]> = (star.iter().map(|c| ws.mesh().cell(*c)))
        .filter(|corners| !corners.contains(&b))
        .map(|corners| corners.map(onto))
        .collect();
    let better = |corners: &[VertexId; N]| ws.quality_with(corners, None) > wanted;
    if new.is_empty() || !new.iter().all(better) || ws.is_held(a) || !ws.may_move(a) {
        return None;
    }
    let hold = Hold::of(ws, a);
    if hold.freedom(ws) == Freedom::None || !keeps_boundary(ws, a, &star, ws.mesh().rest_position(b)) {
        return None;
    }
    let sheet: Vec<FacetKey> = (hold.sheet.iter())
        .filter(|f| !f.0.contains(&b.0))
        .map(|f| renamed(f, a, b))
        .collect();
    if !hold.sheet.is_empty() {
        if limits.is_fixed {
            return None;
        }
        let (old, now) = (places(ws, &hold.sheet, None), places(ws, &sheet, None));
        if !keeps_sheet(limits, &old, &now, ws.mesh().local_size(a)) {
            return None;
        }
    }
    if hold.front().next().is_some() {
        let from = |v: VertexId| {
            let edges = hold.front().map(|w| [ws.position(v), ws.position(w)]);
            edges.collect::<Vec<_>>()
        };
        if !keeps_front(limits, &from(a), &from(b), ws.mesh().local_size(a)) {
            return None;
        }
    }
    if !link::condition(ws, a, b, [&hold, &Hold::of(ws, b)]) {
        return None;
    }
    let behind = behind_flat_cells(ws, &star, [a, b]);
    let kept = behind.iter().map(|c| ws.mesh().cell(*c));
    let (old, new) = (
        [&star[..], &behind].concat(),
        new.into_iter().chain(kept).collect::<Vec<_>>(),
    );
    let made = ws.retile(&old, &new, Some((a, b)), &[]);
    ws.exchange_sheet(&hold.sheet, &sheet);
    ws.edit.remove_vertex(a, Some(b));
    Some(made)
}

/// Cells outside the star of `a` that come to lie at the boundary as a cell between `a` and `b` vanishes that was flat against it:
/// they are made anew with it, as they take over the label of its boundary facet.
fn behind_flat_cells<const N: usize>(ws: &Workspace<'_, N>, star: &[CellId], [a, b]: [VertexId; 2]) -> Vec<CellId> {
    let mesh = ws.mesh();
    let mut behind: Vec<CellId> = (star.iter())
        .filter_map(|&cell| {
            let across = |v: VertexId| {
                let local = mesh.cell(cell).iter().position(|w| *w == v)? as u8;
                Some(mesh.other_side(FacetSide { cell, local }))
            };
            match (across(b)?, across(a)?) {
                (None, Some(inner)) => Some(inner.cell),
                _ => None,
            }
        })
        .collect();
    behind.sort_unstable();
    behind.dedup();
    behind
}

fn renamed(facet: &FacetKey, a: VertexId, b: VertexId) -> FacetKey {
    let mut key = facet.0.map(|v| if v == a.0 { b.0 } else { v });
    key.sort_unstable();
    FacetKey(key)
}
