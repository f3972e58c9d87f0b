//! A loop that steps and cuts and writes no files: one semi-implicit step a frame, a cut in mid-flight.

use kerfem_cutting::{CutOptions, Sweep};
use kerfem_engine::{Scene, Simulation};
use kerfem_mesh::Point;

const SCENE: &str = r#"
name = "loop"
[mesh]
ball = { center = [0, 0, 0], radius = 0.05, layers = 6 }
[material]
young = 5.0e3
poisson = 0.4
density = 1000.0
[[fixed]]
where = "z > 0.04"
[[load]]
gravity = [0, 0, -9.81]
[time]
scheme = "backward-euler"
dt = 0.01
end = 1.0
nonlinear = "one-step"
"#;

/// Runs forty frames; returns how many cells the cut replaced.
pub(crate) fn run() -> Result<usize, Box<dyn std::error::Error>> {
    let mut sim = Simulation::new(Scene::parse(SCENE, "loop.toml")?)?;
    let mut replaced = 0;
    for frame in 0..40 {
        if frame == 20 {
            // a blade swept half-way into the body, where it hangs now
            let lowest = sim.positions().iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
            let corner = |x: f64, z: f64| Point::new(x, 0.003, z);
            let (z0, z1) = (lowest - 0.01, lowest + 0.06);
            let points = vec![corner(-0.1, z0), corner(0.1, z0), corner(0.1, z1), corner(-0.1, z1)];
            let (blade, _) = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]])?;
            let record = sim.cut(&blade, &CutOptions::default())?;
            replaced = record.cells_removed;
            println!(
                "frame {frame}: {} cells replaced by {}, {} matrix rows",
                replaced, record.cells_added, record.rows_updated
            );
        }
        let info = sim.step(0.01)?;
        assert!(info.converged, "the residual is {}", info.residual);
    }
    println!(
        "lowest point {:.4} m",
        sim.positions().iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
    );
    Ok(replaced)
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    run().map(|_| ())
}
