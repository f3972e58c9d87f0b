//! States as `.vtu` files, and the `.pvd` that lists them.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use kerfem_mesh::io::{VtuArray, VtuCells, VtuGrid, write_atomically, write_vtu};
use kerfem_mesh::{CellId, Point, SimplexMesh, VertexId, quality};
use nalgebra::{Matrix3, SymmetricEigen};
use serde::{Deserialize, Serialize};

use crate::{EngineError, FieldName, Simulation};

/// Numbers vertices without the empty slots: surviving vertices of the input first, in its order, then new ones.
pub(crate) struct Numbering {
    pub(crate) vertices: Vec<VertexId>,
    pub(crate) index: Vec<usize>,
}

impl Numbering {
    pub(crate) fn of<const N: usize>(mesh: &SimplexMesh<N>) -> Self {
        let vertices: Vec<VertexId> = mesh.vertex_ids().collect();
        let mut index = vec![usize::MAX; mesh.vertex_slots()];
        for (i, v) in vertices.iter().enumerate() {
            index[v.index()] = i;
        }
        Numbering { vertices, index }
    }

    fn grid<const N: usize>(&self, mesh: &SimplexMesh<N>) -> VtuGrid<'static> {
        let points: Vec<Point> = self.vertices.iter().map(|v| mesh.rest_position(*v)).collect();
        let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| self.index[v.index()]));
        let cells = if N == 3 {
            VtuCells::Triangles(cells.map(|c| [c[0], c[1], c[2]]).collect())
        } else {
            VtuCells::Tets(cells.map(|c| [c[0], c[1], c[2], c[3]]).collect())
        };
        let ids: Vec<i64> = self.vertices.iter().map(|v| i64::from(v.0)).collect();
        VtuGrid {
            points: points.into(),
            cells,
            point_arrays: vec![VtuArray::integers("vertex_id", ids)],
            cell_arrays: Vec::new(),
        }
    }

    /// The rows of a flat nodal field, `components` a vertex.
    fn rows(&self, field: &[f64], components: usize) -> Vec<f64> {
        self.vertices
            .iter()
            .flat_map(|v| &field[components * v.index()..][..components])
            .copied()
            .collect()
    }
}

/// Writes a mesh at rest with the quality of its cells.
///
/// # Errors
/// [`EngineError::Write`].
pub fn write_mesh<const N: usize>(path: &Path, mesh: &SimplexMesh<N>) -> Result<(), EngineError> {
    let mut grid = Numbering::of(mesh).grid(mesh);
    let values: Vec<f64> = mesh
        .cell_ids()
        .map(|c| quality::radius_ratio(&mesh.cell_rest_positions(c)))
        .collect();
    grid.cell_arrays.push(VtuArray::reals("quality", 1, values));
    write_vtu(path, &grid).map_err(EngineError::Write)
}

/// Writes the present state at rest positions, with the fields that the scene asks for.
pub(crate) fn write_state<const N: usize>(path: &Path, simulation: &Simulation<N>) -> Result<(), EngineError> {
    let mesh = &simulation.mesh;
    let numbering = Numbering::of(mesh);
    let mut grid = numbering.grid(mesh);
    let mut point = |name: &'static str, components, field: &[f64]| {
        grid.point_arrays
            .push(VtuArray::reals(name, components, numbering.rows(field, components)));
    };
    point("displacement", 3, &simulation.state.u);
    point("velocity", 3, &simulation.state.v);
    let wanted = &simulation.scene.output.fields;
    if wanted.contains(&FieldName::InternalForce) {
        let mut force = vec![0.0; simulation.state.u.len()];
        simulation
            .assembler
            .internal_force(mesh, simulation.model, &simulation.state.u, &mut force);
        point("internal_force", 3, &force);
    }
    if wanted.contains(&FieldName::Mass) {
        point("mass", 1, simulation.assembler.lumped_mass());
    }
    let mut seen = Vec::new();
    for &field in wanted {
        if let (Some((name, components)), false) = (cell_field(field), seen.contains(&field)) {
            seen.push(field);
            let values: Vec<f64> = mesh
                .cell_ids()
                .flat_map(|c| cell_values(simulation, field, c))
                .collect();
            grid.cell_arrays.push(VtuArray::reals(name, components, values));
        }
    }
    write_vtu(path, &grid).map_err(EngineError::Write)
}

/// Name and number of components of a field on cells.
fn cell_field(field: FieldName) -> Option<(&'static str, usize)> {
    match field {
        FieldName::VonMises => Some(("von_mises", 1)),
        FieldName::Quality => Some(("quality", 1)),
        FieldName::Stress => Some(("stress", 9)),
        FieldName::Strain => Some(("strain", 9)),
        FieldName::Region => Some(("region", 1)),
        FieldName::Displacement | FieldName::Velocity | FieldName::InternalForce | FieldName::Mass => None,
    }
}

