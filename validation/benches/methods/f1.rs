//! F1: a plane at `eps h` from a layer of vertices. Who fails where.

use std::fmt::Write as _;

use kerfem_cutting::{CutOptions, Method};
use kerfem_engine::chart::{self, Across, Panel, Series};
use kerfem_mesh::{Point, generate};

use crate::Settings;
use crate::cases::{grid, variants};
use crate::measure::{Quality, cut_timed, mechanics, show};

const EPS: [f64; 9] = [0.2, 0.1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 0.0];

pub(crate) fn run(settings: &Settings) -> Result<String, Box<dyn std::error::Error>> {
    // held at both ends along x, so that both halves stay held
    let held = |p: Point| p.x < 1e-9 || p.x > 1.0 - 1e-9;
    let mesh = generate::box_tets([1.0; 3], [8; 3], [0.0; 3]);
    let (iterations, step) = mechanics(&mesh, held)?;
    let mut text = format!(
        "## F1: a plane at eps h from a layer of vertices\n\nCube of 8^3 cells, z = .5 + eps/8, both ends held. Jacobi-CG iterations to 1e-8 \
         and the stable explicit step, each of uncut ({iterations} iterations, {} s), and the worst 3r/R. eps 0: parting along facets.\n\n",
        show(step)
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
        let mut lines = [Vec::new(), Vec::new(), Vec::new()];
        for eps in EPS {
            let z = 0.5 + eps / 8.0;
            let sweep = grid(1, |s, t| Point::new(1.4 * s - 0.2, 1.4 * t - 0.2, z));
            let cut = cut_timed(&mesh, &sweep, &options, 1)?;
            let (own_iterations, own_step) = mechanics(&cut.mesh, held)?;
            lines[0].push(own_iterations / iterations);
            lines[1].push(own_step / step);
            lines[2].push(Quality::of(&cut.mesh).min_ratio);
        }
        for (figure, line) in ["iterations", "step", "worst 3r/R"].iter().zip(&lines) {
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
        steps.push(series(&lines[1]));
    }
    let panel = |title: &str, series| Panel::series(title, Across::Log("eps".into()), series);
    let panels = [
        panel("Jacobi-CG iterations, of uncut", solves),
        panel("stable explicit step, of uncut", steps),
    ];
    chart::write(&settings.out.join("f1"), &panels, 2)?;
    Ok(text)
}
