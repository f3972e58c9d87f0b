//! What each scheme promises: its order in time, what it keeps, cuts and restarts under way, stable steps.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::{AnySimulation, Scene, Simulation};
use kerfem_mesh::{Point, quality};
use nalgebra::Vector3;

use super::{nodal, weighted};

/// Every scheme that steps, with its order.
const SCHEMES: [(&str, f64); 5] = [
    ("backward-euler", 1.0),
    ("midpoint", 2.0),
    ("newmark", 2.0),
    ("bdf2", 2.0),
    ("central-difference", 2.0),
];

/// Soft, so that steps of moderate length resolve its vibrations (Pa).
const YOUNG: f64 = 1e4;

const SLAB: &str = "box = { size = [2, 0.5, 0.5], cells = [4, 1, 1] }";
const PLATE: &str = "plate = { size = [2, 0.5], cells = [6, 2] }";

/// Without anything from outside.
const FREE: &str = "[initial]\nvelocity = ['0.3*sin(2*y) - 0.4*y', '0.4*x + 0.2*cos(x)' ZERO]\n";
/// Held at one end, and bent.
const BENT: &str = "[initial]\nvelocity = ['0.1*x*y', '0.3*x^2' ZERO]\n[[fixed]]\nwhere = 'x < 1e-9'\n";
/// Held by a support that shakes, under a load that changes, damped both ways.
const SHAKEN: &str = "[[fixed]]\nwhere = 'x < 1e-9'\ndisplacement = [0, '0.02 * t^2 * (3 - t)' ZERO]\n[[load]]\n\
    gravity = ['sin(3 * t)', '2 * t - 1' ZERO]\n[initial]\nvelocity = [0, '0.2*x^2' ZERO]\n";
const DAMPED: &str = "damping = { mass = 0.5, stiffness = 0.01 }\n";

fn scene(body: &str, model: &str, scheme: &str, sections: &str) -> Scene {
    let zero = if body == PLATE { "" } else { ", 0" };
    let text = format!(
        "name = 'body'\n[mesh]\n{body}\n[material]\nyoung = {YOUNG}\npoisson = 0.3\ndensity = 1000\n{}[model]\nkind = '{model}'\n\
         [solver]\ntolerance = 1e-12\n[time]\nscheme = '{scheme}'\ndt = 0.01\nend = 100\n",
        sections.replace(" ZERO", zero)
    );
    Scene::parse(&text, "test.toml").unwrap()
}

fn solid(model: &str, scheme: &str, sections: &str) -> Simulation {
    Simulation::new(scene(SLAB, model, scheme, sections)).unwrap()
}

fn planar(model: &str, scheme: &str, sections: &str) -> Simulation<3> {
    Simulation::planar(scene(PLATE, model, scheme, sections)).unwrap()
}

fn step<const N: usize>(s: &mut Simulation<N>, dt: f64) {
    let info = s.step(dt).unwrap();
    assert!(info.converged, "{info:?}");
}

/// A wall across the body.
fn wall(x: f64) -> Sweep {
    let points = [
        [x, -9.0, -9.0],
        [x, 9.0, -9.0],
        [x + 0.03, 9.0, 9.0],
        [x + 0.03, -9.0, 9.0],
    ];
    let points = points.map(Point::from).to_vec();
    Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0
}

/// A line across the plate.
fn line(x: f64) -> Sweep {
    let points = vec![Point::new(x, -9.0, 0.0), Point::new(x + 0.03, 9.0, 0.0)];
    Sweep::from_segments(points, vec![[0, 1]]).unwrap().0
}

/// Observed orders from states at the same time by steps that halve: of displacements and of velocities.
fn orders(states: &[(Vec<f64>, Vec<f64>)]) -> Vec<f64> {
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let halved = states.windows(2);
    let errors: Vec<[f64; 2]> = halved
        .map(|w| [distance(&w[0].0, &w[1].0), distance(&w[0].1, &w[1].1)])
        .collect();
    let rates = errors.windows(2);
    rates.flat_map(|e| [0, 1].map(|k| (e[0][k] / e[1][k]).log2())).collect()
}

/// States after 0.4 s by so many steps and by twice, four and eight times as many.
fn refined<const N: usize>(
    base: usize,
    start: impl Fn() -> Simulation<N>,
    advance: impl Fn(&mut Simulation<N>, usize),
) -> Vec<(Vec<f64>, Vec<f64>)> {
    let run = |refinement: usize| {
        let mut s = start();
        advance(&mut s, base * refinement);
        assert!((s.state().time - 0.4).abs() < 1e-12);
        (s.u().to_vec(), s.v().to_vec())
    };
    [1, 2, 4, 8].map(run).to_vec()
}

