//! Scenes written in tests, solved in a line.

use std::fmt::Write as _;
use std::path::Path;

use kerfem_engine::{Scene, Simulation};
use kerfem_fem::{Assembler, LinearSolver, Material, SolverKind, SolverOptions};
use kerfem_mesh::{Point, TetMesh};

pub(crate) const MATERIAL: &str = "[material]\nyoung = 1e7\npoisson = 0.3\ndensity = 1000.0\n";

/// A simulation from the text of a scene whose files lie in `folder`.
pub(crate) fn simulation(text: &str, folder: &Path) -> Simulation {
    let scene = Scene::parse(text, folder.join("scene.toml")).unwrap();
    Simulation::new(scene).unwrap()
}

/// The displacements of a static scene without files of its own.
pub(crate) fn statics(text: &str) -> Simulation {
    let mut s = simulation(text, Path::new("."));
    let info = s.step(0.0).unwrap();
    assert!(info.converged, "residual {:e}", info.residual);
    s
}

/// The parallelogram with the given centre and half sides, as two triangles.
pub(crate) fn rectangle(center: Point, a: Point, b: Point) -> (Vec<Point>, Vec<[usize; 3]>) {
    let corners = vec![center - a - b, center + a - b, center + a + b, center - a + b];
    (corners, vec![[0, 1, 2], [0, 2, 3]])
}

pub(crate) fn write_obj(path: &Path, (points, triangles): &(Vec<Point>, Vec<[usize; 3]>)) {
    let mut text = String::new();
    for p in points {
        writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z).unwrap();
    }
    for t in triangles {
        writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

pub(crate) fn assemble(mesh: &TetMesh) -> Assembler {
    let material = Material::new(1e7, 0.3, 1000.0).unwrap();
    Assembler::new(mesh, |_| material).unwrap()
}

/// Solves `K u = load` with the values of `u` at fixed dofs kept.
pub(crate) fn solve(assembler: &Assembler, fixed: &[bool], load: &[f64], mut u: Vec<f64>) -> Vec<f64> {
    let mut solver = LinearSolver::new(SolverOptions {
        kind: SolverKind::Cholesky,
        tolerance: 1e-13,
        ..SolverOptions::default()
    });
    let info = solver.solve(assembler.stiffness(), fixed, load, &mut u).unwrap();
    assert!(info.residual < 1e-11, "residual {:e}", info.residual);
    u
}

/// Largest absolute value.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values
        .into_iter()
        .map(f64::abs)
        .fold(0.0, |a, b| if b.is_nan() || b > a { b } else { a })
}
