//! Order 2 in whole scenes: as accurate as it should be, and through cuts.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::{Frame, Scene, Simulation};
use kerfem_mesh::VertexId;
use nalgebra::Vector3;

use super::{box_scene, nodal, simulation};

/// A large square in the plane `x = at`, a little askew.
fn blade(at: f64) -> Sweep {
    let p = |y: f64, z: f64| Vector3::new(at + 0.013 * y - 0.017 * z, y, z);
    let points = vec![p(-5.0, -5.0), p(5.0, -5.0), p(5.0, 5.0), p(-5.0, 5.0)];
    Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0
}

fn moving(mass: &str) -> String {
    let sections = format!(
        "[model]\norder = 2\nmass = '{mass}'\n[initial]\nvelocity = ['0.3*sin(3*y)', 'x*z', '0.4*cos(2*x)']\n[[fixed]]\n\
         where = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -9.81]\n[[load]]\nwhere = 'z > 0.999'\ntraction = [0, 0, -50]\n\
         [[probe]]\nname = 'p'\npoint = [1.5, 0.4, 0.3]\n[time]\nscheme = 'midpoint'\ndt = 0.01\nend = 1\n"
    );
    box_scene([2.0, 1.0, 1.0], [4, 2, 2], &sections)
}

#[test]
fn a_cut_of_a_moving_body_keeps_what_it_must() {
    let methods = [
        Method::Subdivide,
        Method::Snap,
        Method::Hybrid,
        Method::Collapse,
        Method::Merge,
    ];
    for (k, method) in methods.into_iter().enumerate() {
        let mut s = simulation(&moving(["lumped", "consistent"][k % 2]));
        s.record_figures(true);
        s.verify(true);
        for _ in 0..3 {
            assert!(s.step(0.01).unwrap().converged);
        }
        let frame = [Frame::Deformed, Frame::Rest][k / 2 % 2];
        for at in [1.07, 0.61] {
            let scale = (2.0 * s.energies().kinetic).sqrt();
            let record = s.cut_in_frame(frame, &blade(at), &CutOptions::of(method)).unwrap();
            assert!(
                record.refused.is_empty() && record.pieces_after > record.pieces_before,
                "{method:?}"
            );
            assert!(
                record.mass_change_relative.abs() < 1e-12 && record.momentum_change_relative < 1e-12,
                "{record:?}"
            );
            assert!(
                record.velocity_correction < 0.05 * scale,
                "{} of {scale}",
                record.velocity_correction
            );
            let verified = s.verification().unwrap();
            assert_eq!(verified.invariants, "ok", "{method:?} {frame:?}");
            assert_eq!(verified.stiffness_max_relative_difference, 0.0);
            assert_eq!(verified.mass_max_relative_difference, 0.0);
            for _ in 0..3 {
                assert!(s.step(0.01).unwrap().converged, "{method:?}");
            }
        }
    }
}

#[test]
fn a_planar_body_is_cut_too() {
    let text = "name = 'plate'\n[mesh]\nplate2d = { size = [2, 1], cells = [6, 3] }\n[material]\nyoung = 1e5\npoisson = 0.3\n\
         density = 1000\n[model]\norder = 2\n[initial]\nvelocity = ['0.3*sin(3*y)', 'x']\n[[fixed]]\nwhere = 'x < 1e-9'\n\
         [[load]]\nwhere = 'y > 0.999'\ntraction = [0, -50]\n[time]\nscheme = 'newmark'\ndt = 0.01\nend = 1\n";
    let mut s = Simulation::planar(Scene::parse(text, "plate.toml").unwrap()).unwrap();
    s.record_figures(true);
    s.verify(true);
    for method in [Method::Subdivide, Method::Hybrid, Method::Snap] {
        for _ in 0..3 {
            assert!(s.step(0.01).unwrap().converged);
        }
        let x = s.cuts().len() as f64 * 0.4 + 0.53;
        let line = [Vector3::new(x, -1.0, 0.0), Vector3::new(x + 0.1, 2.0, 0.0)];
        let sweep = Sweep::from_segments(line.to_vec(), vec![[0, 1]]).unwrap().0;
        let record = s.cut(&sweep, &CutOptions::of(method)).unwrap();
        assert!(
            record.refused.is_empty() && record.pieces_after == record.pieces_before + 1,
            "{method:?}"
        );
        assert_eq!(s.verification().unwrap().invariants, "ok", "{method:?}");
    }
    assert!(s.v().iter().skip(2).step_by(3).all(|z| *z == 0.0));
}

