//! The cure of volumetric locking through scenes, steps, cuts, saves and results.

use std::path::Path;

use kerfem_cutting::{CutOptions, Sweep};
use kerfem_engine::run::{RunOptions, run};
use kerfem_engine::{Scene, Simulation};
use kerfem_mesh::Point;

use super::{box_scene, simulation};

/// A bottom of steel-like rubber, a top that is nearly incompressible.
const SECTIONS: &str = "[[region]]\nwhere = 'z > 0.5'\nyoung = 3e4\npoisson = 0.49\n[[fixed]]\nwhere = 'x < 1e-9'\n\
    [[load]]\ngravity = [0, 0, -9.81]\n[[load]]\nwhere = 'x > 1.999'\ntraction = [0, 20, -50]\n";

/// Across the box and half way down.
fn blade() -> Sweep {
    let corners = [[1.03, -1.0, 0.3], [1.08, 2.0, 0.3], [1.05, 2.0, 2.0], [1.0, -1.0, 2.0]];
    Sweep::new(corners.map(Point::from).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        .unwrap()
        .0
}

fn bits(s: &Simulation) -> Vec<u64> {
    let e = s.energies();
    let numbers = [e.kinetic, e.elastic, e.potential, e.dissipated];
    let all = s.u().iter().chain(s.v()).chain(&numbers);
    all.map(|x| x.to_bits()).collect()
}

fn go(text: &str, threads: usize, saved_in: Option<&Path>) -> Simulation {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let mut s = simulation(text);
        s.verify(true);
        for step in 0..6 {
            if step == 2 {
                let record = s.cut(&blade(), &CutOptions::default()).unwrap();
                assert!(record.refused.is_empty() && record.cells_added > 0);
            }
            assert!(s.step(0.01).unwrap().converged);
            if let (Some(folder), 1 | 4) = (saved_in, step) {
                let path = folder.join("state.kerfem");
                s.save(&path).unwrap();
                s = Simulation::restore(&path).unwrap();
                s.verify(true);
            }
        }
        let verified = s.verification().unwrap();
        assert_eq!(verified.invariants, "ok");
        assert_eq!(verified.stiffness_max_relative_difference, 0.0);
        s
    })
}

#[test]
fn a_cured_body_moves_is_cut_and_saved_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    for (model, scheme) in [
        ("corotated", "backward-euler"),
        ("corotated", "midpoint"),
        ("linear", "newmark"),
        ("corotated", "central-difference"),
    ] {
        let time = format!("[model]\nkind = '{model}'\n[time]\nscheme = '{scheme}'\ndt = 0.01\nend = 1\n");
        let text = box_scene([2.0, 1.0, 1.0], [6, 3, 3], &format!("{SECTIONS}{time}"));
        let one = go(&text, 1, None);
        assert_eq!(one.choices()["model.locking"].chosen, "nodal");
        assert!(bits(&one) == bits(&go(&text, 3, None)), "{model} {scheme}");
        assert!(
            bits(&one) == bits(&go(&text, 1, Some(folder.path()))),
            "{model} {scheme}"
        );
        // nothing is lost or won but by the scheme: the ledger has the energy of the patches
        let e = one.energies();
        assert!(e.elastic > 0.0);
        if scheme == "newmark" {
            assert!(e.dissipated.abs() < 0.2 * e.elastic, "{e:?}");
        }
    }
}

const STATIC: &str = "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 3.999'\ntraction = [0, 0, -1]\n[[quantity]]\nname = 'tip'\n\
    mean = 'uz'\nwhere = 'x > 3.999'\n[time]\nscheme = 'static'\nend = 1\ndt = 1\n";

/// Tip deflection (m) of a cantilever with `model` under a load of 1 Pa.
fn tip(poisson: f64, model: &str) -> (f64, Simulation) {
    let text = box_scene([4.0, 1.0, 1.0], [16, 4, 4], &format!("[model]\n{model}\n{STATIC}"));
    let text = text.replace("poisson = 0.3", &format!("poisson = {poisson}"));
    let mut s = simulation(&text);
    assert!(s.step(1.0).unwrap().converged, "{model}");
    (s.quantities()["tip"].unwrap(), s)
}

#[test]
fn up_to_a_poisson_ratio_of_4999_a_cantilever_bends() {
    let (soft, _) = tip(0.3, "kind = 'linear'\nlocking = 'nodal'");
    for kind in ["linear", "corotated"] {
        for poisson in [0.49, 0.4999] {
            let (cured, s) = tip(poisson, &format!("kind = '{kind}'"));
            assert_eq!(s.choices()["model.locking"].chosen, "nodal");
            assert!((cured / soft - 1.0).abs() < 0.15, "{kind} {poisson}: {cured} {soft}");
        }
    }
    let (locked, s) = tip(0.4999, "kind = 'linear'\nlocking = 'none'");
    assert!(!s.choices().contains_key("model.locking"));
    assert!(locked / soft < 0.1, "{locked} {soft}");
    let (_, s) = tip(0.45, "kind = 'linear'");
    assert_eq!(s.choices()["model.locking"].chosen, "none");
}

/// The numbers of a Matrix Market file.
fn entries(path: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn the_stiffness_that_is_exported_has_no_cure_and_the_tangent_has() {
    let folder = tempfile::tempdir().unwrap();
    let export = |locking: &str| {
        let model = format!("[model]\nkind = 'linear'\nlocking = '{locking}'\n");
        let text = box_scene(
            [1.0, 1.0, 1.0],
            [2, 2, 2],
            &format!("{SECTIONS}{model}").replace("1.999", "0.999"),
        );
        let text =
            format!("{text}[time]\nscheme = 'static'\ndt = 1\nend = 1\n[output]\nfields = ['stress', 'von_mises']\n");
        let options = RunOptions {
            folder: folder.path().join(locking),
            export_system: true,
            verify: true,
            ..RunOptions::default()
        };
        run(Scene::parse(&text, "test.toml").unwrap(), &options, |_| true).unwrap();
        let system = folder.path().join(locking).join("system");
        ["K.mtx", "K_tangent.mtx", "M.mtx"].map(|name| entries(&system.join(name)))
    };
    let ([plain, tangent, mass], [cured_plain, cured, cured_mass]) = (export("none"), export("nodal"));
    assert!(plain == cured_plain && mass == cured_mass);
    assert!(tangent != cured && cured.len() > 2 * tangent.len());
}
