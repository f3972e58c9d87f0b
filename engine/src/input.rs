//! The mesh and the sets that a scene names, read from its file or generated.

use std::collections::BTreeMap;
use std::path::Path;

use kerfem_mesh::io::{self, DataArray, MeshData};
use kerfem_mesh::{MeshError, Point, SimplexMesh, TriMesh, generate};

use crate::nearest::nearest;
use crate::scene::source::{Source, unreadable};
use crate::{EngineError, InitialField, MeshSpec};

/// A named set of a mesh file, as indices of vertices and cells from zero, ascending, and corners of facets (of a planar mesh
/// the second end of an edge is repeated).
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NamedSet {
    pub(crate) vertices: Vec<usize>,
    pub(crate) facets: Vec<[usize; 3]>,
    pub(crate) cells: Vec<usize>,
}

/// A mesh and the named sets of its file.
#[derive(Clone, Debug)]
pub(crate) struct MeshInput<const N: usize = 4> {
    pub(crate) mesh: SimplexMesh<N>,
    pub(crate) sets: BTreeMap<String, NamedSet>,
}

/// The mesh of a scene, whichever kind it is.
pub(crate) enum AnyInput {
    /// Tetrahedra.
    Solid(MeshInput<4>),
    /// Triangles in the plane.
    Planar(MeshInput<3>),
}

impl AnyInput {
    /// Reads or generates the mesh of a scene.
    pub(crate) fn read(spec: &MeshSpec, source: &Source) -> Result<Self, EngineError> {
        let scale = spec.scale.unwrap_or(1.0);
        let at_fault = |key: &'static str| move |e: MeshError| source.error("mesh", 0, key, e.to_string());
        if let Some(b) = &spec.r#box {
            let (size, origin) = (b.size.map(|s| s * scale), b.origin.map(|o| o * scale));
            let mesh = generate::try_box_tets(size, b.cells, origin).map_err(at_fault("box"))?;
            return Ok(AnyInput::Solid(MeshInput::generated(mesh)));
        }
        if let Some(b) = &spec.ball {
            let center = b.center.map(|c| c * scale);
            let mesh = generate::ball_tets(center, b.radius * scale, b.layers).map_err(at_fault("ball"))?;
            return Ok(AnyInput::Solid(MeshInput::generated(mesh)));
        }
        if let Some(c) = &spec.cylinder {
            let (origin, radius, length) = (c.origin.map(|o| o * scale), c.radius * scale, c.length * scale);
            let mesh = generate::cylinder_tets(origin, c.axis, radius, length, c.layers, c.slices)
                .map_err(at_fault("cylinder"))?;
            return Ok(AnyInput::Solid(MeshInput::generated(mesh)));
        }
        if let Some(p) = &spec.plate {
            let (size, origin) = (p.size.map(|s| s * scale), p.origin.map(|o| o * scale));
            let mesh = generate::rect_triangles(size, p.cells, origin).map_err(at_fault("plate"))?;
            return Ok(AnyInput::Planar(MeshInput::generated(mesh)));
        }
        let file = spec.file.as_deref().unwrap_or(Path::new(""));
        let read = io::read_mesh(source.resolve(file));
        let mut data = read.map_err(|e| source.file_error("mesh", 0, "file", &e))?;
        for p in &mut data.points {
            *p *= scale;
        }
        let fail = |message: String| source.error("mesh", 0, "file", format!("{}: {message}", file.display()));
        let sets = named_sets(&data);
        if !data.tets.is_empty() {
            let mesh = data.into_tet_mesh().map_err(|e| fail(e.to_string()))?;
            return Ok(AnyInput::Solid(MeshInput { mesh, sets }));
        }
        if data.triangles.is_empty() {
            return Err(fail("it has neither tetrahedra nor triangles".into()));
        }
        match TriMesh::planar(data.points, data.triangles) {
            Ok(mesh) => Ok(AnyInput::Planar(MeshInput { mesh, sets })),
            Err(e @ MeshError::OutOfPlane { .. }) => Err(fail(format!(
                "{e}; surfaces in space have no mechanics yet, tetrahedra or triangles in that plane are needed"
            ))),
            Err(e) => Err(fail(e.to_string())),
        }
    }
}

impl MeshInput<4> {
    /// The mesh of a scene if it is made of tetrahedra.
    pub(crate) fn read(spec: &MeshSpec, source: &Source) -> Result<Self, EngineError> {
        match AnyInput::read(spec, source)? {
            AnyInput::Solid(input) => Ok(input),
            AnyInput::Planar(_) => Err(source.error("mesh", 0, "", "it is planar; tetrahedra are needed here")),
        }
    }
}

impl MeshInput<3> {
    /// The mesh of a scene if it is made of triangles in the plane.
    pub(crate) fn read_planar(spec: &MeshSpec, source: &Source) -> Result<Self, EngineError> {
        match AnyInput::read(spec, source)? {
            AnyInput::Planar(input) => Ok(input),
            AnyInput::Solid(_) => Err(source.error("mesh", 0, "", "it has tetrahedra; a planar mesh is needed here")),
        }
    }
}

impl<const N: usize> MeshInput<N> {
    fn generated(mesh: SimplexMesh<N>) -> Self {
        MeshInput {
            mesh,
            sets: BTreeMap::new(),
        }
    }

    /// A named set, or an error that says which there are.
    pub(crate) fn set(&self, name: &str) -> Result<&NamedSet, String> {
        self.sets.get(name).ok_or_else(|| {
            let known: Vec<String> = self.sets.keys().map(|k| format!("\"{k}\"")).collect();
            let hint = nearest(name, self.sets.keys().map(String::as_str))
                .map_or_else(String::new, |n| format!("did you mean \"{n}\"? "));
            match known.is_empty() {
                true => format!("there is no group \"{name}\"; the mesh has no groups"),
                false => format!("there is no group \"{name}\"; {hint}the mesh has {}", known.join(", ")),
            }
        })
    }
}

