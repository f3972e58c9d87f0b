//! How far the field of a run is from that of a reference.

use std::borrow::Cow;
use std::cmp::Reverse;
use std::path::Path;

use kerfem_mesh::io::{MeshData, VtuArray, VtuCells, VtuGrid, read_mesh, read_result, write_vtu};
use kerfem_mesh::{Aabb, BoxTree, CellId, Deepest, MeshError, Point, SimplexMesh, quality};

use crate::{EngineError, Expression};

/// How far into its cell a corner is moved before it is looked for in another mesh: both lips of a cut have their own side.
const INWARDS: f64 = 1e-6;

/// A field to compare with.
pub(super) enum Known<'a> {
    /// The point array of a file.
    File(&'a Path, &'a str),
    /// Formulas in the rest position.
    Exact(&'a [Expression; 3]),
}

/// The relative L2 norm of the difference between the point array `name` of a result and a known field, over the corners of
/// cells; writes both and their difference (point by point) to `out`.
///
/// A reference is looked up in its own cells, linearly; where the meshes are the same that is what it says at each vertex.
///
/// # Errors
/// Files that cannot be read or written, or do not cover each other.
pub(super) fn difference(result: &Path, name: &str, known: &Known<'_>, out: &Path) -> Result<f64, EngineError> {
    let data = read_result(result).map_err(EngineError::Read)?;
    match data.tets.is_empty() {
        false => of_mesh(
            data,
            MeshData::into_tet_mesh,
            |m| m.tets.clone(),
            name,
            known,
            result,
            out,
        ),
        true => of_mesh(data, planar, |m| m.triangles.clone(), name, known, result, out),
    }
}

fn planar(data: MeshData) -> Result<SimplexMesh<3>, MeshError> {
    SimplexMesh::planar(data.points, data.triangles)
}

/// A reference: the last state of a run, or a mesh of any format.
fn read(path: &Path) -> Result<MeshData, EngineError> {
    let read = match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vtu")) {
        true => read_result(path),
        false => read_mesh(path),
    };
    read.map_err(EngineError::Read)
}

fn fail<T>(path: &Path, message: impl Into<String>) -> Result<T, EngineError> {
    Err(EngineError::Scene {
        place: path.display().to_string(),
        message: message.into(),
    })
}

fn array(data: &MeshData, name: &str, path: &Path) -> Result<Vec<Point>, EngineError> {
    match data.point_arrays.get(name).filter(|a| a.components == 3) {
        Some(array) => Ok(array.values.chunks(3).map(Point::from_column_slice).collect()),
        None => fail(path, format!("point data \"{name}\" with 3 components is needed")),
    }
}

fn of_mesh<const N: usize>(
    data: MeshData,
    into_mesh: impl Fn(MeshData) -> Result<SimplexMesh<N>, MeshError>,
    cells: impl Fn(&MeshData) -> Vec<[usize; N]>,
    name: &str,
    known: &Known<'_>,
    result: &Path,
    out: &Path,
) -> Result<f64, EngineError> {
    let found = array(&data, name, result)?;
    let looked_up = match known {
        Known::Exact(formulas) => Lookup::Exact(formulas),
        Known::File(path, name) => {
            let reference = read(path)?;
            let values = array(&reference, name, path)?;
            let corners = cells(&reference);
            let Ok(mesh) = into_mesh(reference) else {
                return fail(path, "its cells are not those of a mesh of the kind of the result");
            };
            let tree = BoxTree::of_cells(&mesh, mesh.rest_positions());
            Lookup::Mesh(Box::new(Reference {
                margin: INWARDS * mesh_size(&mesh),
                mesh,
                tree,
                corners,
                values,
            }))
        }
    };
    let (mut sum, mut size) = (0.0, 0.0);
    let mut at_points = vec![Point::zeros(); found.len()];
    for cell in cells(&data) {
        let p = cell.map(|v| data.points[v]);
        let mean = |of: &[Point]| cell.iter().map(|v| of[*v]).sum::<Point>() / N as f64;
        let (center, middle) = (mean(&data.points), mean(&found));
        let weight = quality::cell_volume(&p).abs() / N as f64;
        for v in cell {
            let place = data.points[v] + INWARDS * (center - data.points[v]);
            let own = match looked_up {
                Lookup::Exact(_) => found[v],
                Lookup::Mesh(..) => found[v] + INWARDS * (middle - found[v]),
            };
            let Some(wanted) = looked_up.at(&data.points[v], &place) else {
                let p = data.points[v];
                return fail(
                    result,
                    format!("({}, {}, {}) does not lie in the mesh of the reference", p.x, p.y, p.z),
                );
            };
            sum += weight * (own - wanted).norm_squared();
            size += weight * wanted.norm_squared();
            at_points[v] = wanted;
        }
    }
    let errors: Vec<Point> = found.iter().zip(&at_points).map(|(a, b)| a - b).collect();
    let grid = VtuGrid {
        points: Cow::Borrowed(&data.points),
        cells: shown(&data),
        point_arrays: vec![
            VtuArray::vectors(name.to_owned(), &found),
            VtuArray::vectors("reference", &at_points),
            VtuArray::vectors("error", &errors),
        ],
        cell_arrays: Vec::new(),
    };
    write_vtu(out, &grid).map_err(EngineError::Write)?;
    Ok(if size > 0.0 { (sum / size).sqrt() } else { sum.sqrt() })
}

fn shown(data: &MeshData) -> VtuCells<'_> {
    match data.tets.is_empty() {
        false => VtuCells::Tets(Cow::Borrowed(&data.tets)),
        true => VtuCells::Triangles(Cow::Borrowed(&data.triangles)),
    }
}

/// A field on a mesh of its own.
struct Reference<const N: usize> {
    mesh: SimplexMesh<N>,
    tree: BoxTree,
    /// How far outside its cells a point may lie (m): a curved boundary may leave it there.
    margin: f64,
    corners: Vec<[usize; N]>,
    values: Vec<Point>,
}

enum Lookup<'a, const N: usize> {
    Exact(&'a [Expression; 3]),
    Mesh(Box<Reference<N>>),
}

impl<const N: usize> Lookup<'_, N> {
    /// The field at a vertex, `inside` of one of its cells.
    fn at(&self, vertex: &Point, inside: &Point) -> Option<Point> {
        match self {
            Lookup::Exact(formulas) => Some(Point::from_fn(|k, _| formulas[k].value(vertex, 0.0))),
            Lookup::Mesh(reference) => {
                let mut near = Vec::new();
                let around = Aabb::around([*inside]).grown(reference.margin);
                reference.tree.query(&around, |item| near.push(CellId(item)));
                let cells = near.iter().enumerate();
                let cells = cells.map(|(k, c)| ((Reverse(k), *c), reference.mesh.cell_rest_positions(*c)));
                let deepest = Deepest::of(inside, cells)?;
                let corners = reference.corners[deepest.key.1.index()].iter();
                Some(
                    corners
                        .zip(deepest.coordinates)
                        .map(|(v, w)| w * reference.values[*v])
                        .sum(),
                )
            }
        }
    }
}

fn mesh_size<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let bounds = Aabb::around(mesh.rest_positions().iter().copied());
    (bounds.max - bounds.min).norm()
}
