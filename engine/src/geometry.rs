//! Cutting a mesh with no physics.

use std::path::Path;

use kerfem_cutting::{Borders, CutOptions};
use kerfem_mesh::{SimplexMesh, io, quality};
use serde::Serialize;

use crate::cutter::Cutter;
use crate::pending;
use crate::report::QualityFigures;
use crate::{EngineError, Frame};

/// Size and quality of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GeometryFigures {
    /// Vertices, unreferenced ones included.
    pub vertices: usize,
    /// Cells.
    pub cells: usize,
    /// Pieces, connected through facets.
    pub pieces: usize,
    /// Volume; of triangles their area times one metre.
    pub volume_m3: f64,
    /// Quality.
    pub quality: QualityFigures,
}

impl GeometryFigures {
    fn of<const N: usize>(mesh: &SimplexMesh<N>) -> Self {
        GeometryFigures {
            vertices: mesh.num_vertices(),
            cells: mesh.num_cells(),
            pieces: mesh.pieces().1,
            volume_m3: quality::volume(mesh),
            quality: QualityFigures::of(mesh),
        }
    }
}

/// What a cut did to a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GeometryCut {
    /// Method.
    pub method: String,
    /// The mesh before.
    pub before: GeometryFigures,
    /// The mesh after.
    pub after: GeometryFigures,
    /// Cells that are gone.
    pub cells_removed: usize,
    /// Cells that are new.
    pub cells_added: usize,
    /// Vertices that are new.
    pub vertices_added: usize,
    /// Vertices that are gone.
    pub vertices_removed: usize,
    /// Vertices that moved.
    pub vertices_moved: usize,
    /// Area of one lip; in the plane its length times one metre.
    pub area_m2: f64,
    /// Largest distance of the new faces to the sweep.
    pub max_distance_to_sweep_m: f64,
    /// Seconds spent finding cells.
    pub find_seconds: f64,
    /// Seconds spent changing the mesh.
    pub remesh_seconds: f64,
    /// Seconds spent improving cells.
    pub improve_seconds: f64,
    /// Operations made to improve cells.
    pub operations: usize,
    /// Bad cells left over because the operations allowed were used up.
    pub unfinished: usize,
    /// Why the cut was not made, if it was not.
    pub refused: Vec<String>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Cuts a mesh at rest by the surface in a file.
///
/// # Errors
/// [`EngineError::Read`], [`EngineError::Scene`] for a sweep that does not fit the mesh, [`EngineError::Cut`] for options.
pub fn cut_at_rest<const N: usize>(
    mesh: &mut SimplexMesh<N>,
    sweep: &Path,
    options: &CutOptions,
) -> Result<GeometryCut, EngineError> {
    let data = io::read_sweep(sweep).map_err(EngineError::Read)?;
    let (sweep, mut warnings) = pending::sweep_for::<N>(data).map_err(|e| EngineError::Scene {
        place: sweep.display().to_string(),
        message: e.to_string(),
    })?;
    let before = GeometryFigures::of(mesh);
    let mut cutter = Cutter::default();
    cutter.prepare(mesh, &[], Frame::Rest);
    let outcome = cutter.cut(mesh, &sweep, options, Borders::NONE)?;
    warnings.extend(outcome.report.warnings.iter().cloned());
    let record = pending::record(0.0, options.method, &outcome);
    Ok(GeometryCut {
        method: record.method,
        before,
        after: GeometryFigures::of(mesh),
        cells_removed: record.cells_removed,
        cells_added: record.cells_added,
        vertices_added: record.vertices_added,
        vertices_removed: record.vertices_removed,
        vertices_moved: record.vertices_moved,
        area_m2: record.area_m2,
        max_distance_to_sweep_m: record.max_distance_to_sweep_m,
        find_seconds: record.seconds.find,
        remesh_seconds: record.seconds.remesh,
        improve_seconds: record.seconds.improve,
        operations: record.operations,
        unfinished: record.unfinished,
        refused: record.refused,
        warnings,
    })
}
