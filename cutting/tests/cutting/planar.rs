//! Planar triangles cut by line segments: known answers, and seeded polylines with every invariant checked after each.
//!
//! `KERFEM_SWEEPS` sets how many polylines are tried (default 600).

use super::common::*;
use kerfem_cutting::{CutError, CutOptions, CutOutcome, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, TriMesh, VertexId, generate, quality};

fn unit_square(n: usize) -> TriMesh {
    generate::rect_triangles([1.0, 1.0], [n, n], [0.0, 0.0]).unwrap()
}

fn shaken_square(n: usize, by: f64, seed: u64) -> TriMesh {
    let mesh = unit_square(n);
    let mut random = Random(seed);
    let places = mesh
        .vertex_ids()
        .map(|v| {
            let shift = Point::new(random.range(-by, by), random.range(-by, by), 0.0) / n as f64;
            mesh.rest_position(v)
                + if mesh.is_boundary_vertex(v) {
                    Point::zeros()
                } else {
                    shift
                }
        })
        .collect();
    TriMesh::new(
        places,
        mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect(),
    )
    .unwrap()
}

fn at(p: [f64; 2]) -> Point {
    Point::new(p[0], p[1], 0.0)
}

fn polyline(points: &[[f64; 2]]) -> Sweep {
    let segments = (1..points.len()).map(|k| [k - 1, k]).collect();
    let (sweep, warnings) = Sweep::from_segments(points.iter().map(|p| at(*p)).collect(), segments).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    sweep
}

fn cut_checked(before: &TriMesh, sweep: &Sweep, method: Method) -> (TriMesh, CutOutcome<3>) {
    let mut mesh = before.clone();
    let outcome = cut_rest(&mut mesh, sweep, method);
    assert_eq!(outcome.report.refused, []);
    check_cut(before, &mesh, &outcome).unwrap();
    (mesh, outcome)
}

fn vertices_at(mesh: &TriMesh, p: [f64; 2]) -> Vec<VertexId> {
    mesh.vertex_ids()
        .filter(|v| (mesh.rest_position(*v) - at(p)).norm() < 1e-12)
        .collect()
}

fn close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    assert!(
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance),
        "{found:?} {expected:?}"
    );
}

const SPLITTING: [Method; 2] = [Method::Subdivide, Method::Hybrid];

#[test]
fn a_line_through_parts_the_square_exactly() {
    for method in SPLITTING {
        let (mesh, outcome) = cut_checked(&unit_square(4), &polyline(&[[-0.1, 0.41], [1.1, 0.41]]), method);
        close(&piece_volumes(&mesh), &[0.41, 0.59], 1e-14);
        assert!(
            (outcome.report.area - 1.0).abs() < 1e-14,
            "the length of a lip: {}",
            outcome.report.area
        );
        assert!(outcome.report.max_distance_to_sweep < 1e-14);
    }
}

#[test]
fn f3_a_line_along_edges_or_through_vertices_only_separates() {
    let before = unit_square(4);
    for line in [
        [[-1.0, 0.5], [2.0, 0.5]],
        [[0.0, 0.5], [1.0, 0.5]],
        [[2.0, 0.5], [-1.0, 0.5]],
    ] {
        for method in [Method::Subdivide, Method::Hybrid, Method::Snap] {
            let (mesh, outcome) = cut_checked(&before, &polyline(&line), method);
            assert_eq!(mesh.num_cells(), before.num_cells());
            assert_eq!(mesh.num_vertices(), before.num_vertices() + 5);
            assert!(outcome.change.vertices_moved.is_empty());
            close(&piece_volumes(&mesh), &[0.5, 0.5], 1e-14);
        }
    }
    // along a diagonal of the square: its triangles' edges and their middles
    let (mesh, _) = cut_checked(&before, &polyline(&[[-0.1, -0.1], [1.1, 1.1]]), Method::Subdivide);
    close(&piece_volumes(&mesh), &[0.5, 0.5], 1e-14);
}

#[test]
fn f7_a_slit_ends_exactly_at_its_tip() {
    let before = shaken_square(6, 0.2, 3);
    for tip in [[0.431, 0.377], [0.5, 0.5 + 1e-9], [0.77, 0.2]] {
        let (mesh, _) = cut_checked(&before, &polyline(&[[-0.1, 0.37], tip]), Method::Subdivide);
        assert_eq!(mesh.pieces().1, 1);
        let there = vertices_at(&mesh, tip);
        assert_eq!(there.len(), 1, "a front vertex, not doubled, at {tip:?}");
        assert!(mesh.is_boundary_vertex(there[0]), "the slit reaches its tip");
    }
}

