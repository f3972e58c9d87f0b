//! METHODS S6: every 6-bit edge code and 4-bit vertex code that a plane or a disc can produce in a tetrahedron.
//!
//! A plane gives the corners any signs but four zeros. It meets the tetrahedron in a polygon with corners on the crossed
//! edges and on the corners of sign zero; a disc in the plane covers some of these. The codes so found are committed as
//! `codes.txt` (`edges vertices`, binary, edges in the order 01 02 03 12 13 23).

use std::collections::BTreeSet;

use super::common::*;
use kerfem_cutting::{Method, Sweep};
use kerfem_mesh::{Point, TetMesh};

const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// A tetrahedron with a neighbour on every facet, so that front vertices on its facets must agree with both sides.
fn star() -> TetMesh {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.0, 0.1], [0.3, 0.2, 0.9]];
    let mut points: Vec<Point> = corners.iter().map(|c| Point::new(c[0], c[1], c[2])).collect();
    let middle = (points[0] + points[1] + points[2] + points[3]) / 4.0;
    let mut cells = vec![[0, 1, 2, 3]];
    for k in 0..4 {
        let apex = points.len();
        points.push(middle + (middle - points[k]) * 1.5);
        // the apex mirrors corner k, so the orientation turns
        let mut cell = [0, 1, 2, 3];
        cell[k] = apex;
        cell.swap((k + 1) % 4, (k + 2) % 4);
        cells.push(cell);
    }
    TetMesh::new(points, cells).unwrap()
}

/// Heights of the corners over the plane.
fn heights(signs: [i32; 4]) -> [f64; 4] {
    signs.map(|s| s as f64 * if s > 0 { 0.6 } else { 0.4 })
}

/// Normal of the plane over which the corners have the heights that [`polygon`] uses.
fn plane_normal(p: &[Point; 4], signs: [i32; 4]) -> Point {
    let h = heights(signs);
    let rows = [1, 2, 3].map(|k| (p[k] - p[0]).transpose());
    let inverse = nalgebra::Matrix3::from_rows(&rows).try_inverse().unwrap();
    (inverse * Point::new(h[1] - h[0], h[2] - h[0], h[3] - h[0])).normalize()
}

/// Where a plane with the given corner signs meets edges (0 to 5) and corners (6 to 9).
fn polygon(p: &[Point; 4], signs: [i32; 4]) -> Vec<(usize, Point)> {
    let height = heights(signs);
    let mut out = Vec::new();
    for (k, e) in EDGES.iter().enumerate() {
        let (a, b) = (height[e[0]], height[e[1]]);
        if a * b < 0.0 {
            out.push((k, p[e[0]] + (p[e[1]] - p[e[0]]) * (a / (a - b))));
        }
    }
    out.extend((0..4).filter(|&k| signs[k] == 0).map(|k| (6 + k, p[k])));
    out
}

/// A flat patch around some points of a plane: a fan over a ring around each, hulls joined by a strip from the mean.
fn patch(points: &[Point], normal: Point, radius: f64) -> Sweep {
    let u = normal
        .cross(&if normal.x.abs() < 0.7 { Point::x() } else { Point::y() })
        .normalize();
    let w = normal.cross(&u);
    let center = points.iter().sum::<Point>() / points.len() as f64;
    let flat = |p: &Point| [(p - center).dot(&u), (p - center).dot(&w)];
    let mut ring: Vec<[f64; 2]> = Vec::new();
    for p in points {
        let [x, y] = flat(p);
        for k in 0..12 {
            let a = (k as f64 + 0.37) * std::f64::consts::TAU / 12.0;
            ring.push([x + radius * a.cos(), y + radius * a.sin()]);
        }
    }
    let hull = convex_hull(ring);
    let mut places = vec![center];
    places.extend(hull.iter().map(|q| center + u * q[0] + w * q[1]));
    let n = hull.len();
    sweep_of(places, (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect())
}

fn convex_hull(mut p: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    p.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let chain = |it: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut h: Vec<[f64; 2]> = Vec::new();
        for q in it {
            while h.len() >= 2 && turn(h[h.len() - 2], h[h.len() - 1], q) <= 1e-12 {
                h.pop();
            }
            h.push(q);
        }
        h.pop();
        h
    };
    let mut hull = chain(&mut p.iter().copied());
    hull.extend(chain(&mut p.iter().rev().copied()));
    hull
}

