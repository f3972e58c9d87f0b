//! A6: linear statics of order 1 has one right answer on a mesh; scikit-fem's is at hand.

use kerfem_engine::{Scene, Simulation};
use kerfem_validation::norms::relative_difference;
use kerfem_validation::{Reference, reference_file};

use super::helpers::*;

const AGREES: f64 = 1e-9;

fn engine(name: &str) -> Simulation {
    let scene = Scene::read(reference_file(&format!("{name}.toml"))).unwrap();
    let mut simulation = Simulation::new(scene).unwrap();
    assert!(simulation.step(0.0).unwrap().converged);
    simulation
}

/// The scene solved by the engine, and the reference's load solved for by the lower crates alone.
fn compare(name: &str) -> (Reference, Simulation) {
    let reference = Reference::read(name).unwrap();
    assert!(largest(reference.displacement.iter().copied()) > 1e-4 && reference.fixed.contains(&false));

    let simulation = engine(name);
    assert_eq!(simulation.mesh().rest_positions(), reference.mesh.rest_positions());
    let difference = relative_difference(simulation.u(), &reference.displacement);
    println!("{name}: engine {difference:e}");
    assert!(difference < AGREES, "{name}: the engine differs by {difference:e}");

    let free = |(u, fixed): (&f64, &bool)| if *fixed { *u } else { 0.0 };
    let start = reference.displacement.iter().zip(&reference.fixed).map(free).collect();
    let u = solve(&assemble(&reference.mesh), &reference.fixed, &reference.load, start);
    let difference = relative_difference(&u, &reference.displacement);
    println!("{name}: fem {difference:e}");
    assert!(difference < AGREES, "{name}: fem differs by {difference:e}");
    (reference, simulation)
}

#[test]
fn patch_test() {
    let (reference, simulation) = compare("patch_test");
    let gradient = nalgebra::Matrix3::new(0.01, 0.02, -0.03, 0.005, -0.02, 0.01, 0.015, 0.004, 0.02);
    let points = reference.mesh.rest_positions().iter();
    let exact: Vec<f64> = points.flat_map(|p| <[f64; 3]>::from(gradient * p)).collect();
    assert!(
        relative_difference(simulation.u(), &exact) < 1e-13,
        "a linear field is met exactly"
    );
    let (mesh, assembler) = (&reference.mesh, assemble(&reference.mesh));
    for c in mesh.cell_ids() {
        let found = assembler.deformation_gradient(mesh, c, simulation.u()) - nalgebra::Matrix3::identity();
        assert!((found - gradient).norm() < 1e-13, "cell {c:?}: {found}");
    }
}

#[test]
fn cantilever_under_gravity() {
    compare("cantilever_gravity");
}

#[test]
fn cantilever_under_a_traction_that_bends_and_twists_it() {
    compare("cantilever_traction");
}

/// A5: Lamé's `u = p a³ / (E (b³ - a³)) ((1 - 2 nu) r + (1 + nu) b³ / (2 r²))`, to what the mesh can do.
#[test]
fn thick_sphere_under_pressure() {
    let (reference, simulation) = compare("thick_sphere");
    let (a, b, pressure, nu) = (1.0_f64, 2.0_f64, 2e4, 0.3);
    let factor = pressure * a.powi(3) / (1e7 * (b.powi(3) - a.powi(3)));
    let mut worst: f64 = 0.0;
    for (p, u) in reference.mesh.rest_positions().iter().zip(simulation.u().chunks(3)) {
        let r = p.norm();
        let exact = factor * ((1.0 - 2.0 * nu) * r + (1.0 + nu) * b.powi(3) / (2.0 * r * r));
        let radial = (p.x * u[0] + p.y * u[1] + p.z * u[2]) / r;
        worst = worst.max((radial / exact - 1.0).abs());
    }
    println!("thick sphere: radial displacement within {worst:.4} of Lamé");
    assert!(worst < 0.07, "{worst}");
}
