//! Geometry only: a ball cut in two by a wavy surface, written as `cut_ball.vtu`.

use kerfem_cutting::{CutOptions, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, generate, io, quality};

/// A sheet over the x-y plane with waves in z.
fn wavy_sheet(n: usize) -> (Vec<Point>, Vec<[usize; 3]>) {
    let at = |k: usize| 2.4 * k as f64 / n as f64 - 1.2;
    let mut points = Vec::new();
    for j in 0..=n {
        points.extend((0..=n).map(|i| Point::new(at(i), at(j), 0.15 * (4.0 * at(i)).sin())));
    }
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let k = i + (n + 1) * j;
            triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
        }
    }
    (points, triangles)
}

/// Cuts the ball; returns the worst radius ratio afterwards.
pub(crate) fn run(out: &std::path::Path) -> Result<f64, Box<dyn std::error::Error>> {
    let mut mesh = generate::ball_tets([0.0; 3], 1.0, 8)?;
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&mesh, &positions);
    let (points, triangles) = wavy_sheet(40);
    let (sweep, _) = Sweep::new(points, triangles)?;

    let before = mesh.num_cells();
    let outcome = cut(&mut mesh, &tree, &positions, &sweep, &CutOptions::default())?;

    let report = quality::report(&mesh, mesh.rest_positions());
    println!(
        "{before} cells became {} in {} pieces",
        mesh.num_cells(),
        mesh.pieces().1
    );
    println!(
        "area of the cut {:.3} m2, at most {:.4} m from the surface",
        outcome.report.area, outcome.report.max_distance_to_sweep
    );
    println!("worst radius ratio {:.3}", report.min_radius_ratio);
    io::write_vtu(out.join("cut_ball.vtu"), &io::VtuGrid::from_tet_mesh(&mesh))?;
    Ok(report.min_radius_ratio)
}

#[allow(dead_code)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    run(std::path::Path::new(".")).map(|_| ())
}
