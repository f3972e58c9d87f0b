//! Quality maintenance and the methods that consist of it (METHODS G, Y, S10; F2, F13).

use super::common::*;
use kerfem_cutting::{Borders, CutOptions, CutOutcome, Method, Sweep, cut, cut_within, improve};
use kerfem_mesh::{BoxTree, CellId, Point, TetMesh, VertexId, generate, quality};

fn cut_with(mesh: &mut TetMesh, sweep: &Sweep, options: &CutOptions) -> CutOutcome {
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(mesh, &positions);
    cut(mesh, &tree, &positions, sweep, options).unwrap()
}

fn sweeps() -> Vec<(&'static str, Sweep)> {
    let normal = Point::new(0.3, 0.5, 0.9).normalize();
    let wave = |s: f64, t: f64| Point::new(1.4 * s - 0.2, 1.4 * t - 0.2, 0.45 + 0.2 * (3.0 * s).sin() * t);
    vec![
        ("plane", rectangle(Point::repeat(0.47), normal, 3.0, 3.0)),
        ("partial", rectangle(Point::repeat(0.47), normal, 0.3, 0.4)),
        ("wave", surface(8, wave)),
    ]
}

/// Methods that follow a sweep by splitting, maintained: no bad cell is left on bodies with a flat boundary, where
/// splitting alone leaves cells a hundred times worse.
#[test]
fn no_bad_cell_is_left_in_a_box() {
    for before in [unit_box(5), shaken_box(5, 0.2, 5)] {
        for (name, sweep) in sweeps() {
            let split = &mut before.clone();
            cut_with(split, &sweep, &CutOptions::of(Method::Subdivide));
            for method in [Method::Subdivide, Method::Hybrid, Method::Collapse, Method::Merge] {
                let mut mesh = before.clone();
                let options = CutOptions {
                    improve: true,
                    ..CutOptions::of(method)
                };
                let outcome = cut_with(&mut mesh, &sweep, &options);
                check_cut(&before, &mesh, &outcome).unwrap();
                // the corners of a front leave their cells little freedom
                let floor = if name == "partial" { 0.15 } else { 0.25 };
                assert!(worst(&mesh) >= floor, "{name} {method:?}: {}", worst(&mesh));
                assert!(worst(split) < 0.02, "{name}: {}", worst(split));
                assert!(mesh.num_cells() < split.num_cells());
                assert_eq!(
                    mesh.pieces().1,
                    if name == "partial" { 1 } else { 2 },
                    "{name} {method:?}"
                );
                let far = outcome.report.max_distance_to_sweep;
                assert!(far <= 0.2 * 0.3, "{name} {method:?}: {far}");
                // F31
                let once = mesh.clone();
                assert!(cut_with(&mut mesh, &sweep, &options).change.is_empty() && mesh == once);
            }
        }
    }
}

/// G5: one operation at a time; each lifts the worst cell it touches or takes the cells away, and keeps the mesh sound.
#[test]
fn every_single_operation_keeps_what_it_must() {
    let before = shaken_box(4, 0.2, 9);
    for (name, sweep) in sweeps() {
        for method in [Method::Collapse, Method::Merge, Method::Hybrid] {
            let mut mesh = before.clone();
            let options = CutOptions {
                improve: true,
                operations: 0,
                quality: 0.4,
                ..CutOptions::of(method)
            };
            let mut left = cut_with(&mut mesh, &sweep, &options).report.unfinished;
            let one = CutOptions {
                operations: 1,
                ..options
            };
            let volumes = piece_volumes(&mesh);
            let (mut done, start) = (0, worst(&mesh));
            while !left.is_empty() {
                let old = mesh.clone();
                let positions = mesh.rest_positions().to_vec();
                let outcome = improve(&mut mesh, &positions, &left, &one, Borders::NONE).unwrap();
                mesh.check(true).unwrap();
                let now = piece_volumes(&mesh);
                assert!(
                    volumes.iter().zip(&now).all(|(a, b)| (a - b).abs() < 1e-13),
                    "{name}: {volumes:?} {now:?}"
                );
                lifts_the_worst(&old, &mesh, &outcome);
                done += outcome.report.operations;
                assert!(outcome.report.operations <= 1);
                left = outcome.report.unfinished;
                assert!(done < 2000);
            }
            assert!(done > 0 && worst(&mesh) >= start, "{name} {method:?}: {done}");
        }
    }
}

