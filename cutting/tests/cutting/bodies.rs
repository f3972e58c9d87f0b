//! Bodies to cut.

use kerfem_mesh::{Point, TetMesh, generate};

use super::numbers::Random;

pub(crate) fn unit_box(n: usize) -> TetMesh {
    generate::box_tets([1.0, 1.0, 1.0], [n, n, n], [0.0; 3])
}

/// A box whose interior vertices are shaken by a fraction of the cell size.
pub(crate) fn shaken_box(n: usize, by: f64, seed: u64) -> TetMesh {
    let mesh = unit_box(n);
    let mut random = Random(seed);
    let places = mesh
        .vertex_ids()
        .map(|v| {
            let shift = Point::from_fn(|_, _| random.range(-by, by) / n as f64);
            mesh.rest_position(v)
                + if mesh.is_boundary_vertex(v) {
                    Point::zeros()
                } else {
                    shift
                }
        })
        .collect();
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
    TetMesh::new(places, cells).unwrap()
}

/// A box bent onto a curved body without any flat boundary.
pub(crate) fn curved_body(n: usize) -> TetMesh {
    let mesh = unit_box(n);
    let bend = |p: Point| {
        let q = (p - Point::repeat(0.5)) * 2.0;
        let round = q * (0.75 + 0.25 * q.amax() / q.norm().max(1e-12) * (1.0 - 0.2 * q.norm_squared()));
        Point::new(round.x, round.y + 0.2 * round.x * round.x, round.z) * 0.5 + Point::repeat(0.5)
    };
    let places = mesh.vertex_ids().map(|v| bend(mesh.rest_position(v))).collect();
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
    TetMesh::new(places, cells).unwrap()
}

/// The same cells with every vertex taken elsewhere.
pub(crate) fn mapped(mesh: &TetMesh, place: impl Fn(Point) -> Point) -> TetMesh {
    let places = mesh.vertex_ids().map(|v| place(mesh.rest_position(v))).collect();
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
    TetMesh::new(places, cells).unwrap()
}

/// A unit box whose cells grow along every axis in equal steps, the last `ratio` times as long as the first (F33).
pub(crate) fn graded_box(n: usize, ratio: f64) -> TetMesh {
    let step = ratio.powf(1.0 / (n as f64 - 1.0));
    let place = |x: f64| (step.powf(x * n as f64) - 1.0) / (step.powf(n as f64) - 1.0);
    mapped(&unit_box(n), |p| p.map(place))
}

/// A unit box with one layer of cells a tenth as thick as the others (F8).
pub(crate) fn layered_box(n: usize) -> TetMesh {
    let h = 1.0 / n as f64;
    let thin = (n / 2) as f64 * h;
    mapped(&unit_box(n), |p| {
        let beyond = ((p.z - thin) / h).round().clamp(0.0, 1.0);
        Point::new(p.x, p.y, p.z - 0.9 * h * beyond)
    })
}

/// A plate one cell thick, a twentieth as thick as it is wide.
pub(crate) fn thin_plate() -> TetMesh {
    generate::box_tets([1.0, 1.0, 0.05], [8, 8, 1], [0.0, 0.0, 0.475])
}

pub(crate) fn ball(layers: usize) -> TetMesh {
    generate::ball_tets([0.5; 3], 0.5, layers).unwrap()
}
