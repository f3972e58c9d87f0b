//! Runs a scene from beginning to end and writes its results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use kerfem_mesh::io::write_atomically;
use serde::Serialize;

use crate::output::{self, Frames, StepTable, export_system, write_state};
use crate::report::{CutRecord, MeshFigures, Seconds, SolverFigures, VerifyFigures};
use crate::{AnySimulation, Choices, EngineError, Scene, Scheme, Simulation, StepInfo};

/// How a scene is run.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Folder of the results; made if need be.
    pub folder: PathBuf,
    /// Check every invariant after each cut.
    pub verify: bool,
    /// Write the matrices at the end.
    pub export_system: bool,
    /// Stop at this time (s) if it comes before the end of the scene.
    pub until: Option<f64>,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// At the end of the scene.
    Done,
    /// Because it was asked to stop.
    Interrupted,
    /// At the end, but a check of `verify` failed.
    Broken,
}

/// `report.json`.
#[derive(Serialize)]
struct Report<'a> {
    name: &'a str,
    version: &'static str,
    threads: usize,
    time: f64,
    steps: usize,
    mesh: Meshes,
    solver: SolverFigures,
    seconds: Seconds,
    cuts: &'a [CutRecord],
    quantities: BTreeMap<String, Option<f64>>,
    choices: &'a Choices,
    warnings: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    verify: Option<&'a VerifyFigures>,
    /// Why the run did not reach its end, if it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    stopped: Option<String>,
}

#[derive(Serialize)]
struct Meshes {
    initial: MeshFigures,
    r#final: MeshFigures,
}

/// Runs a scene; `after_step` sees each step and says whether to go on.
///
/// Writes `frames/`, `NAME.pvd`, `steps.csv` as it goes, and `final.vtu`, `report.json` at the end, however it ends.
///
/// # Errors
/// [`EngineError`]; what was written before can be read.
pub fn run(
    scene: Scene,
    options: &RunOptions,
    after_step: impl FnMut(&StepInfo) -> bool,
) -> Result<Ending, EngineError> {
    let clock = Instant::now();
    match AnySimulation::new(scene)? {
        AnySimulation::Solid(simulation) => run_to_end(simulation, clock, options, after_step),
        AnySimulation::Planar(simulation) => run_to_end(simulation, clock, options, after_step),
    }
}

fn run_to_end<const N: usize>(
    mut simulation: Simulation<N>,
    clock: Instant,
    options: &RunOptions,
    mut after_step: impl FnMut(&StepInfo) -> bool,
) -> Result<Ending, EngineError> {
    simulation.record_figures(true);
    simulation.verify(options.verify);
    output::make_folder(&options.folder)?;
    let initial = simulation.mesh_figures();
    let result = advance(&mut simulation, options, &mut after_step);
    simulation.note_verification(None);
    let start = Instant::now();
    write_state(&options.folder.join("final.vtu"), &simulation)?;
    if options.export_system {
        export_system(&options.folder, &simulation)?;
    }
    simulation.seconds.write += start.elapsed().as_secs_f64();
    simulation.seconds.total = clock.elapsed().as_secs_f64();
    let stopped = match &result {
        Ok(Ending::Interrupted) => Some("interrupted".into()),
        Ok(_) => None,
        Err(e) => Some(e.to_string()),
    };
    write_report(&options.folder, &simulation, initial, stopped)?;
    let broken = simulation.verification().is_some_and(|v| !v.is_ok());
    match result? {
        Ending::Done if broken => Ok(Ending::Broken),
        ending => Ok(ending),
    }
}

fn advance<const N: usize>(
    simulation: &mut Simulation<N>,
    options: &RunOptions,
    after_step: &mut impl FnMut(&StepInfo) -> bool,
) -> Result<Ending, EngineError> {
    let folder = &options.folder;
    let mut table = StepTable::new(folder, simulation)?;
    let mut frames = Frames::new(folder, &simulation.scene.name, simulation.scene.output.every)?;
    let time = simulation.scene.time.clone();
    let last = time.end.unwrap_or(0.0);
    let end = options.until.map_or(last, |until| until.min(last));
    let steps_in_time = matches!(time.scheme, Scheme::BackwardEuler | Scheme::Midpoint);
    let dt = if steps_in_time { time.dt.unwrap_or(last) } else { end };
    let slack = 1e-9 * dt;
    if steps_in_time {
        write_frame(simulation, &mut frames, slack)?;
    }
    let mut first = true;
    let mut ending = Ending::Done;
    let result = loop {
        let left = end - simulation.state.time;
        if (!first || steps_in_time) && left <= slack {
            break Ok(());
        }
        first = false;
        // the last step is shortened to hit the end
        let step = if left < dt - slack { left } else { dt };
        let info = match simulation.step(step) {
            Ok(info) => info,
            Err(error) => break Err(error),
        };
        let clock = simulation.seconds.write;
        write_frame(simulation, &mut frames, slack)?;
        table.add(simulation, &info, simulation.seconds.write - clock)?;
        if !after_step(&info) {
            ending = Ending::Interrupted;
            break Ok(());
        }
    };
    frames.write_list()?;
    if result.is_ok() && ending == Ending::Done {
        let late: Vec<f64> = simulation.pending.iter().map(|c| c.at).collect();
        for at in late {
            simulation.warn(format!(
                "the cut at {at} s was not made: the run ended at {} s",
                simulation.state.time
            ));
        }
    }
    result.map(|()| ending)
}

fn write_frame<const N: usize>(
    simulation: &mut Simulation<N>,
    frames: &mut Frames,
    slack: f64,
) -> Result<(), EngineError> {
    let clock = Instant::now();
    frames.offer(simulation, slack)?;
    simulation.seconds.write += clock.elapsed().as_secs_f64();
    Ok(())
}

fn write_report<const N: usize>(
    folder: &Path,
    simulation: &Simulation<N>,
    initial: MeshFigures,
    stopped: Option<String>,
) -> Result<(), EngineError> {
    let report = Report {
        name: &simulation.scene.name,
        version: env!("CARGO_PKG_VERSION"),
        threads: rayon::current_num_threads(),
        time: simulation.state.time,
        steps: simulation.state.step,
        mesh: Meshes {
            initial,
            r#final: simulation.mesh_figures(),
        },
        solver: simulation.solver_figures,
        seconds: simulation.seconds,
        cuts: &simulation.cuts,
        quantities: simulation.quantities(),
        choices: &simulation.choices,
        warnings: &simulation.warnings,
        verify: simulation.verification(),
        stopped,
    };
    let written = write_atomically(folder.join("report.json"), |out| {
        serde_json::to_writer_pretty(&mut *out, &report)?;
        writeln!(out)
    });
    written.map_err(EngineError::Write)
}
