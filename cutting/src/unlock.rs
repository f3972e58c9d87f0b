//! Facets that a cut marks and cannot open: all their vertices lie on its border, so that none is doubled. The corner of a cut
//! inside a tetrahedron is one, as is a cut that passes between the vertices of a cell. Such a facet gets a vertex in its
//! middle, which is (METHODS N1, Y1, F7).

use std::collections::BTreeSet;

use kerfem_mesh::{FacetKey, VertexId};

use crate::split;
use crate::workspace::Workspace;

/// Of `d`: the least radius of the inscribed circle of a facet that is opened; smaller ones stay closed, within `d` of the
/// border.
const OPENED: f64 = 0.1;

/// Of the local size: the least such radius where `d` is less.
const LEAST: f64 = 1e-3;

/// Splits the facets of the sheet that would stay closed; whether there are any.
pub(crate) fn split_locked<const N: usize>(ws: &mut Workspace<'_, N>, snap: f64) -> bool {
    if N != 4 {
        return false;
    }
    let closed: BTreeSet<FacetKey> = ws.sheet.iter().copied().collect();
    let vertices: BTreeSet<VertexId> = closed.iter().flat_map(|key| key.0.map(VertexId)).collect();
    let on_border: BTreeSet<VertexId> = vertices.into_iter().filter(|&v| stays_whole(ws, v, &closed)).collect();
    let locked: Vec<[VertexId; 3]> = closed
        .iter()
        .map(|key| key.0.map(VertexId))
        .filter(|f| f.iter().all(|v| on_border.contains(v)) && is_large(ws, f, snap))
        .collect();
    let any = !locked.is_empty();
    for [a, b, c] in locked {
        let v = split::split_triangle(ws, [a, b, c], [1.0 / 3.0; 3]);
        ws.take(v, true);
        // the new vertex has the largest number
        let key = |x: VertexId, y: VertexId| FacetKey([x.0, y.0, v.0]);
        ws.exchange_sheet(&[FacetKey([a.0, b.0, c.0])], &[key(a, b), key(b, c), key(a, c)]);
    }
    any
}

/// Whether the cells at a vertex stay connected when the marked facets open.
fn stays_whole<const N: usize>(ws: &Workspace<'_, N>, v: VertexId, closed: &BTreeSet<FacetKey>) -> bool {
    let cells = ws.mesh().cells_of_vertex(v);
    let (_, count) = ws.mesh().pieces_among(cells, |side| {
        ws.mesh().cell(side.cell)[side.local as usize] != v && !closed.contains(&ws.mesh().facet_key(side))
    });
    count <= 1
}

fn is_large<const N: usize>(ws: &Workspace<'_, N>, facet: &[VertexId; 3], snap: f64) -> bool {
    let p = facet.map(|v| ws.position(v));
    let around: f64 = (0..3).map(|k| (p[(k + 1) % 3] - p[k]).norm()).sum();
    let radius = (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / around;
    let least = |v: &VertexId| ws.reach(*v, (OPENED * snap).max(LEAST));
    facet.iter().all(|v| radius > least(v))
}
