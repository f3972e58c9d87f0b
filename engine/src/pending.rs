//! Cuts of a scene that wait for their time, and what is recorded of one.

use kerfem_cutting::{CutOptions, CutOutcome, Method, Sweep};
use kerfem_mesh::io;

use crate::report::{CutRecord, CutSeconds};
use crate::{EngineError, Frame, MethodName, Scene};

/// A cut to be made at a time.
#[derive(Debug)]
pub(crate) struct PendingCut {
    pub(crate) at: f64,
    pub(crate) frame: Frame,
    pub(crate) sweep: Sweep,
    pub(crate) options: CutOptions,
    /// What reading the sweep had to say.
    pub(crate) warnings: Vec<String>,
}

/// Reads the sweeps of a scene, in order of their time (of the scene, for the same time).
pub(crate) fn read(scene: &Scene) -> Result<Vec<PendingCut>, EngineError> {
    let mut cuts = Vec::with_capacity(scene.cut.len());
    for (i, spec) in scene.cut.iter().enumerate() {
        let data = io::read_sweep(scene.source.resolve(&spec.sweep)).map_err(EngineError::Read)?;
        let sweep = Sweep::new(data.points, data.triangles);
        let (sweep, warnings) = sweep.map_err(|e| {
            let message = format!("{}: {e}", spec.sweep.display());
            scene.source.error("cut", i, "sweep", message)
        })?;
        let method = match spec.method {
            MethodName::Delete => Method::Delete,
            MethodName::Subdivide => Method::Subdivide,
            MethodName::Snap => Method::Snap,
            MethodName::Hybrid => Method::Hybrid,
        };
        cuts.push(PendingCut {
            at: spec.at,
            frame: spec.frame,
            sweep,
            options: CutOptions {
                method,
                snap: spec.snap,
            },
            warnings: warnings
                .iter()
                .map(|w| format!("{}: {w}", spec.sweep.display()))
                .collect(),
        });
    }
    cuts.sort_by(|a, b| a.at.total_cmp(&b.at));
    Ok(cuts)
}

/// What the cutting crate has to say about a cut; the rest is filled in by the simulation.
pub(crate) fn record(time: f64, method: Method, outcome: &CutOutcome) -> CutRecord {
    let (change, report) = (&outcome.change, &outcome.report);
    let name = Method::NAMES
        .iter()
        .find(|(_, m)| *m == method)
        .map_or("", |(name, _)| name);
    CutRecord {
        at: time,
        method: name.into(),
        seconds: CutSeconds {
            find: report.find_seconds,
            remesh: report.remesh_seconds,
            ..CutSeconds::default()
        },
        cells_removed: change.cells_removed.len(),
        cells_added: change.cells_added.len(),
        vertices_added: change.vertices_added.len(),
        vertices_removed: change.vertices_removed.len(),
        vertices_moved: change.vertices_moved.len(),
        tree_nodes: report.tree_nodes,
        area_m2: report.area,
        max_distance_to_sweep_m: report.max_distance_to_sweep,
        refused: report.refused.iter().map(ToString::to_string).collect(),
        ..CutRecord::default()
    }
}
