//! States as `.vtu` files, and their surfaces as `.vtp`.

use std::collections::BTreeSet;
use std::path::Path;

use kerfem_mesh::io::{IoError, VtuArray, VtuCells, VtuGrid, write_vtp, write_vtu};
use kerfem_mesh::{CellId, Midpoints, Point, SimplexMesh, VertexId, quality};
use nalgebra::{Matrix3, SymmetricEigen};
use serde::{Deserialize, Serialize};

use super::series::{FileList, Kind, Series};
use crate::{EngineError, FieldName, OutputSpec, Simulation};

/// Numbers vertices without the empty slots: surviving vertices of the input first, in its order, then new ones.
pub(crate) struct Numbering {
    pub(crate) vertices: Vec<VertexId>,
    pub(crate) index: Vec<usize>,
}

impl Numbering {
    pub(crate) fn of<const N: usize>(mesh: &SimplexMesh<N>) -> Self {
        Numbering::new(mesh, mesh.vertex_ids().collect())
    }

    fn new<const N: usize>(mesh: &SimplexMesh<N>, vertices: Vec<VertexId>) -> Self {
        let mut index = vec![usize::MAX; mesh.vertex_slots()];
        for (i, v) in vertices.iter().enumerate() {
            index[v.index()] = i;
        }
        Numbering { vertices, index }
    }

    /// Only the vertices in some triangles or lines.
    fn of_parts<const N: usize>(mesh: &SimplexMesh<N>, parts: &[[VertexId; 3]]) -> Self {
        let vertices: BTreeSet<VertexId> = parts.iter().flatten().copied().collect();
        Numbering::new(mesh, vertices.into_iter().collect())
    }

    /// The cells of a mesh, quadratic if it has `midpoints`.
    pub(super) fn cells<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        midpoints: Option<&Midpoints<N>>,
    ) -> VtuCells<'static> {
        let at = |v: VertexId| self.index[v.index()];
        if let Some(midpoints) = midpoints {
            let cells = mesh.cell_ids().map(|c| midpoints.nodes(mesh, c));
            return match N {
                3 => VtuCells::QuadraticTriangles(
                    cells
                        .map(|c| std::array::from_fn(|k| at(c[k])))
                        .collect::<Vec<_>>()
                        .into(),
                ),
                _ => VtuCells::QuadraticTets(cells.map(|c| c.map(at)).collect::<Vec<_>>().into()),
            };
        }
        let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(at));
        match N {
            3 => VtuCells::Triangles(cells.map(|c| [c[0], c[1], c[2]]).collect()),
            _ => VtuCells::Tets(cells.map(|c| [c[0], c[1], c[2], c[3]]).collect()),
        }
    }

    /// Triangles or, in the plane, lines.
    fn surface<const N: usize>(&self, parts: &[[VertexId; 3]]) -> VtuCells<'static> {
        let parts = parts.iter().map(|f| f.map(|v| self.index[v.index()]));
        match N {
            3 => VtuCells::Lines(parts.map(|[a, b, _]| [a, b]).collect()),
            _ => VtuCells::Triangles(parts.collect()),
        }
    }

    pub(super) fn grid<const N: usize>(&self, mesh: &SimplexMesh<N>, cells: VtuCells<'static>) -> VtuGrid<'static> {
        let points: Vec<Point> = self.vertices.iter().map(|v| mesh.rest_position(*v)).collect();
        let ids: Vec<i64> = self.vertices.iter().map(|v| i64::from(v.0)).collect();
        VtuGrid {
            points: points.into(),
            cells,
            point_arrays: vec![VtuArray::integers("vertex_id", ids)],
            cell_arrays: Vec::new(),
        }
    }

    /// A grid with the motion of its points.
    fn moving_grid<const N: usize>(&self, simulation: &Simulation<N>, cells: VtuCells<'static>) -> VtuGrid<'static> {
        let mut grid = self.grid(&simulation.mesh, cells);
        for (name, field) in [("displacement", &simulation.state.u), ("velocity", &simulation.state.v)] {
            grid.point_arrays.push(VtuArray::reals(name, 3, self.rows(field, 3)));
        }
        grid
    }

    /// The rows of a flat nodal field, `components` a vertex.
    pub(super) fn rows(&self, field: &[f64], components: usize) -> Vec<f64> {
        self.vertices
            .iter()
            .flat_map(|v| &field[components * v.index()..][..components])
            .copied()
            .collect()
    }
}

/// Writes the present state at rest positions, with the fields that the scene asks for.
pub(crate) fn write_state<const N: usize>(path: &Path, simulation: &Simulation<N>) -> Result<(), EngineError> {
    let mesh = &simulation.mesh;
    let numbering = Numbering::of(mesh);
    let midpoints = simulation.assembler.midpoints();
    let mut grid = numbering.moving_grid(simulation, numbering.cells(mesh, midpoints));
    let mut point = |name: &'static str, components, field: &[f64]| {
        grid.point_arrays
            .push(VtuArray::reals(name, components, numbering.rows(field, components)));
    };
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

/// Writes the boundary of the present state at rest positions, with its motion.
fn write_surface<const N: usize>(path: &Path, simulation: &Simulation<N>) -> Result<(), EngineError> {
    let mesh = &simulation.mesh;
    let parts = boundary(mesh, simulation.assembler.midpoints());
    let numbering = Numbering::of_parts(mesh, &parts);
    let grid = numbering.moving_grid(simulation, numbering.surface::<N>(&parts));
    write_vtp(path, &grid).map_err(EngineError::Write)
}

/// The boundary of a mesh: triangles with their normal outwards, of a planar mesh lines that run counter-clockwise (their second
/// vertex repeated). With `midpoints` each facet is divided at these, as a surface file holds no quadratic cells.
fn boundary<const N: usize>(mesh: &SimplexMesh<N>, midpoints: Option<&Midpoints<N>>) -> Vec<[VertexId; 3]> {
    let sides = mesh.boundary_facets();
    let Some(midpoints) = midpoints else {
        return sides.map(|side| mesh.facet_corners(side)).collect();
    };
    let divided = sides.flat_map(|side| {
        let ([a, b, c, d, e, f], _) = midpoints.facet_nodes(mesh, side);
        match N {
            3 => vec![[a, c, c], [c, b, b]],
            _ => vec![[a, d, f], [d, b, e], [f, e, c], [d, e, f]],
        }
    });
    divided.collect()
}

/// Writes a mesh at rest with the quality of its cells, as its file's ending says: `.vtu`, or `.vtp` for triangles.
///
/// # Errors
/// [`EngineError::Scene`] for another ending, before anything is done; what is returned gives [`EngineError::Write`].
pub fn mesh_writer<const N: usize>(
    path: &Path,
) -> Result<impl FnOnce(&SimplexMesh<N>) -> Result<(), EngineError>, EngineError> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let write: fn(&Path, &VtuGrid) -> Result<(), IoError> = match (ending.as_str(), N) {
        ("vtu", _) => |path, grid| write_vtu(path, grid),
        ("vtp", 3) => |path, grid| write_vtp(path, grid),
        _ => {
            let (what, accepted) = match N {
                3 => ("triangles", ".vtu, .vtp"),
                _ => ("tetrahedra", ".vtu"),
            };
            return Err(EngineError::Scene {
                place: path.display().to_string(),
                message: format!("a mesh of {what} is written to {accepted} files"),
            });
        }
    };
    Ok(move |mesh: &SimplexMesh<N>| {
        let numbering = Numbering::of(mesh);
        let mut grid = numbering.grid(mesh, numbering.cells(mesh, None));
        let ratio = |c| quality::radius_ratio(&mesh.cell_rest_positions(c));
        let values: Vec<f64> = mesh.cell_ids().map(ratio).collect();
        grid.cell_arrays.push(VtuArray::reals("quality", 1, values));
        write(path, &grid).map_err(EngineError::Write)
    })
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

/// The frames of a run, each with its surface if the scene asks for it.
pub(crate) struct Frames {
    every: Option<f64>,
    /// Time (s) from which on the next frame is due.
    next: f64,
    states: Series,
    surfaces: Option<Series>,
}

/// The frames written so far.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct FrameList {
    next: f64,
    states: FileList,
    surfaces: FileList,
}

