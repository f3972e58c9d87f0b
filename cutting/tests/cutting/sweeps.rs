//! Seeded bodies, sweeps and methods, shared by all who cut at random.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_mesh::{Point, TetMesh};

use super::common::*;

/// A random sweep.
pub(crate) struct Drawn {
    /// What it is.
    pub(crate) kind: &'static str,
    pub(crate) sweep: Sweep,
    /// Nothing about it is special to the mesh or to itself: no refusal is expected.
    pub(crate) general: bool,
}

/// The bodies that are cut at random, by name; all lie in the unit cube or near it.
pub(crate) fn random_bodies() -> Vec<(&'static str, TetMesh)> {
    vec![
        ("box", unit_box(4)),
        ("shaken", shaken_box(4, 0.25, 11)),
        ("curved", curved_body(4)),
        ("ball", ball(3)),
        ("graded", graded_box(5, 20.0)),
        ("layered", layered_box(4)),
        ("plate", thin_plate()),
    ]
}

/// Any method, mostly with the default threshold, with and without quality maintenance.
pub(crate) fn random_options(random: &mut Random) -> CutOptions {
    let method = Method::NAMES[random.below(Method::NAMES.len())].1;
    let snap = match random.below(6) {
        0 => 0.0,
        1 => random.range(0.0, 0.45),
        _ => CutOptions::default().snap,
    };
    let usual = CutOptions::of(method);
    CutOptions {
        snap,
        // the other way than usual now and then
        improve: usual.improve != (random.below(4) == 0),
        relax: random.below(6) == 0,
        // a sheet that may not give way at all leaves little to improve
        quality: if snap == 0.0 {
            0.1
        } else {
            [0.3, 0.3, 0.3, 0.3, 0.1, 0.45][random.below(6)]
        },
        operations: [usize::MAX, usize::MAX, 7][random.below(3)],
        ..usual
    }
}

/// A place in the unit cube, or in a random cell, so that small cells are met as often as large ones.
fn somewhere(mesh: &TetMesh, positions: &[Point], random: &mut Random) -> Point {
    if random.below(2) == 0 || mesh.num_cells() == 0 {
        return Point::from_fn(|_, _| random.range(0.1, 0.9));
    }
    let weights = [0; 4].map(|_| random.range(0.1, 1.0));
    let total: f64 = weights.iter().sum();
    let p = some_cell(mesh, positions, random);
    p.iter().zip(weights).map(|(p, w)| p * (w / total)).sum()
}

/// Corners of a random cell; of a mesh without cells a place outside.
fn some_cell(mesh: &TetMesh, positions: &[Point], random: &mut Random) -> [Point; 4] {
    let start = random.below(mesh.cell_slots().max(1));
    let found = mesh
        .cell_ids()
        .find(|c| c.index() >= start)
        .or_else(|| mesh.cell_ids().next());
    found.map_or([Point::repeat(2.0), Point::x(), Point::y(), Point::z()], |c| {
        mesh.cell(c).map(|v| positions[v.index()])
    })
}

/// Two unit vectors that span the plane across a direction.
fn across(n: Point, random: &mut Random) -> [Point; 2] {
    loop {
        let u = n.cross(&random.direction());
        if u.norm() > 0.1 {
            let u = u.normalize();
            return [u, n.cross(&u)];
        }
    }
}

/// A direction across an edge, and other than along it.
fn across_edge(a: Point, b: Point, random: &mut Random) -> Point {
    across((b - a).normalize(), random)[0]
}

