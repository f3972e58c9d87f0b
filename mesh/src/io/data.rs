//! What a mesh file holds.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

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
    /// Ends of the line segments: boundary edges beside triangles, a curve beside tetrahedra.
    pub segments: Vec<[usize; 2]>,
    /// Arrays with one row per point.
    pub point_arrays: BTreeMap<String, DataArray>,
    /// Arrays with one row per cell: the rows of [`Self::tets`], [`Self::triangles`] and [`Self::segments`], in this order.
    pub cell_arrays: BTreeMap<String, DataArray>,
    /// Named sets: gmsh's physical groups, Medit's references, TetGen's regions and markers. One without a name is called by
    /// its number.
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
    /// Line segments of the set.
    pub segments: Vec<usize>,
}

/// A triangulated cutting surface, or a line that cuts in the plane. Triangles and segments may be degenerate and points
/// unused.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SweepData {
    /// Positions (m), finite.
    pub points: Vec<Point>,
    /// Corners of the triangles, from zero.
    pub triangles: Vec<[usize; 3]>,
    /// Ends of the line segments, from zero.
    pub segments: Vec<[usize; 2]>,
}

impl MeshData {
    /// Takes in a cell of `corners` (2 to 4; one alone is a point) and lets it belong to the group called `group`, if any.
    pub(super) fn push(&mut self, corners: &[usize], group: Option<&str>) {
        let mut unnamed = Group::default();
        let group = group.map_or(&mut unnamed, |name| self.groups.entry(name.into()).or_default());
        group.vertices.extend_from_slice(corners);
        match *corners {
            [a, b, c, d] => {
                group.tets.push(self.tets.len());
                self.tets.push([a, b, c, d]);
            }
            [a, b, c] => {
                group.triangles.push(self.triangles.len());
                self.triangles.push([a, b, c]);
            }
            [a, b] => {
                group.segments.push(self.segments.len());
                self.segments.push([a, b]);
            }
            _ => {}
        }
    }

    /// Sorts the lists of the groups.
    pub(super) fn sort_groups(&mut self) {
        for group in self.groups.values_mut() {
            for list in [
                &mut group.vertices,
                &mut group.tets,
                &mut group.triangles,
                &mut group.segments,
            ] {
                list.sort_unstable();
                list.dedup();
            }
        }
    }

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