fn check_order(what: &str, states: &[(Vec<f64>, Vec<f64>)], order: f64) {
    let found = orders(states);
    println!("{what}: orders of u and v {found:.3?}");
    let last = &found[2..];
    assert!(last.iter().all(|o| (o - order).abs() < 0.15), "{what}: {found:?}");
}

fn equal_steps<const N: usize>(s: &mut Simulation<N>, steps: usize) {
    (0..steps).for_each(|_| step(s, 0.4 / steps as f64));
}

#[test]
fn every_scheme_has_its_order() {
    let damped = format!("{DAMPED}{SHAKEN}");
    for (scheme, order) in SCHEMES {
        let base = if order > 1.0 { 80 } else { 320 };
        let mut ends = Vec::new();
        for model in ["linear", "corotated"] {
            for (name, sections) in [("free", FREE), ("bent", BENT), ("shaken", damped.as_str())] {
                let states = refined(base, || solid(model, scheme, sections), equal_steps);
                check_order(&format!("{scheme} {model} {name}"), &states, order);
                ends.push(states[3].0.clone());
                let states = refined(base, || planar(model, scheme, sections), equal_steps);
                check_order(&format!("planar {scheme} {model} {name}"), &states, order);
            }
        }
        // all have the same limit
        let mut limit = solid("corotated", "midpoint", &damped);
        equal_steps(&mut limit, 640);
        let error = ends[5]
            .iter()
            .zip(limit.u())
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        println!("{scheme}: {error:e} m from the limit");
        assert!(error < if order > 1.0 { 1e-5 } else { 1e-3 }, "{scheme}: {error}");
    }
}

#[test]
fn two_step_differences_keep_their_order_with_steps_of_any_length() {
    // long and short ones in turn, and now and then one so long that the scheme starts anew
    let uneven = |s: &mut Simulation, steps: usize| {
        let dt = 0.4 / steps as f64;
        for k in 0..steps / 2 {
            let first = if k % 2 == 0 { 1.3 } else { 0.8 };
            step(s, first * dt);
            step(s, (2.0 - first) * dt);
        }
    };
    let states = refined(80, || solid("corotated", "bdf2", BENT), uneven);
    check_order("bdf2, uneven steps", &states, 2.0);
    let mut s = solid("corotated", "bdf2", BENT);
    [1e-4, 1e-2, 1e-6, 1e-2].iter().for_each(|dt| step(&mut s, *dt));
    assert!(s.energies().kinetic < 1.1 * solid("corotated", "bdf2", BENT).energies().kinetic);
}

#[test]
fn the_order_outlives_a_cut() {
    // at rest positions, so that the cut is the same for every step length
    let options = CutOptions::of(Method::Subdivide);
    for (scheme, order) in SCHEMES.into_iter().filter(|(_, order)| *order > 1.0) {
        // a cut sets off fast vibrations, and the step of backward Euler after it damps them
        let base = if scheme == "bdf2" { 320 } else { 80 };
        let states = refined(
            base,
            || solid("corotated", scheme, BENT),
            |s, steps| {
                let dt = 0.4 / steps as f64;
                (0..steps / 2).for_each(|_| step(s, dt));
                let sweep = wall(0.9);
                let record = s.cut_in_frame(kerfem_engine::Frame::Rest, &sweep, &options).unwrap();
                assert!(record.refused.is_empty() && record.cells_added > 0);
                (0..steps / 2).for_each(|_| step(s, dt));
            },
        );
        check_order(&format!("{scheme}, cut half-way"), &states, order);
    }
}

/// Linear and angular momentum about the origin, by the lumped mass.
fn momenta(s: &Simulation) -> (Vector3<f64>, Vector3<f64>) {
    let x = s.positions();
    let linear = weighted(s, 1000.0, |i| nodal(s.v(), i));
    (linear, weighted(s, 1000.0, |i| x[i].cross(&nodal(s.v(), i))))
}

