//! Validation: studies that say how large an error may be, and how fast it must shrink.

use std::fmt::Write;
use std::path::Path;

use super::page::rounded;
use super::pictures::{grouped, line_keys};
use super::results::{Row, as_number};
use super::spec::Study;
use super::{Progress, StudyOptions, run};
use crate::{EngineError, fit};

/// What became of one measure along one line of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The case.
    pub case: String,
    /// The settings of the line, and its end.
    pub line: String,
    /// What is measured.
    pub measure: String,
    /// Value at the end of the line; none of fields.
    pub value: Option<f64>,
    /// What it should be.
    pub reference: Option<f64>,
    /// How far it is from it, relative.
    pub error: Option<f64>,
    /// The largest error that is accepted.
    pub tolerance: Option<f64>,
    /// The order of convergence along the line, fitted.
    pub order: Option<f64>,
    /// The least order that is accepted.
    pub rate: Option<f64>,
    /// Why there is no error, if there is none.
    pub reason: Option<String>,
}

impl Verdict {
    /// Whether both bounds are kept.
    pub fn is_met(&self) -> bool {
        let within = self.tolerance.is_none_or(|t| self.error.is_some_and(|e| e <= t));
        let fast = self.rate.is_none_or(|r| self.order.is_some_and(|o| o >= r));
        self.reason.is_none() && within && fast
    }
}

/// Makes a case anew, and judges each of its measures that has a tolerance or a rate; none if `go_on` said to stop.
///
/// # Errors
/// As [`run`].
pub fn validate(
    study: &Study,
    folder: &Path,
    go_on: &(dyn Fn() -> bool + Sync),
    tell: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<Vec<Verdict>>, EngineError> {
    // an earlier result says nothing about this code
    let _ = std::fs::remove_file(folder.join("runs.jsonl"));
    let options = StudyOptions {
        folder: folder.to_owned(),
        parallel: 1,
    };
    let Some(rows) = run(study, &options, go_on, tell)? else {
        return Ok(None);
    };
    let mut keys: Vec<&str> = study.each.iter().map(String::as_str).collect();
    keys.extend(line_keys(study));
    let mut verdicts = Vec::new();
    for (line, rows) in grouped(rows.iter(), &keys) {
        for k in 0..study.measure.len() {
            let verdict = judged(study, &line, k, &rows);
            if verdict.tolerance.is_some() || verdict.rate.is_some() {
                verdicts.push(verdict);
            }
        }
    }
    Ok(Some(verdicts))
}

fn judged(study: &Study, line: &str, k: usize, rows: &[&Row]) -> Verdict {
    let (measure, along) = (&study.measure[k], study.along());
    let end = rows[rows.len() - 1];
    let at = end.point.labels(along.iter().copied()).join(", ");
    let bound = |key: &str| end.point.value(key).and_then(as_number);
    let place = [line, &at]
        .into_iter()
        .filter(|t| !t.is_empty())
        .collect::<Vec<_>>()
        .join("; ");
    let figure = end.figures[k];
    let failed = rows.iter().find_map(|r| r.failed.clone());
    let missing = || figure.error.is_none().then(|| "no value".to_owned());
    Verdict {
        case: study.name.clone(),
        line: place,
        measure: measure.name.clone(),
        value: figure.value,
        reference: figure.reference,
        error: figure.error,
        tolerance: measure.tolerance.or_else(|| bound("tolerance")),
        order: along.first().and_then(|key| order(key, rows, k)),
        rate: measure.rate.or_else(|| bound("rate")),
        reason: failed.or_else(missing),
    }
}

/// The order of convergence of a measure along a line. A list is refined by its first number.
fn order(key: &str, rows: &[&Row], k: usize) -> Option<f64> {
    let size = |row: &&&Row| {
        let value = row.point.value(key)?;
        as_number(value).or_else(|| as_number(value.as_array()?.first()?))
    };
    let points = rows.iter().map(|row| Some((size(&row)?, row.figures[k].error?)));
    fit::order(&points.collect::<Option<Vec<_>>>()?)
}

/// The table of all verdicts, as Markdown that can be read as it stands.
pub fn verdict_table(verdicts: &[Verdict]) -> String {
    let head = [
        "case",
        "settings",
        "measure",
        "value",
        "reference",
        "error",
        "allowed",
        "order",
        "needed",
        "",
    ];
    let number = |value: Option<f64>| value.map_or(String::new(), |v| rounded(&format!("{v:e}")));
    let rows: Vec<[String; 10]> = verdicts
        .iter()
        .map(|v| {
            [
                v.case.clone(),
                v.line.clone(),
                v.measure.clone(),
                number(v.value),
                number(v.reference),
                number(v.error),
                number(v.tolerance),
                v.order.map_or(String::new(), |o| format!("{o:.2}")),
                number(v.rate),
                match (&v.reason, v.is_met()) {
                    (Some(reason), _) => format!("MISSED: {reason}"),
                    (None, true) => "ok".into(),
                    (None, false) => "MISSED".into(),
                },
            ]
        })
        .collect();
    let width = |k: usize| {
        rows.iter()
            .map(|r| r[k].chars().count())
            .chain([head[k].len()])
            .max()
            .unwrap_or(0)
    };
    let mut table = String::new();
    let mut line = |cells: &[&str], fill: char| {
        for (k, cell) in cells.iter().enumerate() {
            let missing = width(k) - cell.chars().count();
            let filling: String = std::iter::repeat_n(fill, missing).collect();
            let _ = write!(table, "|{fill}{cell}{filling}{fill}");
        }
        table += "|\n";
    };
    line(&head, ' ');
    line(&[""; 10], '-');
    for row in &rows {
        line(&row.each_ref().map(String::as_str), ' ');
    }
    table
}
