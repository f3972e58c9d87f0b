//! The table of a study: one row a run, with errors against references.

use std::collections::BTreeMap;
use std::path::Path;

use kerfem_mesh::io::{IoError, write_atomically};
use toml::Value;

use super::fields::{Known, difference};
use super::grid::{Point, label};
use super::journal::Record;
use super::measured::folder_of;
use super::spec::{Measure, Reference, Study, is_of_scene};
use crate::EngineError;

/// One combination of settings, measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Keys and values.
    pub point: Point,
    /// The median over the repeats, files left out.
    pub seconds: f64,
    /// The least over the repeats.
    pub seconds_min: f64,
    /// Iterations of the linear solver, all steps.
    pub iterations: usize,
    /// Degrees of freedom at the end.
    pub dofs: usize,
    /// Cells at the end.
    pub cells: usize,
    /// Steps.
    pub steps: usize,
    /// One for each measure.
    pub figures: Vec<Figure>,
    /// Why the run did not reach its end.
    pub failed: Option<String>,
}

/// What a measure has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figure {
    /// The number; of a field none.
    pub value: Option<f64>,
    /// What it should be.
    pub reference: Option<f64>,
    /// How far it is from it, relative.
    pub error: Option<f64>,
}

/// The rows of a study from the records of all its runs; fields are compared here, and their errors written.
pub(super) fn rows(
    study: &Study,
    points: &[Point],
    records: &[Record],
    folder: &Path,
) -> Result<Vec<Row>, EngineError> {
    let mut of_point: BTreeMap<usize, Vec<&Record>> = BTreeMap::new();
    for record in records {
        of_point.entry(record.point).or_default().push(record);
    }
    let mut rows: Vec<Row> = Vec::new();
    for (k, point) in points.iter().enumerate() {
        let Some(records) = of_point.get(&k) else { continue };
        let first = records.iter().min_by_key(|r| r.repeat).unwrap_or(&records[0]);
        let mut seconds: Vec<f64> = records.iter().map(|r| r.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let value = |m: &Measure| first.values.get(&m.name).copied().flatten();
        rows.push(Row {
            point: point.clone(),
            seconds: median(&seconds),
            seconds_min: seconds[0],
            iterations: first.iterations,
            dofs: first.dofs,
            cells: first.cells,
            steps: first.steps,
            figures: study
                .measure
                .iter()
                .map(|m| Figure {
                    value: value(m),
                    ..Figure::default()
                })
                .collect(),
            failed: first.failed.clone(),
        });
    }
    for (k, measure) in study.measure.iter().enumerate() {
        for i in 0..rows.len() {
            if rows[i].failed.is_none() {
                rows[i].figures[k] = compared(study, measure, k, i, &rows, points, folder)?;
            }
        }
    }
    Ok(rows)
}

/// The figure of measure number `k` in row `i`, with its reference and its error.
fn compared(
    study: &Study,
    measure: &Measure,
    k: usize,
    i: usize,
    rows: &[Row],
    points: &[Point],
    folder: &Path,
) -> Result<Figure, EngineError> {
    let row = &rows[i];
    let number = |row: &Row| points.iter().position(|p| *p == row.point).unwrap_or(0);
    if let Some(field) = &measure.field {
        let own = folder_of(folder, number(row));
        let result = own.join("final.vtu");
        let out = own.join(format!("error_{k}.vtu"));
        let error = match &measure.reference {
            Some(Reference::File(file, name)) => {
                let file = study.source.resolve(file);
                difference(&result, field, &Known::File(&file, name), &out)?
            }
            Some(Reference::Exact(formulas)) => difference(&result, field, &Known::Exact(formulas), &out)?,
            _ => {
                let finest = folder_of(folder, number(finest(study, rows, row))).join("final.vtu");
                difference(&result, field, &Known::File(&finest, field), &out)?
            }
        };
        return Ok(Figure {
            error: Some(error),
            ..Figure::default()
        });
    }
    let reference = match &measure.reference {
        Some(Reference::Number(value)) => Some(*value),
        Some(_) => finest(study, rows, row).figures[k].value,
        None => row.point.value("reference").and_then(as_number),
    };
    let value = row.figures[k].value;
    let relative = |v: f64, r: f64| {
        let scale = measure.scale.unwrap_or(r).abs();
        (v - r).abs() / if scale > 0.0 { scale } else { 1.0 }
    };
    Ok(Figure {
        value,
        reference,
        error: value.zip(reference).map(|(v, r)| relative(v, r)),
    })
}

/// The run with the most dofs and steps among those of the same problem.
fn finest<'a>(study: &Study, rows: &'a [Row], row: &Row) -> &'a Row {
    let same = |other: &&Row| {
        study
            .each
            .iter()
            .all(|key| other.point.value(key) == row.point.value(key))
    };
    let size = |r: &Row| r.dofs.max(1).saturating_mul(r.steps.max(1));
    let candidates = rows.iter().filter(same).filter(|r| r.failed.is_none());
    candidates.max_by_key(|r| size(r)).unwrap_or(&rows[0])
}

pub(super) fn as_number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(value) => Some(*value as f64),
        Value::Float(value) => Some(*value),
        _ => None,
    }
}

fn median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0
}

/// The names of the columns of the table.
pub(super) fn columns(study: &Study) -> Vec<String> {
    let keys = study.keys().map(str::to_owned);
    let figures = study.measure.iter().flat_map(|m| {
        let named = |what: &str| match study.measure.len() {
            1 => what.to_owned(),
            _ => format!("{}.{what}", m.name),
        };
        ["value", "reference", "error"].map(named)
    });
    let rest = [
        "seconds",
        "seconds_min",
        "iterations",
        "dofs",
        "cells",
        "steps",
        "failed",
    ];
    keys.chain(figures).chain(rest.map(str::to_owned)).collect()
}

/// The cells of a row of the table.
pub(super) fn fields(row: &Row) -> Vec<String> {
    let keys = row
        .point
        .settings
        .iter()
        .filter(|(k, _)| is_of_scene(k))
        .map(|(_, v)| label(v));
    let figures = row.figures.iter().flat_map(|f| [f.value, f.reference, f.error]);
    let figures = figures.map(|f| f.map_or(String::new(), |v| format!("{v:e}")));
    let rest = [
        format!("{:.6}", row.seconds),
        format!("{:.6}", row.seconds_min),
        row.iterations.to_string(),
        row.dofs.to_string(),
        row.cells.to_string(),
        row.steps.to_string(),
    ];
    let rest = rest.map(|figure| if row.failed.is_some() { String::new() } else { figure });
    keys.chain(figures)
        .chain(rest)
        .chain([row.failed.clone().unwrap_or_default()])
        .collect()
}

/// Writes `study.csv`.
pub(super) fn write_table(study: &Study, rows: &[Row], folder: &Path) -> Result<(), EngineError> {
    let path = folder.join("study.csv");
    let mut table = csv::Writer::from_writer(Vec::new());
    let failed = |source: std::io::Error| {
        EngineError::Write(IoError::Write {
            path: path.clone(),
            source,
        })
    };
    table.write_record(columns(study)).map_err(|e| failed(e.into()))?;
    for row in rows {
        table.write_record(fields(row)).map_err(|e| failed(e.into()))?;
    }
    let bytes = table.into_inner().map_err(|e| failed(e.into_error()))?;
    write_atomically(&path, |out| out.write_all(&bytes)).map_err(EngineError::Write)
}
