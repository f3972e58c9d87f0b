//! Meshes, sweeps and the invariants that hold after every cut.

use kerfem_cutting::{CutOptions, CutOutcome, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, SimplexMesh, TetMesh, generate, quality};

/// A small deterministic generator of numbers (splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [low, high).
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub(crate) fn direction(&mut self) -> Point {
        loop {
            let p = Point::from_fn(|_, _| self.range(-1.0, 1.0));
            if p.norm() > 0.1 && p.norm() < 1.0 {
                return p.normalize();
            }
        }
    }
}

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

/// What must hold after every cut (DESIGN invariants 3 and 5, F16).
pub(crate) fn check_cut<const N: usize>(
    before: &SimplexMesh<N>,
    after: &SimplexMesh<N>,
    outcome: &CutOutcome<N>,
) -> Result<(), String> {
    after.check(true)?;
    let (v0, v1) = (quality::volume(before), quality::volume(after));
    if (v1 - v0).abs() > 1e-12 * v0 {
        return Err(format!("rest volume went from {v0} to {v1}"));
    }
    for m in &outcome.change.vertices_added {
        let sum: f64 = m.parents.iter().map(|(_, w)| w).sum();
        if (sum - 1.0).abs() > 1e-12 || m.parents.iter().any(|(p, _)| !before.has_vertex(*p)) {
            return Err(format!("weights of new vertex {} are {:?}", m.id.0, m.parents));
        }
        if after.cells_of_vertex(m.id).is_empty() {
            return Err(format!("new vertex {} has no cell", m.id.0));
        }
    }
    let (p0, p1) = (before.pieces().1, after.pieces().1);
    if p1 < p0 {
        return Err(format!("pieces went from {p0} to {p1}"));
    }
    if !outcome.report.refused.is_empty() && before != after {
        return Err("a refused cut changed the mesh".into());
    }
    Ok(())
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
