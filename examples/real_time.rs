//! A loop that steps and cuts and writes no files: one semi-implicit step a frame, a pull that changes from frame to frame, a
//! cut in mid-flight. Frames without a cut allocate nothing once the loop is warm.

use kerfem_cutting::{CutOptions, Sweep};
use kerfem_engine::{EngineError, Scene, Simulation};
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
[[load]]
where = "z < -0.04"
force = [0, 0, 0]
[time]
scheme = "backward-euler"
dt = 0.01
end = 1.0
nonlinear = "one-step"
"#;

/// What the loop works on: the body, and where its vertices are for whoever draws it.
pub(crate) struct Loop {
    sim: Simulation,
    positions: Vec<Point>,
}

impl Loop {
    /// The scene, ready to step.
    pub(crate) fn new() -> Result<Self, EngineError> {
        Ok(Loop {
            sim: Simulation::new(Scene::parse(SCENE, "loop.toml")?)?,
            positions: Vec::new(),
        })
    }

    /// One frame: the hand pulls, the body moves.
    pub(crate) fn frame(&mut self, number: u32) -> Result<(), EngineError> {
        let pull = 0.5 * (0.2 * f64::from(number)).sin();
        self.sim.set_load(1, [pull, 0.0, 0.0]);
        let info = self.sim.step(0.01)?;
        assert!(info.converged, "the residual is {}", info.residual);
        self.sim.positions_into(&mut self.positions);
        Ok(())
    }

    /// A blade swept half-way into the body, where it hangs now; how many cells it replaced.
    pub(crate) fn cut(&mut self) -> Result<usize, EngineError> {
        let lowest = self.lowest();
        let corner = |x: f64, z: f64| Point::new(x, 0.003, z);
        let (z0, z1) = (lowest - 0.01, lowest + 0.06);
        let points = vec![corner(-0.1, z0), corner(0.1, z0), corner(0.1, z1), corner(-0.1, z1)];
        let (blade, _) = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]])?;
        let record = self.sim.cut(&blade, &CutOptions::default())?;
        println!(
            "{} cells replaced by {}, {} matrix rows",
            record.cells_removed, record.cells_added, record.rows_updated
        );
        Ok(record.cells_removed)
    }

    /// Height of the lowest vertex (m).
    pub(crate) fn lowest(&self) -> f64 {
        self.positions.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
    }
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut body = Loop::new()?;
    for number in 0..40 {
        if number == 20 {
            body.cut()?;
        }
        body.frame(number)?;
    }
    println!("lowest point {:.4} m", body.lowest());
    Ok(())
}