impl Frames {
    /// Frames that follow those of `list`; others that a run of this name left in the folder are removed.
    pub(crate) fn new(results: &Path, name: &str, output: &OutputSpec, list: FrameList) -> Result<Self, EngineError> {
        let surfaces = match output.surface {
            true => Some(Series::new(Kind::SURFACES, results, name, list.surfaces)?),
            false => {
                Kind::SURFACES.remove_old(results, name, &list.surfaces)?;
                None
            }
        };
        Ok(Frames {
            every: output.every,
            next: list.next,
            states: Series::new(Kind::FRAMES, results, name, list.states)?,
            surfaces,
        })
    }

    /// Writes the present state if a frame is due, to within `slack` (s).
    pub(crate) fn offer<const N: usize>(&mut self, simulation: &Simulation<N>, slack: f64) -> Result<(), EngineError> {
        let (step, time) = (simulation.state.step, simulation.state.time);
        if time < self.next - slack {
            return Ok(());
        }
        if let Some(every) = self.every {
            // where frames are so dense that rounding hides the next one, every step is a frame
            let next = (((time + slack) / every).floor() + 1.0) * every;
            self.next = if next.is_finite() { next } else { time };
        }
        self.states.add(step, time, |path| write_state(path, simulation))?;
        match &mut self.surfaces {
            Some(surfaces) => surfaces.add(step, time, |path| write_surface(path, simulation)),
            None => Ok(()),
        }
    }

    /// The frames so far.
    pub(crate) fn list(&self) -> FrameList {
        FrameList {
            next: self.next,
            states: self.states.written().clone(),
            surfaces: self
                .surfaces
                .as_ref()
                .map_or_else(FileList::new, |s| s.written().clone()),
        }
    }

    /// Writes the lists of frames.
    pub(crate) fn write_lists(&self) -> Result<(), EngineError> {
        self.states.write_list()?;
        self.surfaces.as_ref().map_or(Ok(()), Series::write_list)
    }
}
