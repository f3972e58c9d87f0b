//! Motion.

use nalgebra::Vector3;

use super::{box_scene, nodal, simulation, weighted};

fn stepping(scheme: &str, dt: f64, end: f64) -> String {
    format!("[time]\nscheme = '{scheme}'\ndt = {dt}\nend = {end}\n")
}

#[test]
fn a_falling_body_gains_the_momentum_of_its_weight() {
    for (scheme, drop) in [
        ("backward-euler", 9.81 * 0.01 * 0.01 * 50.0 * 51.0 / 2.0),
        ("midpoint", 9.81 * 0.125),
        ("newmark", 9.81 * 0.125),
        ("central-difference", 9.81 * 0.125),
    ] {
        for mass in ["lumped", "consistent"] {
            if scheme == "central-difference" && mass == "consistent" {
                continue;
            }
            let sections = format!(
                "[[load]]\ngravity = [0, 0, -9.81]\n[model]\nmass = '{mass}'\n[solver]\ntolerance = 1e-12\n{}",
                stepping(scheme, 0.01, 0.5)
            );
            let mut s = simulation(&box_scene([1.0, 0.5, 0.5], [2, 1, 1], &sections));
            for _ in 0..50 {
                let info = s.step(0.01).unwrap();
                assert!(info.converged, "{info:?}");
            }
            let p = weighted(&s, 1000.0, |i| nodal(s.v(), i));
            assert!(
                (p.z + 250.0 * 9.81 * 0.5).abs() < 1e-9 * 250.0 * 9.81 * 0.5,
                "{scheme} {mass}: {p}"
            );
            assert!(
                s.u()
                    .chunks(3)
                    .all(|u| (u[2] + drop).abs() < 1e-10 && u[0].abs() < 1e-10)
            );
        }
    }
}

/// A box from the origin that flies and turns, and is 1 m away along x.
#[test]
fn momenta_are_those_of_the_velocity_field() {
    let sections = |model: &str| {
        let axes = ["x", "y", "z"];
        let of = |key: &str| {
            axes.map(|a| format!("[[quantity]]\nname = '{key} {a}'\n{key} = '{a}'\n"))
                .concat()
        };
        format!(
            "[model]\n{model}\n[initial]\ndisplacement = ['1', '0', '0']\nvelocity = ['0.5 - 2*y', '2*x', '0.3']\n{}{}{}",
            of("momentum"),
            of("angular_momentum"),
            "[time]\nscheme = 'evaluate'\n"
        )
    };
    // of 2000 kg
    let linear = [-0.5, 2.0, 0.3].map(|v| 2000.0 * v);
    let angular = [-0.85, -0.85, 37.0 / 12.0 + 2.0].map(|l| 2000.0 * l);
    for (model, is_exact) in [
        ("mass = 'lumped'", false),
        ("mass = 'consistent'", true),
        ("mass = 'consistent'\norder = 2", true),
    ] {
        let s = simulation(&box_scene([2.0, 1.0, 1.0], [4, 2, 2], &sections(model)));
        let found = s.quantities();
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let found = |key: &str| found[&format!("{key} {axis}")].unwrap();
            let off = [found("momentum") - linear[k], found("angular_momentum") - angular[k]];
            assert!(off[0].abs() < 1e-9, "{model} {axis}: {off:?}");
            // masses at the vertices lie farther out than the matter: by h² / 6 = 1/24 m² in the square, for x and y twice
            let bound = if is_exact {
                1e-9
            } else {
                2000.0 * 2.0 * 2.0 / 24.0 + 1e-9
            };
            assert!(off[1].abs() < bound, "{model} {axis}: {off:?}");
        }
    }
}

const SPIN: &str = "[initial]\nvelocity = ['-3*(y-0.5) + 0.5*sin(3*z)', '3*(x-0.5)', 'x*y']\n";

#[test]
fn midpoint_keeps_momenta_and_backward_euler_loses_energy() {
    let sections = format!("{SPIN}[solver]\ntolerance = 1e-12\n");
    let scene = box_scene(
        [1.0, 1.0, 1.0],
        [2, 2, 2],
        &format!("{sections}{}", stepping("midpoint", 0.01, 1.0)),
    );
    let mut s = simulation(&scene);
    let momenta = |s: &kerfem_engine::Simulation| {
        let x = s.positions();
        let linear = weighted(s, 1000.0, |i| nodal(s.v(), i));
        (linear, weighted(s, 1000.0, |i| x[i].cross(&nodal(s.v(), i))))
    };
    let (p, l) = momenta(&s);
    for _ in 0..30 {
        assert!(s.step(0.01).unwrap().converged);
    }
    let (q, m) = momenta(&s);
    assert!((p - q).norm() < 1e-9 * p.norm(), "{}", (p - q).norm());
    assert!((l - m).norm() < 1e-9 * l.norm(), "{}", (l - m).norm());

    let scene = box_scene(
        [1.0, 1.0, 1.0],
        [2, 2, 2],
        &format!("{sections}{}", stepping("backward-euler", 0.01, 1.0)),
    );
    let mut s = simulation(&scene);
    let energy = |s: &kerfem_engine::Simulation| s.energies().kinetic + s.energies().elastic;
    let start = energy(&s);
    let mut last = start;
    for _ in 0..30 {
        s.step(0.01).unwrap();
        let now = energy(&s);
        assert!(now <= last * (1.0 + 1e-12), "{now} after {last}");
        last = now;
    }
    assert!(s.energies().dissipated > 0.0);
    assert!((start - last - s.energies().dissipated).abs() < 1e-9 * start);
}

