//! One run of a study, and the numbers that are taken of it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use kerfem_mesh::io::IoError;
use nalgebra::Vector3;
use serde_json::Value;
use toml::Table;

use super::grid::Point;
use super::journal::Record;
use super::spec::{Measure, Study, Take};
use crate::run::{Ending, RunOptions};
use crate::{EngineError, modes, run};

/// The folder of a point of the grid.
pub(super) fn folder_of(folder: &Path, point: usize) -> PathBuf {
    folder.join("runs").join(format!("{point:05}"))
}

/// Makes a run; none if it was interrupted. What the run itself does not survive is part of its record.
///
/// # Errors
/// Files that cannot be written.
pub(super) fn make(
    study: &Study,
    point: &Point,
    [number, repeat]: [usize; 2],
    folder: &Path,
    go_on: &dyn Fn() -> bool,
) -> Result<Option<Record>, EngineError> {
    let folder = folder_of(folder, number);
    let mut record = Record {
        point: number,
        repeat,
        ..Record::default()
    };
    match attempt(study, point, &folder, &mut record, go_on) {
        Ok(true) => {}
        Ok(false) => return Ok(None),
        Err(e @ (EngineError::Write(_) | EngineError::Folder(_))) => return Err(e),
        Err(e) => record.failed = Some(e.to_string()),
    }
    Ok(Some(record))
}

/// Whether the run was not interrupted.
fn attempt(
    study: &Study,
    point: &Point,
    folder: &Path,
    record: &mut Record,
    go_on: &dyn Fn() -> bool,
) -> Result<bool, EngineError> {
    let count = study.measure.iter().filter_map(|m| m.frequency).max();
    if let Some(count) = count {
        let clock = Instant::now();
        let (figures, _) = modes::write(study.scene_of(point, &Table::new())?, count, &folder.join("modes"))?;
        record.seconds = clock.elapsed().as_secs_f64();
        for measure in &study.measure {
            let Some(number) = measure.frequency else { continue };
            let value = figures.frequencies_hz.get(number - 1).copied();
            record
                .values
                .insert(measure.name.clone(), value.map(|v| measure.transformed(v)));
        }
    }
    if study.measure.iter().all(|m| m.frequency.is_some()) {
        return Ok(true);
    }
    let Some(files) = Files::of_run(study, point, &Table::new(), folder, go_on)? else {
        return Ok(false);
    };
    let figure = |path: &str| files.figure(path).unwrap_or(0.0);
    record.seconds += figure("seconds.total") - figure("seconds.write");
    record.cells = figure("mesh.final.cells") as usize;
    record.steps = figure("steps") as usize;
    record.iterations = figure("solver.iterations_total") as usize;
    record.dofs = files.column("dofs", Take::Last).unwrap_or(0.0) as usize;
    for (k, measure) in study.measure.iter().enumerate() {
        if measure.field.is_some() || measure.frequency.is_some() {
            continue;
        }
        let mut value = files.number(measure);
        if !measure.with.is_empty() && record.repeat == 0 {
            let other = folder.join(format!("with_{k}"));
            let Some(other) = Files::of_run(study, point, &measure.with, &other, go_on)? else {
                return Ok(false);
            };
            let difference = |a: f64, b: f64| (b - a) / measure.over.unwrap_or(1.0);
            value = value.zip(other.number(measure)).map(|(a, b)| difference(a, b));
        }
        record
            .values
            .insert(measure.name.clone(), value.map(|v| measure.transformed(v)));
    }
    Ok(true)
}

impl Measure {
    fn transformed(&self, number: f64) -> f64 {
        let formula = self.value.as_ref();
        formula.map_or(number, |f| f.value(&Vector3::new(number, 0.0, 0.0), 0.0))
    }
}

/// What a run has written.
struct Files {
    report: Value,
    columns: BTreeMap<String, Vec<f64>>,
}

impl Files {
    /// Runs a scene into a folder, and keeps its last state, its report and its table of steps. None: interrupted.
    fn of_run(
        study: &Study,
        point: &Point,
        more: &Table,
        folder: &Path,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<Files>, EngineError> {
        let mut scene = study.scene_of(point, more)?;
        // nobody looks at the frames of a study
        scene.output.every = scene.time.end.filter(|end| *end > 0.0);
        let name = scene.name.clone();
        let options = RunOptions {
            folder: folder.to_owned(),
            ..RunOptions::default()
        };
        let ended = run::run(scene, &options, |_| go_on());
        for left in ["frames", "surface"] {
            let _ = std::fs::remove_dir_all(folder.join(left));
        }
        for left in [
            "state.kerfem".into(),
            format!("{name}.pvd"),
            format!("{name}_surface.pvd"),
        ] {
            let _ = std::fs::remove_file(folder.join(left));
        }
        match ended? {
            Ending::Interrupted => Ok(None),
            Ending::Done | Ending::Broken => Self::read(folder).map(Some),
        }
    }

    fn read(folder: &Path) -> Result<Files, EngineError> {
        let failed = |path: &Path, source: std::io::Error| {
            let path = path.into();
            EngineError::Read(IoError::Read { path, source })
        };
        let path = folder.join("report.json");
        let bytes = std::fs::read(&path).map_err(|e| failed(&path, e))?;
        let report = serde_json::from_slice(&bytes).map_err(|e| failed(&path, e.into()))?;
        let path = folder.join("steps.csv");
        let table = |e: csv::Error| failed(&path, e.into());
        let mut reader = csv::Reader::from_path(&path).map_err(table)?;
        let names: Vec<String> = reader.headers().map_err(table)?.iter().map(str::to_owned).collect();
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for row in reader.records() {
            for (name, field) in names.iter().zip(&row.map_err(table)?) {
                columns
                    .entry(name.clone())
                    .or_default()
                    .push(field.parse().unwrap_or(f64::NAN));
            }
        }
        Ok(Files { report, columns })
    }

    /// A number of the report, by names and numbers with dots between them.
    fn figure(&self, path: &str) -> Option<f64> {
        let step = |value: &Value, part: &str| match value {
            Value::Array(list) => list.get(part.parse::<usize>().ok()?).cloned(),
            other => other.get(part).cloned(),
        };
        path.split('.')
            .try_fold(self.report.clone(), |v, part| step(&v, part))?
            .as_f64()
    }

    /// A column of the table of steps, or the sum of several.
    fn column(&self, names: &str, take: Take) -> Option<f64> {
        let columns = names.split('+').map(|name| self.columns.get(name.trim()));
        let columns: Vec<&Vec<f64>> = columns.collect::<Option<_>>()?;
        let rows = 0..columns.first()?.len();
        let sums = rows.map(|k| columns.iter().map(|c| c[k]).sum::<f64>());
        let sums: Vec<f64> = sums.filter(|v| !v.is_nan()).collect();
        let (first, last) = (*sums.first()?, *sums.last()?);
        let extremes = sums.iter().fold((first, first), |(a, b), v| (a.min(*v), b.max(*v)));
        Some(match take {
            Take::Last => last,
            Take::First => first,
            Take::Max => extremes.1,
            Take::Min => extremes.0,
            Take::Spread => extremes.1 - extremes.0,
            Take::Growth => extremes.1 / first,
        })
    }

    fn number(&self, measure: &Measure) -> Option<f64> {
        match (&measure.quantity, &measure.report, &measure.steps) {
            // a quantity may be called anything
            (Some(name), ..) => self.report.get("quantities")?.get(name)?.as_f64(),
            (_, Some(path), _) => self.figure(path),
            (.., Some(names)) => self.column(names, measure.take),
            _ => None,
        }
    }
}
