//! The mesh and the sets that a scene names, read from its file or generated.

use std::collections::BTreeMap;
use std::path::Path;

use kerfem_mesh::io::{self, DataArray, MeshData};
use kerfem_mesh::{Point, TetMesh, generate};

use crate::scene::source::Source;
use crate::{EngineError, InitialField, MeshSpec};

/// A named set of a mesh file, as indices into its lists and corners of its facets; from zero, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct NamedSet {
    pub(crate) vertices: Vec<usize>,
    pub(crate) facets: Vec<[usize; 3]>,
    pub(crate) cells: Vec<usize>,
}

/// A mesh and the named sets of its file.
#[derive(Clone, Debug)]
pub(crate) struct MeshInput {
    pub(crate) mesh: TetMesh,
    pub(crate) sets: BTreeMap<String, NamedSet>,
}

impl MeshInput {
    /// Reads or generates the mesh of a scene.
    pub(crate) fn read(spec: &MeshSpec, source: &Source) -> Result<Self, EngineError> {
        let scale = spec.scale.unwrap_or(1.0);
        let generated = match (&spec.r#box, &spec.ball) {
            (Some(b), _) => {
                let (size, origin) = (b.size.map(|s| s * scale), b.origin.map(|o| o * scale));
                Some(("box", generate::try_box_tets(size, b.cells, origin)))
            }
            (_, Some(b)) => {
                let center = b.center.map(|c| c * scale);
                Some(("ball", generate::ball_tets(center, b.radius * scale, b.layers)))
            }
            (None, None) => None,
        };
        if let Some((key, mesh)) = generated {
            let mesh = mesh.map_err(|e| source.error("mesh", 0, key, e.to_string()))?;
            return Ok(MeshInput {
                mesh,
                sets: BTreeMap::new(),
            });
        }
        let file = spec.file.as_deref().unwrap_or(Path::new(""));
        let mut data = io::read_mesh(source.resolve(file)).map_err(EngineError::Read)?;
        if data.tets.is_empty() {
            let what = format!(
                "{} has {} triangles and no tetrahedra",
                file.display(),
                data.triangles.len()
            );
            return Err(source.error("mesh", 0, "file", format!("{what}; tetrahedra are needed")));
        }
        for p in &mut data.points {
            *p *= scale;
        }
        let sets = named_sets(&data);
        let mesh = data.into_tet_mesh();
        let mesh = mesh.map_err(|e| source.error("mesh", 0, "file", format!("{}: {e}", file.display())))?;
        Ok(MeshInput { mesh, sets })
    }

    /// A named set, or an error that says which there are.
    pub(crate) fn set(&self, name: &str) -> Result<&NamedSet, String> {
        self.sets.get(name).ok_or_else(|| {
            let known: Vec<String> = self.sets.keys().map(|k| format!("\"{k}\"")).collect();
            match known.is_empty() {
                true => format!("there is no group \"{name}\"; the mesh has no groups"),
                false => format!("there is no group \"{name}\"; the mesh has {}", known.join(", ")),
            }
        })
    }
}

/// Physical groups, and arrays of one component: the points or cells where their value is not zero.
fn named_sets(data: &MeshData) -> BTreeMap<String, NamedSet> {
    let mut sets: BTreeMap<String, NamedSet> = BTreeMap::new();
    let nonzero = |a: &DataArray| {
        let rows = a.values.iter().enumerate();
        rows.filter(|(_, v)| **v != 0.0).map(|(i, _)| i).collect::<Vec<_>>()
    };
    for (name, array) in data.cell_arrays.iter().filter(|(_, a)| a.components == 1) {
        let set = sets.entry(name.clone()).or_default();
        for i in nonzero(array) {
            match i.checked_sub(data.tets.len()) {
                None => {
                    set.cells.push(i);
                    set.vertices.extend(data.tets[i]);
                }
                Some(k) => {
                    set.facets.push(data.triangles[k]);
                    set.vertices.extend(data.triangles[k]);
                }
            }
        }
    }
    for (name, array) in data.point_arrays.iter().filter(|(_, a)| a.components == 1) {
        sets.insert(
            name.clone(),
            NamedSet {
                vertices: nonzero(array),
                ..NamedSet::default()
            },
        );
    }
    for (name, group) in &data.groups {
        let facets = group.triangles.iter().map(|&k| data.triangles[k]).collect();
        let (vertices, cells) = (group.vertices.clone(), group.tets.clone());
        sets.insert(
            name.clone(),
            NamedSet {
                vertices,
                facets,
                cells,
            },
        );
    }
    for set in sets.values_mut() {
        set.vertices.sort_unstable();
        set.vertices.dedup();
    }
    sets
}

/// The values of an initial field at the vertices of the mesh as read, flat (3 a vertex).
pub(crate) fn initial_values(
    field: &InitialField,
    key: &str,
    rest_positions: &[Point],
    source: &Source,
) -> Result<Vec<f64>, EngineError> {
    let fail = |message: String| source.error("initial", 0, key, message);
    match field {
        InitialField::Formula(components) => {
            let values: Vec<f64> = rest_positions
                .iter()
                .flat_map(|p| components.each_ref().map(|e| e.value(p, 0.0)))
                .collect();
            match values.iter().position(|v| !v.is_finite()) {
                None => Ok(values),
                Some(i) => {
                    let (e, p) = (components[i % 3].text(), rest_positions[i / 3]);
                    Err(fail(format!(
                        "\"{e}\" has no finite value at ({}, {}, {})",
                        p.x, p.y, p.z
                    )))
                }
            }
        }
        InitialField::File { file, array } => {
            let data = io::read_mesh(source.resolve(file)).map_err(EngineError::Read)?;
            let Some(found) = data.point_arrays.get(array) else {
                let known: Vec<String> = data.point_arrays.keys().map(|k| format!("\"{k}\"")).collect();
                let known = known.join(", ");
                return Err(fail(format!(
                    "{} has no point array \"{array}\"; it has {known}",
                    file.display()
                )));
            };
            if found.components != 3 || found.values.len() != 3 * rest_positions.len() {
                let (rows, columns) = (found.values.len() / found.components.max(1), found.components);
                return Err(fail(format!(
                    "array \"{array}\" has {rows} rows of {columns}; {} rows of 3 are needed",
                    rest_positions.len()
                )));
            }
            match found.values.iter().position(|v| !v.is_finite()) {
                None => Ok(found.values.clone()),
                Some(i) => Err(fail(format!(
                    "array \"{array}\" is not finite at point {} (from zero)",
                    i / 3
                ))),
            }
        }
    }
}
