//! Rayleigh damping.

use std::path::Path;

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::{AnySimulation, MassKind, Scene, Simulation};
use kerfem_fem::{Assembler, LinearSolver, SolverKind, SolverOptions};
use kerfem_mesh::io::{VtuArray, VtuCells, VtuGrid, write_vtu};
use kerfem_mesh::{SimplexMesh, generate};
use nalgebra::Vector3;

use super::{box_scene, nodal, simulation};

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A body in one of its modes of vibration.
struct Mode {
    /// Displacements (m), flat.
    shape: Vec<f64>,
    /// The shape times the mass.
    weighted: Vec<f64>,
    /// Square of the angular frequency (1/s²).
    omega_squared: f64,
}

impl Mode {
    /// The slowest mode of a body held where `fixed`, by inverse iteration, with the largest displacement `size`.
    fn slowest<const N: usize>(assembler: &Assembler<N>, fixed: &[bool], mass: MassKind, size: f64) -> Self {
        let times_mass = |x: &[f64], out: &mut Vec<f64>| match mass {
            MassKind::Lumped => {
                *out = x
                    .iter()
                    .enumerate()
                    .map(|(d, x)| assembler.lumped_mass()[d / 3] * x)
                    .collect()
            }
            MassKind::Consistent => assembler.consistent_mass().multiply(x, out),
        };
        let mut solver = LinearSolver::new(SolverOptions {
            kind: SolverKind::Cholesky,
            tolerance: 1e-13,
            ..SolverOptions::default()
        });
        let mut shape: Vec<f64> = fixed.iter().map(|f| f64::from(u8::from(!f))).collect();
        let mut weighted = vec![0.0; shape.len()];
        for _ in 0..40 {
            times_mass(&shape, &mut weighted);
            shape.fill(0.0);
            solver
                .solve(assembler.stiffness(), fixed, &weighted, &mut shape)
                .unwrap();
            let largest = shape.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            shape.iter_mut().for_each(|x| *x *= size / largest);
        }
        times_mass(&shape, &mut weighted);
        let mut force = vec![0.0; shape.len()];
        assembler.stiffness().multiply(&shape, &mut force);
        let omega_squared = dot(&shape, &force) / dot(&shape, &weighted);
        Mode {
            shape,
            weighted,
            omega_squared,
        }
    }

    /// How much of the mode is in a field.
    fn amount(&self, field: &[f64]) -> f64 {
        dot(&self.weighted, field) / dot(&self.weighted, &self.shape)
    }
}

const DENSITY: f64 = 1000.0;
const YOUNG: f64 = 1e5;
const LENGTH: f64 = 2.0;
/// 1/s and s.
const DAMPING: (f64, f64) = (0.6, 0.015);
/// Small, so that a corotated body is as good as linear.
const AMPLITUDE: f64 = 1e-7;

/// A bar of tetrahedra or a strip of triangles in the plane that can move along x only, held at x = 0; a scene that lets it
/// vibrate in its slowest mode.
fn bar<const N: usize>(mesh: &SimplexMesh<N>, model: &str, mass: MassKind, folder: &Path) -> (Mode, String) {
    let material = kerfem_fem::Material::new(YOUNG, 0.0, DENSITY).unwrap();
    let assembler = Assembler::new(mesh, |_| material).unwrap();
    let points = mesh.rest_positions();
    let fixed: Vec<bool> = (0..3 * points.len())
        .map(|d| d % 3 > 0 || points[d / 3].x < 1e-9)
        .collect();
    let mode = Mode::slowest(&assembler, &fixed, mass, AMPLITUDE);
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index()));
    let grid = VtuGrid {
        points: points.to_vec().into(),
        cells: match N {
            3 => VtuCells::Triangles(cells.map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>().into()),
            _ => VtuCells::Tets(cells.map(|c| [c[0], c[1], c[2], c[3]]).collect::<Vec<_>>().into()),
        },
        point_arrays: vec![VtuArray::reals("mode", 3, mode.shape.clone())],
        cell_arrays: Vec::new(),
    };
    write_vtu(folder.join("bar.vtu"), &grid).unwrap();
    let mass = match mass {
        MassKind::Lumped => "lumped",
        MassKind::Consistent => "consistent",
    };
    let across = if N == 3 { "y" } else { "yz" };
    let (alpha, beta) = DAMPING;
    let text = format!(
        "name = 'bar'\n[mesh]\nfile = 'bar.vtu'\n[material]\nyoung = {YOUNG}\npoisson = 0\ndensity = {DENSITY}\n\
         damping = {{ mass = {alpha}, stiffness = {beta} }}\n[model]\nkind = '{model}'\nmass = '{mass}'\n[[fixed]]\n\
         where = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > -1'\naxes = '{across}'\n[initial]\n\
         displacement = {{ file = 'bar.vtu', array = 'mode' }}\n[solver]\ntolerance = 1e-11\n"
    );
    (mode, text)
}