fn cell_values<const N: usize>(simulation: &Simulation<N>, field: FieldName, c: CellId) -> Vec<f64> {
    let (mesh, u) = (&simulation.mesh, &simulation.state.u);
    let stress = || simulation.assembler.cauchy_like_stress(mesh, simulation.model, c, u);
    match field {
        FieldName::VonMises => vec![von_mises(&stress())],
        FieldName::Quality => vec![quality::radius_ratio(&mesh.cell_rest_positions(c))],
        FieldName::Region => vec![f64::from(simulation.regions[c.index()])],
        FieldName::Stress => row_by_row(&stress()),
        FieldName::Strain => {
            let gradient = simulation.assembler.deformation_gradient(mesh, c, u);
            let mut strain = match simulation.model {
                kerfem_fem::Model::Linear => (gradient + gradient.transpose()) / 2.0 - Matrix3::identity(),
                kerfem_fem::Model::Corotated => stretch(&gradient) - Matrix3::identity(),
            };
            let material = simulation.assembler.material(c);
            if N == 3 && material.plane() == kerfem_fem::Plane::Stress {
                strain[(2, 2)] = -material.poisson() / (1.0 - material.poisson()) * strain.trace();
            }
            row_by_row(&strain)
        }
        FieldName::Displacement | FieldName::Velocity | FieldName::InternalForce | FieldName::Mass => Vec::new(),
    }
}

fn row_by_row(m: &Matrix3<f64>) -> Vec<f64> {
    m.transpose().as_slice().to_vec()
}

/// The right stretch `S = sqrt(F^T F)`, with `F = R S`.
fn stretch(gradient: &Matrix3<f64>) -> Matrix3<f64> {
    let eigen = SymmetricEigen::new(gradient.transpose() * gradient);
    let roots = eigen.eigenvalues.map(|l| l.max(0.0).sqrt());
    eigen.eigenvectors * Matrix3::from_diagonal(&roots) * eigen.eigenvectors.transpose()
}

fn von_mises(stress: &Matrix3<f64>) -> f64 {
    let deviator = stress - Matrix3::identity() * (stress.trace() / 3.0);
    (1.5 * deviator.norm_squared()).sqrt()
}

/// The frames of a run: `frames/NAME_000123.vtu` (the number is that of the step) and `NAME.pvd`.
pub(crate) struct Frames {
    folder: PathBuf,
    name: String,
    every: Option<f64>,
    list: FrameList,
}

/// The frames written so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FrameList {
    /// Time (s) from which on the next frame is due.
    next: f64,
    /// Time (s) and file, relative to the folder of results.
    written: Vec<(f64, String)>,
}

/// The list of frames is written anew with each of the first frames, and then with every so many.
const LIST_EVERY: usize = 64;

impl Frames {
    /// Frames that follow those of `list`; others that a run of this name left in the folder are removed.
    pub(crate) fn new(folder: &Path, name: &str, every: Option<f64>, list: FrameList) -> Result<Self, EngineError> {
        let frames = folder.join("frames");
        if frames.is_dir() {
            remove_old(&frames, name, &list).map_err(|source| {
                EngineError::Write(kerfem_mesh::io::IoError::Write {
                    path: frames.clone(),
                    source,
                })
            })?;
        }
        super::make_folder(&frames)?;
        let (folder, name) = (folder.to_owned(), name.to_owned());
        Ok(Frames {
            folder,
            name,
            every,
            list,
        })
    }

    /// Writes the present state if a frame is due, to within `slack` (s).
    pub(crate) fn offer<const N: usize>(&mut self, simulation: &Simulation<N>, slack: f64) -> Result<(), EngineError> {
        let time = simulation.state.time;
        if time < self.list.next - slack {
            return Ok(());
        }
        if let Some(every) = self.every {
            // where frames are so dense that rounding hides the next one, every step is a frame
            let next = (((time + slack) / every).floor() + 1.0) * every;
            self.list.next = if next.is_finite() { next } else { time };
        }
        let file = format!("frames/{}_{:06}.vtu", self.name, simulation.state.step);
        write_state(&self.folder.join(&file), simulation)?;
        tracing::debug!(file, t = time, "frame");
        self.list.written.push((time, file));
        let count = self.list.written.len();
        if count <= LIST_EVERY || count.is_multiple_of(LIST_EVERY) {
            self.write_list()?;
        }
        Ok(())
    }

    /// The frames so far.
    pub(crate) fn list(&self) -> &FrameList {
        &self.list
    }

    /// Writes `NAME.pvd`.
    pub(crate) fn write_list(&self) -> Result<(), EngineError> {
        let path = self.folder.join(format!("{}.pvd", self.name));
        let written = write_atomically(path, |out| {
            writeln!(out, "<?xml version=\"1.0\"?>")?;
            writeln!(
                out,
                "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>"
            )?;
            for (time, file) in &self.list.written {
                writeln!(
                    out,
                    "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>",
                    escaped(file)
                )?;
            }
            writeln!(out, "</Collection>\n</VTKFile>")
        });
        written.map_err(EngineError::Write)
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

/// Frames of an earlier run would be taken for this one's.
fn remove_old(frames: &Path, name: &str, list: &FrameList) -> std::io::Result<()> {
    let kept: HashSet<&str> = list
        .written
        .iter()
        .filter_map(|(_, f)| f.strip_prefix("frames/"))
        .collect();
    for entry in std::fs::read_dir(frames)? {
        let entry = entry?;
        let file = entry.file_name().to_string_lossy().into_owned();
        let number = file
            .strip_prefix(name)
            .and_then(|f| f.strip_prefix('_'))
            .and_then(|f| f.strip_suffix(".vtu"));
        if number.is_some_and(|n| n.chars().all(|c| c.is_ascii_digit())) && !kept.contains(file.as_str()) {
            std::fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}
