//! What a mesh file holds.

use std::collections::BTreeMap;

use crate::{MeshError, Point, TetMesh, TriMesh};

use super::error::Problem;

/// The content of a mesh file, in the file's order. Indices count from zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// Positions (m), finite.
    pub points: Vec<Point>,
    /// Corners of the tetrahedra.
    pub tets: Vec<[usize; 4]>,
    /// Corners of the triangles: the cells of a planar mesh, or a surface beside tetrahedra.
    pub triangles: Vec<[usize; 3]>,
    /// Arrays with one row per point.
    pub point_arrays: BTreeMap<String, DataArray>,
    /// Arrays with one row per cell: first the rows of [`Self::tets`], then those of [`Self::triangles`].
    pub cell_arrays: BTreeMap<String, DataArray>,
    /// Named sets (gmsh physical groups; one without a name is called by its number).
    pub groups: BTreeMap<String, Group>,
}

/// Numbers attached to points or cells. Integers are converted; what is not a number (NaN) is kept.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DataArray {
    /// Numbers in a row.
    pub components: usize,
    /// All rows, one after another.
    pub values: Vec<f64>,
}

/// A named set: indices into the lists of [`MeshData`], ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Points of all cells of the set, whatever their dimension.
    pub vertices: Vec<usize>,
    /// Tetrahedra of the set.
    pub tets: Vec<usize>,
    /// Triangles of the set.
    pub triangles: Vec<usize>,
}

/// A triangulated cutting surface. Triangles may be degenerate and points unused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweepData {
    /// Positions (m), finite.
    pub points: Vec<Point>,
    /// Corners of the triangles, from zero.
    pub triangles: Vec<[usize; 3]>,
}

impl MeshData {
    /// The tetrahedra as a mesh; points that none of them names are kept, triangles are left out.
    ///
    /// # Errors
    /// [`MeshError`] names the vertex or cell at fault.
    pub fn into_tet_mesh(self) -> Result<TetMesh, MeshError> {
        TetMesh::new(self.points, self.tets)
    }

    /// The triangles as a mesh; points that none of them names are kept, tetrahedra are left out.
    ///
    /// # Errors
    /// [`MeshError`] names the vertex or cell at fault.
    pub fn into_tri_mesh(self) -> Result<TriMesh, MeshError> {
        TriMesh::new(self.points, self.triangles)
    }
}

impl DataArray {
    /// The numbers of one row.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.values[index * self.components..(index + 1) * self.components]
    }
}

/// Refuses coordinates that are not finite.
pub(super) fn check_finite(points: &[Point]) -> Result<(), Problem> {
    match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        None => Ok(()),
        Some(i) => {
            let p = points[i];
            Err(Problem::new(
                format!("point {i} (from zero)"),
                format!(
                    "({}, {}, {}) is not finite; coordinates must be finite numbers",
                    p.x, p.y, p.z
                ),
            ))
        }
    }
}