/// Physical groups, and arrays of one component: the points or cells where their value is not zero.
fn named_sets(data: &MeshData) -> BTreeMap<String, NamedSet> {
    let (tets, triangles) = (data.tets.len(), data.triangles.len());
    let nonzero = |a: &DataArray| {
        let rows = a.values.iter().enumerate();
        rows.filter(|(_, v)| **v != 0.0).map(|(i, _)| i).collect::<Vec<_>>()
    };
    let mut sets: BTreeMap<String, NamedSet> = BTreeMap::new();
    for (name, array) in data.cell_arrays.iter().filter(|(_, a)| a.components == 1) {
        sets.insert(name.clone(), NamedSet::of(data, &nonzero(array), &[]));
    }
    for (name, array) in data.point_arrays.iter().filter(|(_, a)| a.components == 1) {
        sets.insert(name.clone(), NamedSet::of(data, &[], &nonzero(array)));
    }
    for (name, group) in &data.groups {
        let rows = group.tets.iter().copied();
        let rows = rows.chain(group.triangles.iter().map(|i| tets + i));
        let rows = rows.chain(group.segments.iter().map(|i| tets + triangles + i));
        let rows: Vec<usize> = rows.collect();
        sets.insert(name.clone(), NamedSet::of(data, &rows, &group.vertices));
    }
    sets
}

impl NamedSet {
    /// The set of some rows of the cell arrays of a file (its tetrahedra, triangles, line segments, in this order) and of
    /// some points. Without tetrahedra the triangles are the cells, and segments their facets.
    fn of(data: &MeshData, rows: &[usize], points: &[usize]) -> Self {
        let (tets, triangles, planar) = (data.tets.len(), data.triangles.len(), data.tets.is_empty());
        let mut set = NamedSet::default();
        set.vertices.extend(points);
        for &row in rows {
            if row < tets {
                set.cells.push(row);
                set.vertices.extend(data.tets[row]);
            } else if row < tets + triangles {
                let corners = data.triangles[row - tets];
                match planar {
                    true => set.cells.push(row),
                    false => set.facets.push(corners),
                }
                set.vertices.extend(corners);
            } else {
                let [a, b] = data.segments[row - tets - triangles];
                if planar {
                    set.facets.push([a, b, b]);
                }
                set.vertices.extend([a, b]);
            }
        }
        set.vertices.sort_unstable();
        set.vertices.dedup();
        set
    }
}

/// The values of an initial field at the vertices of the mesh as read, flat (3 a vertex; in two dimensions the third is 0).
pub(crate) fn initial_values(
    field: &InitialField,
    key: &str,
    rest_positions: &[Point],
    dimension: usize,
    source: &Source,
) -> Result<Vec<f64>, EngineError> {
    let fail = |message: String| source.error("initial", 0, key, message);
    match field {
        InitialField::Here(components) => {
            let components = components.in_space();
            let values: Vec<f64> = rest_positions
                .iter()
                .flat_map(|p| components.each_ref().map(|e| e.value(p, 0.0)))
                .collect();
            match values.iter().position(|v| !v.is_finite()) {
                None => Ok(values),
                Some(i) => {
                    let (e, p) = (components[i % 3].shown(), rest_positions[i / 3]);
                    Err(fail(format!(
                        "\"{e}\" has no finite value at ({}, {}, {})",
                        p.x, p.y, p.z
                    )))
                }
            }
        }
        InitialField::File { file, array } => point_array(source, file, array, rest_positions.len(), dimension, fail),
    }
}

/// The vectors in a point array of a file, flat (3 a point; in two dimensions the third is 0); `fail` makes an error of what is
/// wrong with them.
pub(crate) fn point_array(
    source: &Source,
    file: &Path,
    array: &str,
    points: usize,
    dimension: usize,
    fail: impl Fn(String) -> EngineError,
) -> Result<Vec<f64>, EngineError> {
    let data = io::read_mesh(source.resolve(file)).map_err(|e| fail(unreadable(&e)))?;
    let Some(found) = data.point_arrays.get(array) else {
        let known: Vec<String> = data.point_arrays.keys().map(|k| format!("\"{k}\"")).collect();
        let known = known.join(", ");
        return Err(fail(format!(
            "{} has no point array \"{array}\"; it has {known}",
            file.display()
        )));
    };
    let (rows, columns) = (found.values.len() / found.components.max(1), found.components);
    if !(dimension..=3).contains(&columns) || rows != points {
        let wanted = if dimension == 2 { "2 or 3" } else { "3" };
        return Err(fail(format!(
            "array \"{array}\" has {rows} rows of {columns}; {points} rows of {wanted} are needed"
        )));
    }
    if let Some(i) = (0..rows).find(|&i| dimension == 2 && columns == 3 && found.row(i)[2] != 0.0) {
        return Err(fail(format!(
            "array \"{array}\" leaves the plane of the mesh at point {i} (from zero); its third component must be 0"
        )));
    }
    let third = |row: &[f64]| [row[0], row[1], row.get(2).copied().unwrap_or(0.0)];
    match found.values.iter().position(|v| !v.is_finite()) {
        None => Ok((0..rows).flat_map(|i| third(found.row(i))).collect()),
        Some(i) => Err(fail(format!(
            "array \"{array}\" is not finite at point {} (from zero)",
            i / columns
        ))),
    }
}
