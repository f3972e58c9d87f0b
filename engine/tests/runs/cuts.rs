//! Cuts in the middle of everything.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::{Frame, Simulation};
use nalgebra::Vector3;

use super::{box_scene, nodal, simulation, weighted};

/// A large square in the plane `x = at`, a little askew.
fn blade(at: f64) -> Sweep {
    let p = |y: f64, z: f64| Vector3::new(at + 0.013 * y - 0.017 * z, y, z);
    let points = vec![p(-5.0, -5.0), p(5.0, -5.0), p(5.0, 5.0), p(-5.0, 5.0)];
    Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0
}

fn options(method: Method) -> CutOptions {
    CutOptions::of(method)
}

const MOVING: &str = "[initial]\nvelocity = ['0.3*sin(3*y)', 'x*z', '0.4*cos(2*x)']\n[[fixed]]\nwhere = 'x < 1e-9'\n\
    [[load]]\ngravity = [0, 0, -9.81]\n[[load]]\nwhere = 'z > 0.999'\ntraction = [0, 0, -50]\n\
    [time]\nscheme = 'backward-euler'\ndt = 0.01\nend = 1\n";

fn moving() -> Simulation {
    let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [6, 3, 3], MOVING));
    s.record_figures(true);
    s.verify(true);
    for _ in 0..5 {
        assert!(s.step(0.01).unwrap().converged);
    }
    s
}

#[test]
fn every_method_keeps_what_it_must() {
    for method in [
        Method::Subdivide,
        Method::Snap,
        Method::Hybrid,
        Method::Collapse,
        Method::Merge,
    ] {
        for frame in [Frame::Deformed, Frame::Rest] {
            let mut s = moving();
            let record = s.cut_in_frame(frame, &blade(1.07), &options(method)).unwrap();
            assert!(record.refused.is_empty(), "{method:?}: {:?}", record.refused);
            assert_eq!(
                (record.pieces_before, record.pieces_after),
                (1, 2),
                "{method:?} {frame:?}"
            );
            assert!(record.volume_change_relative.abs() < 1e-12 && record.mass_change_relative.abs() < 1e-12);
            assert!(
                record.momentum_change_relative < 1e-12,
                "{method:?}: {}",
                record.momentum_change_relative
            );
            let verified = s.verification().unwrap();
            assert_eq!(verified.invariants, "ok", "{method:?} {frame:?}");
            assert_eq!(verified.stiffness_max_relative_difference, 0.0);
            for _ in 0..5 {
                let info = s.step(0.01).unwrap();
                assert!(info.converged, "{method:?}: {info:?}");
            }
            let far = |v: &kerfem_mesh::VertexId| s.mesh().rest_position(*v).x > 1.99;
            let fallen = s
                .mesh()
                .vertex_ids()
                .filter(far)
                .all(|v| nodal(s.v(), v.index()).z < -0.3);
            assert!(fallen, "the free half falls");
        }
    }
}

#[test]
fn deleted_cells_take_their_mass_along() {
    let mut s = moving();
    let record = s
        .cut_in_frame(Frame::Rest, &blade(1.07), &options(Method::Delete))
        .unwrap();
    assert!(record.cells_removed > 0 && record.cells_added <= record.cells_removed);
    assert!(record.volume_change_relative < -1e-3);
    assert_eq!(s.verification().unwrap().invariants, "ok");
    assert!(s.step(0.01).unwrap().converged);
}