/// Amplitude after one period over that at the start, when the bar steps so often.
fn decay<const N: usize>(s: &mut Simulation<N>, mode: &Mode, steps: usize) -> f64 {
    let (zeta, omega) = decay_rate(mode);
    let period = 2.0 * std::f64::consts::PI / omega;
    let dt = period / steps as f64;
    let amplitude = |s: &Simulation<N>| {
        let (q, v) = (mode.amount(s.u()), mode.amount(s.v()));
        q.hypot((v + zeta * q) / omega)
    };
    let start = amplitude(s);
    for _ in 0..steps {
        let info = s.step(dt).unwrap();
        assert!(info.converged, "{info:?}");
    }
    // nothing but the mode moves
    let rest: Vec<f64> = s
        .u()
        .iter()
        .zip(&mode.shape)
        .map(|(u, m)| u - mode.amount(s.u()) * m)
        .collect();
    assert!(rest.iter().all(|r| r.abs() < 1e-4 * AMPLITUDE));
    amplitude(s) / start
}

/// Rate of decay and angular frequency of the damped oscillator that a mode is.
fn decay_rate(mode: &Mode) -> (f64, f64) {
    let zeta = 0.5 * (DAMPING.0 + DAMPING.1 * mode.omega_squared);
    (zeta, (mode.omega_squared - zeta * zeta).sqrt())
}

/// Checks the decay over a period at three step lengths, and the order in which its error falls.
fn check_decay<const N: usize>(
    mode: &Mode,
    mut start: impl FnMut() -> Simulation<N>,
    (order, steps): (f64, usize),
    what: &str,
) {
    let (zeta, omega) = decay_rate(mode);
    let exact = (-zeta * 2.0 * std::f64::consts::PI / omega).exp();
    let errors = [1, 2, 4].map(|k| (decay(&mut start(), mode, k * steps) / exact).ln().abs());
    let orders = [0, 1].map(|k| (errors[k] / errors[k + 1]).log2());
    println!("{what}: decay {exact:.5} a period, errors of its logarithm {errors:.6?}, orders {orders:.3?}");
    assert!(
        orders.iter().all(|o| (o - order).abs() < 0.1),
        "{what}: {orders:?} {errors:?}"
    );
    assert!(errors[2] < if order > 1.5 { 1e-3 } else { 0.2 }, "{what}: {errors:?}");
}

fn with_time(text: &str, scheme: &str) -> String {
    format!("{text}[time]\nscheme = '{scheme}'\ndt = 1\nend = 1000\n")
}

fn read(text: &str, folder: &Path) -> AnySimulation {
    AnySimulation::new(Scene::parse(text, folder.join("scene.toml")).unwrap()).unwrap()
}

fn solid(text: &str, folder: &Path) -> Simulation {
    match read(text, folder) {
        AnySimulation::Solid(s) => s,
        AnySimulation::Planar(_) => panic!("it has tetrahedra"),
    }
}

fn planar(text: &str, folder: &Path) -> Simulation<3> {
    match read(text, folder) {
        AnySimulation::Planar(s) => s,
        AnySimulation::Solid(_) => panic!("it has triangles"),
    }
}

/// Schemes, their orders, and into how many steps a period is divided at first.
const SCHEMES: [(&str, f64, usize); 6] = [
    ("backward-euler", 1.0, 40),
    ("backward-euler'\nnonlinear = 'one-step", 1.0, 40),
    ("midpoint", 2.0, 40),
    ("newmark", 2.0, 40),
    ("bdf2", 2.0, 640),
    ("central-difference", 2.0, 320),
];

