//! Meshes of triangles that lie in the plane z = 0.

use crate::{MeshError, Point, TriMesh, predicates::orient2d};

impl TriMesh {
    /// A mesh in the plane z = 0 from rest positions (m) and triangles (indices from zero). Each triangle that runs clockwise
    /// is turned: files mix both, as the surfaces of a gmsh geometry each have their own orientation.
    ///
    /// # Errors
    /// As [`TriMesh::new`]; [`MeshError::OutOfPlane`] for a position with z other than zero.
    pub fn planar(rest_positions: Vec<Point>, mut cells: Vec<[usize; 3]>) -> Result<Self, MeshError> {
        if let Some(vertex) = rest_positions.iter().position(|p| p.z != 0.0 && p.z.is_finite()) {
            let z = rest_positions[vertex].z;
            return Err(MeshError::OutOfPlane { vertex, z });
        }
        for c in &mut cells {
            if let [Some(p), Some(q), Some(r)] = c.map(|v| rest_positions.get(v))
                && orient2d(*p, *q, *r) < 0.0
            {
                c.swap(1, 2);
            }
        }
        TriMesh::new(rest_positions, cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellId;

    fn square() -> Vec<Point> {
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| Point::new(x, y, 0.0))
            .to_vec()
    }

    #[test]
    fn clockwise_triangles_are_turned() {
        let mesh = TriMesh::planar(square(), vec![[0, 1, 2], [0, 3, 2]]).unwrap();
        assert_eq!(mesh.cell(CellId(0)).map(|v| v.0), [0, 1, 2]);
        assert_eq!(mesh.cell(CellId(1)).map(|v| v.0), [0, 2, 3]);
        let around: Point = mesh.boundary_facets().map(|s| mesh.facet_normal(s)).sum();
        assert_eq!(around, Point::zeros());
        let up = mesh.boundary_facets().map(|s| mesh.facet_normal(s)).find(|n| n.y > 0.0);
        assert_eq!(up, Some(Point::y()));
    }

    #[test]
    fn folds_and_places_out_of_the_plane_are_named() {
        let mut points = square();
        points[3] = Point::new(0.9, 0.1, 0.0);
        let folded = TriMesh::planar(points.clone(), vec![[0, 1, 2], [0, 3, 2]]);
        assert!(
            matches!(
                folded,
                Err(MeshError::Overlap {
                    first: 0,
                    second: 1,
                    ..
                })
            ),
            "{folded:?}"
        );
        points[2].z = 1e-9;
        assert_eq!(
            TriMesh::planar(points, vec![[0, 1, 2]]),
            Err(MeshError::OutOfPlane { vertex: 2, z: 1e-9 })
        );
        let flat = vec![Point::zeros(), Point::x(), Point::x() * 2.0];
        assert!(matches!(
            TriMesh::planar(flat, vec![[0, 1, 2]]),
            Err(MeshError::ZeroVolume { .. })
        ));
        assert!(matches!(
            TriMesh::planar(square(), vec![[0, 1, 9]]),
            Err(MeshError::NoSuchVertex { .. })
        ));
    }
}