#[test]
fn a_body_falls_as_one_and_its_parts_too() {
    let sections = "[model]\norder = 2\n[[load]]\ngravity = [0, 0, -9.81]\n[time]\nscheme = 'newmark'\ndt = 0.01\nend = 1\n\
         [solver]\ntolerance = 1e-12\n";
    let mut s = simulation(&box_scene([1.0, 1.0, 1.0], [2, 2, 2], sections));
    for step in 0..10 {
        if step == 4 {
            assert!(s.cut(&blade(0.43), &CutOptions::default()).unwrap().refused.is_empty());
        }
        s.step(0.01).unwrap();
    }
    let off = |v: VertexId| (nodal(s.v(), v.index()) - Vector3::new(0.0, 0.0, -0.981)).norm();
    let worst = s.mesh().vertex_ids().map(off).fold(0.0, f64::max);
    assert!(worst < 1e-9, "{worst}");
}

/// Deflection of the end of a cantilever under a shear traction.
fn deflection(order: u32, cells: [usize; 3], extra: &str) -> f64 {
    let sections = format!(
        "[model]\nkind = 'linear'\norder = {order}\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 3.999'\n\
         traction = [0, 0, -100]\n[[quantity]]\nname = 'end'\nmean = 'uz'\nwhere = 'x > 3.999'\n{extra}"
    );
    let mut s = simulation(&box_scene([4.0, 1.0, 1.0], cells, &sections));
    assert!(s.step(1.0).unwrap().converged);
    s.quantities()["end"].unwrap()
}

#[test]
fn a_coarse_quadratic_beam_is_better_than_a_fine_linear_one() {
    let reference = deflection(2, [16, 4, 4], "");
    let off = |found: f64| (found / reference - 1.0).abs();
    let (linear, quadratic) = (off(deflection(1, [16, 4, 4], "")), off(deflection(2, [8, 2, 2], "")));
    assert!(quadratic < 0.01 && linear > 5.0 * quadratic, "{quadratic} {linear}");
    // by Timoshenko's theory with a shear factor of 5/6, without the warping that the clamp holds
    let (force, inertia, shear) = (100.0f64, 1.0 / 12.0, 1e5 / 2.6);
    let beam = force * 64.0 / (3.0 * 1e5 * inertia) + force * 4.0 / (5.0 / 6.0 * shear);
    assert!((reference / -beam - 1.0).abs() < 0.03, "{reference} {beam}");
}

#[test]
fn sets_given_by_vertices_hold_the_edges_between_them() {
    let numbers: Vec<String> = (0..27).filter(|i| i % 3 == 0).map(|i: usize| i.to_string()).collect();
    let list = format!("[[fixed]]\nvertices = [{}]\n", numbers.join(", "));
    let tail = "[model]\nkind = 'linear'\norder = 2\n[[load]]\nwhere = 'x > 0.999'\ntraction = [0, 0, -100]\n\
         [[quantity]]\nname = 'pull'\nreaction = 'z'\nwhere = 'x < 1e-9'\n[[quantity]]\nname = 'end'\nmin = 'uz'\n";
    let quantities = |fixed: &str, cut: bool| {
        let mut s = simulation(&box_scene([1.0; 3], [2; 3], &format!("{fixed}{tail}")));
        if cut {
            let half = [
                [-0.1, 0.46, -1.0],
                [0.7, 0.46, -1.0],
                [0.7, 0.46, 2.0],
                [-0.1, 0.46, 2.0],
            ];
            let points = half.map(Vector3::from).to_vec();
            let sweep = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0;
            assert!(s.cut(&sweep, &CutOptions::of(Method::Subdivide)).unwrap().cells_added > 0);
        }
        assert!(s.step(1.0).unwrap().converged);
        (s.quantities()["pull"].unwrap(), s.quantities()["end"].unwrap())
    };
    for cut in [false, true] {
        let (by_list, by_place) = (
            quantities(&list, cut),
            quantities("[[fixed]]\nwhere = 'x < 1e-9'\n", cut),
        );
        assert!((by_list.0 - 100.0).abs() < 1e-6, "{by_list:?}");
        assert!((by_list.1 / by_place.1 - 1.0).abs() < 1e-8, "{by_list:?} {by_place:?}");
    }
}

