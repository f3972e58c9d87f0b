//! Studies: a grid of settings of a scene, the error of what is measured, and the time it took.
//!
//! [`Study::read`] reads a `STUDY.toml`; [`run`] makes its runs, in turns where they are repeated, so that what disturbs the clock
//! disturbs all alike, and writes `study.csv`, `chart.svg`, `chart.png` and `index.html`. Each run is noted in `runs.jsonl` when it is
//! done: the same call goes on where an earlier one was interrupted. A run that fails is a row with its reason.

mod fields;
mod grid;
mod journal;
mod measured;
mod page;
mod pictures;
mod results;
mod spec;
mod validate;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

pub use grid::Point;
pub use results::{Figure, Row};
pub use spec::{Chart, Measure, Reference, Study, Take};
pub use validate::{Verdict, validate, verdict_table};

use crate::{EngineError, chart, output};
use journal::{Journal, Record};

/// How a study is made.
#[derive(Clone, Debug, Default)]
pub struct StudyOptions {
    /// Folder of the results; made if need be.
    pub folder: PathBuf,
    /// Runs at a time, one thread each; one at a time, with all threads, where it is 0 or 1. Time is measured best alone.
    pub parallel: usize,
}

/// How far a study has come.
#[derive(Clone, Copy, Debug)]
pub struct Progress<'a> {
    /// Runs done, those of an earlier call included.
    pub done: usize,
    /// All runs.
    pub runs: usize,
    /// The settings of the last one.
    pub point: &'a Point,
}

impl Progress<'_> {
    /// The settings of the last run, in words.
    pub fn settings(&self) -> String {
        self.point
            .labels(self.point.settings.iter().map(|(k, _)| k.as_str()))
            .join(", ")
    }
}

/// Makes the runs of a study that are not yet made, then its table, its charts and its page; none if `go_on` said to stop before.
///
/// # Errors
/// [`EngineError`] of the files of the study; what a run does not survive is a row of the table.
pub fn run(
    study: &Study,
    options: &StudyOptions,
    go_on: &(dyn Fn() -> bool + Sync),
    tell: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<Vec<Row>>, EngineError> {
    let folder = &options.folder;
    output::open_folder(folder)?;
    let points = grid::points(study)?;
    let (mut journal, mut records) = Journal::open(folder, study)?;
    let all = (0..study.repeats()).flat_map(|repeat| (0..points.len()).map(move |point| [point, repeat]));
    let runs = study.repeats() * points.len();
    let is_done = |[point, repeat]: &[usize; 2]| records.iter().any(|r| r.point == *point && r.repeat == *repeat);
    let left: Vec<[usize; 2]> = all.filter(|task| !is_done(task)).collect();
    let make = |task: [usize; 2]| measured::make(study, &points[task[0]], task, folder, go_on);
    let mut keep = |record: Record| {
        journal.add(&record)?;
        let point = &points[record.point];
        records.push(record);
        tell(Progress {
            done: records.len(),
            runs,
            point,
        });
        Ok(())
    };
    let complete = match options.parallel {
        0 | 1 => one_by_one(&left, make, go_on, &mut keep)?,
        workers => side_by_side(&left, workers, make, go_on, &mut keep)?,
    };
    if !complete {
        return Ok(None);
    }
    let rows = results::rows(study, &points, &records, folder)?;
    results::write_table(study, &rows, folder)?;
    let panels = pictures::panels(study, &rows);
    chart::write(&folder.join("chart"), &panels, if panels.len() == 1 { 1 } else { 2 })?;
    page::write(study, &rows, folder)?;
    Ok(Some(rows))
}

type Made = Result<Option<Record>, EngineError>;

/// Whether all were made.
fn one_by_one(
    tasks: &[[usize; 2]],
    make: impl Fn([usize; 2]) -> Made,
    go_on: &dyn Fn() -> bool,
    keep: &mut dyn FnMut(Record) -> Result<(), EngineError>,
) -> Result<bool, EngineError> {
    for task in tasks {
        if !go_on() {
            return Ok(false);
        }
        match make(*task)? {
            Some(record) => keep(record)?,
            None => return Ok(false),
        }
    }
    Ok(true)
}

/// [`one_by_one`] by several workers, of one thread each.
fn side_by_side(
    tasks: &[[usize; 2]],
    workers: usize,
    make: impl Fn([usize; 2]) -> Made + Sync,
    go_on: &(dyn Fn() -> bool + Sync),
    keep: &mut dyn FnMut(Record) -> Result<(), EngineError>,
) -> Result<bool, EngineError> {
    let (next, stop) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, made) = mpsc::channel::<Made>();
    std::thread::scope(|scope| {
        for _ in 0..workers.min(tasks.len()) {
            let (sender, next, stop, make) = (sender.clone(), &next, &stop, &make);
            scope.spawn(move || {
                let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else {
                    return;
                };
                while let Some(task) = tasks.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if stop.load(Ordering::Relaxed) || !go_on() || sender.send(pool.install(|| make(*task))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let mut count = 0;
        for made in made {
            let kept = made.and_then(|record| match record {
                Some(record) => keep(record).map(|()| 1),
                None => Ok(0),
            });
            match kept {
                Ok(one) => count += one,
                Err(e) => {
                    stop.store(true, Ordering::Relaxed);
                    return Err(e);
                }
            }
        }
        Ok(count == tasks.len())
    })
}
