//! Meshes, cutting surfaces and results from and to files.
//!
//! | format | extension | [`read_mesh`] | [`read_sweep`] | written |
//! |---|---|---|---|---|
//! | VTK XML unstructured grid | `.vtu` | tetrahedra, triangles | triangles, polygons, lines | [`write_vtu`] |
//! | VTK XML surface | `.vtp` | triangles | triangles, polygons, strips, lines | [`write_vtp`] |
//! | VTK legacy (to 5.1; ASCII, binary) | `.vtk` | tetrahedra, triangles | triangles, polygons, strips, lines | |
//! | gmsh 1 (ASCII), 2, 4.1 (ASCII, binary) | `.msh` | tetrahedra, triangles | | |
//! | TetGen, Triangle | `.node`, `.ele` | tetrahedra, triangles | | |
//! | Medit (ASCII) | `.mesh` | tetrahedra, triangles | | |
//! | Wavefront | `.obj` | | triangles, polygons, lines | |
//! | STL (ASCII, binary) | `.stl` | | triangles | |
//!
//! A file is read whole or refused with one line that names the file, the place, what is wrong and what is accepted. What
//! a count in a file claims is checked against the bytes there are before memory is taken for it.
//!
//! ```
//! # use kerfem_mesh::{generate, io};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let dir = tempfile::tempdir()?;
//! # let path = dir.path().join("box.vtu");
//! let mesh = generate::box_tets([1.0, 1.0, 1.0], [1, 1, 1], [0.0, 0.0, 0.0]);
//! io::write_vtu(&path, &io::VtuGrid::from_tet_mesh(&mesh))?;
//! let again = io::read_mesh(&path)?.into_tet_mesh()?;
//! assert_eq!(again, mesh);
//! # Ok(())
//! # }
//! ```

mod atomic;
mod data;
mod error;
mod gmsh;
mod gmsh4;
mod gmsh_legacy;
mod gmsh_source;
mod grid;
mod medit;
mod obj;
mod stl;
mod tetgen;
mod text;
mod vtk;
mod vtu;
mod vtu_array;
mod vtu_write;
mod xml;

use std::path::Path;

pub use atomic::write_atomically;
pub use data::{DataArray, Group, MeshData, SweepData};
pub use error::IoError;
use error::Problem;
pub use vtu_write::{VtuArray, VtuCells, VtuGrid, VtuValues, write_vtp, write_vtu};

/// A mesh of tetrahedra, triangles and line segments. TetGen's two files are found by the name of either.
///
/// Vertices and cells keep the order of the file. Indices are in range and coordinates are finite; whether the cells make
/// a mesh is for [`MeshData::into_tet_mesh`] to say. Points among the cells are left out.
///
/// # Errors
/// [`IoError`], in one line.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<MeshData, IoError> {
    let path = path.as_ref();
    let parse: fn(&[u8]) -> Result<MeshData, Problem> = match extension(path).as_str() {
        "vtu" => |bytes| vtu::parse_unstructured(bytes)?.into_mesh(),
        "vtp" => |bytes| vtu::parse_poly_data(bytes)?.into_mesh(),
        "vtk" => |bytes| vtk::parse(bytes)?.into_mesh(),
        "msh" => gmsh::parse,
        "mesh" => medit::parse,
        "node" | "ele" => return tetgen::read(path),
        _ => {
            let accepted = [".vtu", ".vtp", ".vtk", ".msh", ".mesh", ".node", ".ele"];
            return Err(IoError::extension(path, "a mesh", &accepted));
        }
    };
    parse_file(path, parse)
}

/// The cells of a result (`.vtu`) by their corners: of cells of order 2 the middles of edges are points without a cell.
///
/// # Errors
/// [`IoError`], in one line.
pub fn read_result(path: impl AsRef<Path>) -> Result<MeshData, IoError> {
    parse_file(path.as_ref(), |bytes| {
        vtu::parse_unstructured(bytes)?.by_corners().into_mesh()
    })
}

/// A cutting surface, or line segments that cut a planar mesh. Polygons are cut into triangles that share their first corner
/// (right for convex ones).
///
/// # Errors
/// [`IoError`], in one line; also where the file holds neither.
pub fn read_sweep(path: impl AsRef<Path>) -> Result<SweepData, IoError> {
    let path = path.as_ref();
    let parse: fn(&[u8]) -> Result<SweepData, Problem> = match extension(path).as_str() {
        "obj" => obj::parse,
        "stl" => stl::parse,
        "vtu" => |bytes| vtu::parse_unstructured(bytes)?.into_sweep(),
        "vtp" => |bytes| vtu::parse_poly_data(bytes)?.into_sweep(),
        "vtk" => |bytes| vtk::parse(bytes)?.into_sweep(),
        _ => {
            return Err(IoError::extension(
                path,
                "a sweep",
                &[".obj", ".stl", ".vtu", ".vtp", ".vtk"],
            ));
        }
    };
    let sweep = parse_file(path, parse)?;
    if sweep.triangles.is_empty() && sweep.segments.is_empty() {
        let problem = Problem::new(
            "cells",
            "the file holds no triangle, polygon or line; a sweep is a triangulated surface or, in the plane, a line",
        );
        return Err(problem.in_file(path));
    }
    Ok(sweep)
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

fn parse_file<T>(path: &Path, parse: impl FnOnce(&[u8]) -> Result<T, Problem>) -> Result<T, IoError> {
    let bytes = std::fs::read(path).map_err(|source| IoError::Read {
        path: path.into(),
        source,
    })?;
    parse(&bytes).map_err(|p| p.in_file(path))
}
