//! `kerfem check`.

use std::path::Path;

use kerfem_engine::{EngineError, Scene, Simulation};

pub(super) fn check(path: &Path) -> Result<u8, EngineError> {
    let scene = Scene::read(path)?;
    let name = scene.name.clone();
    let simulation = Simulation::new(scene)?;
    let figures = simulation.mesh_figures();
    println!("{name}: accepted");
    println!("vertices {}", figures.vertices);
    println!("cells {}", figures.cells);
    println!("pieces {}", figures.pieces);
    println!("volume {:e} m3", figures.volume_m3);
    println!("mass {:e} kg", figures.mass_kg);
    println!("min radius ratio {:.4}", figures.quality.min_radius_ratio);
    for line in simulation.selections() {
        println!("{line}");
    }
    for (key, choice) in simulation.choices() {
        println!("{key} = auto: {} ({})", choice.chosen, choice.why);
    }
    for warning in simulation.warnings() {
        println!("warning: {warning}");
    }
    Ok(0)
}
