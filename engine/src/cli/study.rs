//! `kerfem study` and `kerfem validate`.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use indicatif::{ProgressBar, ProgressStyle};
use kerfem_engine::EngineError;
use kerfem_engine::study::{Progress, Row, Study, StudyOptions, Verdict, run, validate, verdict_table};
use kerfem_mesh::io::write_atomically;

use super::arguments::{bad, start_threads};
use super::run::{INTERRUPTED, stop_on_interrupt};
use super::{StudyArguments, ValidateArguments};

/// Where the cases are, from the root of the project.
const CASES: &str = "validation/cases";

pub(super) fn study(arguments: &StudyArguments) -> Result<u8, EngineError> {
    start_threads(arguments.threads)?;
    let study = Study::read(&arguments.study)?;
    let options = StudyOptions {
        folder: arguments
            .output
            .clone()
            .unwrap_or_else(|| Path::new("out").join(&study.name)),
        parallel: arguments.parallel,
    };
    let stop = stop_on_interrupt()?;
    let bar = progress_bar(arguments.quiet);
    let go_on = || !stop.load(Ordering::Relaxed);
    let rows = run(&study, &options, &go_on, &mut |progress| show(&bar, "", progress))?;
    bar.finish_and_clear();
    let Some(rows) = rows else {
        if !arguments.quiet {
            eprintln!("kerfem: interrupted; the same call goes on");
        }
        return Ok(INTERRUPTED);
    };
    if !arguments.quiet {
        say!("{}: {}", options.folder.display(), told(&rows));
        say!("the page is {}", options.folder.join("index.html").display());
    }
    Ok(0)
}

/// What a study has come to, in one line.
fn told(rows: &[Row]) -> String {
    let failed: Vec<&Row> = rows.iter().filter(|r| r.failed.is_some()).collect();
    let seconds: f64 = rows.iter().map(|r| r.seconds).sum();
    let mut line = format!("{} runs, {seconds:.1} s of them once", rows.len());
    if let Some(reason) = failed.first().and_then(|r| r.failed.as_ref()) {
        line += &format!("; {} failed, the first: {reason}", failed.len());
    }
    line
}

pub(super) fn validate_cases(arguments: &ValidateArguments) -> Result<u8, EngineError> {
    start_threads(arguments.threads)?;
    let cases = chosen(arguments)?;
    let folder = arguments
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from("out/validate"));
    let stop = stop_on_interrupt()?;
    let bar = progress_bar(arguments.quiet);
    let go_on = || !stop.load(Ordering::Relaxed);
    let mut verdicts: Vec<Verdict> = Vec::new();
    for path in &cases {
        let study = Study::read(path)?;
        let own = folder.join(&study.name);
        match validate(&study, &own, &go_on, &mut |progress| show(&bar, &study.name, progress))? {
            Some(found) => verdicts.extend(found),
            None => {
                bar.finish_and_clear();
                return Ok(INTERRUPTED);
            }
        }
    }
    bar.finish_and_clear();
    let table = verdict_table(&verdicts);
    let written = write_atomically(folder.join("validation.md"), |out| out.write_all(table.as_bytes()));
    written.map_err(EngineError::Write)?;
    let missed = verdicts.iter().filter(|v| !v.is_met()).count();
    if !arguments.quiet {
        say!("{}", table.trim_end());
        say!(
            "{} cases, {} figures, {missed} missed; fields and errors are in {}",
            cases.len(),
            verdicts.len(),
            folder.display()
        );
    }
    Ok(u8::from(missed > 0))
}

/// The files of the cases asked for, in the order of their names.
fn chosen(arguments: &ValidateArguments) -> Result<Vec<PathBuf>, EngineError> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(CASES);
    let folder = arguments
        .cases
        .clone()
        .unwrap_or_else(|| match Path::new(CASES).is_dir() {
            true => CASES.into(),
            false => beside,
        });
    let nothing = |e: String| {
        let message = format!(
            "{}: {e}; a folder with cases (*.study.toml) is needed",
            folder.display()
        );
        bad("--cases", message)
    };
    let entries = std::fs::read_dir(&folder).map_err(|e| nothing(e.to_string()))?;
    let name = |path: &Path| {
        let file = path.file_name()?.to_str()?;
        file.strip_suffix(".study.toml").map(str::to_owned)
    };
    let mut known: Vec<(String, PathBuf)> = Vec::new();
    for entry in entries {
        let path = entry.map_err(|e| nothing(e.to_string()))?.path();
        known.extend(name(&path).map(|n| (n, path)));
    }
    known.sort();
    if known.is_empty() {
        return Err(nothing("it holds none".into()));
    }
    let names = || known.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(", ");
    let find = |asked: &String| {
        let found = known.iter().find(|(n, _)| n == asked);
        found
            .map(|(_, path)| path.clone())
            .ok_or_else(|| bad("CASE", format!("\"{asked}\" is not accepted; accepted: {}", names())))
    };
    match arguments.case.is_empty() {
        true => Ok(known.into_iter().map(|(_, path)| path).collect()),
        false => arguments.case.iter().map(find).collect(),
    }
}

/// A bar on a terminal.
fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg} {eta}") {
        bar.set_style(style);
    }
    bar
}

fn show(bar: &ProgressBar, case: &str, progress: Progress<'_>) {
    bar.set_length(progress.runs as u64);
    bar.set_position(progress.done as u64);
    bar.set_message(format!("{case} {}", progress.settings()));
}
