//! Splits: one vertex in, every cell around it replaced by cells that fill the same space.

use kerfem_mesh::{CellId, FacetLabel, VertexId};

use crate::workspace::Workspace;

/// Splits an edge at `a + t (b - a)`. Every cell of the edge becomes two:
///
/// ```text
///        c                 c
///       / \               /|\
///      /   \     ->      / | \
///     a --- b           a--p--b
/// ```
///
/// The new vertices, nearly always one: fans of cells that hang together by the edge only get one each.
pub(crate) fn split_edge<const N: usize>(ws: &mut Workspace<'_, N>, a: VertexId, b: VertexId, t: f64) -> Vec<VertexId> {
    let mut fans = ws.mesh().fans_of_edge(a, b);
    // by corners, not by the numbers of cells (F10)
    fans.sort_by_cached_key(|fan| fan.iter().map(|c| ws.sorted_corners(*c)).min());
    let split = |fan: Vec<CellId>| {
        let p = ws.add_vertex(&[(a, 1.0 - t), (b, t)]);
        for c in fan {
            // the facet between the two children lies opposite the end that a child keeps
            let children = [(a, b), (b, a)].map(|(gone, kept)| child(ws, c, gone, p, &[kept]));
            ws.replace(c, &children);
        }
        p
    };
    fans.into_iter().map(split).collect()
}

/// Splits a triangle, a facet of tetrahedra or a planar cell, at a point given by weights over its corners. Every cell that
/// has these corners becomes three.
pub(crate) fn split_triangle<const N: usize>(
    ws: &mut Workspace<'_, N>,
    corners: [VertexId; 3],
    weights: [f64; 3],
) -> VertexId {
    let cells = cells_with(ws, corners);
    let p = ws.add_vertex(&[
        (corners[0], weights[0]),
        (corners[1], weights[1]),
        (corners[2], weights[2]),
    ]);
    for c in cells {
        let children = [0, 1, 2].map(|k| child(ws, c, corners[k], p, &[corners[(k + 1) % 3], corners[(k + 2) % 3]]));
        ws.replace(c, &children);
    }
    p
}

/// Splits a cell into one cell for each of its facets, at a point inside given by weights over its corners.
pub(crate) fn split_cell<const N: usize>(ws: &mut Workspace<'_, N>, c: CellId, weights: [f64; N]) -> VertexId {
    let corners = ws.mesh().cell(c);
    let mut parents: Vec<(VertexId, f64)> = corners.into_iter().zip(weights).collect();
    parents.sort_by_key(|(v, _)| *v);
    let p = ws.add_vertex(&parents);
    let others = |gone: VertexId| corners.into_iter().filter(|v| *v != gone).collect::<Vec<_>>();
    let children = corners.map(|gone| child(ws, c, gone, p, &others(gone)));
    ws.replace(c, &children);
    p
}

/// Cells that have all these corners, ascending.
pub(crate) fn cells_with<const N: usize>(ws: &Workspace<'_, N>, corners: [VertexId; 3]) -> Vec<CellId> {
    let has = |c: &CellId| corners.iter().all(|v| ws.mesh().cell(*c).contains(v));
    let around = ws.mesh().cells_of_vertex(corners[0]);
    around.iter().copied().filter(has).collect()
}

/// The cell `c` with `gone` replaced by `p`; facets opposite `inner` are new and lie inside `c`.
fn child<const N: usize>(
    ws: &Workspace<'_, N>,
    c: CellId,
    gone: VertexId,
    p: VertexId,
    inner: &[VertexId],
) -> ([VertexId; N], [FacetLabel; N]) {
    let corners = ws.mesh().cell(c);
    let mut labels = ws.mesh().facet_labels(c);
    for k in 0..N {
        if inner.contains(&corners[k]) {
            labels[k] = FacetLabel::NONE;
        }
    }
    (corners.map(|v| if v == gone { p } else { v }), labels)
}