#[test]
fn linear_momentum_is_kept_by_a_cut_through_a_free_body() {
    let text = MOVING.replace("[[fixed]]\nwhere = 'x < 1e-9'\n", "");
    let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [6, 3, 3], &text));
    for _ in 0..3 {
        s.step(0.01).unwrap();
    }
    let momenta = |s: &Simulation| {
        let mut sum = (Vector3::zeros(), Vector3::zeros());
        for c in s.mesh().cell_ids() {
            // consistent mass: m/20 (1 + delta)
            let m = 1000.0 * kerfem_mesh::quality::tet_volume(&s.mesh().cell_rest_positions(c)) / 20.0;
            let corners = s.mesh().cell(c);
            let x = corners.map(|v| s.mesh().rest_position(v) + nodal(s.u(), v.index()));
            let v = corners.map(|v| nodal(s.v(), v.index()));
            for i in 0..4 {
                sum.0 += 5.0 * m * v[i];
                for j in 0..4 {
                    sum.1 += m * (1.0 + f64::from(u8::from(i == j))) * x[i].cross(&v[j]);
                }
            }
        }
        sum
    };
    let (p, l) = momenta(&s);
    let record = s.cut(&blade(0.93), &options(Method::Hybrid)).unwrap();
    assert!(record.vertices_moved > 0 && record.velocity_correction > 0.0);
    let (q, m) = momenta(&s);
    assert!((p - q).norm() < 1e-12 * p.norm(), "{}", (p - q).norm());
    assert!((l - m).norm() < 1e-11 * l.norm(), "{}", (l - m).norm());
    let whole = weighted(&s, 1000.0, |i| nodal(s.v(), i));
    assert!((whole - q).norm() < 1e-9);
}

#[test]
fn a_cut_in_the_air_changes_nothing_and_says_so() {
    let mut s = moving();
    let before = s.state().clone();
    let record = s.cut(&blade(7.0), &options(Method::Hybrid)).unwrap();
    assert_eq!((record.cells_added, record.rows_updated), (0, 0));
    assert_eq!(*s.state(), before);
    assert!(s.warnings().iter().any(|w| w.contains("changes nothing")));
}

#[test]
fn a_cut_touches_as_much_of_a_large_mesh_as_of_a_small_one() {
    let touched = |n: usize| {
        let mut s = simulation(&box_scene(
            [n as f64, 4.0, 4.0],
            [n, 4, 4],
            "[time]\nscheme = 'evaluate'",
        ));
        let p = |x: f64, z: f64| Vector3::new(x, 2.03 + 0.01 * x, z);
        let points = vec![p(1.3, 1.2), p(2.7, 1.2), p(2.7, 2.8), p(1.3, 2.8)];
        let sweep = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0;
        let record = s.cut_in_frame(Frame::Rest, &sweep, &options(Method::Hybrid)).unwrap();
        assert!(record.cells_added > 0, "{record:?}");
        (record.rows_updated, record.cells_updated, record.cells_added)
    };
    assert_eq!(touched(4), touched(40));
}

#[test]
fn probes_follow_their_side_of_a_cut() {
    let probe =
        "[[probe]]\nname = 'near'\npoint = [0.6, 0.41, 0.52]\n[[probe]]\nname = 'far'\npoint = [1.45, 0.41, 0.52]\n";
    let folder = tempfile::tempdir().unwrap();
    let surface = "v 1.07 -5 -5\nv 1.07 5 -5\nv 1.07 5 5\nv 1.07 -5 5\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(folder.path().join("blade.obj"), surface).unwrap();
    let cut = "[[cut]]\nat = 0.05\nsweep = 'blade.obj'\nframe = 'rest'\n";
    let point = |name: &str, c: &str| {
        format!("[[quantity]]\nname = '{name}.{c}'\npoint = [1.45, 0.41, 0.52]\ncomponent = 'u{c}'\n")
    };
    let points = ["x", "y", "z"].map(|c| point("far", c)).concat();
    let text = box_scene([2.0, 1.0, 1.0], [6, 3, 3], &format!("{MOVING}{probe}{points}{cut}"));
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let scene = kerfem_engine::Scene::read(&path).unwrap();
    let options = kerfem_engine::run::RunOptions {
        folder: folder.path().join("result"),
        verify: true,
        until: Some(0.3),
        ..Default::default()
    };
    let mut steps = 0;
    let ending = kerfem_engine::run::run(scene, &options, |info| {
        steps += 1;
        assert!(info.converged);
        true
    });
    assert_eq!(ending.unwrap(), kerfem_engine::run::Ending::Done);
    assert_eq!(steps, 30);
    let table = std::fs::read_to_string(options.folder.join("steps.csv")).unwrap();
    let mut lines = table.lines();
    let column = |name: &str, lines: &str| lines.split(',').position(|c| c == name).unwrap();
    let head = lines.next().unwrap();
    assert!(
        head.ends_with(",write_s,probe.near.x,probe.near.y,probe.near.z,probe.far.x,probe.far.y,probe.far.z"),
        "{head}"
    );
    let (near, far) = (column("probe.near.z", head), column("probe.far.z", head));
    let rows: Vec<Vec<f64>> = lines
        .map(|l| l.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 30);
    let last = rows.last().unwrap();
    assert!(last[far] < last[near] - 0.2, "{} {}", last[near], last[far]);
    let report: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(options.folder.join("report.json")).unwrap()).unwrap();
    for c in ["x", "y", "z"] {
        let quantity = report["quantities"][format!("far.{c}")].as_f64().unwrap();
        let followed = last[column(&format!("probe.far.{c}"), head)];
        assert!((quantity - followed).abs() < 1e-12, "{c}: {quantity} {followed}");
    }
    assert_eq!(report["cuts"][0]["pieces_after"], 2);
    assert_eq!(report["verify"]["invariants"], "ok");
    assert_eq!(report["mesh"]["final"]["pieces"], 2);
}

