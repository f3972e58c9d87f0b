//! Runs a scene from beginning to end and writes its results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use kerfem_mesh::io::write_atomically;
use serde::{Deserialize, Serialize};

use crate::output::{self, FrameList, Frames, StepTable, export_system, write_state};
use crate::report::{CutRecord, MeshFigures, Seconds, SolverFigures, VerifyFigures};
use crate::{AnySimulation, Choices, EngineError, Scene, Simulation, StepInfo};

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
    /// Go on from the save in the folder instead of beginning anew.
    pub resume: bool,
    /// Time by the clock between saves (zero: after each step); `None`: only the last state is saved.
    pub save_every: Option<Duration>,
}

/// The save of a run, in its folder.
const SAVE: &str = "state.kerfem";

/// Of the volume of the body: how much of it may lie twice before that is worth a warning.
const OVERLAP: f64 = 1e-3;

/// How far a run has come, besides the state of its simulation.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Progress {
    /// The mesh at the beginning.
    initial: MeshFigures,
    frames: FrameList,
    /// Length of `steps.csv`.
    table_bytes: u64,
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
    /// Volume in which the deformed body lies twice at the end.
    overlap_m3: f64,
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

/// What a run has come to, for whoever tells it.
#[derive(Clone, Copy, Debug)]
pub struct Closing<'a> {
    /// Time it began at, if it went on from a save (s).
    pub resumed_at: Option<f64>,
    /// Time it has come to (s).
    pub time: f64,
    /// Steps done, those before a save included.
    pub steps: usize,
    /// Cuts made, those without effect included.
    pub cuts: &'a [CutRecord],
    /// Pieces of the body, connected through facets.
    pub pieces: usize,
    /// Figures of the solver.
    pub solver: SolverFigures,
    /// What `verify` found, if it was asked for.
    pub verification: Option<&'a VerifyFigures>,
    /// What the user should know.
    pub warnings: &'a [String],
}

/// Runs a scene; `after_step` sees each step and says whether to go on.
///
/// Writes `frames/`, `NAME.pvd` (and `surface/`, `NAME_surface.pvd`), `steps.csv` and saves as it goes, and `final.vtu`,
/// `report.json` at the end, however it ends. A run that goes on from a save gives the same bits as one that was never
/// interrupted (seconds aside); its scene may differ in `[time]`, `[solver]`, `[output]` and `[[quantity]]`.
///
/// # Errors
/// [`EngineError`]; what was written before can be read.
pub fn run(
    scene: Scene,
    options: &RunOptions,
    after_step: impl FnMut(&StepInfo) -> bool,
) -> Result<Ending, EngineError> {
    run_and_tell(scene, options, after_step, |_| {})
}

