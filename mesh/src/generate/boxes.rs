//! Boxes of tetrahedra and rectangles of triangles.

use super::check_count;
use crate::{MeshError, Point, TetMesh, TriMesh};

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
///
/// # Panics
/// Where [`try_box_tets`] has an error; use that one for numbers from outside.
pub fn box_tets(size: [f64; 3], cells: [usize; 3], origin: [f64; 3]) -> TetMesh {
    try_box_tets(size, cells, origin).expect("a box of ordinary size is a valid mesh")
}

/// [`box_tets`] for any numbers.
///
/// # Errors
/// [`MeshError`] if there are too many cells, a coordinate is not finite, or cells have no volume because the box is too
/// small for the rounding at its place.
pub fn try_box_tets(size: [f64; 3], cells: [usize; 3], origin: [f64; 3]) -> Result<TetMesh, MeshError> {
    if cells.contains(&0) || !size.iter().all(|&s| s > 0.0) {
        return TetMesh::new(Vec::new(), Vec::new());
    }
    let corners = cells
        .map(|n| n.saturating_add(1))
        .into_iter()
        .fold(1, usize::saturating_mul);
    check_count("the box", corners.saturating_mul(6))?;
    let (points, tets) = box_lists(size, cells, origin);
    TetMesh::new(points, tets)
}

/// A rectangle of `cells` rectangles in the plane `z = 0`, two triangles each, with a corner at `origin` (m). The diagonals
/// alternate, so that no direction is preferred. Vertex `i + (nx+1) j` lies at grid place `(i, j)`. A zero cell count or a
/// size that is not positive gives an empty mesh.
///
/// # Errors
/// [`MeshError`] if there are too many cells, a coordinate is not finite, or cells have no area because the rectangle is too
/// small for the rounding at its place.
pub fn rect_triangles(size: [f64; 2], cells: [usize; 2], origin: [f64; 2]) -> Result<TriMesh, MeshError> {
    let [nx, ny] = cells;
    if cells.contains(&0) || !size.iter().all(|&s| s > 0.0) {
        return TriMesh::new(Vec::new(), Vec::new());
    }
    check_count(
        "the rectangle",
        nx.saturating_add(1)
            .saturating_mul(ny.saturating_add(1))
            .saturating_mul(2),
    )?;
    let at = |i: usize, n: usize, axis: usize| origin[axis] + size[axis] * (i as f64 / n as f64);
    let mut points = Vec::with_capacity((nx + 1) * (ny + 1));
    let mut triangles = Vec::with_capacity(2 * nx * ny);
    for j in 0..=ny {
        points.extend((0..=nx).map(|i| Point::new(at(i, nx, 0), at(j, ny, 1), 0.0)));
    }
    for j in 0..ny {
        for i in 0..nx {
            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| i + (nx + 1) * j);
            triangles.extend(match (i + j) % 2 {
                0 => [[a, b, c], [a, c, d]],
                _ => [[a, b, d], [b, c, d]],
            });
        }
    }
    TriMesh::new(points, triangles)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_boxes_are_errors() {
        assert!(matches!(
            try_box_tets([1.0; 3], [usize::MAX; 3], [0.0; 3]),
            Err(MeshError::TooLarge { .. })
        ));
        assert!(matches!(
            try_box_tets([1e-20; 3], [1; 3], [1.0; 3]),
            Err(MeshError::ZeroVolume { .. })
        ));
    }
}