#[test]
fn a_bar_in_its_slowest_mode_decays_as_both_kinds_of_damping_say() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = generate::box_tets([LENGTH, 0.3, 0.2], [6, 1, 1], [0.0; 3]);
    let strip = generate::rect_triangles([LENGTH, 0.3], [6, 2], [0.0; 2]).unwrap();
    for model in ["linear", "corotated"] {
        for mass in [MassKind::Lumped, MassKind::Consistent] {
            for (scheme, order, steps) in SCHEMES {
                if scheme == "central-difference" && mass == MassKind::Consistent {
                    continue;
                }
                let (mode, text) = bar(&mesh, model, mass, folder.path());
                let continuous = YOUNG / DENSITY * (std::f64::consts::PI / (2.0 * LENGTH)).powi(2);
                assert!((mode.omega_squared / continuous - 1.0).abs() < 0.03, "a bar");
                let text = with_time(&text, scheme);
                let what = format!("{model} {mass:?} {scheme:?}");
                check_decay(&mode, || solid(&text, folder.path()), (order, steps), &what);

                let (mode, text) = bar(&strip, model, mass, folder.path());
                let text = with_time(&text, scheme);
                check_decay(
                    &mode,
                    || planar(&text, folder.path()),
                    (order, steps),
                    &format!("planar {what}"),
                );
            }
        }
    }
}

#[test]
fn what_damping_takes_is_what_the_ledger_says() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = generate::box_tets([LENGTH, 0.3, 0.2], [6, 1, 1], [0.0; 3]);
    let (_, text) = bar(&mesh, "linear", MassKind::Lumped, folder.path());
    let mut s = solid(&with_time(&text, "midpoint"), folder.path());
    let material = kerfem_fem::Material::new(YOUNG, 0.0, DENSITY).unwrap();
    let assembler = Assembler::new(&mesh, |_| material).unwrap();
    let start = s.energies();
    let (dt, mut taken) = (0.01, 0.0);
    for _ in 0..30 {
        let before = s.u().to_vec();
        s.step(dt).unwrap();
        let v: Vec<f64> = s.u().iter().zip(&before).map(|(new, old)| (new - old) / dt).collect();
        let mut force = vec![0.0; v.len()];
        assembler.stiffness().multiply(&v, &mut force);
        let kinetic: f64 = v
            .iter()
            .enumerate()
            .map(|(d, v)| assembler.lumped_mass()[d / 3] * v * v)
            .sum();
        taken += dt * (DAMPING.0 * kinetic + DAMPING.1 * dot(&v, &force));
    }
    let e = s.energies();
    assert!(
        (e.dissipated - taken).abs() < 1e-8 * start.elastic,
        "{} {taken}",
        e.dissipated
    );
    assert!((start.elastic - e.elastic - e.kinetic - taken).abs() < 1e-8 * start.elastic);
    assert!(taken > 0.3 * start.elastic, "{taken} of {}", start.elastic);
}

#[test]
fn a_support_feels_the_damping() {
    // a spring and a dashpot side by side: force = k (u + beta u'), k = E A / L
    for model in ["linear", "corotated"] {
        for scheme in ["backward-euler", "midpoint", "newmark", "bdf2"] {
            let text = format!(
                "name = 'pull'\n[mesh]\nbox = {{ size = [2, 1, 1], cells = [2, 1, 1] }}\n[material]\nyoung = 1e5\npoisson = 0\n\
                 density = 1e-6\ndamping = {{ stiffness = 0.2 }}\n[model]\nkind = '{model}'\n[[fixed]]\nwhere = 'x < 1e-9'\n\
                 [[fixed]]\nwhere = 'x > 1.999'\naxes = 'x'\ndisplacement = ['1e-3*t']\n[initial]\n\
                 velocity = ['5e-4*x', 0, 0]\n[solver]\ntolerance = 1e-11\n[time]\nscheme = '{scheme}'\ndt = 0.05\nend = 1\n\
                 [[quantity]]\nname = 'pull'\nreaction = 'x'\nwhere = 'x > 1.999'\n"
            );
            let mut s = simulation(&text);
            (0..10).for_each(|_| assert!(s.step(0.05).unwrap().converged));
            // these balance forces half-way
            let half_way = ["midpoint", "newmark"].contains(&scheme);
            let t = if half_way { 0.475 } else { 0.5 };
            let (pull, wanted) = (s.quantities()["pull"].unwrap(), 5e4 * 1e-3 * (t + 0.2));
            assert!((pull / wanted - 1.0).abs() < 1e-6, "{model} {scheme}: {pull} {wanted}");
        }
    }
}

