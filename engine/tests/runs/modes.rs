//! Natural frequencies.

use std::f64::consts::PI;
use std::path::Path;

use kerfem_engine::{AnySimulation, Scene, Simulation, modes};

use super::{box_scene, simulation};

fn frequencies(modes: &[modes::Mode]) -> Vec<f64> {
    modes.iter().map(|m| m.omega_squared.sqrt() / (2.0 * PI)).collect()
}

#[test]
fn a_bar_that_moves_along_its_axis_has_the_frequencies_of_the_wave_equation() {
    // held at one end: (2 k - 1) c / 4 L, c² = E / rho where it cannot move across
    for mass in ["lumped", "consistent"] {
        let text = box_scene(
            [2.0, 0.1, 0.1],
            [40, 1, 1],
            &format!(
                "[model]\nmass = '{mass}'\n[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > -1'\naxes = 'yz'\n"
            ),
        )
        .replace("poisson = 0.3", "poisson = 0");
        let (modes, rigid) = simulation(&text).modes(4).unwrap();
        assert_eq!(rigid, 0);
        for (k, f) in frequencies(&modes).iter().enumerate() {
            let wanted = (2 * k + 1) as f64 * 10.0 / 8.0;
            assert!((f / wanted - 1.0).abs() < 0.01, "{mass} {k}: {f} Hz for {wanted} Hz");
        }
        assert!(modes.iter().all(|m| m.residual < 1e-8));
    }
}

#[test]
fn rigid_motions_are_counted_and_left_out() {
    let rigid = |sections: &str| {
        let (modes, rigid) = simulation(&box_scene([2.0, 0.5, 0.4], [8, 2, 2], sections))
            .modes(5)
            .unwrap();
        assert!(modes.iter().all(|m| m.residual < 1e-8), "{sections}");
        let all = frequencies(&modes);
        assert!(all.len() == 5 && all[0] > 0.1 && all.is_sorted(), "{sections}: {all:?}");
        rigid
    };
    assert_eq!(rigid(""), 6);
    assert_eq!(rigid("[[fixed]]\nwhere = 'x < 1e-9'\n"), 0);
    assert_eq!(rigid("[[fixed]]\nwhere = 'z < 1e-9'\naxes = 'z'\n"), 3);
    assert_eq!(rigid("[[fixed]]\nvertices = [0]\n"), 3);
}

/// Writes a wall across the box at x = 1 and a scene that is cut by it.
fn cut_scene(folder: &Path, sections: &str) -> Scene {
    std::fs::write(
        folder.join("wall.obj"),
        "v 1.03 -9 -9\nv 1.03 9 -9\nv 1.03 9 9\nv 1.03 -9 9\nf 1 2 3 4\n",
    )
    .unwrap();
    let text = box_scene([2.0, 0.5, 0.4], [8, 2, 2], sections);
    Scene::parse(&text, folder.join("scene.toml")).unwrap()
}

#[test]
fn cuts_that_are_due_come_first() {
    let folder = tempfile::tempdir().unwrap();
    let cut = "[[cut]]\nat = 0\nframe = 'rest'\nmethod = 'subdivide'\nsweep = 'wall.obj'\n";
    let held = "[[fixed]]\nwhere = 'x < 1e-9'\n";
    let stepping = "[time]\nscheme = 'newmark'\ndt = 0.01\nend = 1\n";
    let of = |sections: &str| {
        let mut s = Simulation::new(cut_scene(folder.path(), sections)).unwrap();
        let (modes, rigid) = s.modes(3).unwrap();
        (frequencies(&modes), rigid)
    };
    let (whole, none) = of(held);
    let (parts, free) = of(&format!("{held}{stepping}{cut}"));
    assert_eq!((none, free), (0, 6));
    // half the length bends about four times as fast
    assert!(parts[0] > 2.0 * whole[0], "{parts:?} {whole:?}");
    assert_eq!(of(cut).1, 12);
    // in statics all cuts come first, else those of the first step
    let late = cut.replace("at = 0", "at = 0.5");
    assert_eq!(of(&format!("{held}{late}")).1, 6);
    assert_eq!(of(&format!("{held}{stepping}{late}")), (whole, 0));
}

#[test]
fn what_is_written_vibrates_at_its_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let body = "name = 'strip'\n[mesh]\nplate = { size = [2, 0.4], cells = [10, 2] }\n[material]\nyoung = 1e5\npoisson = 0.3\n\
        density = 1000\n[model]\nkind = 'linear'\n[[fixed]]\nwhere = 'x < 1e-9'\n";
    let parse = |text: &str| Scene::parse(text, folder.path().join("scene.toml")).unwrap();
    let (figures, warnings) = modes::write(parse(body), 3, folder.path()).unwrap();
    assert!(warnings.is_empty() && figures.rigid == 0 && figures.frequencies_hz.len() == 3);
    let read: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("modes.json")).unwrap()).unwrap();
    assert_eq!(read["rigid"], 0);
    for (k, frequency) in figures.frequencies_hz.iter().enumerate() {
        assert_eq!(read["frequencies_hz"][k].as_f64().unwrap(), *frequency);
        assert!(read["residuals"][k].as_f64().unwrap() < 1e-8);
        let dt = 1.0 / frequency / 200.0;
        let start = format!(
            "{body}[initial]\ndisplacement = {{ file = 'modes/strip_00000{}.vtu', array = 'displacement' }}\n[solver]\n\
             tolerance = 1e-11\n[time]\nscheme = 'newmark'\ndt = {dt}\nend = {}\n",
            k + 1,
            200.0 * dt
        );
        let AnySimulation::Planar(mut s) = AnySimulation::new(parse(&start)).unwrap() else {
            panic!("a strip is planar")
        };
        let start = s.u().to_vec();
        (0..200).for_each(|_| assert!(s.step(dt).unwrap().converged));
        let largest = start.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
        let apart = s.u().iter().zip(&start).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // the period is longer by (w dt)² / 12
        assert!(apart < 1e-3 * largest && largest > 0.1, "{k}: {apart} of {largest}");
    }
    assert!(folder.path().join("strip_modes.pvd").is_file());
    // fewer modes leave no file of an earlier call
    modes::write(parse(body), 1, folder.path()).unwrap();
    assert_eq!(std::fs::read_dir(folder.path().join("modes")).unwrap().count(), 1);
}
