//! Cells of any kind over points, as VTK's formats hold them, and what is made of them.

use std::collections::BTreeMap;

use crate::Point;

use super::data::{DataArray, MeshData, SweepData, check_finite};
use super::error::Problem;

pub(super) const VERTEX: i64 = 1;
pub(super) const POLY_VERTEX: i64 = 2;
pub(super) const LINE: i64 = 3;
pub(super) const POLY_LINE: i64 = 4;
pub(super) const TRIANGLE: i64 = 5;
pub(super) const POLYGON: i64 = 7;
pub(super) const TRIANGLE_STRIP: i64 = 6;
pub(super) const QUAD: i64 = 9;
pub(super) const TETRA: i64 = 10;
const TRIANGLE_2: i64 = 22;
const TETRA_2: i64 = 24;

fn kind_name(kind: i64) -> &'static str {
    match kind {
        TRIANGLE => "triangle",
        TRIANGLE_STRIP => "triangle strip",
        POLYGON => "polygon",
        8 => "pixel",
        QUAD => "quadrilateral",
        TETRA => "tetrahedron",
        11 => "voxel",
        12 => "hexahedron",
        13 => "wedge",
        14 => "pyramid",
        21 => "line of order 2",
        TRIANGLE_2 => "triangle of order 2",
        TETRA_2 => "tetrahedron of order 2",
        42 => "polyhedron",
        _ => "cell of another kind",
    }
}

/// Points and cells of a file.
#[derive(Default)]
pub(super) struct Grid {
    pub(super) points: Vec<Point>,
    /// Points of all cells, one cell after another.
    pub(super) connectivity: Vec<usize>,
    /// Where in `connectivity` each cell ends.
    pub(super) ends: Vec<usize>,
    /// VTK's number of the kind of each cell.
    pub(super) kinds: Vec<i64>,
    pub(super) point_arrays: BTreeMap<String, DataArray>,
    pub(super) cell_arrays: BTreeMap<String, DataArray>,
}

impl Grid {
    fn nodes(&self, cell: usize) -> &[usize] {
        let start = if cell == 0 { 0 } else { self.ends[cell - 1] };
        &self.connectivity[start..self.ends[cell]]
    }

    fn corners<const N: usize>(&self, cell: usize) -> Result<[usize; N], Problem> {
        self.nodes(cell)
            .try_into()
            .map_err(|_| self.wrong_corners(cell, &N.to_string()))
    }

    fn wrong_corners(&self, cell: usize, accepted: &str) -> Problem {
        let (name, count) = (kind_name(self.kinds[cell]), self.nodes(cell).len());
        let text = format!("is a {name} with {count} corners; {accepted} are accepted");
        Problem::new(format!("cell {cell} (from zero)"), text)
    }

    fn refused(&self, cell: usize, kind: i64, accepted: &str) -> Problem {
        let text = format!("is a {} (VTK cell type {kind}); {accepted}", kind_name(kind));
        Problem::new(format!("cell {cell} (from zero)"), text)
    }

    /// The consecutive pairs of a line's points.
    fn pairs(&self, cell: usize) -> impl Iterator<Item = [usize; 2]> + '_ {
        self.nodes(cell).windows(2).map(|w| [w[0], w[1]])
    }

    /// The cells by their corners alone: the middles of edges that cells of order 2 have are left without a cell.
    pub(super) fn by_corners(self) -> Self {
        let (mut connectivity, mut ends, mut kinds) = (Vec::new(), Vec::new(), Vec::new());
        for cell in 0..self.kinds.len() {
            let (kind, count) = match self.kinds[cell] {
                TRIANGLE_2 => (TRIANGLE, 3),
                TETRA_2 => (TETRA, 4),
                kind => (kind, self.nodes(cell).len()),
            };
            connectivity.extend(self.nodes(cell).iter().take(count));
            ends.push(connectivity.len());
            kinds.push(kind);
        }
        Grid {
            connectivity,
            ends,
            kinds,
            ..self
        }
    }

    /// Tetrahedra, triangles and line segments of a mesh.
    pub(super) fn into_mesh(self) -> Result<MeshData, Problem> {
        check_finite(&self.points)?;
        let mut mesh = MeshData::default();
        let [mut of_tets, mut of_triangles, mut of_segments] = [const { Vec::new() }; 3];
        for cell in 0..self.kinds.len() {
            match self.kinds[cell] {
                TETRA => {
                    mesh.tets.push(self.corners(cell)?);
                    of_tets.push(cell);
                }
                TRIANGLE => {
                    mesh.triangles.push(self.corners(cell)?);
                    of_triangles.push(cell);
                }
                POLYGON if self.nodes(cell).len() == 3 => {
                    mesh.triangles.push(self.corners(cell)?);
                    of_triangles.push(cell);
                }
                LINE | POLY_LINE => {
                    mesh.segments.extend(self.pairs(cell));
                    of_segments.resize(mesh.segments.len(), cell);
                }
                VERTEX | POLY_VERTEX => {}
                kind => {
                    return Err(self.refused(
                        cell,
                        kind,
                        "tetrahedra and triangles of order 1 are accepted, and lines and points beside them",
                    ));
                }
            }
        }
        let rows = [of_tets, of_triangles, of_segments].concat();
        let pick = |array: DataArray| DataArray {
            components: array.components,
            values: rows.iter().flat_map(|&row| array.row(row).iter().copied()).collect(),
        };
        let arrays = self.cell_arrays.into_iter();
        mesh.cell_arrays = arrays.map(|(name, array)| (name, pick(array))).collect();
        mesh.point_arrays = self.point_arrays;
        mesh.points = self.points;
        Ok(mesh)
    }

    /// Triangles, polygons and line segments of a sweep.
    pub(super) fn into_sweep(self) -> Result<SweepData, Problem> {
        check_finite(&self.points)?;
        let (mut triangles, mut segments) = (Vec::new(), Vec::new());
        for cell in 0..self.kinds.len() {
            let nodes = self.nodes(cell);
            match self.kinds[cell] {
                TRIANGLE => triangles.push(self.corners(cell)?),
                QUAD => {
                    let [a, b, c, d] = self.corners(cell)?;
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
                POLYGON if nodes.len() >= 3 => {
                    triangles.extend((2..nodes.len()).map(|k| [nodes[0], nodes[k - 1], nodes[k]]));
                }
                TRIANGLE_STRIP if nodes.len() >= 3 => triangles.extend(nodes.windows(3).map(|w| [w[0], w[1], w[2]])),
                POLYGON | TRIANGLE_STRIP => return Err(self.wrong_corners(cell, "three or more")),
                LINE | POLY_LINE => segments.extend(self.pairs(cell)),
                VERTEX | POLY_VERTEX => {}
                kind => {
                    return Err(self.refused(
                        cell,
                        kind,
                        "a sweep is a surface or, in the plane, a line: triangles, quadrilaterals, polygons, strips and lines \
                         are accepted",
                    ));
                }
            }
        }
        Ok(SweepData {
            points: self.points,
            triangles,
            segments,
        })
    }
}