/// Linear and angular momentum about the origin of a free body, by the mass of the scene.
fn momenta(s: &Simulation, mass: MassKind) -> (Vector3<f64>, Vector3<f64>) {
    let x = s.positions();
    let (mut p, mut l) = (Vector3::zeros(), Vector3::zeros());
    for c in s.mesh().cell_ids() {
        let m = DENSITY * kerfem_mesh::quality::tet_volume(&s.mesh().cell_rest_positions(c)) / 20.0;
        let corners = s.mesh().cell(c).map(|v| v.index());
        for i in corners {
            p += 5.0 * m * nodal(s.v(), i);
            for j in corners {
                let share = match mass {
                    MassKind::Lumped => 5.0 * f64::from(u8::from(i == j)),
                    MassKind::Consistent => 1.0 + f64::from(u8::from(i == j)),
                };
                l += share * m * x[i].cross(&nodal(s.v(), j));
            }
        }
    }
    (p, l)
}

fn spinning(young: f64, beta: f64, scheme: &str, mass: &str) -> Simulation {
    let text = box_scene(
        [2.0, 1.0, 0.5],
        [4, 2, 1],
        &format!(
            "damping = {{ stiffness = {beta} }}\n[model]\nkind = 'corotated'\nmass = '{mass}'\n[initial]\n\
             velocity = ['0.2 - 3*(y-0.5)', '3*(x-1) - 0.1', '0.3']\n[solver]\ntolerance = 1e-10\n[time]\n\
             scheme = '{scheme}'\ndt = 0.01\nend = 10\n"
        ),
    );
    simulation(&text.replace("young = 1e5", &format!("young = {young}")))
}

#[test]
fn a_spinning_body_goes_on_spinning() {
    for mass in [MassKind::Lumped, MassKind::Consistent] {
        let name = if mass == MassKind::Lumped {
            "lumped"
        } else {
            "consistent"
        };
        for scheme in ["midpoint", "backward-euler"] {
            let turn = |beta: f64, dt: f64| {
                let mut s = spinning(1e8, beta, scheme, name);
                let (p, l) = momenta(&s, mass);
                for _ in 0..(1.0 / dt).round() as usize {
                    let info = s.step(dt).unwrap();
                    assert!(info.converged && info.newton_steps < 10, "{info:?}");
                }
                let (q, m) = momenta(&s, mass);
                assert!((q - p).norm() < 1e-8 * p.norm(), "{}", (q - p).norm());
                ((m - l).norm() / l.norm(), s.energies())
            };
            // what damping changes of spin and energy falls faster than the square of the step
            let changed = [0.02, 0.01].map(|dt| {
                let (bare, damped) = (turn(0.0, dt), turn(0.05, dt));
                println!(
                    "{scheme} {name} dt {dt}: spin lost {:.3e} and, damped, {:.3e}; kinetic energy {:.4} J and {:.4} J",
                    bare.0, damped.0, bare.1.kinetic, damped.1.kinetic
                );
                assert!(scheme != "midpoint" || damped.0 < 1e-3 * (dt / 0.02).powi(3));
                let energy = (damped.1.kinetic / bare.1.kinetic - 1.0).abs();
                (damped.0 - bare.0).abs().max(energy)
            });
            assert!(
                changed[1] < 0.01 && changed[0] > 5.0 * changed[1],
                "{scheme} {name}: {changed:?}"
            );
        }
    }
}

const MOVING: &str = "[initial]\nvelocity = ['0.3*sin(3*y)', '0.2*x*y']\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\n\
    gravity = [0, -9.81]\n[solver]\ntolerance = 1e-9\n[time]\ndt = 0.01\nend = 1\n";