#[test]
fn f7_a_tip_on_a_vertex_or_an_edge() {
    let before = unit_square(4);
    let (mesh, outcome) = cut_checked(&before, &polyline(&[[0.0, 0.5], [0.5, 0.5]]), Method::Subdivide);
    assert_eq!(mesh.num_cells(), before.num_cells());
    assert_eq!(
        outcome.change.vertices_added.len(),
        2,
        "the mouth and the vertex between are doubled, the tip is not"
    );
    let (mesh, _) = cut_checked(&before, &polyline(&[[0.0, 0.5], [0.375, 0.5]]), Method::Subdivide);
    let tip = vertices_at(&mesh, [0.375, 0.5]);
    assert!(tip.len() == 1 && mesh.is_boundary_vertex(tip[0]));
}

#[test]
fn a_sharp_corner_is_cut_exactly() {
    let v = [[-0.1, 0.31], [0.521, 0.437], [0.33, 1.1]];
    let (mesh, outcome) = cut_checked(&shaken_square(6, 0.2, 4), &polyline(&v), Method::Subdivide);
    assert!(outcome.report.max_distance_to_sweep < 1e-12);
    assert_eq!(vertices_at(&mesh, v[1]).len(), 2, "the corner is doubled");
    let (mouth, top) = (0.31 + 0.1 * 0.127 / 0.621, 0.521 - 0.191 * 0.563 / 0.663);
    let wedge = [[0.0, mouth], v[1], [top, 1.0], [0.0, 1.0]];
    let area: f64 = (0..4)
        .map(|k| (wedge[k], wedge[(k + 1) % 4]))
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum();
    close(&piece_volumes(&mesh), &[area / 2.0, 1.0 - area / 2.0], 1e-12);
}

#[test]
fn an_interior_slit_opens_between_its_tips() {
    let (mesh, outcome) = cut_checked(
        &shaken_square(8, 0.2, 5),
        &polyline(&[[0.31, 0.42], [0.72, 0.55]]),
        Method::Subdivide,
    );
    assert_eq!(mesh.pieces().1, 1);
    let length = f64::hypot(0.41, 0.13);
    assert!(
        (outcome.report.area - length).abs() < 1e-12,
        "{} {length}",
        outcome.report.area
    );
    for tip in [[0.31, 0.42], [0.72, 0.55]] {
        assert_eq!(vertices_at(&mesh, tip).len(), 1);
    }
}

#[test]
fn a_closed_polygon_frees_a_plug() {
    let ring: Vec<[f64; 2]> = (0..=24)
        .map(|k| f64::from(k % 24) * std::f64::consts::TAU / 24.0)
        .map(|a| [0.5 + 0.3 * a.cos(), 0.5 + 0.3 * a.sin()])
        .collect();
    for method in SPLITTING {
        let (mesh, _) = cut_checked(&unit_square(10), &polyline(&ring), method);
        assert_eq!(mesh.pieces().1, 2);
        let plug = piece_volumes(&mesh)[0];
        assert!((plug - 0.279).abs() < 0.01, "{method:?}: {plug}");
    }
}

#[test]
fn crossing_lines_make_four_pieces_and_f14_no_pinched_vertex() {
    for shift in [0.0, 0.0371] {
        let points = vec![
            at([-0.1, 0.5 + shift]),
            at([1.1, 0.5]),
            at([0.5, -0.1]),
            at([0.5 + shift, 1.1]),
        ];
        let sweep = Sweep::from_segments(points, vec![[0, 1], [2, 3]]).unwrap().0;
        for method in SPLITTING {
            let (mesh, _) = cut_checked(&unit_square(4), &sweep, method);
            assert_eq!(mesh.pieces().1, 4, "{method:?}");
        }
    }
}

#[test]
fn f31_the_same_line_again_and_misses_change_nothing() {
    let lines = [
        polyline(&[[-0.1, 0.37], [0.62, 0.43]]),
        polyline(&[[0.2, 0.2], [0.5, 0.7], [0.8, 0.21]]),
        polyline(&[[0.3, -0.2], [0.34, 1.2]]),
    ];
    for sweep in &lines {
        for method in [Method::Subdivide, Method::Hybrid, Method::Snap] {
            let (once, _) = cut_checked(&shaken_square(6, 0.2, 9), sweep, method);
            let mut twice = once.clone();
            assert!(cut_rest(&mut twice, sweep, method).change.is_empty(), "{method:?}");
            assert_eq!(once, twice);
        }
    }
    let before = unit_square(4);
    for line in [
        [[2.0, 0.0], [2.0, 1.0]],
        [[0.0, 0.0], [1.0, 0.0]],
        [[1.0, -1.0], [1.0, 2.0]],
    ] {
        let (mesh, outcome) = cut_checked(&before, &polyline(&line), Method::Subdivide);
        assert_eq!((&mesh, outcome.report.warnings.len()), (&before, 1));
    }
}

