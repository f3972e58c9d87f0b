//! An organ sags at its clamp; a curved blade cuts half-way into it while it moves. How far does the incision gape?

use std::collections::HashMap;

use kerfem_engine::{Scene, Simulation};

/// Runs the scene to 0.8 s; returns the largest distance between the two lips (m).
pub(crate) fn run() -> Result<f64, Box<dyn std::error::Error>> {
    let scene = Scene::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/organ.toml"))?;
    let mut sim = Simulation::new(scene)?;
    let vertices = sim.mesh().num_vertices();
    while sim.state().time < 0.8 - 1e-9 {
        sim.step(0.02)?;
    }
    println!("the cut added {} vertices", sim.mesh().num_vertices() - vertices);
    let gape = gape(&sim);
    println!("the incision gapes {:.2} mm", 1e3 * gape);
    Ok(gape)
}

/// Lips are where two vertices share one rest position.
fn gape(sim: &Simulation) -> f64 {
    let now = sim.positions();
    let mut first = HashMap::new();
    let mut widest = 0.0f64;
    for v in sim.mesh().vertex_ids() {
        let rest = sim.mesh().rest_position(v);
        let twin = *first.entry([rest.x, rest.y, rest.z].map(f64::to_bits)).or_insert(v);
        widest = widest.max((now[v.index()] - now[twin.index()]).norm());
    }
    widest
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    run().map(|_| ())
}
