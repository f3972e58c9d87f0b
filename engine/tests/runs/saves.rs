//! Saves: a restored simulation goes on with the same bits, and what is no save is refused.

use std::path::Path;

use kerfem_cutting::{CutOptions, Sweep};
use kerfem_engine::{AnySimulation, Scene, Simulation};
use kerfem_mesh::Point;

use super::box_scene;

/// A wall across the box at `x`, tilted.
fn blade(x: f64) -> Sweep {
    let corners = [
        [x, -1.0, -1.0],
        [x + 0.1, 2.0, -1.0],
        [x + 0.07, 2.0, 2.0],
        [x, -1.0, 0.45],
    ];
    let points = corners.map(Point::from).to_vec();
    Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0
}

const SECTIONS: &str = "[[region]]\nwhere = 'z > 0.5'\nyoung = 3e5\n[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\n\
    vertices = [8, 17, 26]\naxes = 'y'\ndisplacement = ['0.05 * sin(9 * t)']\n[[load]]\ngravity = ['sin(t)', 0, -9.81]\n\
    [[load]]\nwhere = 'x > 1.999'\ntraction = [0, '200 * y', 0]\n[[load]]\nvertices = [4, 13]\nforce = [0, 0, 3]\n\
    [[probe]]\nname = 'tip'\npoint = [1.9, 0.4, 0.3]\n[[quantity]]\nname = 'pull'\nreaction = 'z'\nwhere = 'x < 1e-9'\n";

/// Steps and cuts, and is saved and restored after the steps in `saves`.
fn go(text: &str, steps: usize, saves: &[usize], folder: &Path) -> Simulation {
    let mut s = Simulation::new(Scene::parse(text, "test.toml").unwrap()).unwrap();
    s.record_figures(true);
    for step in 0..steps {
        if step == 3 || step == 6 {
            let record = s.cut(&blade(0.3 + 0.2 * step as f64), &CutOptions::default()).unwrap();
            assert!(record.refused.is_empty() && record.cells_added > 0);
        }
        if step == 5 {
            assert!(s.set_load(2, [0.0, 1.0, 5.0]) && s.set_fixed(0, [0.0, 0.0, 0.01]));
        }
        s.step(0.01).unwrap();
        if saves.contains(&step) {
            let path = folder.join("state.kerfem");
            s.save(&path).unwrap();
            s = Simulation::restore(&path).unwrap();
        }
    }
    s
}

/// Everything that must agree to the bit.
fn bits(s: &Simulation) -> Vec<u64> {
    let e = s.energies();
    let numbers = [e.kinetic, e.elastic, e.potential, e.dissipated, s.state().time];
    let quantities: Vec<f64> = s.quantities().into_values().flatten().collect();
    let all = s.u().iter().chain(s.v()).chain(&numbers).chain(&quantities);
    all.map(|x| x.to_bits()).collect()
}

#[test]
fn a_restored_simulation_goes_on_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let schemes = [
        ("backward-euler", "newton", "corotated", "cg", "lumped"),
        ("backward-euler", "one-step", "corotated", "cg", "lumped"),
        ("midpoint", "newton", "corotated", "cholesky", "consistent"),
        ("midpoint", "newton", "linear", "cg", "lumped"),
        ("newmark", "newton", "corotated", "cg", "consistent"),
        ("bdf2", "newton", "corotated", "cg", "lumped"),
        ("bdf2", "one-step", "corotated", "cholesky", "lumped"),
        ("central-difference", "newton", "corotated", "cg", "lumped"),
    ];
    for (scheme, nonlinear, model, solver, mass) in schemes {
        let time = format!(
            "[model]\nkind = '{model}'\nmass = '{mass}'\n[time]\nscheme = '{scheme}'\nnonlinear = '{nonlinear}'\ndt = 0.01\n\
             end = 1\n[solver]\nkind = '{solver}'\n"
        );
        let text = box_scene([2.0, 1.0, 1.0], [8, 3, 3], &format!("{SECTIONS}{time}"));
        let unbroken = go(&text, 9, &[], folder.path());
        for saves in [&[0, 4][..], &[2, 3, 6], &[8]] {
            let restored = go(&text, 9, saves, folder.path());
            assert_eq!(
                restored.mesh(),
                unbroken.mesh(),
                "{scheme} {nonlinear} {model} {saves:?}"
            );
            assert_eq!(
                bits(&restored),
                bits(&unbroken),
                "{scheme} {nonlinear} {model} {saves:?}"
            );
            assert_eq!(restored.warnings(), unbroken.warnings());
            assert_eq!(restored.selections(), unbroken.selections());
        }
    }
}

