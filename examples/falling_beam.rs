//! A beam is cut through at 0.1 s. Free fall of what is cut off, against the closed form.

use kerfem_engine::{Scene, Simulation};
use kerfem_mesh::{Point, quality};

/// Runs the scene to its end; returns the error of the fall relative to the closed form of the scheme.
pub(crate) fn run() -> Result<f64, Box<dyn std::error::Error>> {
    let scene = Scene::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/beam.toml"))?;
    let mut sim = Simulation::new(scene)?;
    let dt = 0.01;
    for _ in 0..11 {
        sim.step(dt)?;
    }
    let (start, speed) = loose_piece(&sim);
    let steps = 29;
    for _ in 0..steps {
        sim.step(dt)?;
    }
    let fall = loose_piece(&sim).0 - start;
    // backward Euler: v += g dt, z += v dt
    let n = f64::from(steps);
    let exact = n * dt * speed - 9.81 * dt * dt * n * (n + 1.0) / 2.0;
    println!(
        "{} pieces; the loose one fell {:.4} m, in closed form {:.4} m",
        sim.mesh().pieces().1,
        fall,
        exact
    );
    Ok((fall / exact - 1.0).abs())
}

/// Height (m) and vertical speed (m/s) of the centre of mass of the second piece.
fn loose_piece(sim: &Simulation) -> (f64, f64) {
    let mesh = sim.mesh();
    let (piece, _) = mesh.pieces();
    let positions = sim.positions();
    let (mut mass, mut height, mut momentum) = (0.0, 0.0, 0.0);
    let clamped = mesh
        .cell_ids()
        .zip(&piece)
        .find(|(c, _)| mesh.cell_rest_positions(*c).iter().any(|p: &Point| p.x < 1e-9));
    let clamped = clamped.map(|(_, p)| *p);
    for (c, _) in mesh.cell_ids().zip(&piece).filter(|(_, p)| Some(**p) != clamped) {
        let quarter = quality::tet_volume(&mesh.cell_rest_positions(c)) / 4.0;
        for v in mesh.cell(c) {
            mass += quarter;
            height += quarter * positions[v.index()].z;
            momentum += quarter * sim.v()[3 * v.index() + 2];
        }
    }
    (height / mass, momentum / mass)
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    run().map(|_| ())
}
