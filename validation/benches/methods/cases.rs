//! Bodies, sweeps and variants of methods.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_mesh::{MeshError, Point, TetMesh, generate};

/// Every method, without and with maintenance of quality.
pub(crate) fn variants() -> Vec<(String, CutOptions)> {
    let of = |(name, method): (&str, Method), improve| {
        let name = if improve { format!("{name}+") } else { name.to_owned() };
        let options = CutOptions {
            improve,
            ..CutOptions::of(method)
        };
        (name, options)
    };
    Method::NAMES
        .into_iter()
        .flat_map(|m| [of(m, false), of(m, true)])
        // there is nothing to maintain where cells are only removed
        .filter(|(name, _)| name != "delete+")
        .collect()
}

/// A box and a ball of one metre, `n` cells along a side.
pub(crate) fn bodies(n: usize) -> Result<Vec<(&'static str, TetMesh)>, MeshError> {
    let cube = generate::box_tets([1.0; 3], [n; 3], [0.0; 3]);
    Ok(vec![
        ("box", cube),
        ("ball", generate::ball_tets([0.5; 3], 0.5, n.div_ceil(2))?),
    ])
}

/// Where bodies are held: both ends along x, so that what a cut across z parts hangs at both.
pub(crate) fn held(p: Point) -> bool {
    (p.x - 0.5).abs() > 0.4
}

/// A plane, a curved sheet and a cut that ends inside, none along anything of the mesh.
pub(crate) fn sweeps() -> Vec<(&'static str, Sweep)> {
    let plane = |x: f64, y: f64| Point::new(x, y, 0.471 + 0.07 * x - 0.05 * y);
    let sheet = |s: f64, t: f64| {
        let (x, y) = (1.4 * s - 0.2, 1.4 * t - 0.2);
        Point::new(x, y, 0.48 + 0.09 * (5.0 * x).sin() * (0.4 + y))
    };
    vec![
        ("plane", grid(1, |s, t| plane(1.4 * s - 0.2, 1.4 * t - 0.2))),
        ("sheet", grid(14, sheet)),
        ("partial", grid(1, |s, t| plane(1.4 * s - 0.2, 0.77 * t - 0.2))),
    ]
}

/// A surface over the unit square in `2 n^2` triangles.
pub(crate) fn grid(n: usize, at: impl Fn(f64, f64) -> Point) -> Sweep {
    let place = |k: usize| k as f64 / n as f64;
    let points = (0..=n)
        .flat_map(|j| (0..=n).map(move |i| (i, j)))
        .map(|(i, j)| at(place(i), place(j)));
    let corners = (0..n).flat_map(|j| (0..n).map(move |i| i + (n + 1) * j));
    let triangles = corners.flat_map(|k| [[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
    Sweep::new(points.collect(), triangles.collect())
        .expect("finite points")
        .0
}
