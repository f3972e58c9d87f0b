//! Whole scenes through the library: statics, motion, cuts, input from files. One file each.

mod blades;
mod cuts;
mod damping;
mod dynamics;
mod files;
mod iterations;
mod jump;
mod locking;
mod modes;
mod newton;
mod nodal_loads;
mod order2;
mod planar;
mod planar_cuts;
mod recovery;
mod saves;
mod schemes;
mod statics;
mod surfaces;

use kerfem_engine::{Scene, Simulation};

/// A simulation of a scene given as text.
fn simulation(text: &str) -> Simulation {
    Simulation::new(Scene::parse(text, "test.toml").expect("the scene is accepted")).expect("the mesh is accepted")
}

/// A box with material and the given sections.
fn box_scene(size: [f64; 3], cells: [usize; 3], sections: &str) -> String {
    format!(
        "name = 'test'\n[mesh]\nbox = {{ size = {size:?}, cells = {cells:?} }}\n[material]\nyoung = 1e5\npoisson = 0.3\n\
         density = 1000\n{sections}"
    )
}

/// Mass-weighted sum over the vertices of a quantity (the lumped mass of a vertex is a quarter of that of its cells).
fn weighted(s: &Simulation, density: f64, value: impl Fn(usize) -> nalgebra::Vector3<f64>) -> nalgebra::Vector3<f64> {
    let mut sum = nalgebra::Vector3::zeros();
    for c in s.mesh().cell_ids() {
        let mass = density * kerfem_mesh::quality::tet_volume(&s.mesh().cell_rest_positions(c)) / 4.0;
        sum += s
            .mesh()
            .cell(c)
            .iter()
            .map(|v| mass * value(v.index()))
            .sum::<nalgebra::Vector3<f64>>();
    }
    sum
}

/// Entry `i` of a flat nodal field.
fn nodal(field: &[f64], i: usize) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(field[3 * i], field[3 * i + 1], field[3 * i + 2])
}