/// G3, G5: a budget of one operation a step spreads the improvement of cells over later steps; K and M equal a fresh assembly
/// after every single operation, and momentum is kept.
#[test]
fn what_a_cut_leaves_over_is_done_in_later_steps() {
    let free = MOVING.replace("[[fixed]]\nwhere = 'x < 1e-9'\n", "").replace(
        "[[load]]\ngravity = [0, 0, -9.81]\n[[load]]\nwhere = 'z > 0.999'\ntraction = [0, 0, -50]\n",
        "",
    );
    let corners = [[0.6, -1.0, -1.0], [1.6, 2.0, -1.0], [1.9, 2.0, 2.0], [0.9, -1.0, 2.0]];
    let askew = Sweep::new(corners.map(Vector3::from).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        .unwrap()
        .0;
    for method in [Method::Collapse, Method::Merge, Method::Hybrid] {
        let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [6, 3, 3], &free));
        s.verify(true);
        s.step(0.01).unwrap();
        let budget = CutOptions {
            operations: 1,
            quality: 0.4,
            ..options(method)
        };
        let momentum = |s: &Simulation| weighted(s, 1000.0, |i| nodal(s.v(), i));
        let before = momentum(&s);
        let record = s.cut(&askew, &budget).unwrap();
        assert!(
            record.operations == 1 && record.unfinished > 3,
            "{method:?}: {record:?}"
        );
        let cells = s.mesh().num_cells();
        for _ in 0..60 {
            assert!(s.step(0.002).unwrap().converged);
        }
        let verified = s.verification().unwrap();
        assert_eq!(verified.invariants, "ok", "{method:?}");
        assert_eq!(verified.stiffness_max_relative_difference, 0.0);
        assert_eq!(verified.mass_max_relative_difference, 0.0);
        assert_ne!(s.mesh().num_cells(), cells, "{method:?}");
        let lost = (momentum(&s) - before).norm();
        assert!(lost < 1e-9 * before.norm(), "{method:?}: {lost}");
    }
}

/// F32: nothing keeps cut faces apart; how far they went through each other is told.
#[test]
fn f32_lips_that_went_through_each_other_are_told() {
    for (push, overlap) in [(-0.1, 0.1), (-0.02, 0.02), (0.1, 0.0)] {
        let sections = format!(
            "[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > 1.999'\ndisplacement = [{push}, 0.0, 0.0]\n[time]\nscheme = 'static'\n"
        );
        let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [6, 3, 3], &sections));
        let record = s
            .cut_in_frame(Frame::Rest, &blade(1.07), &options(Method::Hybrid))
            .unwrap();
        assert_eq!((record.refused.len(), s.mesh().pieces().1, s.overlap()), (0, 2, 0.0));
        assert!(s.step(1.0).unwrap().converged);
        assert!((s.overlap() - overlap).abs() < 1e-6, "{push}: {}", s.overlap());
    }
}