#[test]
fn delete_removes_the_crossed_triangles_only() {
    let mut mesh = unit_square(4);
    let outcome = cut_rest(&mut mesh, &polyline(&[[-0.1, 0.4], [1.1, 0.4]]), Method::Delete);
    mesh.check(true).unwrap();
    assert_eq!(outcome.change.cells_removed.len(), 8);
    assert_eq!(mesh.pieces().1, 2);
    let mut mesh = unit_square(4);
    // inside one triangle: its ends lie in it
    let outcome = cut_rest(&mut mesh, &polyline(&[[0.30, 0.31], [0.31, 0.32]]), Method::Delete);
    assert_eq!(outcome.change.cells_removed.len(), 1);
}

#[test]
fn what_does_not_fit_is_refused_in_words() {
    let attempt = |mesh: &mut TriMesh, sweep: &Sweep| {
        let positions = mesh.rest_positions().to_vec();
        let tree = BoxTree::of_cells(mesh, &positions);
        cut(mesh, &tree, &positions, sweep, &CutOptions::default())
            .unwrap_err()
            .to_string()
    };
    let line = polyline(&[[0.0, 0.5], [1.0, 0.5]]);
    let surface = rectangle(Point::repeat(0.5), Point::x(), 1.0, 1.0);
    assert!(attempt(&mut unit_square(2), &surface).contains("accepted: a sweep of line segments"));
    let cap = vec![Point::zeros(), Point::x(), Point::y(), Point::z()];
    let mut cap = TriMesh::new(cap, vec![[0, 1, 2], [0, 1, 3]]).unwrap();
    assert!(!cap.is_planar() && cap.check(true).is_ok());
    assert!(attempt(&mut cap, &line).contains("accepted: tetrahedra, and triangles in the plane"));
    let mut tets = unit_box(2);
    let (positions, tree) = (
        tets.rest_positions().to_vec(),
        BoxTree::of_cells(&tets, tets.rest_positions()),
    );
    let e = cut(&mut tets, &tree, &positions, &line, &CutOptions::default()).unwrap_err();
    assert!(matches!(e, CutError::WrongKind(_)) && e.to_string().contains("accepted: a sweep of triangles"));
    assert!(Sweep::from_segments(vec![Point::z()], vec![]).is_err());
    assert!(Sweep::from_segments(vec![Point::zeros()], vec![[0, 1]]).is_err());
    assert!(Sweep::from_segments(vec![Point::new(f64::NAN, 0.0, 0.0)], vec![]).is_err());
    let (sweep, warnings) =
        Sweep::from_segments(vec![at([0.0, 0.0]), at([1.0, 0.0])], vec![[0, 1], [1, 0], [1, 1]]).unwrap();
    assert!(!sweep.is_empty());
    assert_eq!(
        warnings,
        [
            "1 segments of the sweep have no length and were ignored",
            "1 repeated segments of the sweep were ignored"
        ]
    );
}

#[test]
fn clockwise_files_are_turned_and_mixtures_refused() {
    let square = vec![at([0.0, 0.0]), at([1.0, 0.0]), at([1.0, 1.0]), at([0.0, 1.0])];
    let turned = TriMesh::new(square.clone(), vec![[0, 2, 1], [0, 3, 2]]).unwrap();
    assert!(turned.check(true).is_ok() && (quality::volume(&turned) - 1.0).abs() < 1e-15);
    assert!(TriMesh::new(square.clone(), vec![[0, 1, 2], [0, 3, 2]]).is_err());
    let mut folded = square;
    folded[3] = at([0.9, 0.2]);
    let e = TriMesh::new(folded, vec![[0, 1, 2], [0, 3, 2]])
        .unwrap_err()
        .to_string();
    assert!(e.contains("overlap"), "{e}");
}

#[test]
fn the_order_of_segments_changes_nothing() {
    let points: Vec<Point> = [[-0.1, 0.33], [0.4, 0.52], [0.71, 0.35], [1.2, 0.66]].map(at).to_vec();
    let forward = Sweep::from_segments(points.clone(), vec![[0, 1], [1, 2], [2, 3]])
        .unwrap()
        .0;
    let mixed = Sweep::from_segments(points, vec![[2, 3], [0, 1], [2, 1]]).unwrap().0;
    for method in SPLITTING {
        let before = shaken_square(7, 0.2, 21);
        assert_eq!(
            cut_checked(&before, &forward, method).0,
            cut_checked(&before, &mixed, method).0
        );
    }
}