#[test]
fn momentum_is_kept_in_free_motion() {
    for scheme in ["midpoint", "newmark", "central-difference"] {
        for model in ["linear", "corotated"] {
            let mut s = solid(model, scheme, FREE);
            let (p, l) = momenta(&s);
            let drifts = |s: &mut Simulation| {
                (0..50).fold((0.0, 0.0), |(linear, angular): (f64, f64), _| {
                    step(s, 0.01);
                    let (q, m) = momenta(s);
                    (
                        linear.max((q - p).norm() / p.norm()),
                        angular.max((m - l).norm() / l.norm()),
                    )
                })
            };
            let (linear, angular) = drifts(&mut s);
            let record = s.cut(&wall(0.9), &CutOptions::default()).unwrap();
            assert!(record.refused.is_empty() && record.cells_added > 0);
            // one split changes angular momentum by the lumped mass, so that is not compared across it
            let (across, _) = drifts(&mut s);
            println!(
                "{scheme} {model}: linear momentum drifts by {linear:.1e}, with a cut {across:.1e}, angular by {angular:.1e}"
            );
            assert!(linear.max(across) < 1e-10, "{scheme} {model}: {linear} {across}");
            // the trapezoidal rule keeps angular momentum to the order of the step only; a linear body turns in no way
            let kept = model == "corotated" && scheme != "newmark";
            assert!(!kept || angular < 1e-10, "{scheme} {model}: {angular}");
            assert!(model == "linear" || angular < 1e-3, "{scheme} {model}: {angular}");
        }
    }
}

#[test]
fn energy_goes_as_each_scheme_says() {
    let dt = 0.01;
    let history = |model: &str, scheme: &str| {
        let mut s = solid(model, scheme, BENT);
        let total = |s: &Simulation| s.energies().kinetic + s.energies().elastic;
        let start = total(&s);
        let all = (0..400).map(|_| {
            step(&mut s, dt);
            let now = total(&s);
            // nothing does work, so the ledger tells the same
            assert!((start - now - s.energies().dissipated).abs() < 1e-9 * start);
            now / start - 1.0
        });
        all.collect::<Vec<_>>()
    };
    let largest = |all: &[f64]| all.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    for model in ["linear", "corotated"] {
        let [euler, midpoint, newmark, bdf2, central] = SCHEMES.map(|(scheme, _)| history(model, scheme));
        println!(
            "{model}: energy off by midpoint {:.1e}, newmark {:.1e}, central-difference {:.1e}; lost by bdf2 {:.1e}, \
             backward-euler {:.1e}",
            largest(&midpoint),
            largest(&newmark),
            largest(&central),
            -bdf2[399],
            -euler[399]
        );
        let bound = if model == "linear" { 1e-9 } else { 5e-3 };
        assert!(largest(&midpoint) < bound && largest(&newmark) < bound);
        // the leapfrog's energy swings and does not drift
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        assert!(largest(&central) < 0.1);
        assert!((mean(&central[..200]) - mean(&central[200..])).abs() < 0.1 * largest(&central));
        assert!(euler.windows(2).all(|e| e[1] <= e[0] + 1e-12));
        assert!(
            bdf2[399] < -1e-6 && bdf2[399] > 0.2 * euler[399],
            "{} {}",
            bdf2[399],
            euler[399]
        );
    }
}

/// Lets a body move, cuts it in two, lets it go on; everything that moved.
fn cut_in_flight<const N: usize>(mut s: Simulation<N>, sweep: &Sweep, method: Method) -> Vec<f64> {
    s.record_figures(true);
    s.verify(true);
    (0..4).for_each(|_| step(&mut s, 0.01));
    let record = s.cut(sweep, &CutOptions::of(method)).unwrap();
    assert!(record.refused.is_empty() && record.pieces_after == 2, "{record:?}");
    assert!(record.momentum_change_relative < 1e-12);
    (0..6).for_each(|_| step(&mut s, 0.01));
    assert_eq!(s.verification().unwrap().invariants, "ok");
    let e = s.energies();
    assert!(e.kinetic.is_finite() && e.kinetic < 1e3, "{e:?}");
    s.u().iter().chain(s.v()).copied().collect()
}

#[test]
fn every_scheme_goes_on_after_a_cut_with_the_same_bits_at_any_number_of_threads() {
    let sections = format!("{DAMPED}{SHAKEN}");
    for (scheme, _) in SCHEMES {
        for model in ["linear", "corotated"] {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let in_space = cut_in_flight(solid(model, scheme, &sections), &wall(0.9), Method::Hybrid);
                    let in_plane = cut_in_flight(planar(model, scheme, &sections), &line(0.9), Method::Subdivide);
                    (in_space, in_plane)
                })
            };
            assert!(run(1) == run(3), "{scheme} {model}");
        }
    }
}