/// [`run`]; once all is written, `tell` hears what it has come to, however it ended.
///
/// # Errors
/// As [`run`].
pub fn run_and_tell(
    scene: Scene,
    options: &RunOptions,
    after_step: impl FnMut(&StepInfo) -> bool,
    tell: impl FnOnce(&Closing<'_>),
) -> Result<Ending, EngineError> {
    let clock = Instant::now();
    let (simulation, progress) = match options.resume {
        true => {
            let path = options.folder.join(SAVE);
            if !path.exists() {
                return Err(EngineError::Scene {
                    place: path.display().to_string(),
                    message: "there is no save to go on from; without --resume the run begins anew".into(),
                });
            }
            let (simulation, progress) = AnySimulation::restore_with(&path, |saved| scene.resuming(&saved))?;
            (simulation, Some(progress))
        }
        false => (AnySimulation::new(scene)?, None),
    };
    match simulation {
        AnySimulation::Solid(simulation) => run_to_end(simulation, progress, clock, options, after_step, tell),
        AnySimulation::Planar(simulation) => run_to_end(simulation, progress, clock, options, after_step, tell),
    }
}

fn run_to_end<const N: usize>(
    mut simulation: Simulation<N>,
    progress: Option<Progress>,
    clock: Instant,
    options: &RunOptions,
    mut after_step: impl FnMut(&StepInfo) -> bool,
    tell: impl FnOnce(&Closing<'_>),
) -> Result<Ending, EngineError> {
    let resumed_at = progress.is_some().then_some(simulation.state.time);
    simulation.record_figures(true);
    if simulation.verification().is_none() || !options.verify {
        simulation.verify(options.verify);
    }
    output::open_folder(&options.folder)?;
    let earlier = simulation.seconds.total;
    let mut writers = Writers::open(&simulation, progress, options)?;
    let result = advance(&mut simulation, &mut writers, options, &mut after_step);
    let overlap = simulation.overlap();
    let volume = simulation.thickness() * kerfem_mesh::quality::volume(&simulation.mesh);
    if matches!(result, Ok(Ending::Done)) && overlap > OVERLAP * volume {
        simulation.warn(format!(
            "cut faces went through each other: {overlap:.3e} m3 of the body lie twice at the end, as nothing keeps them apart"
        ));
    }
    simulation.note_verification(None);
    let start = Instant::now();
    write_state(&options.folder.join("final.vtu"), &simulation)?;
    if options.export_system {
        export_system(&options.folder, &simulation)?;
    }
    simulation.seconds.write += start.elapsed().as_secs_f64();
    simulation.seconds.total = earlier + clock.elapsed().as_secs_f64();
    writers.save(&simulation)?;
    let stopped = match &result {
        Ok(Ending::Interrupted) => Some("interrupted".into()),
        Ok(_) => None,
        Err(e) => Some(e.to_string()),
    };
    write_report(&options.folder, &simulation, writers.initial, overlap, stopped)?;
    tell(&Closing {
        resumed_at,
        time: simulation.state.time,
        steps: simulation.state.step,
        cuts: &simulation.cuts,
        pieces: simulation.mesh.pieces().1,
        solver: simulation.solver_figures,
        verification: simulation.verification(),
        warnings: &simulation.warnings,
    });
    let broken = simulation.verification().is_some_and(|v| !v.is_ok());
    match result? {
        Ending::Done if broken => Ok(Ending::Broken),
        ending => Ok(ending),
    }
}

/// What a run writes as it goes.
struct Writers {
    frames: Frames,
    table: StepTable,
    initial: MeshFigures,
    path: PathBuf,
    save_every: Option<Duration>,
    last_save: Instant,
}

impl Writers {
    /// New files, or those of an earlier run as they were at its save.
    fn open<const N: usize>(
        simulation: &Simulation<N>,
        progress: Option<Progress>,
        options: &RunOptions,
    ) -> Result<Self, EngineError> {
        let folder = &options.folder;
        let table = match &progress {
            Some(progress) => StepTable::resumed(folder, progress.table_bytes)?,
            None => {
                // what an earlier run left would be taken for this one's if this one is killed
                [SAVE, "final.vtu", "report.json"]
                    .iter()
                    .try_for_each(|file| output::remove_file(&folder.join(file)))?;
                StepTable::new(folder, simulation)?
            }
        };
        let progress = progress.unwrap_or_else(|| Progress {
            initial: simulation.mesh_figures(),
            ..Progress::default()
        });
        let (name, output) = (&simulation.scene.name, &simulation.scene.output);
        Ok(Writers {
            frames: Frames::new(folder, name, output, progress.frames)?,
            table,
            initial: progress.initial,
            path: folder.join(SAVE),
            save_every: options.save_every,
            last_save: Instant::now(),
        })
    }

    /// Writes a frame if one is due.
    fn frame<const N: usize>(&mut self, simulation: &mut Simulation<N>, slack: f64) -> Result<(), EngineError> {
        let clock = Instant::now();
        self.frames.offer(simulation, slack)?;
        simulation.seconds.write += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// Writes a save if one is due.
    fn offer_save<const N: usize>(&mut self, simulation: &mut Simulation<N>) -> Result<(), EngineError> {
        if self.save_every.is_some_and(|every| self.last_save.elapsed() >= every) {
            let clock = Instant::now();
            self.save(simulation)?;
            simulation.seconds.write += clock.elapsed().as_secs_f64();
        }
        Ok(())
    }

    fn save<const N: usize>(&mut self, simulation: &Simulation<N>) -> Result<(), EngineError> {
        let progress = Progress {
            initial: self.initial,
            frames: self.frames.list(),
            table_bytes: self.table.bytes()?,
        };
        simulation.save_with(&self.path, &progress)?;
        self.last_save = Instant::now();
        Ok(())
    }
}

fn advance<const N: usize>(
    simulation: &mut Simulation<N>,
    writers: &mut Writers,
    options: &RunOptions,
    after_step: &mut impl FnMut(&StepInfo) -> bool,
) -> Result<Ending, EngineError> {
    let time = simulation.scene.time.clone();
    let last = time.end.unwrap_or(0.0);
    let end = options.until.map_or(last, |until| until.min(last));
    let steps_in_time = time.scheme.steps();
    let dt = if steps_in_time { time.dt.unwrap_or(last) } else { end };
    let slack = 1e-9 * dt;
    if steps_in_time && simulation.state.step == 0 {
        writers.frame(simulation, slack)?;
        if writers.save_every.is_some() {
            writers.save(simulation)?;
        }
    }
    let mut ending = Ending::Done;
    let result = loop {
        let left = end - simulation.state.time;
        if (simulation.state.step > 0 || steps_in_time) && left <= slack {
            break Ok(());
        }
        // the last step is shortened to hit the end
        let step = if left < dt - slack { left } else { dt };
        let info = match simulation.step(step) {
            Ok(info) => info,
            Err(error) => break Err(error),
        };
        let clock = simulation.seconds.write;
        writers.frame(simulation, slack)?;
        writers.table.add(simulation, &info, simulation.seconds.write - clock)?;
        writers.offer_save(simulation)?;
        if !after_step(&info) {
            ending = Ending::Interrupted;
            break Ok(());
        }
    };
    writers.frames.write_lists()?;
    if result.is_ok() && ending == Ending::Done {
        let late: Vec<f64> = simulation.pending.iter().map(|c| c.at).collect();
        for at in late {
            simulation.warn(format!(
                "the cut at {at} s was not made: the run ended at {} s",
                simulation.state.time
            ));
        }
        for text in simulation.unmoved_blades() {
            simulation.warn(text);
        }
    }
    result.map(|()| ending)
}

fn write_report<const N: usize>(
    folder: &Path,
    simulation: &Simulation<N>,
    initial: MeshFigures,
    overlap: f64,
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
        overlap_m3: overlap,
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
