//! `kerfem check`.

use std::path::Path;

use kerfem_engine::{AnySimulation, EngineError, Scene, Simulation};

pub(super) fn check(path: &Path) -> Result<u8, EngineError> {
    let scene = Scene::read(path)?;
    let name = scene.name.clone();
    match AnySimulation::new(scene)? {
        AnySimulation::Solid(simulation) => summarise(&name, &simulation),
        AnySimulation::Planar(simulation) => summarise(&name, &simulation),
    }
    Ok(0)
}

fn summarise<const N: usize>(name: &str, simulation: &Simulation<N>) {
    let figures = simulation.mesh_figures();
    say!("{name}: accepted");
    say!("vertices {}", figures.vertices);
    say!("cells {}", figures.cells);
    say!("pieces {}", figures.pieces);
    say!("box {}", simulation.extents());
    say!("volume {:.6e} m3", figures.volume_m3);
    say!("mass {:.6e} kg", figures.mass_kg);
    say!("min radius ratio {:.4}", figures.quality.min_radius_ratio);
    for line in simulation.selections() {
        say!("{line}");
    }
    for (key, choice) in simulation.choices() {
        say!("{key} = auto: {} ({})", choice.chosen, choice.why);
    }
    for warning in simulation.warnings() {
        say!("warning: {warning}");
    }
}
