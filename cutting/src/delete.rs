//! Baseline B1: the cells that the sweep touches are removed.

use std::collections::BTreeSet;

use kerfem_mesh::{CellId, VertexId, quality};

use crate::sweep::Piece;
use crate::workspace::Workspace;

/// Removes every cell that the piece crosses, then the vertices that are left without a cell. Returns the corners that are
/// left.
pub(crate) fn remove_crossed<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece) -> BTreeSet<VertexId> {
    let crossed: Vec<CellId> = ws
        .region
        .iter()
        .copied()
        .filter(|&c| is_crossed(ws, piece, c))
        .collect();
    let mut left = BTreeSet::new();
    for &c in &crossed {
        let corners: [VertexId; N] = ws.mesh().cell(c);
        ws.take_out(c);
        ws.leave_region(c);
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

/// Whether the piece crosses an edge of the cell or its border pierces a facet (a planar cell itself).
fn is_crossed<const N: usize>(ws: &Workspace<'_, N>, piece: &Piece, c: CellId) -> bool {
    const TRIANGLES: [[usize; 3]; 4] = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]];
    let p = ws.cell_positions(c);
    let triangles = &TRIANGLES[..if N == 4 { 4 } else { 1 }];
    quality::edges::<N>()
        .iter()
        .any(|[i, j]| !piece.hits(p[*i], p[*j]).is_empty())
        || triangles
            .iter()
            .any(|f| !piece.border_piercings(f.map(|k| p[k])).is_empty())
}
