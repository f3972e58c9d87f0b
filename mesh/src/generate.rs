//! Meshes of simple bodies.

use crate::{Point, TetMesh};

/// Corners of the six tetrahedra of a unit cell (Kuhn's subdivision): all share the diagonal from corner 0 to corner 7;
/// corner number = `x + 2 y + 4 z`.
const KUHN: [[usize; 4]; 6] = [
    [0, 1, 3, 7],
    [0, 3, 2, 7],
    [0, 2, 6, 7],
    [0, 6, 4, 7],
    [0, 4, 5, 7],
    [0, 5, 1, 7],
];

/// A box of `cells` hexahedra, each cut into six tetrahedra (Kuhn), with a corner at `origin` (m). Vertex
/// `i + (nx+1) (j + (ny+1) k)` lies at grid place `(i, j, k)`. A zero cell count or a size that is not positive gives an
/// empty mesh.
pub fn box_tets(size: [f64; 3], cells: [usize; 3], origin: [f64; 3]) -> TetMesh {
    let [nx, ny, nz] = cells;
    let empty = cells.contains(&0) || !size.iter().all(|&s| s > 0.0);
    let (points, tets) = if empty {
        (Vec::new(), Vec::new())
    } else {
        box_lists(size, [nx, ny, nz], origin)
    };
    TetMesh::new(points, tets).expect("a box of positive size is a valid mesh")
}

fn box_lists(size: [f64; 3], [nx, ny, nz]: [usize; 3], origin: [f64; 3]) -> (Vec<Point>, Vec<[usize; 4]>) {
    let at = |i: usize, n: usize, axis: usize| origin[axis] + size[axis] * (i as f64 / n as f64);
    let index = |i: usize, j: usize, k: usize| i + (nx + 1) * (j + (ny + 1) * k);
    let mut points = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
    for k in 0..=nz {
        for j in 0..=ny {
            points.extend((0..=nx).map(|i| Point::new(at(i, nx, 0), at(j, ny, 1), at(k, nz, 2))));
        }
    }
    let mut tets = Vec::with_capacity(6 * nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let corner = |b: usize| index(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2 & 1));
                tets.extend(KUHN.map(|t| t.map(corner)));
            }
        }
    }
    (points, tets)
}