#[test]
fn a_planar_body_is_saved_too() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cut.obj"), "v 1.02 -1 0\nv 0.98 0.6 0\nl 1 2\n").unwrap();
    let text = "name = 'plate'\n[mesh]\nplate = { size = [2, 1], cells = [8, 4] }\n[material]\nyoung = 1e4\npoisson = 0.3\n\
        density = 1000\nplane = 'stress'\nthickness = 0.1\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, -1]\n[time]\n\
        scheme = 'backward-euler'\ndt = 0.02\nend = 1\n[[cut]]\nat = 0.05\nsweep = 'cut.obj'\n";
    let scene = Scene::parse(text, folder.path().join("plate.toml")).unwrap();
    let mut unbroken = Simulation::planar(scene.clone()).unwrap();
    let mut s = Simulation::planar(scene).unwrap();
    for step in 0..5 {
        unbroken.step(0.02).unwrap();
        s.step(0.02).unwrap();
        let path = folder.path().join("plate.save");
        s.save(&path).unwrap();
        // what waits is in the save
        let _ = std::fs::remove_file(folder.path().join("cut.obj"));
        assert!(Simulation::restore(&path).unwrap_err().to_string().contains("planar"));
        s = match AnySimulation::restore(&path).unwrap() {
            AnySimulation::Planar(s) => s,
            AnySimulation::Solid(_) => panic!("a plate is planar"),
        };
        assert_eq!((s.u(), s.v()), (unbroken.u(), unbroken.v()), "step {step}");
        assert_eq!(s.mesh(), unbroken.mesh());
    }
    assert!(s.mesh().num_cells() > 64, "the cut was made");
}

/// The bytes of a small save, written to `path`.
fn saved(path: &Path) -> Vec<u8> {
    let sections = SECTIONS.replace("[8, 17, 26]", "[8, 17]");
    let text = box_scene([2.0, 1.0, 1.0], [2, 2, 2], &sections);
    let s = Simulation::new(Scene::parse(&text, "test.toml").unwrap()).unwrap();
    s.save(path).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn what_is_no_save_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    let whole = saved(&path);
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let error = Simulation::restore(&path).unwrap_err();
        let text = error.to_string();
        assert_eq!(error.exit_code(), 2, "{text}");
        assert!(text.contains("state.kerfem") && !text.contains('\n'), "{text}");
        text
    };
    assert!(refused(b"<?xml version='1.0'?>").contains("not a save of kerfem"));
    assert!(refused(b"").contains("not a save of kerfem"));
    for length in [14, 20, 30, 31, 32, 33, whole.len() / 2, whole.len() - 1] {
        refused(&whole[..length]);
    }
    let mut newer = whole.clone();
    newer[12] = 77;
    assert!(refused(&newer).contains("format 77; this version reads 5"));
    for at in [16, 21, 28, 40, whole.len() / 3, whole.len() - 2] {
        let mut damaged = whole.clone();
        damaged[at] ^= 4;
        refused(&damaged);
    }
    std::fs::remove_file(&path).unwrap();
    assert!(
        Simulation::restore(&path)
            .unwrap_err()
            .to_string()
            .contains("cannot be read")
    );
}

/// Content that has the right checksum and still makes no sense: no panic, whatever it says.
#[test]
fn a_forged_save_is_refused_or_restored() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    let whole = saved(&path);
    const HEAD: usize = 32;
    let (mut refused, mut state) = (0, 1u64);
    for _ in 0..1000 {
        let mut forged = whole.clone();
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let at = HEAD + (state >> 20) as usize % (forged.len() - HEAD);
        forged[at] = (state >> 56) as u8;
        let sum = crc32fast::hash(&forged[HEAD..]);
        forged[HEAD - 4..HEAD].copy_from_slice(&sum.to_le_bytes());
        std::fs::write(&path, &forged).unwrap();
        match Simulation::restore(&path) {
            Ok(mut s) => drop(s.step(0.01)),
            Err(e) => {
                assert!(!e.to_string().contains('\n'), "{e}");
                refused += 1;
            }
        }
    }
    assert!(refused > 150, "{refused}");
}
