//! The same cuts by every method.

use std::fmt::Write as _;

use kerfem_engine::chart::{self, Across, Panel, Series};
use kerfem_validation::conditioning::Cost;

use crate::Settings;
use crate::cases::{bodies, held, sweeps, variants};
use crate::measure::{Quality, Reshaped, cells_touched, cut_timed, mean_size, show};

const HEAD: [&str; 20] = [
    "method",
    "cells",
    "min 3r/R",
    "mean 3r/R",
    "Q of created",
    "max edge/r",
    "mean edge/r",
    "edge/r > 200",
    "min r/R",
    "Vmax/Vmin",
    "lmax/lmin",
    "volume",
    "pieces",
    "distance / h",
    "cells touched",
    "us per cell",
    "CG iterations",
    "explicit step",
    "operations",
    "refused",
];

/// What is drawn: a title, and how it is found from a row.
type Drawn = (&'static str, fn(&Row) -> f64);

const DRAWN: [Drawn; 6] = [
    ("cells, of uncut", |r| r.cells),
    ("worst 3r/R, of uncut", |r| r.worst),
    ("mean 3r/R of created cells", |r| r.created),
    ("Jacobi-CG iterations, of uncut", |r| r.iterations),
    ("stable explicit step, of uncut", |r| r.step),
    ("microseconds per cell touched", |r| r.micros),
];

/// What the picture shows of one cut.
struct Row {
    case: String,
    variant: usize,
    cells: f64,
    worst: f64,
    created: f64,
    iterations: f64,
    step: f64,
    micros: f64,
}

pub(crate) fn run(settings: &Settings) -> Result<String, Box<dyn std::error::Error>> {
    let mut text = String::from(
        "## The same cuts by every method\n\n`+`: with quality maintenance. Rows of a method are relative to the uncut mesh (its own row: \
         absolute), except for Q, edge/r > 200, pieces, distance, cells touched, times, operations.\n",
    );
    let variants = variants();
    let mut rows = Vec::new();
    for (body, mesh) in bodies(settings.cells)? {
        let uncut = Quality::of(&mesh);
        let cost = Cost::of(&mesh, held)?;
        let h = mean_size(&mesh);
        for (sweep_name, sweep) in sweeps() {
            writeln!(
                text,
                "\n### {body}, {} tets, {sweep_name}\n\n| {} |",
                uncut.cells,
                HEAD.join(" | ")
            )?;
            writeln!(text, "|{}", "---|".repeat(HEAD.len()))?;
            let whole = [
                "uncut".into(),
                uncut.cells.to_string(),
                show(uncut.min_ratio),
                show(uncut.mean_ratio),
                String::new(),
                show(uncut.max_aspect),
                show(uncut.mean_aspect),
                show(uncut.bad),
                show(uncut.min_ratio / 3.0),
                show(uncut.volumes),
                show(uncut.edges),
                show(uncut.volume),
                mesh.pieces().1.to_string(),
                String::new(),
                String::new(),
                String::new(),
                show(cost.mean_iterations()),
                format!("{} s", show(cost.step)),
                String::new(),
                String::new(),
            ];
            writeln!(text, "| {} |", whole.join(" | "))?;
            for (k, (name, options)) in variants.iter().enumerate() {
                let cut = cut_timed(&mesh, &sweep, options, settings.repeats)?;
                let (q, report) = (Quality::of(&cut.mesh), &cut.outcome.report);
                let created = Reshaped::of(&cut.mesh, &cut.outcome.change);
                let touched = cells_touched(&mesh, &cut.outcome.change);
                let micros = 1e6 * cut.seconds / touched.max(1) as f64;
                let ratios = Cost::of(&cut.mesh, held)?.over(&cost);
                let line = [
                    name.clone(),
                    show(q.cells as f64 / uncut.cells as f64),
                    show(q.min_ratio / uncut.min_ratio),
                    show(q.mean_ratio / uncut.mean_ratio),
                    if created.created > 0 {
                        show(created.mean_ratio)
                    } else {
                        String::new()
                    },
                    show(q.max_aspect / uncut.max_aspect),
                    show(q.mean_aspect / uncut.mean_aspect),
                    show(q.bad),
                    show(q.min_ratio / uncut.min_ratio),
                    show(q.volumes / uncut.volumes),
                    show(q.edges / uncut.edges),
                    format!("{:.3}", q.volume / uncut.volume),
                    cut.mesh.pieces().1.to_string(),
                    show(report.max_distance_to_sweep / h),
                    touched.to_string(),
                    show(micros),
                    show(ratios.mean),
                    show(ratios.step),
                    report.operations.to_string(),
                    report.refused.first().map_or(String::new(), ToString::to_string),
                ];
                writeln!(text, "| {} |", line.join(" | "))?;
                rows.push(Row {
                    case: format!("{body}, {sweep_name}"),
                    variant: k,
                    cells: q.cells as f64 / uncut.cells as f64,
                    worst: q.min_ratio / uncut.min_ratio,
                    created: created.mean_ratio,
                    iterations: ratios.mean,
                    step: ratios.step,
                    micros,
                });
            }
        }
    }
    let names: Vec<String> = variants.into_iter().map(|(name, _)| name).collect();
    chart::write(&settings.out.join("compare"), &panels(&rows, &names), 2)?;
    Ok(text)
}

fn panels(rows: &[Row], names: &[String]) -> Vec<Panel> {
    let mut cases: Vec<&str> = rows.iter().map(|r| r.case.as_str()).collect();
    cases.dedup();
    let series = |value: fn(&Row) -> f64| {
        let of_case = |(color, case): (usize, &&str)| Series {
            name: (*case).to_owned(),
            color,
            open: false,
            points: rows
                .iter()
                .filter(|r| r.case == **case)
                .map(|r| (r.variant as f64, value(r)))
                .collect(),
        };
        cases.iter().enumerate().map(of_case).collect()
    };
    let panel = |(title, value): Drawn| Panel::series(title, Across::Names(names.to_vec()), series(value));
    DRAWN.into_iter().map(panel).collect()
}