/// A random sweep at a body whose vertices are at `positions`.
pub(crate) fn random_sweep(mesh: &TetMesh, positions: &[Point], random: &mut Random) -> Drawn {
    let drawn = |kind, sweep, general| Drawn { kind, sweep, general };
    let c = somewhere(mesh, positions, random);
    let n = random.direction();
    let p = some_cell(mesh, positions, random);
    match random.below(14) {
        0 | 1 => drawn("plane", rectangle(c, n, 2.0, 2.0), true),
        2 | 3 => {
            let (a, b) = (random.range(0.1, 0.7), random.range(0.1, 0.7));
            drawn("partial plane", rectangle(c, n, a, b), true)
        }
        4 => drawn("curved", curved(c, n, random), true),
        5 => drawn("through a vertex", rectangle(p[0], n, 2.0, 2.0), false),
        6 => drawn(
            "through an edge",
            rectangle(p[0], across_edge(p[0], p[1], random), 0.8, 0.8),
            false,
        ),
        7 => {
            let facet = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
            drawn("through a facet", rectangle(p[0], facet, 1.5, 1.5), false)
        }
        8 => {
            let n = Point::ith(random.below(3), 1.0);
            let at = Point::repeat(random.below(5) as f64 / 4.0);
            drawn(
                "on the grid",
                rectangle(at, n, [0.5, 0.6, 2.0][random.below(3)], 0.5),
                false,
            )
        }
        9 => drawn("missing", rectangle(Point::repeat(2.5), n, 0.5, 0.5), true),
        10 => drawn("closed", sphere(c, random.range(0.05, 0.4)), true),
        11 => drawn("pivoting", fan(c, n, random), true),
        12 => drawn("crossing pair", two_planes(c, n, random), false),
        _ => {
            let gap = 10f64.powf(random.range(-6.0, -1.0));
            let (a, b) = (rectangle_points(c, n, 2.0), rectangle_points(c + n * gap, n, 2.0));
            drawn("parallel pair", joined(a, b), false)
        }
    }
}

pub(crate) fn rectangle_points(center: Point, normal: Point, a: f64) -> Vec<Point> {
    let u = normal
        .cross(&if normal.x.abs() < 0.7 { Point::x() } else { Point::y() })
        .normalize();
    let w = normal.cross(&u);
    [[-a, -a], [a, -a], [a, a], [-a, a]]
        .map(|[s, t]| center + u * s + w * t)
        .to_vec()
}

/// Two quadrilaterals as one sweep.
pub(crate) fn joined(mut a: Vec<Point>, b: Vec<Point>) -> Sweep {
    a.extend(b);
    sweep_of(a, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
}

fn two_planes(c: Point, n: Point, random: &mut Random) -> Sweep {
    let other = (n + across(n, random)[0] * random.range(0.3, 3.0)).normalize();
    joined(rectangle_points(c, n, 2.0), rectangle_points(c, other, 2.0))
}

fn curved(c: Point, n: Point, random: &mut Random) -> Sweep {
    let [u, w] = across(n, random);
    let (bend, size) = (random.range(0.2, 0.9), random.range(0.3, 1.2));
    surface(2 + random.below(9), |s, t| {
        let (x, y) = ((2.0 * s - 1.0) * size, (2.0 * t - 1.0) * size);
        c + u * x + w * y + n * (bend * x * x - 0.3 * bend * x * y)
    })
}

pub(crate) fn sphere(c: Point, radius: f64) -> Sweep {
    surface(12, |s, t| {
        let (a, b) = (std::f64::consts::TAU * s, std::f64::consts::PI * t);
        c + Point::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos()) * radius
    })
}

/// What a blade sweeps that turns about one of its ends (F4).
fn fan(c: Point, n: Point, random: &mut Random) -> Sweep {
    let [u, w] = across(n, random);
    let (pivot, turn) = (c - u, random.range(0.05, 0.2));
    let tip = |k: usize| {
        let a = turn * k as f64 - 4.0 * turn;
        pivot + (u * a.cos() + w * a.sin() + n * (0.2 * a)) * 2.0
    };
    let mut points = vec![pivot];
    points.extend((0..=8).map(tip));
    sweep_of(points, (1..=8).map(|k| [0, k, k + 1]).collect())
}