fn lifts_the_worst(old: &TetMesh, new: &TetMesh, outcome: &CutOutcome) {
    let change = &outcome.change;
    let moved = change.vertices_moved.iter().flat_map(|v| new.cells_of_vertex(v.id));
    let kept = moved.copied().filter(|c| old.has_cell(*c)).collect::<Vec<_>>();
    let of = |mesh: &TetMesh, c: CellId| quality::radius_ratio(&mesh.cell_rest_positions(c));
    let before = change
        .cells_removed
        .iter()
        .map(|c| of(old, c.id))
        .chain(kept.iter().map(|c| of(old, *c)));
    let after = change
        .cells_added
        .iter()
        .map(|c| of(new, c.id))
        .chain(kept.iter().map(|c| of(new, *c)));
    let least = |all: &mut dyn Iterator<Item = f64>| all.fold(f64::INFINITY, f64::min);
    let (before, after) = (least(&mut { before }), least(&mut { after }));
    assert!(after >= before, "{before} -> {after}");
}

/// F2: a vertex at 1e-4 h from its opposite facet.
#[test]
fn f2_a_sliver_near_the_cut_is_taken_away() {
    let mut before = unit_box(4);
    let v = before.vertex_ids().find(|v| !before.is_boundary_vertex(*v)).unwrap();
    let cell = before.cells_of_vertex(v)[0];
    let corners = before.cell(cell).map(|w| before.rest_position(w));
    let local = before.cell(cell).iter().position(|w| *w == v).unwrap();
    let middle = (0..4).filter(|k| *k != local).map(|k| corners[k]).sum::<Point>() / 3.0;
    let mut places = before.rest_positions().to_vec();
    places[v.index()] = middle + (places[v.index()] - middle) * 1e-4 * 4.0;
    let cells = before.cell_ids().map(|c| before.cell(c).map(|v| v.index())).collect();
    before = TetMesh::new(places, cells).unwrap();
    assert!(worst(&before) < 1e-6);
    let sweep = rectangle(middle + Point::new(0.0, 0.0, 0.04), Point::z(), 0.3, 0.3);
    for method in [Method::Hybrid, Method::Collapse, Method::Merge] {
        let mut mesh = before.clone();
        let outcome = cut_with(&mut mesh, &sweep, &CutOptions::of(method));
        check_cut(&before, &mesh, &outcome).unwrap();
        assert!(worst(&mesh) > 0.2, "{method:?}: {}", worst(&mesh));
    }
}

