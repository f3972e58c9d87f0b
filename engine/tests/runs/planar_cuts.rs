//! Cuts of planar bodies by line segments.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::{AnySimulation, Frame, Scene, Simulation};
use nalgebra::Vector3;

use super::nodal;

fn line(points: &[[f64; 2]]) -> Sweep {
    let segments = (1..points.len()).map(|k| [k - 1, k]).collect();
    let points = points.iter().map(|[x, y]| Vector3::new(*x, *y, 0.0)).collect();
    Sweep::from_segments(points, segments).unwrap().0
}

fn options(method: Method) -> CutOptions {
    CutOptions::of(method)
}

const MOVING: &str = "name = 'plate'\n[mesh]\nplate = { size = [2, 1], cells = [12, 6] }\n[material]\nyoung = 1e5\n\
    poisson = 0.3\ndensity = 1000\nplane = 'stress'\nthickness = 0.3\n[initial]\nvelocity = ['0.3*sin(3*y)', '0.2*x*y']\n\
    [[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, -9.81]\n[[load]]\nwhere = 'y > 0.999'\ntraction = [0, -50]\n\
    [time]\nscheme = 'backward-euler'\ndt = 0.01\nend = 1\n";

fn moving(text: &str) -> Simulation<3> {
    let mut s = Simulation::planar(Scene::parse(text, "test.toml").unwrap()).unwrap();
    s.record_figures(true);
    s.verify(true);
    for _ in 0..4 {
        assert!(s.step(0.01).unwrap().converged);
    }
    s
}

#[test]
fn every_method_keeps_what_it_must() {
    for method in [Method::Subdivide, Method::Snap, Method::Hybrid, Method::Delete] {
        for frame in [Frame::Deformed, Frame::Rest] {
            let mut s = moving(MOVING);
            let through = line(&[[1.03, -1.0], [1.11, 0.4], [1.05, 2.0]]);
            let record = s.cut_in_frame(frame, &through, &options(method)).unwrap();
            assert!(record.refused.is_empty(), "{method:?}: {:?}", record.refused);
            assert_eq!(
                (record.pieces_before, record.pieces_after),
                (1, 2),
                "{method:?} {frame:?}"
            );
            if method == Method::Delete {
                assert!(record.mass_change_relative < -1e-3);
            } else {
                assert!(record.volume_change_relative.abs() < 1e-12 && record.mass_change_relative.abs() < 1e-12);
                assert!(
                    record.momentum_change_relative < 1e-12,
                    "{}",
                    record.momentum_change_relative
                );
                // one lip: length times thickness, the body a little deformed
                assert!((record.area_m2 / 0.3 - 1.01).abs() < 0.1, "{}", record.area_m2);
            }
            let verified = s.verification().unwrap();
            assert_eq!(verified.invariants, "ok", "{method:?} {frame:?}");
            let differences = (
                verified.stiffness_max_relative_difference,
                verified.mass_max_relative_difference,
            );
            assert_eq!(differences, (0.0, 0.0));
            for _ in 0..5 {
                let info = s.step(0.01).unwrap();
                assert!(info.converged, "{method:?}: {info:?}");
            }
            assert!(s.u().iter().chain(s.v()).skip(2).step_by(3).all(|z| *z == 0.0));
            let right = s.mesh().vertex_ids().filter(|v| s.mesh().rest_position(*v).x > 1.99);
            assert!(
                right.into_iter().all(|v| nodal(s.v(), v.index()).y < -0.3),
                "the free half falls"
            );
        }
    }
}

#[test]
fn many_cuts_in_a_moving_body_keep_every_invariant_and_the_same_bits() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut s = moving(MOVING);
            let mut rows = 0;
            for k in 0..12 {
                let (a, b) = (0.7 * f64::from(k), 1.3 * f64::from(k) + 2.0);
                let cut = line(&[
                    [1.0 + 0.9 * a.sin(), 0.5 + 0.6 * a.cos()],
                    [1.0 + 0.8 * b.cos(), 0.5 + 0.5 * b.sin()],
                ]);
                let method = [Method::Hybrid, Method::Subdivide, Method::Snap][k as usize % 3];
                let record = s.cut(&cut, &options(method)).unwrap();
                rows += record.rows_updated;
                assert_eq!(s.verification().unwrap().invariants, "ok", "cut {k}");
                assert!(s.step(0.01).unwrap().converged, "cut {k}");
            }
            assert!(rows > 100 && s.mesh_figures().cells > 144);
            (s.u().to_vec(), s.v().to_vec(), s.energies())
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(8));
}

