//! The same random cuts as in the tests of the crate kerfem-cutting, through a body that moves: after each, K and M against a
//! fresh assembly, mass, momentum and everything else that `--verify` checks.
//!
//! `KERFEM_SWEEPS` sets how many cuts are made (default 60), `KERFEM_SEED` the first seed (default 0); a failure names its seed.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use kerfem_cutting::Method;
use kerfem_engine::Simulation;
use kerfem_mesh::{TetMesh, io};

use super::helpers::*;
use super::numbers::Random;
use super::sweeps::{random_bodies, random_options, random_sweep};

/// Most cuts made on one body, and cells from which it is not cut any further.
const LONGEST: usize = 20;
const LARGEST: usize = 3000;

/// A free body of two materials that spins and wobbles.
fn body(name: &str, folder: &Path) -> Simulation {
    let text = format!(
        "name = \"random\"\n[mesh]\nfile = \"{name}.vtu\"\n{MATERIAL}[[region]]\nwhere = \"x < 0.5\"\ndensity = 300\nyoung = 3e6\n\
         [model]\nkind = \"corotated\"\n[initial]\nvelocity = [\"1 - y\", \"x + z^2\", \"0.3 + x * y\"]\n\
         [time]\nscheme = \"backward-euler\"\ndt = 1e-3\nend = 1.0\nnonlinear = \"one-step\"\n[solver]\ntolerance = 1e-6\n"
    );
    let mut s = simulation(&text, folder);
    s.verify(true);
    s
}

/// Largest relative changes seen.
#[derive(Debug, Default)]
struct Largest {
    stiffness: f64,
    mass_matrix: f64,
    mass: f64,
    momentum: f64,
    /// Those of deletion are what it is for.
    deleted_mass: f64,
}

#[test]
fn matrices_mass_and_momentum_are_kept_by_every_random_cut() {
    let number = |name: &str, default| {
        std::env::var(name)
            .ok()
            .and_then(|n| n.parse::<u64>().ok())
            .unwrap_or(default)
    };
    let (limit, first) = (number("KERFEM_SWEEPS", 60), number("KERFEM_SEED", 0));
    let folder = tempfile::tempdir().unwrap();
    let bodies: Vec<(&str, TetMesh)> = random_bodies();
    for (name, mesh) in &bodies {
        let grid = io::VtuGrid::from_tet_mesh(mesh);
        io::write_vtu(folder.path().join(format!("{name}.vtu")), &grid).unwrap();
    }
    let (mut seen, mut refused, mut failures) = (Largest::default(), BTreeMap::<String, usize>::new(), Vec::new());
    let (mut cuts, clock, mut told) = (0, Instant::now(), Instant::now());
    for seed in first.. {
        if cuts >= limit {
            break;
        }
        let mut random = Random(seed);
        let name = bodies[random.below(bodies.len())].0;
        let mut s = body(name, folder.path());
        for number in 0..1 + random.below(LONGEST) {
            if cuts >= limit || s.mesh().num_cells() > LARGEST || s.mesh().num_cells() == 0 {
                break;
            }
            // cells that a cut left almost flat may stop the solver: that is not what is tested here
            if random.below(3) == 0 && s.step(1e-3).is_err() {
                break;
            }
            let positions = s.positions();
            let options = random_options(&mut random);
            let drawn = random_sweep(s.mesh(), &positions, &mut random);
            let record = s.cut(&drawn.sweep, &options).unwrap();
            cuts += 1;
            let verified = s.verification().unwrap();
            let what = format!("seed {seed}, cut {number}, {} by {options:?} on {name}", drawn.kind);
            seen.stiffness = seen.stiffness.max(verified.stiffness_max_relative_difference);
            seen.mass_matrix = seen.mass_matrix.max(verified.mass_max_relative_difference);
            for r in &record.refused {
                *refused
                    .entry(r.split([':', ' ']).take(3).collect::<Vec<_>>().join(" "))
                    .or_default() += 1;
            }
            if options.method == Method::Delete {
                seen.deleted_mass = seen.deleted_mass.max(record.mass_change_relative.abs());
            } else {
                seen.mass = seen.mass.max(record.mass_change_relative.abs());
                seen.momentum = seen.momentum.max(record.momentum_change_relative);
            }
            if !verified.is_ok() {
                failures.push(format!("{what}: {}", verified.invariants));
                break;
            }
        }
        if told.elapsed() > Duration::from_secs(10) {
            told = Instant::now();
            let rate = cuts as f64 / clock.elapsed().as_secs_f64();
            eprintln!(
                "{cuts} of {limit} cuts, seed {seed}, {} failures, {rate:.0} cuts/s",
                failures.len()
            );
        }
    }
    let seconds = clock.elapsed().as_secs_f64();
    println!("{cuts} cuts in {seconds:.0} s, largest relative differences {seen:?}, refused {refused:?}");
    assert!(
        failures.is_empty(),
        "{} failures:\n{}",
        failures.len(),
        failures.join("\n")
    );
    assert_eq!((seen.stiffness, seen.mass_matrix), (0.0, 0.0));
    assert!(seen.mass < 1e-12 && seen.momentum < 1e-12, "{seen:?}");
}
