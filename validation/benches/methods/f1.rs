//! F1: a plane at `eps h` from a layer of vertices. Who fails where.

use std::fmt::Write as _;

use kerfem_cutting::{CutOptions, Method};
use kerfem_engine::chart::{self, Across, Panel, Series};
use kerfem_mesh::{Point, generate};
use kerfem_validation::conditioning::Cost;

use crate::Settings;
use crate::cases::{grid, variants};
use crate::measure::{Quality, cut_timed, show};

const EPS: [f64; 9] = [0.2, 0.1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0];

pub(crate) fn run(settings: &Settings) -> Result<String, Box<dyn std::error::Error>> {
    // held at both ends along x, so that both halves stay held
    let held = |p: Point| p.x < 1e-9 || p.x > 1.0 - 1e-9;
    let mesh = generate::box_tets([1.0; 3], [8; 3], [0.0; 3]);
    let cost = Cost::of(&mesh, held)?;
    let mut text = format!(
        "## F1: a plane at eps h from a layer of vertices\n\nCube of 8^3 cells, z = .5 + eps/8, both ends held. Jacobi-CG iterations to 1e-8 \
         (mean and largest ratio of a dozen loads) and the stable explicit step, each of uncut ({} iterations, {} s), and the worst 3r/R. eps 0: parting along facets.\n\n",
        show(cost.mean_iterations()),
        show(cost.step)
    );
    let names: Vec<String> = EPS.iter().map(|e| format!("{e:e}")).collect();
    writeln!(text, "| method | figure | {} |", names.join(" | "))?;
    writeln!(text, "|{}", "---|".repeat(EPS.len() + 2))?;
    let (mut solves, mut steps) = (Vec::new(), Vec::new());
    let mut all = variants();
    let relaxed = CutOptions {
        relax: true,
        ..CutOptions::default()
    };
    all.push(("hybrid+, relaxed".into(), relaxed));
    for (name, options) in all {
        let mut lines = [const { Vec::new() }; 4];
        for eps in EPS {
            let z = 0.5 + eps / 8.0;
            let sweep = grid(1, |s, t| Point::new(1.4 * s - 0.2, 1.4 * t - 0.2, z));
            let cut = cut_timed(&mesh, &sweep, &options, 1)?;
            let ratios = Cost::of(&cut.mesh, held)?.over(&cost);
            let worst = Quality::of(&cut.mesh).min_ratio;
            for (line, figure) in lines.iter_mut().zip([ratios.largest, ratios.mean, ratios.step, worst]) {
                line.push(figure);
            }
        }
        for (figure, line) in ["iterations, largest", "iterations, mean", "step", "worst 3r/R"]
            .iter()
            .zip(&lines)
        {
            let shown: Vec<String> = line.iter().map(|x| show(*x)).collect();
            writeln!(text, "| {name} | {figure} | {} |", shown.join(" | "))?;
        }
        let series = |line: &[f64]| Series {
            name: name.clone(),
            color: Method::NAMES
                .iter()
                .position(|(_, m)| *m == options.method)
                .unwrap_or(0),
            open: options.improve,
            points: EPS
                .iter()
                .copied()
                .zip(line.iter().copied())
                .filter(|(e, _)| *e > 0.0)
                .collect(),
        };
        solves.push(series(&lines[0]));
        steps.push(series(&lines[2]));
    }
    let panel = |title: &str, series| Panel::series(title, Across::Log("eps".into()), series);
    let panels = [
        panel("Jacobi-CG iterations, of uncut, largest of the loads", solves),
        panel("stable explicit step, of uncut", steps),
    ];
    chart::write(&settings.out.join("f1"), &panels, 2)?;
    Ok(text)
}
