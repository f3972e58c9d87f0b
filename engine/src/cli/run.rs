//! `kerfem run`.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use kerfem_engine::run::{Closing, Ending, RunOptions, run_and_tell};
use kerfem_engine::{EngineError, Scene, StepInfo};

use super::RunArguments;
use super::arguments::{bad, start_threads};

/// Exit code after Ctrl-C.
pub(super) const INTERRUPTED: u8 = 130;

pub(super) fn run(arguments: &RunArguments, logs: bool) -> Result<u8, EngineError> {
    start_threads(arguments.threads)?;
    let scene = Scene::read(&arguments.scene)?;
    let options = RunOptions {
        folder: arguments
            .output
            .clone()
            .unwrap_or_else(|| Path::new("out").join(&scene.name)),
        verify: arguments.verify,
        export_system: arguments.export_system,
        until: arguments.until,
        resume: arguments.resume,
        save_every: Some(arguments.save_every),
    };
    let stop = stop_on_interrupt()?;
    let bar = progress_bar(&scene, arguments, logs);
    let after_step = |info: &StepInfo| {
        if let Some(bar) = &bar {
            let missed = if info.converged { "" } else { ", tolerance missed" };
            bar.set_position(info.step as u64);
            bar.set_message(format!(
                "t = {:.6} s, {} iterations{missed}",
                info.time, info.iterations
            ));
        }
        !stop.load(Ordering::Relaxed)
    };
    let ending = run_and_tell(scene, &options, after_step, |closing| {
        if let Some(bar) = &bar {
            bar.finish_and_clear();
        }
        if !arguments.quiet {
            closing.warnings.iter().for_each(|w| eprintln!("kerfem: warning: {w}"));
            say!("{}: {}", options.folder.display(), told(closing));
        }
    });
    let ending = ending.map_err(|e| match e {
        EngineError::Folder(_) if arguments.output.is_some() => bad("--output", e.to_string()),
        e => e,
    });
    match ending? {
        Ending::Done => Ok(0),
        Ending::Interrupted => {
            if !arguments.quiet {
                eprintln!("kerfem: interrupted; the same call with --resume goes on");
            }
            Ok(INTERRUPTED)
        }
        Ending::Broken => {
            eprintln!(
                "kerfem: a check of --verify failed; see verify in {}",
                options.folder.join("report.json").display()
            );
            Ok(1)
        }
    }
}

/// What a run has come to, in one line.
fn told(closing: &Closing<'_>) -> String {
    let mut line = format!("{} steps, t = {} s", closing.steps, closing.time);
    if let Some(start) = closing.resumed_at {
        line += &format!(", resumed at t = {start} s");
    }
    let without = closing
        .cuts
        .iter()
        .filter(|c| c.area_m2 == 0.0 && c.cells_removed == 0)
        .count();
    line += &format!(", {} cuts", closing.cuts.len());
    if without > 0 {
        line += &format!(" ({without} without effect)");
    }
    line += &format!(", {} pieces", closing.pieces);
    let solver = &closing.solver;
    if solver.unconverged_steps > 0 {
        line += &format!(
            ", {} steps missed the tolerance (residuals up to {:.1e})",
            solver.unconverged_steps, solver.residual_max
        );
    }
    if let Some(found) = closing.verification {
        line += &format!(", verify: {}", found.invariants);
    }
    line
}

/// Set by Ctrl-C and by signals that end a program: the frame is finished and the files are closed first.
pub(super) fn stop_on_interrupt() -> Result<Arc<AtomicBool>, EngineError> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&stop);
    ctrlc::set_handler(move || seen.store(true, Ordering::Relaxed)).map_err(|e| bad("Ctrl-C", e.to_string()))?;
    Ok(stop)
}

/// A bar on a terminal, unless lines of a log would cross it.
fn progress_bar(scene: &Scene, arguments: &RunArguments, logs: bool) -> Option<ProgressBar> {
    if arguments.quiet || logs || !std::io::stderr().is_terminal() {
        return None;
    }
    let end = scene.time.end.unwrap_or(0.0);
    let end = arguments.until.map_or(end, |until| until.min(end));
    let steps = scene.time.dt.map_or(1.0, |dt| (end / dt).ceil().max(1.0));
    let bar = ProgressBar::new(steps as u64);
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg} {eta}") {
        bar.set_style(style);
    }
    Some(bar)
}
