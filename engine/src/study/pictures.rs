//! The charts of a study: lines of error over time with the Pareto front, and maps.

use super::grid::label;
use super::results::{Row, as_number};
use super::spec::{Chart, Study};
use crate::chart::{Across, Drawing, Map, Panel, Series};

/// Colours of [`crate::chart`].
const COLORS: usize = 8;

/// All panels of a study: each chart, for each problem.
pub(super) fn panels(study: &Study, rows: &[Row]) -> Vec<Panel> {
    let standard: Vec<Chart> = match study.chart.is_empty() {
        true => study.measure.iter().map(Chart::standard).collect(),
        false => study.chart.clone(),
    };
    let mut panels = Vec::new();
    for chart in &standard {
        let own: Vec<&str> = match chart.color {
            // what is neither to the right nor upwards
            Some(_) => {
                let drawn = [study.group_of(&chart.x), study.group_of(&chart.y)].concat();
                study.keys().filter(|k| !drawn.contains(k)).collect()
            }
            None => study.each.iter().map(String::as_str).collect(),
        };
        for (problem, rows) in grouped(rows.iter(), &own) {
            let mut title = match chart.title.is_empty() {
                true => chart.color.as_ref().unwrap_or(&chart.y).clone(),
                false => chart.title.clone(),
            };
            if !problem.is_empty() {
                title += &format!(" ({problem})");
            }
            panels.push(match &chart.color {
                Some(color) => map(study, chart, color, title, &rows),
                None => lines(study, chart, title, &rows),
            });
        }
    }
    panels
}

/// Rows by the values of some keys, in the order in which they come.
pub(super) fn grouped<'a>(rows: impl Iterator<Item = &'a Row>, keys: &[&str]) -> Vec<(String, Vec<&'a Row>)> {
    let mut groups: Vec<(String, Vec<&Row>)> = Vec::new();
    for row in rows {
        let name = row.point.labels(keys.iter().copied()).join(", ");
        match groups.iter_mut().find(|(n, _)| *n == name) {
            Some((_, group)) => group.push(row),
            None => groups.push((name, vec![row])),
        }
    }
    groups
}

/// The keys whose values make lines of their own.
pub(super) fn line_keys(study: &Study) -> Vec<&str> {
    let along = study.along();
    let rest = study
        .keys()
        .filter(|k| !along.contains(k) && !study.each.iter().any(|e| e == k));
    rest.collect()
}

/// What a chart shows of a row: "error", "value.NAME", "seconds", "dofs", ...
fn figure(study: &Study, what: &str, row: &Row) -> Option<f64> {
    let (kind, name) = what.split_once('.').unwrap_or((what, ""));
    let k = study.measure.iter().position(|m| name.is_empty() || m.name == name)?;
    if row.failed.is_some() {
        return None;
    }
    match kind {
        "error" => row.figures[k].error,
        "value" => row.figures[k].value,
        "seconds" => Some(row.seconds),
        "iterations" => Some(row.iterations as f64),
        "dofs" => Some(row.dofs as f64),
        "cells" => Some(row.cells as f64),
        _ => None,
    }
}

fn lines(study: &Study, chart: &Chart, title: String, rows: &[&Row]) -> Panel {
    let of_key = study.vary.get(&chart.x).and_then(|v| v.as_array());
    let numbers = of_key.is_none_or(|values| values.iter().all(|v| as_number(v).is_some_and(|x| x > 0.0)));
    let x = |row: &Row| match (row.point.value(&chart.x), numbers) {
        (Some(value), true) => as_number(value),
        (Some(value), false) => of_key?.iter().position(|v| v == value).map(|k| k as f64),
        (None, _) => figure(study, &chart.x, row),
    };
    let groups = grouped(rows.iter().copied(), &line_keys(study));
    let mut series: Vec<Series> = Vec::new();
    for (k, (name, rows)) in groups.iter().enumerate() {
        series.push(Series {
            name: if name.is_empty() {
                study.name.clone()
            } else {
                name.clone()
            },
            color: k % COLORS,
            open: k >= COLORS,
            points: rows
                .iter()
                .filter_map(|r| Some((x(r)?, figure(study, &chart.y, r)?)))
                .collect(),
        });
    }
    if chart.x == "seconds" && chart.y.starts_with("error") {
        let points = series.iter().flat_map(|s| s.points.iter().copied()).collect();
        series.push(Series {
            name: "Pareto front".into(),
            color: 6,
            open: true,
            points: pareto(points),
        });
    }
    let across = match (numbers, of_key) {
        (false, Some(values)) => Across::Names(values.iter().map(label).collect()),
        _ => Across::Log(chart.x.clone()),
    };
    Panel::series(title, across, series)
}

/// Of times and errors those that nothing beats in both, by time.
pub(super) fn pareto(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut best = f64::INFINITY;
    points.retain(|p| {
        let better = p.1 < best;
        best = best.min(p.1);
        better
    });
    points
}

fn map(study: &Study, chart: &Chart, color: &str, title: String, rows: &[&Row]) -> Panel {
    // what moves together is one axis
    let names = |key: &str| {
        let groups = grouped(rows.iter().copied(), &study.group_of(key));
        groups.into_iter().map(|(name, _)| name).collect::<Vec<_>>()
    };
    let name = |row: &Row, key: &str| row.point.labels(study.group_of(key).into_iter()).join(", ");
    let (across, upwards) = (names(&chart.x), names(&chart.y));
    let at = |x: &String, y: &String| {
        let row = rows.iter().find(|r| name(r, &chart.x) == *x && name(r, &chart.y) == *y);
        row.and_then(|r| figure(study, color, r))
    };
    let cells = upwards.iter().flat_map(|y| across.iter().map(move |x| (x, y)));
    let drawing = Drawing::Map(Map {
        axes: [&chart.x, &chart.y].map(|key| study.group_of(key).join(", ")),
        values: cells.map(|(x, y)| at(x, y)).collect(),
        columns: across.clone(),
        rows: upwards.clone(),
    });
    Panel { title, drawing }
}

#[cfg(test)]
mod tests {
    use super::pareto;

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let points = vec![(3.0, 0.1), (1.0, 0.5), (2.0, 0.6), (4.0, 0.1), (1.0, 0.4)];
        assert_eq!(pareto(points), [(1.0, 0.4), (3.0, 0.1)]);
    }
}