#[test]
fn every_code_of_a_plane_or_disc_is_cut_with_exact_volume_and_conforming_neighbours() {
    let before = star();
    let p = [0, 1, 2, 3].map(|k| before.rest_positions()[k]);
    let mut codes = BTreeSet::new();
    let mut opened = 0;
    for number in 0..81 {
        let signs = [number % 3, number / 3 % 3, number / 9 % 3, number / 27].map(|s| s - 1);
        if signs == [0; 4] {
            continue;
        }
        let corners = polygon(&p, signs);
        for subset in 1..1u32 << corners.len() {
            let chosen: Vec<(usize, Point)> = (0..corners.len())
                .filter(|i| subset >> i & 1 == 1)
                .map(|i| corners[i])
                .collect();
            let points: Vec<Point> = chosen.iter().map(|c| c.1).collect();
            // a hull over opposite corners of a quadrilateral is what a disc may cover as well
            let sweep = patch(&points, plane_normal(&p, signs), 0.02);
            let code = chosen.iter().fold(0u32, |c, (k, _)| c | 1 << k);
            codes.insert(format!(
                "{:06b} {:04b}",
                (code & 63).reverse_bits() >> 26,
                (code >> 6).reverse_bits() >> 28
            ));
            for method in [Method::Subdivide, Method::Hybrid] {
                let mut mesh = before.clone();
                let outcome = cut_rest(&mut mesh, &sweep, method);
                assert_eq!(
                    outcome.report.refused,
                    [],
                    "{method:?} signs {signs:?} subset {subset:b}"
                );
                check_cut(&before, &mesh, &outcome).unwrap_or_else(|e| panic!("{method:?} {signs:?} {subset:b}: {e}"));
                if method == Method::Subdivide && corners.len() >= 3 {
                    let split = chosen.iter().filter(|(k, _)| *k < 6).count();
                    for (k, at) in chosen.iter().filter(|(k, _)| *k < 6) {
                        let near = mesh
                            .vertex_ids()
                            .filter(|&v| (mesh.rest_position(v) - at).norm() < 1e-9)
                            .count();
                        assert!(near >= 2, "{signs:?} {subset:b}: edge {k} is not opened");
                    }
                    if split > 0 {
                        let (area, far) = (outcome.report.area, outcome.report.max_distance_to_sweep);
                        assert!(
                            area > 0.0 && far < 1e-6,
                            "{signs:?} {subset:b}: area {area}, {far} from the sweep"
                        );
                        opened += 1;
                    }
                }
            }
        }
    }
    let listed: BTreeSet<String> = include_str!("codes.txt").lines().map(String::from).collect();
    assert_eq!(codes, listed, "codes.txt does not list the codes found");
    assert!(opened > 200, "{opened}");
}

#[test]
fn complete_planes_cut_one_tetrahedron_into_exact_parts() {
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [0.2, 1.0, 0.1], [0.3, 0.2, 0.9]];
    let points: Vec<Point> = corners.iter().map(|c| Point::new(c[0], c[1], c[2])).collect();
    let before = TetMesh::new(points.clone(), vec![[0, 1, 2, 3]]).unwrap();
    let p = [0, 1, 2, 3].map(|k| points[k]);
    for number in 0..81 {
        let signs = [number % 3, number / 3 % 3, number / 9 % 3, number / 27].map(|s| s - 1);
        let on: Vec<Point> = polygon(&p, signs).into_iter().map(|c| c.1).collect();
        let properly = signs.contains(&1) && signs.contains(&-1);
        if on.len() < 3 || signs == [0; 4] {
            continue;
        }
        let middle = on.iter().sum::<Point>() / on.len() as f64;
        let sweep = rectangle(middle, plane_normal(&p, signs), 3.0, 3.0);
        let mut mesh = before.clone();
        let outcome = cut_rest(&mut mesh, &sweep, Method::Subdivide);
        check_cut(&before, &mesh, &outcome).unwrap();
        let volumes = piece_volumes(&mesh);
        assert_eq!(volumes.len(), if properly { 2 } else { 1 }, "{signs:?}");
        if signs.iter().filter(|s| **s == 0).count() == 0 && signs.iter().sum::<i32>().abs() == 2 {
            // three edges at the lone corner, each cut at the same fraction of the way towards it
            let (lone, other): (f64, f64) = if signs.iter().sum::<i32>() < 0 {
                (0.6, 0.4)
            } else {
                (0.4, 0.6)
            };
            let t = lone / (lone + other);
            let expected = t.powi(3) * volumes.iter().sum::<f64>();
            assert!(
                volumes.iter().any(|v| (v - expected).abs() < 1e-12),
                "{volumes:?} {expected}"
            );
        }
        let cells = mesh.num_cells();
        let expected = match (signs.iter().filter(|s| **s == 0).count(), on.len()) {
            _ if !properly => 1,
            (0, 3) => 4,
            (0, 4) => 6,
            (1, _) => 3,
            _ => 2,
        };
        assert_eq!(cells, expected, "{signs:?}: METHODS S6 without face vertices");
    }
}