#[test]
fn momenta_of_a_free_body_survive_vertices_that_move() {
    let mut s = moving(&MOVING.replace("[[fixed]]\nwhere = 'x < 1e-9'\n", ""));
    let momenta = |s: &Simulation<3>| {
        let mut sum = (Vector3::zeros(), Vector3::zeros());
        for c in s.mesh().cell_ids() {
            // consistent mass: m/12 (1 + delta)
            let m = 1000.0 * 0.3 * kerfem_mesh::quality::cell_volume(&s.mesh().cell_rest_positions(c)) / 12.0;
            let corners = s.mesh().cell(c);
            let x = corners.map(|v| s.mesh().rest_position(v) + nodal(s.u(), v.index()));
            let v = corners.map(|v| nodal(s.v(), v.index()));
            for i in 0..3 {
                sum.0 += 4.0 * m * v[i];
                for j in 0..3 {
                    sum.1 += m * (1.0 + f64::from(u8::from(i == j))) * x[i].cross(&v[j]);
                }
            }
        }
        sum
    };
    let (p, l) = momenta(&s);
    let record = s
        .cut(&line(&[[0.9, -2.0], [1.03, 3.0]]), &options(Method::Hybrid))
        .unwrap();
    assert!(record.vertices_moved > 0 && record.velocity_correction > 0.0);
    let (q, m) = momenta(&s);
    assert!((p - q).norm() < 1e-12 * p.norm(), "{}", (p - q).norm());
    assert!(
        (l - m).norm() < 1e-11 * l.norm() && m.x == 0.0 && m.y == 0.0,
        "{}",
        (l - m).norm()
    );
}

const CUT_PLATE: &str = "name = 'plate'\n[mesh]\nplate = { size = [2, 1], cells = [8, 4] }\n[material]\nyoung = 1e5\n\
    poisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 1.999'\ntraction = [5, 0]\n\
    [[cut]]\nsweep = 'cut.obj'\nframe = 'rest'\n[[quantity]]\nname = 'end'\nmean = 'ux'\nwhere = 'x > 1.999'\n";

fn cut_plate(obj: &str) -> Result<AnySimulation, kerfem_engine::EngineError> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cut.obj"), obj).unwrap();
    AnySimulation::new(Scene::parse(CUT_PLATE, folder.path().join("test.toml"))?)
}

#[test]
fn a_slit_softens_and_a_cut_through_leaves_a_piece_that_is_named() {
    let solved = |obj: &str| match cut_plate(obj).unwrap() {
        AnySimulation::Planar(mut s) => s.step(0.0).map(|_| s.quantities()["end"].unwrap()),
        AnySimulation::Solid(_) => panic!("a plate is planar"),
    };
    let whole = solved("v 5 5 0\nv 6 5 0\nl 1 2\n").unwrap();
    let slit = solved("v 1.02 -1 0\nv 0.98 0.5 0\nl 1 2\n").unwrap();
    assert!(
        whole > 0.8 * 2.0 * 5e-5 && slit > 1.2 * whole && slit < 10.0 * whole,
        "{whole} {slit}"
    );
    let stopped = solved("v 1.02 -1 0\nv 0.98 0.5 0\nv 1 3 0\nl 1 2 3\n").unwrap_err();
    assert_eq!(stopped.exit_code(), 3);
    let text = stopped.to_string();
    assert!(
        text.contains("piece 2 of 2") && text.contains("free to move along x"),
        "{text}"
    );
}