#[test]
fn a_cut_in_the_deformed_frame_keeps_the_rest_area() {
    let before = shaken_square(6, 0.2, 2);
    let bend = |p: &Point| Point::new(p.x * (1.0 + 0.4 * p.y), p.y + 0.3 * p.x * p.x, 0.0);
    let deformed: Vec<Point> = before.rest_positions().iter().map(bend).collect();
    let mut mesh = before.clone();
    let tree = BoxTree::of_cells(&mesh, &deformed);
    let options = CutOptions {
        method: Method::Subdivide,
        ..CutOptions::default()
    };
    let outcome = cut(
        &mut mesh,
        &tree,
        &deformed,
        &polyline(&[[-0.1, 0.6], [1.6, 0.7]]),
        &options,
    )
    .unwrap();
    check_cut(&before, &mesh, &outcome).unwrap();
    assert_eq!(mesh.pieces().1, 2);
    assert!(outcome.report.max_distance_to_sweep < 1e-12);
}

/// Of the square, what lies below a line through it: the shoelace formula on the clipped polygon.
fn area_below(p: [f64; 2], q: [f64; 2]) -> f64 {
    let side = |c: [f64; 2]| (q[0] - p[0]) * (c[1] - p[1]) - (q[1] - p[1]) * (c[0] - p[0]);
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        let (sa, sb) = (side(a), side(b));
        if sa >= 0.0 {
            kept.push(a);
        }
        if (sa >= 0.0) != (sb >= 0.0) {
            let t = sa / (sa - sb);
            kept.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    (0..kept.len())
        .map(|k| (kept[k], kept[(k + 1) % kept.len()]))
        .map(|(a, b)| a[0] * b[1] - a[1] * b[0])
        .sum::<f64>()
        / 2.0
}

#[test]
fn no_invariant_breaks_under_random_polylines() {
    let count: u64 = std::env::var("KERFEM_SWEEPS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(600);
    let meshes = [unit_square(6), shaken_square(6, 0.3, 1)];
    let (mut failures, mut refused) = (Vec::new(), 0);
    for seed in 0..count {
        let mut random = Random(seed);
        let before = &meshes[random.below(2)];
        let method = [Method::Subdivide, Method::Hybrid, Method::Snap, Method::Delete][random.below(4)];
        let vertices: Vec<VertexId> = before.vertex_ids().collect();
        let place = |random: &mut Random| match random.below(4) {
            0 => {
                let p = before.rest_position(vertices[random.below(vertices.len())]);
                [p.x, p.y]
            }
            _ => [random.range(-0.3, 1.3), random.range(-0.3, 1.3)],
        };
        let through = random.below(2) == 0;
        let line: Vec<[f64; 2]> = if through {
            let (p, q) = ([0.0; 2].map(|_| random.range(0.1, 0.9)), random.range(0.0, 3.0));
            [-2.0, 2.0]
                .map(|s| [p[0] + s * f64::cos(q), p[1] + s * f64::sin(q)])
                .to_vec()
        } else {
            (0..2 + random.below(4)).map(|_| place(&mut random)).collect()
        };
        let segments = (1..line.len()).map(|k| [k - 1, k]).collect();
        let sweep = Sweep::from_segments(line.iter().map(|p| at(*p)).collect(), segments)
            .unwrap()
            .0;
        let mut mesh = before.clone();
        let outcome = cut_rest(&mut mesh, &sweep, method);
        refused += outcome.report.refused.len();
        let checked = match method {
            Method::Delete => mesh.check(true),
            _ => check_cut(before, &mesh, &outcome),
        };
        if let Err(e) = checked {
            failures.push(format!("seed {seed}, {method:?}: {e}"));
        }
        if through && method == Method::Subdivide {
            let below = area_below(line[0], line[1]);
            let mut expected = [below, 1.0 - below];
            expected.sort_by(f64::total_cmp);
            let found = piece_volumes(&mesh);
            if found.len() != 2 || found.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-12) {
                failures.push(format!("seed {seed}: pieces {found:?}, expected {expected:?}"));
            }
        }
        if seed % 4 == 0 && method != Method::Delete {
            let once = mesh.clone();
            let again = cut_rest(&mut mesh, &sweep, method);
            if !again.change.is_empty() || mesh != once {
                failures.push(format!("seed {seed}, {method:?}: again opened {} m", again.report.area));
            }
        }
    }
    println!("{count} polylines, {refused} refused");
    assert!(
        failures.is_empty(),
        "{} failures:\n{}",
        failures.len(),
        failures.join("\n")
    );
    assert!(refused * 100 <= count as usize, "{refused} refused");
}