/// A damped body in motion: its material, then [`MOVING`].
fn moving(body: &str, scheme: &str, more: &str) -> String {
    let motion = MOVING.replace("[time]", &format!("[time]\nscheme = '{scheme}'"));
    format!(
        "name = 'moving'\n[mesh]\n{body}\n[material]\nyoung = 1e5\npoisson = 0.3\ndensity = 1000\n\
         damping = {{ mass = 0.3, stiffness = 0.02 }}\n[[region]]\nwhere = 'y > 0.5'\nyoung = 2e5\n{motion}{more}"
    )
}

const SLAB: &str = "box = { size = [2, 1, 0.5], cells = [8, 4, 2] }";
const PLATE: &str = "plate = { size = [2, 1], cells = [8, 4] }";

/// In three dimensions everything has a third component.
fn in_space(text: &str) -> String {
    text.replace("'0.2*x*y']", "'0.2*x*y', 0]")
        .replace("-9.81]", "-9.81, 0]")
}

fn cut_and_go_on<const N: usize>(mut s: Simulation<N>, blade: &Sweep, method: Method) -> (Vec<f64>, Vec<f64>, f64) {
    s.record_figures(true);
    s.verify(true);
    (0..4).for_each(|_| assert!(s.step(0.01).unwrap().converged));
    let record = s.cut(blade, &CutOptions::of(method)).unwrap();
    assert!(record.refused.is_empty() && record.pieces_after == 2, "{record:?}");
    assert!(record.momentum_change_relative < 1e-12);
    for _ in 0..6 {
        let info = s.step(0.01).unwrap();
        assert!(info.converged && info.residual < 1e-9, "{info:?}");
    }
    assert_eq!(s.verification().unwrap().invariants, "ok");
    assert!(s.energies().dissipated > 0.0);
    (s.u().to_vec(), s.v().to_vec(), s.energies().dissipated)
}

#[test]
fn a_damped_body_is_cut_in_flight() {
    let folder = tempfile::tempdir().unwrap();
    let p = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let wall = vec![
        p(1.03, -5.0, -5.0),
        p(1.1, 5.0, -5.0),
        p(1.13, 5.0, 5.0),
        p(1.06, -5.0, 5.0),
    ];
    let wall = Sweep::new(wall, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0;
    let line = Sweep::from_segments(vec![p(1.03, -5.0, 0.0), p(1.1, 5.0, 0.0)], vec![[0, 1]]);
    let line = line.unwrap().0;
    for (scheme, mass) in [("backward-euler", "lumped"), ("midpoint", "consistent")] {
        for model in ["linear", "corotated"] {
            for method in [Method::Subdivide, Method::Hybrid] {
                let more = format!("[model]\nkind = '{model}'\nmass = '{mass}'\n");
                let slab = in_space(&moving(SLAB, scheme, &more));
                let plate = moving(PLATE, scheme, &more);
                let run = |threads: usize| {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    pool.install(|| {
                        let solid = cut_and_go_on(solid(&slab, folder.path()), &wall, method);
                        (solid, cut_and_go_on(planar(&plate, folder.path()), &line, method))
                    })
                };
                assert!(
                    run(1) == run(3),
                    "{scheme} {model} {method:?}: the same bits at any number of threads"
                );
            }
        }
    }
}

#[test]
fn a_warm_damped_step_allocates_nothing() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let schemes = [
        ("backward-euler", "linear"),
        ("midpoint", "corotated"),
        ("newmark", "corotated"),
        ("bdf2", "linear"),
        ("central-difference", "corotated"),
    ];
    for (scheme, model) in schemes {
        let more = format!("[model]\nkind = '{model}'\n");
        let mut s = simulation(&in_space(&moving(SLAB, scheme, &more)));
        let counted = pool.install(|| {
            (0..3).for_each(|_| assert!(s.step(0.01).unwrap().converged));
            allocation_counter::measure(|| {
                (0..3).for_each(|_| assert!(s.step(0.01).unwrap().converged));
            })
        });
        assert_eq!(counted.count_total, 0, "{scheme} {model}");
    }
}
