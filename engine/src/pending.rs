//! Cuts of a scene that wait for their time, and what is recorded of one.

use kerfem_cutting::{CutError, CutOptions, CutOutcome, Method, Sweep};
use kerfem_mesh::io::{self, SweepData};
use serde::{Deserialize, Serialize};

use crate::report::{CutRecord, CutSeconds};
use crate::{EngineError, Frame, Scene};

/// A cut to be made at a time.
#[derive(Debug)]
pub(crate) struct PendingCut {
    /// Its number in the scene.
    pub(crate) index: usize,
    pub(crate) at: f64,
    pub(crate) frame: Frame,
    pub(crate) sweep: Sweep,
    pub(crate) options: CutOptions,
    /// What it was made from.
    pub(crate) stored: StoredCut,
    /// What reading the sweep had to say.
    pub(crate) warnings: Vec<String>,
}

/// What a save holds of a cut that waits: the rest is in the scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct StoredCut {
    /// Which `[[cut]]` it is, from zero.
    index: usize,
    surface: SweepData,
}

/// Reads the sweeps of a scene, in order of their time (of the scene, for the same time).
pub(crate) fn read<const N: usize>(scene: &Scene) -> Result<Vec<PendingCut>, EngineError> {
    let mut cuts = Vec::with_capacity(scene.cut.len());
    for (index, spec) in scene.cut.iter().enumerate() {
        let Some(sweep) = &spec.sweep else { continue };
        let read = io::read_sweep(scene.source.resolve(sweep));
        let surface = read.map_err(|e| scene.source.file_error("cut", index, "sweep", &e))?;
        cuts.push(StoredCut { index, surface });
    }
    of::<N>(scene, cuts)
}

/// Cuts of a scene whose sweeps have been read, in order of their time.
pub(crate) fn of<const N: usize>(scene: &Scene, stored: Vec<StoredCut>) -> Result<Vec<PendingCut>, EngineError> {
    let mut cuts = Vec::with_capacity(stored.len());
    for stored in stored {
        let i = stored.index;
        let spec = scene
            .cut
            .get(i)
            .and_then(|spec| Some((spec, spec.sweep.as_ref()?.display())));
        let Some((spec, file)) = spec else {
            return Err(scene.source.error("cut", i, "", "there is no such cut"));
        };
        let (sweep, warnings) = sweep_for::<N>(stored.surface.clone()).map_err(|e| {
            let message = format!("{file}: {e}");
            scene.source.error("cut", i, "sweep", message)
        })?;
        cuts.push(PendingCut {
            index: i,
            at: spec.at.unwrap_or(0.0),
            frame: spec.frame,
            sweep,
            options: spec.options(scene.model.order),
            stored,
            warnings: warnings.iter().map(|w| format!("{file}: {w}")).collect(),
        });
    }
    cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
    Ok(cuts)
}

/// The surface, or for a planar mesh the line, in a file.
///
/// # Errors
/// What is wrong with it, in words.
pub(crate) fn sweep_for<const N: usize>(data: SweepData) -> Result<(Sweep, Vec<String>), CutError> {
    match N {
        3 if data.segments.is_empty() => Err(CutError::WrongKind(
            "it holds no line segment; triangles in the plane are cut by line segments",
        )),
        3 => Sweep::from_segments(data.points, data.segments),
        _ if data.triangles.is_empty() => Err(CutError::WrongKind(
            "it holds no triangle or polygon; tetrahedra are cut by a surface",
        )),
        _ => Sweep::new(data.points, data.triangles),
    }
}

/// The name of a method in scenes.
pub(crate) fn method_name(method: Method) -> &'static str {
    let named = Method::NAMES.iter().find(|(_, m)| *m == method);
    named.map_or("", |(name, _)| name)
}

/// What the cutting crate has to say about a cut; the rest is filled in by the simulation.
pub(crate) fn record<const N: usize>(time: f64, method: Method, outcome: &CutOutcome<N>) -> CutRecord {
    let (change, report) = (&outcome.change, &outcome.report);
    CutRecord {
        at: time,
        method: method_name(method).into(),
        seconds: CutSeconds {
            find: report.find_seconds,
            remesh: report.remesh_seconds,
            improve: report.improve_seconds,
            ..CutSeconds::default()
        },
        cells_removed: change.cells_removed.len(),
        cells_added: change.cells_added.len(),
        vertices_added: change.vertices_added.len(),
        vertices_removed: change.vertices_removed.len(),
        vertices_moved: change.vertices_moved.len(),
        tree_nodes: report.tree_nodes,
        operations: report.operations,
        unfinished: report.unfinished.len(),
        area_m2: report.area,
        max_distance_to_sweep_m: report.max_distance_to_sweep,
        refused: report.refused.iter().map(ToString::to_string).collect(),
        ..CutRecord::default()
    }
}