/// F13: what would close a hole, tear a ligament of one cell or pull a front away is not collapsed; the parts and their
/// boundary stay what they are topologically.
#[test]
fn f13_holes_and_ligaments_stay() {
    // a plate with a square hole; the ligaments beside it are one box wide
    let plate = generate::box_tets([1.0, 1.0, 0.2], [5, 5, 1], [0.0; 3]);
    let is_hole = |p: &Point| (p.x - 0.5).abs() < 0.3 && (p.y - 0.5).abs() < 0.3;
    let cells: Vec<[usize; 4]> = plate
        .cell_ids()
        .filter(|c| !is_hole(&(plate.cell_rest_positions(*c).iter().sum::<Point>() / 4.0)))
        .map(|c| plate.cell(c).map(|v| v.index()))
        .collect();
    let used: Vec<usize> = plate
        .vertex_ids()
        .map(|v| v.index())
        .filter(|v| cells.iter().flatten().any(|c| c == v))
        .collect();
    let number = |v: usize| used.binary_search(&v).unwrap();
    let points = used.iter().map(|v| plate.rest_positions()[*v]).collect();
    let before = TetMesh::new(points, cells.iter().map(|c| c.map(number)).collect()).unwrap();
    // Euler characteristic of the boundary: 0 for a ring
    let euler = |mesh: &TetMesh| {
        let sides: Vec<_> = mesh.boundary_facets().map(|s| mesh.facet_key(s).0).collect();
        let mut vertices: Vec<u32> = sides.iter().flatten().copied().collect();
        let mut edges: Vec<[u32; 2]> = sides
            .iter()
            .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*a, *c]])
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        edges.sort_unstable();
        edges.dedup();
        vertices.len() as i64 - edges.len() as i64 + sides.len() as i64
    };
    assert_eq!(euler(&before), 0);
    // a slit into one ligament from inside, and one that crosses it
    for (depth, ring) in [(0.11, true), (0.3, false)] {
        let sweep = quad([
            [0.5, 0.53, -0.1],
            [0.8 + depth, 0.53, -0.1],
            [0.8 + depth, 0.53, 0.3],
            [0.5, 0.53, 0.3],
        ]);
        for method in [Method::Collapse, Method::Merge, Method::Hybrid, Method::Subdivide] {
            let mut mesh = before.clone();
            let options = CutOptions {
                improve: true,
                quality: 0.7,
                ..CutOptions::of(method)
            };
            let outcome = cut_with(&mut mesh, &sweep, &options);
            check_cut(&before, &mesh, &outcome).unwrap();
            assert_eq!(mesh.pieces().1, 1);
            assert_eq!(euler(&mesh), if ring { 0 } else { 2 }, "{method:?}");
            assert!(outcome.report.operations > 0);
        }
    }
}

/// Vertices with conditions of their own stay (on the boundary they may have been snapped to the sweep before), and so do
/// borders between materials, to the bit.
#[test]
fn what_has_conditions_stays() {
    let before = shaken_box(5, 0.15, 3);
    let positions = before.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&before, &positions);
    let (_, sweep) = &sweeps()[0];
    let held = |v: VertexId| u64::from(v.0.is_multiple_of(3));
    let upper = |c: CellId| u64::from(before.cell_rest_positions(c).iter().sum::<Point>().z > 2.0);
    let borders = Borders {
        cell_group: &upper,
        vertex_group: &held,
        ..Borders::NONE
    };
    for method in [Method::Collapse, Method::Merge, Method::Subdivide] {
        let mut mesh = before.clone();
        let options = CutOptions {
            improve: true,
            quality: 0.6,
            ..CutOptions::of(method)
        };
        let outcome = cut_within(&mut mesh, &tree, &positions, sweep, &options, borders).unwrap();
        check_cut(&before, &mesh, &outcome).unwrap();
        assert!(outcome.report.operations > 20);
        for v in before.vertex_ids().filter(|v| held(*v) == 1) {
            let may_be_snapped = before.is_boundary_vertex(v);
            assert!(mesh.has_vertex(v) && (may_be_snapped || mesh.rest_position(v) == before.rest_position(v)));
        }
        let parents: std::collections::BTreeMap<_, _> =
            outcome.change.cells_added.iter().map(|c| (c.id, c.parent)).collect();
        let volume = |mesh: &TetMesh, group: &dyn Fn(CellId) -> u64| {
            let own = mesh.cell_ids().filter(|c| group(*c) == 1);
            own.map(|c| quality::tet_volume(&mesh.cell_rest_positions(c)))
                .sum::<f64>()
        };
        let now = volume(&mesh, &|c| upper(*parents.get(&c).unwrap_or(&c)));
        assert!((now - volume(&before, &upper)).abs() < 1e-14);
    }
}

