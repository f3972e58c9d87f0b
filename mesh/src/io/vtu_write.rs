//! Writing `.vtu` and `.vtp`: Float64 and Int64, compressed with zlib, base64 inside the XML; read by VTK and meshio.

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;

use crate::{Point, SimplexMesh, TetMesh, TriMesh};

use super::{IoError, write_atomically};

/// What a `.vtu` file should hold. Indices count from zero.
#[derive(Clone, Debug, PartialEq)]
pub struct VtuGrid<'a> {
    /// Positions (m).
    pub points: Cow<'a, [Point]>,
    /// Cells of one kind.
    pub cells: VtuCells<'a>,
    /// Arrays with one row per point; names differ.
    pub point_arrays: Vec<VtuArray<'a>>,
    /// Arrays with one row per cell; names differ.
    pub cell_arrays: Vec<VtuArray<'a>>,
}

/// Cells of a [`VtuGrid`]: corners as indices into its points.
#[derive(Clone, Debug, PartialEq)]
pub enum VtuCells<'a> {
    /// VTK cell type 10.
    Tets(Cow<'a, [[usize; 4]]>),
    /// VTK cell type 5.
    Triangles(Cow<'a, [[usize; 3]]>),
    /// VTK cell type 3.
    Lines(Cow<'a, [[usize; 2]]>),
    /// VTK cell type 24: corners, then the middles of the edges (0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3).
    QuadraticTets(Cow<'a, [[usize; 10]]>),
    /// VTK cell type 22: corners, then the middles of the edges (0, 1), (1, 2), (2, 0).
    QuadraticTriangles(Cow<'a, [[usize; 6]]>),
}

/// A named array, row after row.
#[derive(Clone, Debug, PartialEq)]
pub struct VtuArray<'a> {
    /// What it is called.
    pub name: Cow<'a, str>,
    /// Numbers in a row: 1 for scalars, 3 for vectors, 9 for matrices (row by row).
    pub components: usize,
    /// All numbers.
    pub values: VtuValues<'a>,
}

/// The numbers of a [`VtuArray`].
#[derive(Clone, Debug, PartialEq)]
pub enum VtuValues<'a> {
    /// Written as Float64.
    Reals(Cow<'a, [f64]>),
    /// Written as Int64.
    Integers(Cow<'a, [i64]>),
}

impl<'a> VtuArray<'a> {
    /// An array of reals with `components` numbers in a row.
    pub fn reals(name: impl Into<Cow<'a, str>>, components: usize, values: impl Into<Cow<'a, [f64]>>) -> Self {
        VtuArray {
            name: name.into(),
            components,
            values: VtuValues::Reals(values.into()),
        }
    }

    /// An array of vectors.
    pub fn vectors(name: impl Into<Cow<'a, str>>, values: &[Point]) -> Self {
        let values: Vec<f64> = values.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
        VtuArray::reals(name, 3, values)
    }

    /// An array with one integer in a row.
    pub fn integers(name: impl Into<Cow<'a, str>>, values: impl Into<Cow<'a, [i64]>>) -> Self {
        VtuArray {
            name: name.into(),
            components: 1,
            values: VtuValues::Integers(values.into()),
        }
    }
}

impl VtuGrid<'static> {
    /// The cells of a mesh that exist, at rest positions, with every vertex slot as a point: indices of points are those
    /// of slots.
    pub fn from_tet_mesh(mesh: &TetMesh) -> Self {
        VtuGrid::at_rest(mesh, VtuCells::Tets(corners(mesh).into()))
    }

    /// As [`Self::from_tet_mesh`], for triangles.
    pub fn from_tri_mesh(mesh: &TriMesh) -> Self {
        VtuGrid::at_rest(mesh, VtuCells::Triangles(corners(mesh).into()))
    }

    fn at_rest<const N: usize>(mesh: &SimplexMesh<N>, cells: VtuCells<'static>) -> Self {
        VtuGrid {
            points: mesh.rest_positions().to_vec().into(),
            cells,
            point_arrays: Vec::new(),
            cell_arrays: Vec::new(),
        }
    }
}

fn corners<const N: usize>(mesh: &SimplexMesh<N>) -> Vec<[usize; N]> {
    mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect()
}

/// Writes a grid as `.vtu`, whole or not at all (see [`write_atomically`]).
///
/// # Errors
/// [`IoError::Array`] if an array has not one row per point or cell, or a name occurs twice or a cell names a point that
/// does not exist; [`IoError::Write`].
pub fn write_vtu(path: impl AsRef<Path>, grid: &VtuGrid) -> Result<(), IoError> {
    write(path.as_ref(), grid, "UnstructuredGrid")
}

/// Writes a grid of triangles or lines as a surface, `.vtp`, whole or not at all.
///
/// # Errors
/// As [`write_vtu`], and [`IoError::Array`] for tetrahedra.
pub fn write_vtp(path: impl AsRef<Path>, grid: &VtuGrid) -> Result<(), IoError> {
    write(path.as_ref(), grid, "PolyData")
}

fn write(path: &Path, grid: &VtuGrid, content: &str) -> Result<(), IoError> {
    check(grid, content).map_err(|(array, problem)| IoError::Array {
        path: path.into(),
        array,
        problem,
    })?;
    write_atomically(path, |out| write_grid(out, grid, content))
}

fn check(grid: &VtuGrid, content: &str) -> Result<(), (String, String)> {
    if content == "PolyData" && !matches!(grid.cells, VtuCells::Triangles(_) | VtuCells::Lines(_)) {
        return Err(("connectivity".into(), "a surface is made of triangles or lines".into()));
    }
    let (num_points, num_cells) = (grid.points.len(), grid.cells.len());
    for (arrays, rows, of) in [
        (&grid.point_arrays, num_points, "points"),
        (&grid.cell_arrays, num_cells, "cells"),
    ] {
        for (k, array) in arrays.iter().enumerate() {
            let error = |problem: String| Err((array.name.to_string(), problem));
            let len = match &array.values {
                VtuValues::Reals(values) => values.len(),
                VtuValues::Integers(values) => values.len(),
            };
            if array.components == 0 || len != rows * array.components {
                let n = array.components;
                return error(format!("has {len} numbers for {rows} {of} of {n} components"));
            }
            if arrays[..k].iter().any(|a| a.name == array.name) {
                return error("occurs twice; names must differ".into());
            }
        }
    }
    match grid.cells.flat().iter().find(|&&n| n >= num_points) {
        None => Ok(()),
        Some(n) => Err((
            "connectivity".into(),
            format!("names point {n}, but there are {num_points}"),
        )),
    }
}

impl VtuCells<'_> {
    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.flat().len() / self.nodes_of_cell()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn nodes_of_cell(&self) -> usize {
        match self {
            VtuCells::Tets(_) => 4,
            VtuCells::Triangles(_) => 3,
            VtuCells::Lines(_) => 2,
            VtuCells::QuadraticTets(_) => 10,
            VtuCells::QuadraticTriangles(_) => 6,
        }
    }

    fn vtk_kind(&self) -> u8 {
        match self {
            VtuCells::Tets(_) => 10,
            VtuCells::Triangles(_) => 5,
            VtuCells::Lines(_) => 3,
            VtuCells::QuadraticTets(_) => 24,
            VtuCells::QuadraticTriangles(_) => 22,
        }
    }

    /// The nodes of all cells, one after the other.
    fn flat(&self) -> &[usize] {
        match self {
            VtuCells::Tets(cells) => cells.as_flattened(),
            VtuCells::Triangles(cells) => cells.as_flattened(),
            VtuCells::Lines(cells) => cells.as_flattened(),
            VtuCells::QuadraticTets(cells) => cells.as_flattened(),
            VtuCells::QuadraticTriangles(cells) => cells.as_flattened(),
        }
    }
}

fn write_grid(out: &mut dyn Write, grid: &VtuGrid, content: &str) -> io::Result<()> {
    let surface = content == "PolyData";
    let (number, section) = match (surface, &grid.cells) {
        (false, _) => ("NumberOfCells", "Cells"),
        (true, VtuCells::Lines(_)) => ("NumberOfLines", "Lines"),
        (true, _) => ("NumberOfPolys", "Polys"),
    };
    let (num_points, num_cells) = (grid.points.len(), grid.cells.len());
    writeln!(out, "<?xml version=\"1.0\"?>")?;
    writeln!(
        out,
        "<VTKFile type=\"{content}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
         compressor=\"vtkZLibDataCompressor\">"
    )?;
    writeln!(
        out,
        "<{content}>\n<Piece NumberOfPoints=\"{num_points}\" {number}=\"{num_cells}\">"
    )?;
    writeln!(out, "<Points>")?;
    let coordinates = grid.points.iter().flat_map(|p| [p.x, p.y, p.z]);
    write_array(
        out,
        "Float64",
        "Points",
        3,
        coordinates.flat_map(f64::to_le_bytes).collect(),
    )?;
    writeln!(out, "</Points>\n<{section}>")?;
    let nodes = grid.cells.flat().iter().flat_map(|n| (*n as i64).to_le_bytes());
    write_array(out, "Int64", "connectivity", 1, nodes.collect())?;
    let ends = (1..=num_cells).map(|cell| (cell * grid.cells.nodes_of_cell()) as i64);
    write_array(out, "Int64", "offsets", 1, ends.flat_map(i64::to_le_bytes).collect())?;
    if !surface {
        write_array(out, "UInt8", "types", 1, vec![grid.cells.vtk_kind(); num_cells])?;
    }
    writeln!(out, "</{section}>")?;
    for (section, arrays) in [("PointData", &grid.point_arrays), ("CellData", &grid.cell_arrays)] {
        writeln!(out, "<{section}>")?;
        for array in arrays {
            let name = escape(&array.name);
            let (kind, bytes) = match &array.values {
                VtuValues::Reals(values) => ("Float64", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
                VtuValues::Integers(values) => ("Int64", values.iter().flat_map(|v| v.to_le_bytes()).collect()),
            };
            write_array(out, kind, &name, array.components, bytes)?;
        }
        writeln!(out, "</{section}>")?;
    }
    writeln!(out, "</Piece>\n</{content}>\n</VTKFile>")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// `[blocks][block size][size of the last block, 0 if full][compressed sizes]` and the blocks, each part in base64.
fn write_array(out: &mut dyn Write, kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> io::Result<()> {
    const BLOCK: usize = 1 << 18;
    let mut sizes = Vec::new();
    let mut blocks = Vec::new();
    for block in bytes.chunks(BLOCK) {
        let before = blocks.len();
        let mut encoder = ZlibEncoder::new(&mut blocks, Compression::fast());
        encoder.write_all(block)?;
        encoder.finish()?;
        sizes.push((blocks.len() - before) as u64);
    }
    let mut header = vec![sizes.len() as u64, BLOCK as u64, (bytes.len() % BLOCK) as u64];
    header.extend(sizes);
    let header: Vec<u8> = header.into_iter().flat_map(u64::to_le_bytes).collect();
    // without the attribute for scalars: meshio would give them a second axis
    let columns = if components == 1 {
        String::new()
    } else {
        format!(" NumberOfComponents=\"{components}\"")
    };
    writeln!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\"{columns} format=\"binary\">"
    )?;
    writeln!(out, "{}{}\n</DataArray>", BASE64.encode(header), BASE64.encode(blocks))
}