#[test]
fn a_restored_simulation_goes_on_with_the_same_bits_under_every_scheme() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state.kerfem");
    let sections = format!("{DAMPED}{SHAKEN}");
    for (scheme, _) in SCHEMES {
        for model in ["linear", "corotated"] {
            let go = |saves: &[usize]| {
                let mut s = planar(model, scheme, &sections);
                for k in 0..8 {
                    if k == 4 {
                        s.cut(&line(0.9), &CutOptions::default()).unwrap();
                    }
                    step(&mut s, if k == 6 { 0.004 } else { 0.01 });
                    if saves.contains(&k) {
                        s.save(&path).unwrap();
                        s = match AnySimulation::restore(&path).unwrap() {
                            AnySimulation::Planar(s) => s,
                            AnySimulation::Solid(_) => panic!("a plate is planar"),
                        };
                    }
                }
                let e = s.energies();
                let numbers = [e.kinetic, e.elastic, e.potential, e.dissipated];
                let all = s.u().iter().chain(s.v()).chain(&numbers);
                all.map(|x| x.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(go(&[0, 2, 4, 6]), go(&[]), "{scheme} {model}");
        }
    }
}

/// Square of the highest angular frequency of a free body by lumped mass, by power iteration.
fn highest_frequency(s: &Simulation) -> f64 {
    let material = kerfem_fem::Material::new(YOUNG, 0.3, 1000.0).unwrap();
    let assembler = kerfem_fem::Assembler::new(s.mesh(), |_| material).unwrap();
    let masses = assembler.lumped_mass();
    let mut x: Vec<f64> = (0..3 * masses.len()).map(|i| (7.0 * i as f64).sin()).collect();
    let mut force = vec![0.0; x.len()];
    let mut rate = 0.0;
    for _ in 0..3000 {
        assembler.stiffness().multiply(&x, &mut force);
        for (d, (x, f)) in x.iter_mut().zip(&force).enumerate() {
            *x = if masses[d / 3] > 0.0 { f / masses[d / 3] } else { 0.0 };
        }
        rate = x.iter().map(|x| x * x).sum::<f64>().sqrt();
        x.iter_mut().for_each(|x| *x /= rate);
    }
    rate
}

#[test]
fn the_stable_step_is_a_bound_that_follows_cuts() {
    let mut s = solid("corotated", "central-difference", FREE);
    let uncut = s.stable_step();
    let exact = 2.0 / highest_frequency(&s).sqrt();
    println!("stable step {uncut:.5} s, exact {exact:.5} s");
    assert!(uncut < exact * (1.0 + 1e-9) && uncut > 0.6 * exact, "{uncut} {exact}");

    // close to vertices, where splitting makes small cells and snapping does not
    let mut split = solid("corotated", "central-difference", FREE);
    let close = Sweep::new(
        [
            [0.98, -9.0, -9.0],
            [0.98, 9.0, -9.0],
            [0.98, 9.0, 9.0],
            [0.98, -9.0, 9.0],
        ]
        .map(Point::from)
        .to_vec(),
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let close = close.unwrap().0;
    split.cut(&close, &CutOptions::of(Method::Subdivide)).unwrap();
    s.cut(&close, &CutOptions::default()).unwrap();
    let (small, snapped) = (split.stable_step(), s.stable_step());
    let exact = 2.0 / highest_frequency(&split).sqrt();
    println!("after a cut by splitting {small:.2e} s, exact {exact:.2e} s; by hybrid {snapped:.2e} s");
    assert!(small < 0.2 * uncut && small < exact * (1.0 + 1e-9) && small > 0.3 * exact);
    assert!(snapped > 0.5 * uncut);
    let smallest = split
        .mesh()
        .cell_ids()
        .map(|c| quality::tet_volume(&split.mesh().cell_rest_positions(c)));
    assert!(smallest.fold(f64::INFINITY, f64::min) > 0.0);

    // a step of the uncut body is made of several then
    assert_eq!(s.step(0.9 * snapped).unwrap().iterations, 1);
    let info = split.step(0.9 * uncut).unwrap();
    assert_eq!(info.iterations, (uncut / small).ceil() as usize);
    assert!(split.warnings().iter().any(|w| w.contains("steps are made of several")));
}

#[test]
fn central_differences_stay_bounded_up_to_their_stable_step() {
    for damping in ["", DAMPED] {
        for model in ["linear", "corotated"] {
            // rough, so that the highest frequencies take part
            let rough = format!(
                "{damping}[initial]\nvelocity = ['0.02*sin(99*y+31*x)', '0.02*cos(77*x)', '0.02*sin(55*z+x)']\n"
            );
            let mut s = solid(model, "central-difference", &rough);
            let dt = 0.9 * s.stable_step();
            let start = s.energies().kinetic + s.energies().elastic;
            for _ in 0..2000 {
                let info = s.step(dt).unwrap();
                assert_eq!(info.iterations, 1);
                assert!(
                    s.energies().kinetic + s.energies().elastic < 3.0 * start,
                    "{model} {damping}"
                );
            }
            assert!(damping.is_empty() || s.energies().elastic < 1e-3 * start);
        }
    }
}

#[test]
fn a_long_explicit_step_is_the_same_as_several_short_ones() {
    let sections = format!("{DAMPED}{SHAKEN}");
    let mut long = solid("corotated", "central-difference", &sections);
    let dt = long.stable_step() * 0.9;
    let mut short = solid("corotated", "central-difference", &sections);
    assert_eq!(long.step(5.0 * dt).unwrap().iterations, 5);
    (0..5).for_each(|_| step(&mut short, dt));
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart(long.u(), short.u()) < 1e-14 && apart(long.v(), short.v()) < 1e-13);
    assert!((long.energies().dissipated - short.energies().dissipated).abs() < 1e-9);
}

#[test]
fn a_support_that_accelerates_feels_the_mass_it_carries() {
    // a rigid body driven along x = t³: the support exerts the mass times 6 t
    for (scheme, mass) in [
        ("midpoint", "lumped"),
        ("midpoint", "consistent"),
        ("newmark", "lumped"),
        ("newmark", "consistent"),
        ("bdf2", "lumped"),
        ("bdf2", "consistent"),
        ("central-difference", "lumped"),
    ] {
        let text = format!(
            "name = 'driven'\n[mesh]\nbox = {{ size = [2, 1, 1], cells = [2, 1, 1] }}\n[material]\nyoung = 1e5\npoisson = 0.3\n\
             density = 1000\n[model]\nmass = '{mass}'\n[[fixed]]\nwhere = 'x > -1'\naxes = 'yz'\n[[fixed]]\nwhere = 'x > -1'\n\
             axes = 'x'\ndisplacement = ['t^3']\n[time]\nscheme = '{scheme}'\ndt = 0.01\nend = 1\n[[quantity]]\nname = 'push'\n\
             reaction = 'x'\nwhere = 'x > -1'\n"
        );
        let mut s = super::simulation(&text);
        (0..50).for_each(|_| step(&mut s, 0.01));
        let t = if ["bdf2", "central-difference"].contains(&scheme) {
            0.5
        } else {
            0.495
        };
        let push = s.quantities()["push"].unwrap();
        println!("{scheme} {mass}: {push} N for {} N", 2000.0 * 6.0 * t);
        assert!(
            (push / (2000.0 * 6.0 * t) - 1.0).abs() < 0.02,
            "{scheme} {mass}: {push}"
        );
        assert!((s.v()[0] - 3.0 * 0.25).abs() < 1e-3, "{scheme} {mass}: {}", s.v()[0]);
    }
}

#[test]
fn consistent_mass_passes_the_acceleration_of_a_support_on() {
    let sections = format!("{DAMPED}{SHAKEN}");
    for scheme in ["midpoint", "newmark", "bdf2"] {
        let start = || solid("linear'\nmass = 'consistent", scheme, &sections);
        let states = refined(80, start, equal_steps);
        check_order(&format!("{scheme} consistent"), &states, 2.0);
    }
}

#[test]
fn every_scheme_goes_on_when_nothing_is_left() {
    for (scheme, _) in SCHEMES {
        let text = super::box_scene(
            [1.0; 3],
            [1; 3],
            &format!("{DAMPED}[initial]\nvelocity = [1, 0, 0]\n[time]\nscheme = '{scheme}'\ndt = 0.01\nend = 1\n"),
        );
        let mut s = super::simulation(&text);
        step(&mut s, 0.01);
        s.cut(&wall(0.5), &CutOptions::of(Method::Delete)).unwrap();
        assert_eq!(s.mesh().num_cells(), 0);
        step(&mut s, 0.01);
        assert_eq!((s.energies().kinetic, s.energies().elastic), (0.0, 0.0), "{scheme}");
        assert_eq!(s.stable_step(), f64::INFINITY);
        assert_eq!(s.modes(3).unwrap(), (Vec::new(), 0));
    }
}
