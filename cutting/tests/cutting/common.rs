//! Sweeps and cuts in a line.

use kerfem_cutting::{CutOptions, CutOutcome, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, SimplexMesh, TetMesh, quality};

pub(crate) use super::bodies::*;
pub(crate) use super::invariants::*;
pub(crate) use super::numbers::Random;

pub(crate) fn quad(p: [[f64; 3]; 4]) -> Sweep {
    sweep_of(
        p.map(|q| Point::new(q[0], q[1], q[2])).to_vec(),
        vec![[0, 1, 2], [0, 2, 3]],
    )
}

pub(crate) fn sweep_of(points: Vec<Point>, triangles: Vec<[usize; 3]>) -> Sweep {
    Sweep::new(points, triangles).unwrap().0
}

/// A rectangle around `center` spanned by `normal`, `2 a` by `2 b`.
pub(crate) fn rectangle(center: Point, normal: Point, a: f64, b: f64) -> Sweep {
    let u = normal
        .cross(&if normal.x.abs() < 0.7 { Point::x() } else { Point::y() })
        .normalize();
    let w = normal.cross(&u);
    let at = |s: f64, t: f64| center + u * (s * a) + w * (t * b);
    sweep_of(
        vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        vec![[0, 1, 2], [0, 2, 3]],
    )
}

/// A grid of `(n + 1) x (n + 1)` points of a surface over the unit square.
pub(crate) fn surface(n: usize, at: impl Fn(f64, f64) -> Point) -> Sweep {
    let mut points = Vec::new();
    for j in 0..=n {
        points.extend((0..=n).map(|i| at(i as f64 / n as f64, j as f64 / n as f64)));
    }
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let k = i + (n + 1) * j;
            triangles.push([k, k + 1, k + n + 2]);
            triangles.push([k, k + n + 2, k + n + 1]);
        }
    }
    sweep_of(points, triangles)
}

/// Cuts in the rest frame.
pub(crate) fn cut_rest<const N: usize>(mesh: &mut SimplexMesh<N>, sweep: &Sweep, method: Method) -> CutOutcome<N> {
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(mesh, &positions);
    cut(mesh, &tree, &positions, sweep, &CutOptions::of(method)).unwrap()
}

/// Volumes of the connected pieces, ascending.
pub(crate) fn piece_volumes<const N: usize>(mesh: &SimplexMesh<N>) -> Vec<f64> {
    let (piece, count) = mesh.pieces();
    let mut out = vec![0.0; count];
    for (c, k) in mesh.cell_ids().zip(piece) {
        out[k] += quality::cell_volume(&mesh.cell_rest_positions(c));
    }
    out.sort_by(f64::total_cmp);
    out
}

pub(crate) fn worst(mesh: &TetMesh) -> f64 {
    mesh.cell_ids()
        .map(|c| quality::radius_ratio(&mesh.cell_rest_positions(c)))
        .fold(f64::INFINITY, f64::min)
}
