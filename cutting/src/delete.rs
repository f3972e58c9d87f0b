//! Baseline B1: the cells that the sweep touches are removed.

use std::collections::BTreeSet;

use kerfem_mesh::{CellId, VertexId};

use crate::sweep::Piece;
use crate::workspace::Workspace;

/// Removes every cell that the piece crosses, then the vertices that are left without a cell. Returns the corners that are
/// left.
pub(crate) fn remove_crossed(ws: &mut Workspace<'_>, piece: &Piece) -> BTreeSet<VertexId> {
    let crossed: Vec<CellId> = ws
        .region
        .iter()
        .copied()
        .filter(|&c| is_crossed(ws, piece, c))
        .collect();
    let mut left = BTreeSet::new();
    for &c in &crossed {
        let corners: [VertexId; 4] = ws.mesh().cell(c);
        ws.take_out(c);
        ws.region.remove(&c);
        for v in corners {
            if ws.mesh().cells_of_vertex(v).is_empty() {
                ws.edit.remove_vertex(v, None);
                left.remove(&v);
            } else {
                left.insert(v);
            }
        }
    }
    left
}

/// Whether the piece crosses an edge of the cell or its border pierces a facet.
fn is_crossed(ws: &Workspace<'_>, piece: &Piece, c: CellId) -> bool {
    let p = ws.cell_positions(c);
    let edges = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];
    let facets = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
    edges.iter().any(|e| !piece.hits(p[e[0]], p[e[1]]).is_empty())
        || facets
            .iter()
            .any(|f| !piece.border_piercings(f.map(|k| p[k])).is_empty())
}