/// A cut of a deformed body: cells are good at rest and deformed, and displacements go on being those of the old field.
#[test]
fn cells_are_improved_at_rest_and_deformed_at_once() {
    let before = generate::box_tets([4.0, 1.0, 1.0], [12, 3, 3], [0.0, -0.5, -0.5]);
    let twist = |p: &Point| {
        let a = 0.9 * p.x / 4.0;
        Point::new(1.2 * p.x, p.y * a.cos() - p.z * a.sin(), p.y * a.sin() + p.z * a.cos())
    };
    let positions: Vec<Point> = before.rest_positions().iter().map(twist).collect();
    let tree = BoxTree::of_cells(&before, &positions);
    let sweep = rectangle(
        Point::new(2.3, 0.03, 0.02),
        Point::new(0.9, 0.3, 0.4).normalize(),
        5.0,
        5.0,
    );
    for method in [Method::Hybrid, Method::Collapse, Method::Merge] {
        let mut mesh = before.clone();
        let outcome = cut(&mut mesh, &tree, &positions, &sweep, &CutOptions::of(method)).unwrap();
        check_cut(&before, &mesh, &outcome).unwrap();
        assert_eq!(mesh.pieces().1, 2);
        let mut now = positions.clone();
        now.resize(mesh.vertex_slots(), Point::zeros());
        for (v, p) in &outcome.positions {
            now[v.index()] = *p;
        }
        let added = outcome.change.vertices_added.iter().map(|v| (v.id, &v.parents));
        let moved = outcome.change.vertices_moved.iter().map(|v| (v.id, &v.parents));
        for (v, parents) in added.chain(moved) {
            let place: Point = parents.iter().map(|(p, w)| positions[p.index()] * *w).sum();
            assert!((place - now[v.index()]).norm() < 1e-12);
        }
        for c in mesh.cell_ids() {
            let deformed = quality::radius_ratio(&mesh.cell(c).map(|v| now[v.index()]));
            let rest = quality::radius_ratio(&mesh.cell_rest_positions(c));
            assert!(deformed.min(rest) > 0.2, "{method:?}: {rest} {deformed}");
        }
    }
}

/// Y11: cells that a sheet folds around do not become flaps between its lips.
#[test]
fn three_cuts_that_cross_leave_no_cell_that_is_bad() {
    let at = |s: f64| 1.4 * s - 0.2;
    let wave = |x: f64, y: f64| 0.46 + 0.06 * x - 0.04 * y + 0.03 * (4.0 * x + 1.0).sin() * (3.0 * y).cos();
    let sweeps = [
        surface(10, |s, t| Point::new(at(s), at(t), wave(at(s), at(t)))),
        surface(6, |s, t| Point::new(0.53 + 0.05 * (3.0 * at(t)).sin(), at(s), at(t))),
        surface(1, |s, t| Point::new(at(s), at(t), 0.9 * at(t) - 0.12 * at(s) + 0.13)),
    ];
    for cells in [[5, 5, 5], [6, 5, 4], [4, 4, 4]] {
        let cube = generate::box_tets([1.0; 3], cells, [0.0; 3]);
        let noise = |i: usize, axis: usize| ((12.9898 * (3 * i + axis) as f64).sin() * 43758.5453).fract();
        let place = |v: VertexId| match cube.is_boundary_vertex(v) {
            true => cube.rest_position(v),
            false => cube.rest_position(v) + Point::from_fn(|k, _| 0.2 * noise(v.index(), k) / cells[k] as f64),
        };
        let places = cube.vertex_ids().map(place).collect();
        let corners = cube.cell_ids().map(|c| cube.cell(c).map(|v| v.index())).collect();
        let shaken = TetMesh::new(places, corners).unwrap();
        for method in [Method::Hybrid, Method::Collapse, Method::Merge] {
            let mut mesh = shaken.clone();
            for sweep in &sweeps {
                let before = mesh.clone();
                let outcome = cut_rest(&mut mesh, sweep, method);
                check_cut(&before, &mesh, &outcome).unwrap();
            }
            let aspect = |c: CellId| quality::edge_over_inradius(&mesh.cell_rest_positions(c));
            let worst = mesh.cell_ids().map(aspect).fold(0.0, f64::max);
            println!("{cells:?} {method:?}: worst {worst:.1}, {} pieces", mesh.pieces().1);
            assert!(worst < 40.0 && mesh.pieces().1 == 8, "{cells:?} {method:?}: {worst}");
        }
    }
}
