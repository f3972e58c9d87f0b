//! Seeded sweeps over three meshes: planes, curved, partial, through vertices, edges and facets, missing, repeated.
//!
//! `KERFEM_SWEEPS` sets how many are tried (default 600); every fourth is made twice.

use std::collections::BTreeMap;

use super::common::*;
use kerfem_cutting::{Method, Sweep};
use kerfem_mesh::{Point, TetMesh};

/// A sweep, what kind it is, and whether it is in general position.
fn random_sweep(mesh: &TetMesh, random: &mut Random) -> (&'static str, Sweep, bool) {
    let somewhere = |random: &mut Random| Point::from_fn(|_, _| random.range(0.1, 0.9));
    let vertices: Vec<Point> = mesh.vertex_ids().map(|v| mesh.rest_position(v)).collect();
    let cells: Vec<_> = mesh.cell_ids().collect();
    let corner = |random: &mut Random| mesh.cell_rest_positions(cells[random.below(cells.len())]);
    match random.below(8) {
        0 => (
            "plane",
            rectangle(somewhere(random), random.direction(), 2.0, 2.0),
            true,
        ),
        1 => {
            let (a, b) = (random.range(0.15, 0.7), random.range(0.15, 0.7));
            (
                "partial plane",
                rectangle(somewhere(random), random.direction(), a, b),
                true,
            )
        }
        2 => {
            let (c, n) = (somewhere(random), random.direction());
            let u = n.cross(&random.direction()).normalize();
            let w = n.cross(&u);
            let (bend, size) = (random.range(0.2, 0.9), random.range(0.3, 1.2));
            let at = |s: f64, t: f64| {
                let (x, y) = ((2.0 * s - 1.0) * size, (2.0 * t - 1.0) * size);
                c + u * x + w * y + n * (bend * x * x - 0.3 * bend * x * y)
            };
            ("curved", surface(2 + random.below(9), at), true)
        }
        3 => (
            "through a vertex",
            rectangle(vertices[random.below(vertices.len())], random.direction(), 2.0, 2.0),
            false,
        ),
        4 => {
            let p = corner(random);
            let n = (p[1] - p[0]).cross(&random.direction()).normalize();
            ("through an edge", rectangle(p[0], n, 0.8, 0.8), false)
        }
        5 => {
            let p = corner(random);
            let n = (p[1] - p[0]).cross(&(p[2] - p[0])).normalize();
            ("through a facet", rectangle(p[0], n, 1.5, 1.5), false)
        }
        6 => {
            let k = random.below(3);
            let n = Point::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
            let at = Point::repeat(random.below(5) as f64 / 4.0);
            (
                "on the grid",
                rectangle(at, n, [0.5, 0.6, 2.0][random.below(3)], 0.5),
                false,
            )
        }
        _ => (
            "missing",
            rectangle(Point::repeat(2.5), random.direction(), 0.5, 0.5),
            true,
        ),
    }
}

#[test]
fn no_invariant_breaks_under_random_sweeps() {
    let count: u64 = std::env::var("KERFEM_SWEEPS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(600);
    let meshes = [unit_box(4), shaken_box(4, 0.25, 11), curved_body(4)];
    let mut refusals: BTreeMap<String, usize> = BTreeMap::new();
    let mut failures: Vec<String> = Vec::new();
    let mut general = 0;
    let mut worst_seen: BTreeMap<&str, f64> = BTreeMap::new();
    for seed in 0..count {
        let mut random = Random(seed);
        let before = &meshes[random.below(3)];
        let (kind, sweep, in_general_position) = random_sweep(before, &mut random);
        let mut mesh = before.clone();
        let outcome = cut_rest(&mut mesh, &sweep, Method::Hybrid);
        if let Err(e) = check_cut(before, &mesh, &outcome) {
            failures.push(format!("seed {seed}, {kind}: {e}"));
        }
        general += usize::from(in_general_position);
        for refusal in &outcome.report.refused {
            *refusals
                .entry(format!("{refusal:?}").split(' ').next().unwrap_or("").into())
                .or_default() += 1;
        }
        let reach = 0.2 * 2.0 * 3.0_f64.sqrt() / 4.0;
        let far = outcome.report.max_distance_to_sweep;
        let entry = worst_seen.entry(kind).or_insert(1.0);
        *entry = entry.min(worst(&mesh));
        if far > if kind == "curved" { 2.0 * reach } else { reach } {
            failures.push(format!("seed {seed}, {kind}: {far} from the sweep"));
        }
        if seed % 4 == 0 {
            let once = mesh.clone();
            let again = cut_rest(&mut mesh, &sweep, Method::Hybrid);
            if !again.change.is_empty() || mesh != once {
                let area = again.report.area;
                failures.push(format!("seed {seed}, {kind}: the same sweep again opened {area} m2"));
            }
        }
    }
    println!(
        "{count} sweeps, {general} in general position, refused: {refusals:?}, worst radius ratio: {worst_seen:?}"
    );
    assert!(
        failures.is_empty(),
        "{} failures:\n{}",
        failures.len(),
        failures.join("\n")
    );
    assert!(refusals.values().sum::<usize>() * 100 < general.max(1));
}
