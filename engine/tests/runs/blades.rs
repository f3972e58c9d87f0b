//! Scenes with a blade that moves: bodies that deform while they are cut, both frames, statics, saves in the middle.

use kerfem_engine::{Scene, Simulation};
use kerfem_mesh::quality;

use super::{box_scene, simulation};

/// Down through the middle of the beam from above and out below; the hilt leads a little.
const DOWN: &str = "[[0, [0.98, -0.3, 1.3], [1.0, 1.3, 1.25]], [0.1, [1.0, -0.3, 0.4], [1.02, 1.3, 0.5]], \
    [0.2, [1.03, -0.3, -0.4], [1.01, 1.3, -0.5]]]";

fn beam(blade: &str, cut: &str, time: &str) -> String {
    let sections = format!(
        "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -9.81]\n[[cut]]\nblade = {blade}\n{cut}\n[time]\n{time}\n"
    );
    box_scene([2.0, 1.0, 1.0], [6, 3, 3], &sections)
}

const STEPS: &str = "scheme = 'backward-euler'\ndt = 0.01\nend = 0.3";

fn go(s: &mut Simulation, steps: usize, dt: f64) {
    s.record_figures(true);
    s.verify(true);
    for _ in 0..steps {
        s.step(dt).unwrap();
    }
    let verified = s.verification().unwrap();
    assert_eq!(verified.invariants, "ok");
    assert_eq!(verified.stiffness_max_relative_difference, 0.0);
}

fn volumes(s: &Simulation) -> Vec<f64> {
    let (piece, count) = s.mesh().pieces();
    let mut all = vec![0.0; count];
    for (c, k) in s.mesh().cell_ids().zip(piece) {
        all[k] += quality::cell_volume(&s.mesh().cell_rest_positions(c));
    }
    all.sort_by(f64::total_cmp);
    all
}

/// Snapping distance in the beams here (m), generously.
const SNAP: f64 = 0.2 * 0.58;

#[test]
fn a_beam_that_sags_is_cut_in_two_however_often_the_blade_stops() {
    for (frame, method) in [("deformed", "hybrid"), ("rest", "hybrid"), ("rest", "subdivide")] {
        let mut firsts = Vec::new();
        for (steps, dt) in [(20, 0.01), (4, 0.05), (1, 0.2)] {
            if method == "subdivide" && steps > 4 {
                continue;
            }
            let cut = format!("frame = '{frame}'\nmethod = '{method}'");
            let mut s = simulation(&beam(DOWN, &cut, STEPS));
            go(&mut s, steps, dt);
            let all = volumes(&s);
            let tip = s.cuts().iter().filter_map(|c| c.tip_distance_m).fold(0.0, f64::max);
            println!("{frame} {method} {steps}: {all:?}, {} cuts, tip {tip}", s.cuts().len());
            assert_eq!(all.len(), 2, "{frame} {method} {steps}: {all:?}");
            assert!(s.warnings().is_empty(), "{:?}", s.warnings());
            assert!(s.cuts().iter().all(|c| c.refused.is_empty()) && tip < 2.5 * SNAP);
            firsts.push(all[0]);
        }
        // a blade that turns: the surface is not flat
        assert!(firsts.iter().all(|v| (v - firsts[0]).abs() < SNAP), "{firsts:?}");
    }
}

#[test]
fn statics_and_evaluate_sweep_the_whole_path_first() {
    for time in ["scheme = 'evaluate'", "scheme = 'static'"] {
        // the cut ends inside, so that statics hold the body
        let half = "[[3, [0.98, -0.3, 1.3], [1.0, 1.3, 1.25]], [5, [1.0, -0.3, 0.4], [1.02, 1.3, 0.5]]]";
        let mut s = simulation(&beam(half, "", time));
        go(&mut s, 1, 1.0);
        let area: f64 = s.cuts().iter().map(|c| c.area_m2).sum();
        assert!((area - 0.55).abs() < 0.1, "{area}");
        assert_eq!(s.mesh().pieces().1, 1);
        go(&mut s, 1, 1.0);
        assert_eq!(s.cuts().iter().map(|c| c.area_m2).sum::<f64>(), area);
    }
}

#[test]
fn a_body_that_moves_against_a_still_blade_is_cut() {
    let still = "[[0, [0.98, -0.3, 1.3], [1.0, 1.3, 1.3]], [0.1, [0.98, -0.3, 0.6], [1.0, 1.3, 0.6]], \
        [1.2, [0.98, -0.3, 0.6], [1.0, 1.3, 0.6]]]";
    let text = |velocity: f64| {
        box_scene(
            [2.0, 1.0, 1.0],
            [6, 3, 3],
            &format!("[initial]\nvelocity = [0, 0, {velocity}]\n[[cut]]\nblade = {still}\n[time]\n{STEPS}\n"),
        )
    };
    let mut rising = simulation(&text(1.0));
    go(&mut rising, 24, 0.05);
    assert_eq!(rising.mesh().pieces().1, 2);
    let mut still = simulation(&text(0.0));
    go(&mut still, 4, 0.05);
    let (cells, cuts) = (still.mesh().num_cells(), still.cuts().len());
    go(&mut still, 20, 0.05);
    assert_eq!(
        (still.mesh().pieces().1, still.mesh().num_cells(), still.cuts().len()),
        (1, cells, cuts)
    );
}

#[test]
fn a_save_in_the_middle_of_a_motion_goes_on_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    let text = beam(DOWN, "", STEPS);
    let run = |saves: &[usize]| {
        let mut s = Simulation::new(Scene::parse(&text, "test.toml").unwrap()).unwrap();
        for step in 0..12 {
            s.step(0.02).unwrap();
            if saves.contains(&step) {
                s.save(&path).unwrap();
                s = Simulation::restore(&path).unwrap();
            }
        }
        s
    };
    let unbroken = run(&[]);
    assert_eq!(unbroken.mesh().pieces().1, 2);
    for saves in [&[0, 3, 4][..], &[5, 8], &[2, 9, 11]] {
        let restored = run(saves);
        assert_eq!(restored.mesh(), unbroken.mesh(), "{saves:?}");
        let bits = |s: &Simulation| s.u().iter().chain(s.v()).map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&restored), bits(&unbroken), "{saves:?}");
        assert_eq!(restored.warnings(), unbroken.warnings());
        assert_eq!(restored.cuts().len(), unbroken.cuts().len());
    }
}

#[test]
fn a_blade_that_meets_nothing_and_one_that_is_cut_short_are_told() {
    let far = "[[0, [9, 9, 9], [9, 9, 8]], [0.02, [9, 8, 9], [9, 8, 8]]]";
    let mut s = simulation(&beam(far, "", STEPS));
    go(&mut s, 3, 0.01);
    assert_eq!(s.warnings(), ["the blade of cut 0 meets no body on its way"]);
    assert!(s.cuts().is_empty());
    let s = simulation(&beam(DOWN, "", "scheme = 'backward-euler'\ndt = 0.01\nend = 0.1"));
    assert_eq!(
        s.warnings(),
        ["the blade of cut[0] moves until 0.2 s: the run ends at 0.1 s"]
    );
}