#[test]
fn a_sweep_of_the_other_kind_is_refused() {
    let text = cut_plate("v 1 -1 0\nv 1 2 0\nv 1 2 1\nf 1 2 3\n")
        .unwrap_err()
        .to_string();
    assert!(
        text.ends_with("cut.sweep: cut.obj: it holds no line segment; triangles in the plane are cut by line segments"),
        "{text}"
    );
    let text = cut_plate("v 1 -1 0\nv 1 2 0.5\nl 1 2\n").unwrap_err().to_string();
    assert!(
        text.contains("point 1 is (1, 2, 0.5); a planar sweep lies in z = 0"),
        "{text}"
    );
}

#[test]
fn a_listed_set_takes_new_vertices_of_its_own_edges_only() {
    // a strip one cell wide, held at all its vertices: every edge has both ends in the set, those across only inside
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cut.obj"), "v -1 0.4 0\nv 3 0.6 0\nl 1 2\n").unwrap();
    let text = "name = 'strip'\n[mesh]\nplate = { size = [2, 1], cells = [4, 1] }\n[material]\nyoung = 1e5\npoisson = 0.3\n\
        density = 1000\n[[fixed]]\nvertices = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]\n[[load]]\ngravity = [0, -10]\n[[cut]]\n\
        sweep = 'cut.obj'\nmethod = 'subdivide'\n";
    let scene = Scene::parse(text, folder.path().join("test.toml")).unwrap();
    let mut s = Simulation::planar(scene).unwrap();
    assert!(s.step(0.0).unwrap().converged);
    let new = |v: &kerfem_mesh::VertexId| v.0 >= 10;
    let (ends, inside): (Vec<_>, Vec<_>) =
        (s.mesh().vertex_ids().filter(new)).partition(|v| [0.0, 2.0].contains(&s.mesh().rest_position(*v).x));
    assert_eq!(ends.len(), 4, "two copies at either end");
    assert!(ends.iter().all(|v| nodal(s.u(), v.index()) == Vector3::zeros()));
    assert!(inside.len() >= 6 && inside.iter().all(|v| nodal(s.u(), v.index()).y < 0.0));
}

#[test]
fn probes_follow_their_side_of_a_cut() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cut.obj"), "v 1.05 -1 0\nv 1.12 2 0\nl 1 2\n").unwrap();
    let point = |name: &str, x: f64| {
        format!(
            "[[probe]]\nname = '{name}'\npoint = [{x}, 0.45]\n[[quantity]]\nname = '{name}'\npoint = [{x}, 0.45]\n\
             component = 'uy'\n"
        )
    };
    // both lie in cells that the cut divides
    let text = format!(
        "{MOVING}[[cut]]\nat = 0.05\nsweep = 'cut.obj'\nframe = 'rest'\n{}{}",
        point("near", 1.04),
        point("far", 1.13)
    );
    let scene = Scene::parse(&text, folder.path().join("test.toml")).unwrap();
    let options = kerfem_engine::run::RunOptions {
        folder: folder.path().join("out"),
        verify: true,
        until: Some(0.3),
        ..Default::default()
    };
    kerfem_engine::run::run(scene, &options, |_| true).unwrap();
    let table = std::fs::read_to_string(options.folder.join("steps.csv")).unwrap();
    let head: Vec<&str> = table.lines().next().unwrap().split(',').collect();
    assert_eq!(
        head[16..],
        [
            "probe.near.x",
            "probe.near.y",
            "probe.near.z",
            "probe.far.x",
            "probe.far.y",
            "probe.far.z"
        ]
    );
    let last: Vec<f64> = table
        .lines()
        .last()
        .unwrap()
        .split(',')
        .map(|x| x.parse().unwrap())
        .collect();
    let report = std::fs::read_to_string(options.folder.join("report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    for (name, column) in [("near", 17), ("far", 20)] {
        let quantity = report["quantities"][name].as_f64().unwrap();
        assert!(
            (last[column] - quantity).abs() < 1e-12,
            "{name}: {} {quantity}",
            last[column]
        );
        assert_eq!(last[column + 1], 0.0);
    }
    assert!(
        (last[20] - last[17]).abs() > 0.01,
        "on two pieces: {} {}",
        last[20],
        last[17]
    );
    assert_eq!(report["verify"]["invariants"], "ok");
}
