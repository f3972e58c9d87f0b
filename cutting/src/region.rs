//! Cells near a piece of the sweep.

use std::collections::BTreeSet;

use kerfem_mesh::{Aabb, BoxTree, CellId, Point};

use crate::sweep::Piece;
use crate::workspace::Workspace;

/// Sets `ws.region` to the cells whose boxes meet a triangle of the piece; returns the tree nodes looked at.
///
/// `tree` knows the mesh as it was before the cut; cells that were replaced since are followed to their children.
pub(crate) fn find<const N: usize>(ws: &mut Workspace<'_, N>, tree: &BoxTree, piece: &Piece) -> usize {
    let (mut cells, mut nodes) = (BTreeSet::new(), 0);
    for triangle in piece.triangles() {
        let reaches = TriangleBox::new(triangle);
        let touched = tree.visit(
            |b| reaches.overlaps(b),
            |c| {
                cells.insert(CellId(c));
            },
        );
        nodes += touched.0;
    }
    let mut region = BTreeSet::new();
    for c in cells {
        for c in ws.current(c) {
            region.insert(c);
        }
    }
    region.extend(ws.cells_of_changed());
    region.retain(|&c| {
        let b = Aabb::around(ws.cell_positions(c));
        piece.reaches(&b)
    });
    ws.region = region;
    nodes
}

/// Whether a box meets a triangle: never wrongly "no" (its box and its plane are tried, not its edges).
pub(crate) struct TriangleBox {
    aabb: Aabb,
    normal: Point,
    through: Point,
}

impl TriangleBox {
    pub(crate) fn new(t: &[Point; 3]) -> Self {
        let normal = (t[1] - t[0]).cross(&(t[2] - t[0]));
        TriangleBox {
            aabb: Aabb::around(*t),
            normal: normal / normal.norm(),
            through: t[0],
        }
    }

    pub(crate) fn overlaps(&self, b: &Aabb) -> bool {
        let center = (b.min + b.max) / 2.0;
        let half = (b.max - b.min) / 2.0;
        let reach = half.dot(&self.normal.abs());
        let slack = 1e-12 * (reach + (center - self.through).norm());
        b.overlaps(&self.aabb) && (center - self.through).dot(&self.normal).abs() <= reach + slack
    }
}
