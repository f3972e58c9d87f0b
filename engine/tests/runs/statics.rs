//! Equilibrium.

use kerfem_engine::run::{Ending, RunOptions, run};
use kerfem_engine::{Scene, Simulation};

use super::{box_scene, nodal, simulation};

const CLAMP_AND_PULL: &str = "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 3.999'\ntraction = [0, 0, -1]\n\
    [[quantity]]\nname = 'tip'\nmean = 'uz'\nwhere = 'x > 3.999'\n[[quantity]]\nname = 'held'\nreaction = 'z'\nwhere = 'x < 1e-9'\n";

#[test]
fn a_cantilever_bends_as_beam_theory_says_in_order_of_magnitude() {
    let scene = box_scene(
        [4.0, 1.0, 1.0],
        [16, 4, 4],
        &format!("{CLAMP_AND_PULL}[model]\nkind = 'linear'"),
    );
    let mut s = simulation(&scene);
    let info = s.step(0.0).unwrap();
    assert!(info.converged && info.residual < 1e-8);
    let tip = s.quantities()["tip"].unwrap();
    let beam = -4f64.powi(3) / (3.0 * 1e5 / 12.0);
    assert!(tip / beam > 0.7 && tip / beam < 1.1, "{tip} against {beam}");
    assert!((s.quantities()["held"].unwrap() - 1.0).abs() < 1e-8);
    // work of a load that grows from zero
    assert!((s.energies().elastic + 0.5 * s.energies().potential).abs() < 1e-9 * s.energies().elastic);
}

#[test]
fn large_loads_bend_the_corotated_beam_less() {
    let sections = CLAMP_AND_PULL.replace("-1]", "-800]");
    let tip = |model: &str| {
        let scene = box_scene(
            [4.0, 1.0, 1.0],
            [8, 2, 2],
            &format!("{sections}[model]\nkind = '{model}'"),
        );
        let mut s = simulation(&scene);
        let info = s.step(0.0).unwrap();
        assert!(info.converged, "{info:?}");
        s.quantities()["tip"].unwrap()
    };
    let (linear, corotated) = (tip("linear"), tip("corotated"));
    assert!(corotated < 0.0 && corotated > linear, "{corotated} {linear}");
}

#[test]
fn a_free_piece_with_balanced_loads_is_solved_for_without_rigid_motion() {
    let pull = "[[load]]\nwhere = 'x > 1.999'\ntraction = [100, 0, 0]\n[[load]]\nwhere = 'x < 1e-9'\ntraction = [-100, 0, 0]\n";
    for model in ["linear", "corotated"] {
        let scene = box_scene([2.0, 1.0, 1.0], [4, 2, 2], &format!("{pull}[model]\nkind = '{model}'"));
        let mut s = simulation(&scene);
        assert!(s.step(0.0).unwrap().converged);
        let length = |a: f64, axis: usize| {
            let on = |v: &kerfem_mesh::VertexId| (s.mesh().rest_position(*v)[axis] - a).abs() < 1e-9;
            let all: Vec<_> = s.mesh().vertex_ids().filter(on).collect();
            all.iter().map(|v| nodal(s.u(), v.index())[axis]).sum::<f64>() / all.len() as f64
        };
        assert!((length(2.0, 0) - length(0.0, 0) - 2.0 * 100.0 / 1e5).abs() < 1e-8);
        assert!((length(1.0, 1) - length(0.0, 1) + 0.3 * 100.0 / 1e5).abs() < 1e-8);
    }
}

#[test]
fn a_free_piece_with_other_loads_is_named() {
    let scene = box_scene(
        [2.0, 1.0, 1.0],
        [2, 1, 1],
        "[[fixed]]\nwhere = 'z < 1e-9'\naxes = 'z'\n[[load]]\ngravity = [0, 1, -10]",
    );
    let error = simulation(&scene).step(0.0).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert_eq!(
        error.to_string(),
        "stopped at t = 0 s: piece 1 of 1 (12 vertices around (1.000000, 0.500000, 0.500000)) is free to move along y, and \
         its loads do not balance; hold it with [[fixed]] or use a scheme with inertia"
    );
}