/// A cube all of whose boundary vertices are given one by one, each with the displacement that `of` says.
fn vertex_by_vertex(of: impl Fn(Vector3<f64>) -> [f64; 3], tail: &str) -> Simulation {
    let plain = simulation(&box_scene([1.0; 3], [2; 3], ""));
    let on_boundary = |p: &Vector3<f64>| p.iter().any(|x| x.abs() < 1e-9 || (x - 1.0).abs() < 1e-9);
    let held = plain.mesh().vertex_ids().map(|v| (v, plain.mesh().rest_position(v)));
    let sets = held.filter(|(_, p)| on_boundary(p)).map(|(v, p)| {
        let u = of(p);
        format!("[[fixed]]\nvertices = [{}]\ndisplacement = {u:?}\n", v.0)
    });
    let sets: String = sets.collect();
    simulation(&box_scene(
        [1.0; 3],
        [2; 3],
        &format!("{sets}[model]\nkind = 'linear'\norder = 2\n{tail}"),
    ))
}

#[test]
fn a_displacement_given_vertex_by_vertex_holds_the_edges_of_the_boundary() {
    // an affine field, which is then that of the whole body
    let of = |p: Vector3<f64>| {
        [
            0.01 * p.x + 0.003 * p.y,
            -0.002 * p.x + 0.004 * p.z,
            0.001 * p.y - 0.002 * p.z,
        ]
    };
    let tail = "[solver]\ntolerance = 1e-12\n";
    let mut s = vertex_by_vertex(of, tail);
    assert!(s.step(0.0).unwrap().converged);
    let off = |s: &Simulation| {
        let of = |v: VertexId| (nodal(s.u(), v.index()) - Vector3::from(of(s.mesh().rest_position(v)))).amax();
        s.mesh().vertex_ids().map(of).fold(0.0, f64::max)
    };
    assert!(off(&s) < 1e-12, "{}", off(&s));

    // a cut that divides edges of the boundary leaves the rest of them held, in a restored simulation too
    s.cut(&blade(0.23), &CutOptions::of(Method::Subdivide)).unwrap();
    assert!(s.step(0.0).unwrap().converged);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    s.save(&path).unwrap();
    let mut restored = Simulation::restore(&path).unwrap();
    for s in [&mut s, &mut restored] {
        assert!(s.step(0.0).unwrap().converged);
    }
    assert_eq!(s.u(), restored.u());
    let far = |v: &VertexId| s.mesh().rest_position(*v).x > 0.999;
    for v in s.mesh().vertex_ids().filter(far) {
        let off = (nodal(s.u(), v.index()) - Vector3::from(of(s.mesh().rest_position(v)))).amax();
        assert!(off < 1e-12, "{off}");
    }
}

#[test]
fn between_vertices_that_are_held_the_boundary_follows_their_mean_and_the_inside_is_free() {
    let of = |p: Vector3<f64>| [0.1 * p.y * p.z, 0.0, 0.0];
    let mut s = vertex_by_vertex(of, "");
    assert!(s.step(0.0).unwrap().converged);
    let at = |place: [f64; 3]| {
        let mut all = s.mesh().vertex_ids();
        let found = all.find(|v| (s.mesh().rest_position(*v) - Vector3::from(place)).norm() < 1e-12);
        nodal(s.u(), found.unwrap().index()).x
    };
    // between (0, 0, 0) and (0, 1/2, 1/2)
    assert!((at([0.0, 0.25, 0.25]) - 0.0125).abs() < 1e-12);
    // between (1/2, 1/2, 0) and (1/2, 1, 1/2), through the body
    let inside = at([0.5, 0.75, 0.25]);
    assert!((inside - 0.025).abs() > 1e-4, "{inside}");
}

#[test]
fn a_restored_simulation_goes_on_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    let go = |saved: bool| {
        let mut s = simulation(&moving("lumped"));
        for step in 0..8 {
            if step == 2 || step == 5 {
                s.cut(&blade(0.2 + 0.2 * f64::from(step)), &CutOptions::default())
                    .unwrap();
            }
            s.step(0.01).unwrap();
            if saved && step % 3 == 2 {
                s.save(&path).unwrap();
                s = Simulation::restore(&path).unwrap();
            }
        }
        s.u().iter().chain(s.v()).map(|x| x.to_bits()).collect::<Vec<u64>>()
    };
    assert_eq!(go(false), go(true));
}