#[test]
fn damping_slows_a_body_down() {
    let speed_after = |damping: &str| {
        let text = box_scene(
            [1.0, 1.0, 1.0],
            [1, 1, 1],
            &format!("[initial]\nvelocity = [1, 0, 0]\n{}", stepping("midpoint", 0.01, 1.0)),
        );
        let mut s = simulation(&text.replace("density = 1000", &format!("density = 1000\n{damping}")));
        for _ in 0..100 {
            s.step(0.01).unwrap();
        }
        nodal(s.v(), 0).x
    };
    assert!((speed_after("") - 1.0).abs() < 1e-10);
    // midpoint: a factor of (1 - a dt/2) / (1 + a dt/2) a step
    let a: f64 = (1.0 - 0.01) / (1.0 + 0.01);
    assert!((speed_after("damping = { mass = 2.0 }") - a.powi(100)).abs() < 1e-9);
}

#[test]
fn one_step_is_close_to_newton() {
    let tip = |nonlinear: &str| {
        let sections = format!(
            "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -2]\n{}nonlinear = '{nonlinear}'\n",
            stepping("backward-euler", 0.01, 0.2)
        );
        let mut s = simulation(&box_scene([2.0, 0.5, 0.5], [8, 2, 2], &sections));
        for _ in 0..20 {
            let info = s.step(0.01).unwrap();
            assert!(info.converged && (nonlinear == "newton" || info.newton_steps == 1));
        }
        s.u().chunks(3).map(|u| u[2]).fold(0.0, f64::min)
    };
    let (newton, one_step) = (tip("newton"), tip("one-step"));
    assert!((newton - one_step).abs() < 0.05 * newton.abs(), "{newton} {one_step}");
}

#[test]
fn supports_and_loads_follow_their_expressions() {
    let sections = format!(
        "[[fixed]]\nwhere = 'z < 1e-9'\ndisplacement = ['0.1*t', 0, 0]\n[[load]]\nvertices = [4, 5, 6, 7]\nforce = ['8*t', 0, 0]\n\
         [solver]\ntolerance = 1e-10\n{}",
        stepping("backward-euler", 0.1, 1.0)
    );
    let mut s = simulation(&box_scene([1.0, 1.0, 1.0], [1, 1, 1], &sections));
    for step in 1..=10 {
        s.step(0.1).unwrap();
        assert!((s.u()[0] - 0.01 * f64::from(step)).abs() < 1e-15);
    }
    assert!((s.v()[0] - 0.1).abs() < 1e-12);
}

#[test]
fn threads_do_not_change_a_bit() {
    let sections = format!(
        "{SPIN}[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -9.81]\n{}",
        stepping("backward-euler", 0.01, 0.1)
    );
    let text = box_scene([1.0, 1.0, 1.0], [6, 6, 6], &sections);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut s = simulation(&text);
            for _ in 0..5 {
                s.step(0.01).unwrap();
            }
            s.state().clone()
        })
    };
    let (one, two, three) = (run(1), run(2), run(3));
    let bits = |s: &kerfem_engine::State| s.u.iter().chain(&s.v).map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&one), bits(&two));
    assert_eq!(bits(&one), bits(&three));
}

#[test]
fn loads_and_supports_can_be_set_while_running() {
    let sections = format!(
        "[[fixed]]\nwhere = 'z < 1e-9'\n[[load]]\ngravity = [0, 0, 0]\n{}",
        stepping("backward-euler", 0.1, 1.0)
    );
    let mut s = simulation(&box_scene([1.0, 1.0, 1.0], [1, 1, 1], &sections));
    s.step(0.1).unwrap();
    assert_eq!(s.energies().elastic, 0.0);
    assert!(s.set_load(0, [0.0, 0.0, -1.0]) && s.set_fixed(0, [0.1, 0.0, 0.0]));
    assert!(!s.set_load(1, [0.0; 3]) && !s.set_fixed(7, [0.0; 3]) && !s.set_fixed(0, [f64::NAN; 3]));
    s.step(0.1).unwrap();
    assert_eq!(nodal(s.u(), 0), Vector3::new(0.1, 0.0, 0.0));
    assert!(s.energies().elastic > 0.0);
}

#[test]
fn the_smallest_vibrations_are_solved_for() {
    // strains of 1e-9: energies are rounded by more than a step changes them
    for scheme in ["backward-euler", "midpoint", "newmark", "bdf2"] {
        let sections = format!(
            "[initial]\ndisplacement = ['1e-9*sin(x)', '1e-9*x*z', 0]\n[[fixed]]\nwhere = 'x < 1e-9'\n{}",
            stepping(scheme, 0.01, 1.0)
        );
        let mut s = simulation(&box_scene([2.0, 0.5, 0.5], [8, 2, 2], &sections));
        for _ in 0..20 {
            let info = s.step(0.01).unwrap();
            assert!(info.converged && info.newton_steps < 6, "{info:?}");
        }
    }
}