#[test]
fn supports_that_leave_only_sliding_are_enough_for_a_load_across() {
    let scene = box_scene(
        [2.0, 1.0, 1.0],
        [2, 1, 1],
        "[[fixed]]\nwhere = 'z < 1e-9'\naxes = 'z'\n[[load]]\ngravity = [0, 0, -10]",
    );
    let mut s = simulation(&scene);
    assert!(s.step(0.0).unwrap().converged);
    let bottom: Vec<_> = s
        .mesh()
        .vertex_ids()
        .filter(|v| s.mesh().rest_position(*v).z < 1e-9)
        .collect();
    assert!(bottom.iter().all(|v| s.u()[3 * v.index() + 2] == 0.0));
}

#[test]
fn prescribed_displacements_may_be_large() {
    let turn = "[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > 3.999'\n\
        displacement = [0, '0.5 + (y - 0.5) * cos(pi/2) - (z - 0.5) * sin(pi/2) - y', '0.5 + (y - 0.5) * sin(pi/2) + (z - 0.5) * cos(pi/2) - z']\n";
    let mut s = simulation(&box_scene([4.0, 1.0, 1.0], [8, 2, 2], turn));
    let info = s.step(0.0).unwrap();
    assert!(info.converged, "{info:?}");
    assert!(info.energies.elastic > 0.0);
}

#[test]
fn an_equilibrium_that_is_not_found_is_said_so() {
    let scene = box_scene(
        [4.0, 1.0, 1.0],
        [8, 2, 2],
        &format!(
            "{CLAMP_AND_PULL}[model]\nkind = 'linear'\n[solver]\nkind = 'cg'\npreconditioner = 'jacobi'\nmax_iterations = 3"
        ),
    );
    let error = simulation(&scene).step(0.0).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(
        error.to_string().contains("no equilibrium was found: residual"),
        "{error}"
    );
}

#[test]
fn evaluate_finds_no_force_in_a_rigid_rotation() {
    let turned = "[initial]\ndisplacement = ['-x - z', 0, 'x - z']\n[time]\nscheme = 'evaluate'";
    let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [2, 2, 2], turned));
    s.step(0.0).unwrap();
    assert!(s.energies().elastic < 1e-20);
    let linear = format!("{turned}\n[model]\nkind = 'linear'");
    let mut s = simulation(&box_scene([2.0, 1.0, 1.0], [2, 2, 2], &linear));
    s.step(0.0).unwrap();
    assert!(s.energies().elastic > 1e4);
}

#[test]
fn regions_have_their_own_material() {
    let scene = box_scene(
        [2.0, 1.0, 1.0],
        [2, 1, 1],
        "[[region]]\nwhere = 'x > 1'\ndensity = 3000",
    );
    let s = simulation(&scene);
    assert!((s.mesh_figures().mass_kg - 4000.0).abs() < 1e-9);
}

#[test]
fn a_cylinder_that_is_pulled_has_the_uniform_state() {
    // held so that it may narrow: vertex 0 is the centre of the end, vertex 1 lies beside it along z
    let text = "name = 'rod'\n[mesh]\ncylinder = { radius = 50, length = 300, layers = 3, slices = 6, axis = [0, 2, 0], \
        origin = [10, 0, -20] }\nscale = 0.01\n[material]\nyoung = 1e5\npoisson = 0.3\ndensity = 1000\n[model]\nkind = 'linear'\n\
        [[fixed]]\nwhere = 'y < 1e-9'\naxes = 'y'\n[[fixed]]\nvertices = [0]\n[[fixed]]\nvertices = [1]\naxes = 'x'\n\
        [[load]]\nwhere = 'y > 2.999'\ntraction = [0, 500, 0]\n[[probe]]\nname = 'end'\npoint = [0.1, 3, -0.2]\n\
        [[quantity]]\nname = 'pull'\nmean = 'uy'\nwhere = 'y > 2.999'\n";
    let mut s = simulation(text);
    assert!(s.step(0.0).unwrap().converged);
    let pull = s.quantities()["pull"].unwrap();
    assert!((pull / (3.0 * 500.0 / 1e5) - 1.0).abs() < 1e-7, "{pull}");
    let area = 9.0 * (std::f64::consts::PI / 9.0).sin() * 0.25;
    assert!((s.mesh_figures().volume_m3 / (3.0 * area) - 1.0).abs() < 1e-12);
}

/// Every kind of load on a held beam, whose sum is (30, -120, 260) N and the weight of 2 m3 of it.
const ALL_LOADS: &str = "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 1.999'\ntraction = [10, -100, 200]\n\
    [[load]]\nwhere = 'z < 1e-9'\npressure = 50\n[[load]]\nwhere = 'x > 1.999'\nforce = [19, -30, -40]\n\
    [[load]]\nvertices = [4, 9]\nnodal = [[0, 4, 0], [1, 6, 0]]\n[[load]]\ngravity = [0, 0.5, -1]\n\
    [[quantity]]\nname = 'x'\nreaction = 'x'\nwhere = 'x < 1e-9'\n[[quantity]]\nname = 'y'\nreaction = 'y'\n\
    where = 'x < 0.5'\n[[quantity]]\nname = 'z'\nreaction = 'z'\nwhere = 'x < 1e-9'\n\
    [solver]\ntolerance = 1e-13\n";

fn check_balance(s: &Simulation, what: &str) {
    let q = s.quantities();
    let total = [30.0, -120.0 + 2000.0 * 0.5, 260.0 - 2000.0];
    for (name, load) in ["x", "y", "z"].into_iter().zip(total) {
        let held = q[name].unwrap();
        println!("{what}: the supports hold {held} N along {name} against {load} N");
        assert!((held + load).abs() < 1e-9 * 1740.0, "{what} {name}: {held} {load}");
    }
}

#[test]
fn reactions_balance_all_loads_at_rest() {
    let folder = tempfile::tempdir().unwrap();
    for model in ["linear", "corotated"] {
        let text = box_scene(
            [2.0, 1.0, 1.0],
            [4, 2, 2],
            &format!("{ALL_LOADS}[model]\nkind = '{model}'\n"),
        );
        let mut s = simulation(&text);
        assert_eq!(s.quantities()["z"], None, "nothing was solved for yet");
        assert!(s.step(0.0).unwrap().converged);
        check_balance(&s, model);

        // the body at rest in that state exerts the same, whatever the scheme
        let options = RunOptions {
            folder: folder.path().join("out"),
            ..RunOptions::default()
        };
        assert_eq!(
            run(Scene::parse(&text, "test.toml").unwrap(), &options, |_| true).unwrap(),
            Ending::Done
        );
        for scheme in ["backward-euler", "midpoint"] {
            let rest = format!(
                "{text}[initial]\ndisplacement = {{ file = 'out/final.vtu', array = 'displacement' }}\n[time]\n\
                 scheme = '{scheme}'\ndt = 0.01\nend = 1\n"
            );
            let rest = rest.replace(
                "density = 1000",
                "density = 1000\ndamping = { mass = 1, stiffness = 0.01 }",
            );
            let mut s = Simulation::new(Scene::parse(&rest, folder.path().join("rest.toml")).unwrap()).unwrap();
            (0..3).for_each(|_| assert!(s.step(0.01).unwrap().converged));
            check_balance(&s, &format!("{model} {scheme}"));
        }
    }
}

#[test]
fn what_is_too_much_at_once_is_found_in_stages() {
    // one end of a bar is led around to the other: from the straight bar, turned inside out by the first step, Newton's method
    // does not come to an end
    let folded = "[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > 3.999'\ndisplacement = [-3, 1, 0]\n";
    let mut s = simulation(&box_scene([4.0, 0.4, 0.4], [16, 2, 2], folded));
    let info = s.step(0.0).unwrap();
    assert!(info.converged && info.residual < 1e-8, "{info:?}");
    assert!(info.newton_steps > 200, "one attempt is not enough: {info:?}");
    // no cell is left inside out
    let x = s.positions();
    let volume = |c| kerfem_mesh::quality::tet_volume(&s.mesh().cell(c).map(|v| x[v.index()]));
    let inverted = s.mesh().cell_ids().filter(|c| volume(*c) <= 0.0).count();
    println!("{inverted} cells inside out, {} J", info.energies.elastic);
    assert_eq!(inverted, 0);
}

#[test]
fn what_no_stage_reaches_is_said_so() {
    let heavy = "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -3000]\n";
    let error = simulation(&box_scene([10.0, 0.2, 0.2], [20, 1, 1], heavy))
        .step(0.0)
        .unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("no equilibrium was found"), "{error}");
}
