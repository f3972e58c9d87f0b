//! Awkward sweeps with a known answer (METHODS F3, F4, F6-F10, F14, F25, F31).

use super::common::*;
use super::sweeps::{joined, rectangle_points, sphere};
use kerfem_cutting::{CutError, CutOptions, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, TetMesh, generate, quality};

fn plane_z(z: f64) -> Sweep {
    quad([[-0.13, -0.13, z], [1.13, -0.13, z], [1.13, 1.13, z], [-0.13, 1.13, z]])
}

/// Cuts a copy and checks every invariant.
fn cut_checked(before: &TetMesh, sweep: &Sweep, method: Method) -> (TetMesh, kerfem_cutting::CutOutcome) {
    let mut mesh = before.clone();
    let outcome = cut_rest(&mut mesh, sweep, method);
    assert_eq!(outcome.report.refused, []);
    check_cut(before, &mesh, &outcome).unwrap();
    (mesh, outcome)
}

fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    assert!(
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= tolerance),
        "{found:?} {expected:?}"
    );
}

#[test]
fn f3_a_plane_through_a_layer_of_facets_only_separates() {
    let before = unit_box(4);
    for (z, sign) in [(0.5, 1.0), (0.5, -1.0), (0.0, 1.0), (0.0, -1.0)] {
        let at = if z == 0.0 { 0.0 * sign } else { z };
        let (mesh, outcome) = cut_checked(&before, &plane_z(at), Method::Hybrid);
        assert_eq!(mesh.num_cells(), before.num_cells());
        if z == 0.5 {
            assert_close(&piece_volumes(&mesh), &[0.5, 0.5], 1e-14);
            assert_eq!(mesh.num_vertices(), before.num_vertices() + 25);
            assert!(outcome.change.vertices_moved.is_empty());
        } else {
            assert!(outcome.change.is_empty(), "a sweep on the boundary changes nothing");
        }
    }
}

#[test]
fn f3_planes_exactly_through_a_vertex_or_an_edge() {
    let before = unit_box(4);
    let tilted = quad([[-0.9, -0.1, 1.2], [1.9, -0.1, -0.2], [1.9, 1.1, -0.2], [-0.9, 1.1, 1.2]]);
    let (mesh, outcome) = cut_checked(&before, &tilted, Method::Hybrid);
    assert_close(&piece_volumes(&mesh), &[0.5, 0.5], 1e-12);
    assert!(outcome.report.max_distance_to_sweep < 1e-12);
    let corner = rectangle(Point::repeat(0.5), Point::new(1.0, 2.0, 3.0).normalize(), 2.0, 2.0);
    let (mesh, _) = cut_checked(&before, &corner, Method::Hybrid);
    assert_close(&piece_volumes(&mesh), &[0.5, 0.5], 1e-12);
}

#[test]
fn hybrid_keeps_a_plane_exactly_where_the_boundary_is_flat() {
    for z in [0.4137, 0.500001, 0.26, 0.7499999] {
        let (mesh, outcome) = cut_checked(&unit_box(4), &plane_z(z), Method::Hybrid);
        let mut expected = [z, 1.0 - z];
        expected.sort_by(f64::total_cmp);
        assert_close(&piece_volumes(&mesh), &expected, 1e-12);
        assert!((outcome.report.area - 1.0).abs() < 1e-12);
        assert!(worst(&mesh) > 0.2, "z = {z}: {}", worst(&mesh));
    }
}

#[test]
fn f4_a_pivoting_blade_sweeps_a_fan() {
    let before = shaken_box(4, 0.2, 3);
    let pivot = Point::new(0.5, -0.1, 0.5);
    let tip = |k: usize| {
        let a = 0.3 + 0.15 * k as f64;
        pivot + Point::new(1.5 * a.cos(), 1.4, 1.5 * a.sin())
    };
    // every second triangle has both its pivot ends at the same place and no area
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for k in 0..8 {
        let n = points.len();
        points.extend([pivot, tip(k), tip(k + 1), pivot]);
        triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }
    let (sweep, warnings) = Sweep::new(points, triangles).unwrap();
    assert_eq!(warnings.len(), 1);
    let (mesh, outcome) = cut_checked(&before, &sweep, Method::Hybrid);
    assert!(outcome.report.area > 0.2 && worst(&mesh) > 0.01);
}

#[test]
fn f6_an_edge_hit_twice_by_a_curved_sweep() {
    // a gutter narrower than a cell: both walls cross the same edges, and what lies between them falls out
    let walls = [[0.443, 1.1], [0.443, 0.35], [0.557, 0.35], [0.557, 1.1]];
    let mut points = Vec::new();
    for [x, z] in walls {
        points.extend([Point::new(x, -0.1, z), Point::new(x, 1.1, z)]);
    }
    let gutter = sweep_of(
        points,
        (0..3)
            .flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]])
            .collect(),
    );
    let exact = 0.114 * 0.65;
    for n in [3, 6] {
        let (mesh, outcome) = cut_checked(&unit_box(n), &gutter, Method::Hybrid);
        let volumes = piece_volumes(&mesh);
        assert_eq!(volumes.len(), 2, "{volumes:?}");
        assert!((volumes[0] - exact).abs() < 0.15 * exact, "{volumes:?} {exact}");
        assert!(outcome.report.max_distance_to_sweep < 0.2 * 1.3 / n as f64);
    }
}

#[test]
fn f7_a_cut_that_ends_inside_tetrahedra_has_its_front_there() {
    let before = shaken_box(4, 0.15, 5);
    let sweep = quad([
        [-0.1, 0.18, 0.4137],
        [0.39, 0.18, 0.4137],
        [0.39, 0.63, 0.4137],
        [-0.1, 0.63, 0.4137],
    ]);
    let (mesh, outcome) = cut_checked(&before, &sweep, Method::Hybrid);
    assert_eq!(mesh.pieces().1, 1);
    let area = outcome.report.area;
    assert!((area - 0.39 * 0.45).abs() < 0.1 * 0.39 * 0.45, "{area}");
    // vertices of the front: new faces meet old ones there, undoubled
    let on_front = mesh
        .vertex_ids()
        .map(|v| mesh.rest_position(v))
        .filter(|p| (p.z - 0.4137).abs() < 1e-9 && (p.x - 0.39).abs() < 1e-9 && p.y > 0.18 && p.y < 0.63)
        .count();
    assert!(on_front >= 2, "{on_front}");
}

#[test]
fn f8_a_thin_layer_is_never_inverted() {
    let mut places: Vec<Point> = unit_box(4).rest_positions().to_vec();
    for p in &mut places {
        if p.z == 0.5 {
            p.z = 0.275;
        }
    }
    let cells = unit_box(4)
        .cell_ids()
        .map(|c| unit_box(4).cell(c).map(|v| v.index()))
        .collect();
    let before = TetMesh::new(places, cells).unwrap();
    for z in [0.255, 0.2625, 0.27, 0.29] {
        let (mesh, outcome) = cut_checked(&before, &plane_z(z), Method::Hybrid);
        assert_eq!(mesh.pieces().1, 2, "z = {z}");
        assert!(
            outcome.report.max_distance_to_sweep <= 0.2 * 0.45,
            "{}",
            outcome.report.max_distance_to_sweep
        );
        assert!(
            worst(&mesh) >= 0.5 * worst(&before),
            "z = {z}: {} from {}",
            worst(&mesh),
            worst(&before)
        );
    }
}

#[test]
fn f9_no_surface_vertex_is_pulled_off_a_curved_or_flat_boundary() {
    for before in [
        curved_body(5),
        unit_box(5),
        generate::box_tets([2.0, 1.0, 0.5], [7, 4, 3], [0.1, 0.2, 0.3]),
    ] {
        let v0 = quality::volume(&before);
        for k in 0..12 {
            let mut random = Random(900 + k);
            let middle = Point::from_fn(|_, _| random.range(0.35, 0.65));
            let sweep = rectangle(middle, random.direction(), 3.0, 3.0);
            let (mesh, _) = cut_checked(&before, &sweep, Method::Hybrid);
            assert!((quality::volume(&mesh) - v0).abs() <= 1e-12 * v0);
        }
    }
}

#[test]
fn f10_the_order_of_cells_and_triangles_changes_no_bit_of_the_geometry() {
    let before = shaken_box(4, 0.2, 21);
    let bits = |mesh: &TetMesh| {
        let mut cells: Vec<Vec<[u64; 3]>> = mesh
            .cell_ids()
            .map(|c| {
                let mut p: Vec<[u64; 3]> = mesh
                    .cell_rest_positions(c)
                    .map(|p| [p.x, p.y, p.z].map(f64::to_bits))
                    .to_vec();
                p.sort_unstable();
                p
            })
            .collect();
        cells.sort_unstable();
        cells
    };
    for seed in 0..10 {
        let mut random = Random(seed);
        let mut cells: Vec<[usize; 4]> = before.cell_ids().map(|c| before.cell(c).map(|v| v.index())).collect();
        for i in (1..cells.len()).rev() {
            cells.swap(i, random.below(i + 1));
        }
        let shuffled = TetMesh::new(before.rest_positions().to_vec(), cells).unwrap();
        let sweep = rectangle(Point::repeat(0.47), random.direction(), 0.45, 2.0);
        for method in [Method::Hybrid, Method::Collapse, Method::Merge] {
            let (a, _) = cut_checked(&before, &sweep, method);
            let (b, _) = cut_checked(&shuffled, &sweep, method);
            assert!(bits(&a) == bits(&b), "seed {seed}, {method:?}");
        }
    }
}

#[test]
fn f14_crossing_cuts_leave_every_link_connected() {
    for before in [unit_box(4), shaken_box(4, 0.2, 2), curved_body(4)] {
        let (mesh, _) = cut_checked(&before, &plane_z(0.513), Method::Hybrid);
        let across = quad([
            [0.41, -0.1, -0.1],
            [0.41, 1.1, -0.1],
            [0.41, 1.1, 1.1],
            [0.41, -0.1, 1.1],
        ]);
        let (mesh, _) = cut_checked(&mesh, &across, Method::Hybrid);
        assert_eq!(mesh.pieces().1, 4);
        let third = quad([
            [-0.1, -0.1, -0.15],
            [1.1, -0.1, 1.05],
            [1.1, 1.1, 1.05],
            [-0.1, 1.1, -0.15],
        ]);
        let (mesh, _) = cut_checked(&mesh, &third, Method::Hybrid);
        assert!(mesh.pieces().1 >= 6, "{:?}", piece_volumes(&mesh));
    }
}

#[test]
fn f25_a_tilted_plane_is_followed_by_snapping_alone_within_a_cell() {
    let (mesh, outcome) = cut_checked(&shaken_box(5, 0.2, 4), &plane_z(0.43), Method::Snap);
    assert_eq!(mesh.pieces().1, 2);
    assert!(outcome.report.max_distance_to_sweep < 0.5 / 5.0);
}

#[test]
fn f31_the_same_sweep_twice_is_a_no_op() {
    for before in [unit_box(4), shaken_box(4, 0.2, 8), curved_body(5)] {
        for sweep in [
            plane_z(0.4137),
            plane_z(0.5),
            rectangle(Point::repeat(0.45), Point::new(0.3, 0.5, 0.9).normalize(), 0.3, 0.3),
        ] {
            let (mut mesh, _) = cut_checked(&before, &sweep, Method::Hybrid);
            let once = mesh.clone();
            let outcome = cut_rest(&mut mesh, &sweep, Method::Hybrid);
            assert!(outcome.change.is_empty() && outcome.report.warnings.len() == 1);
            assert!(mesh == once);
        }
    }
}

fn assert_no_op_again(before: &TetMesh, sweep: &Sweep, method: Method) {
    let (mut mesh, _) = cut_checked(before, sweep, method);
    let once = mesh.clone();
    let again = cut_rest(&mut mesh, sweep, method);
    assert!(
        again.change.is_empty() && mesh == once,
        "{method:?}: {} m2",
        again.report.area
    );
}

/// F31 where pieces of one sweep take vertices from each other.
#[test]
fn f31_crossing_planes_twice() {
    let before = shaken_box(4, 0.25, 11);
    for seed in 0..12 {
        let mut random = Random(seed);
        let middle = Point::from_fn(|_, _| random.range(0.3, 0.7));
        let [a, b] = [0, 1].map(|_| rectangle_points(middle, random.direction(), 2.0));
        assert_no_op_again(&before, &joined(a, b), Method::Snap);
    }
}

/// F31 where a sweep is curved within a cell and nothing snaps.
#[test]
fn f31_a_small_sphere_twice() {
    let before = shaken_box(4, 0.25, 11);
    for seed in 0..12 {
        let mut random = Random(seed);
        let middle = Point::from_fn(|_, _| random.range(0.3, 0.7));
        assert_no_op_again(&before, &sphere(middle, random.range(0.05, 0.25)), Method::Subdivide);
    }
}

#[test]
fn a_v_shaped_sweep_frees_a_wedge_and_a_closed_one_a_plug() {
    let p = |x: f64, y: f64, z: f64| Point::new(x, y, z);
    let points = vec![
        p(0.3, -0.1, 1.1),
        p(0.3, 1.1, 1.1),
        p(0.52, -0.1, 0.37),
        p(0.52, 1.1, 0.37),
        p(0.71, -0.1, 1.1),
        p(0.71, 1.1, 1.1),
    ];
    let wedge = sweep_of(points, vec![[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]]);
    for before in [unit_box(4), shaken_box(4, 0.2, 31), unit_box(9)] {
        let (mesh, _) = cut_checked(&before, &wedge, Method::Hybrid);
        let volumes = piece_volumes(&mesh);
        assert_eq!(volumes.len(), 2);
        assert!((volumes[0] - 0.11146).abs() < 0.3 * 0.11146, "{volumes:?}");
    }
    let sphere = surface(24, |s, t| {
        let (a, b) = (std::f64::consts::TAU * s, std::f64::consts::PI * t);
        Point::repeat(0.5) + Point::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos()) * 0.3
    });
    let (mesh, _) = cut_checked(&unit_box(8), &sphere, Method::Hybrid);
    let volumes = piece_volumes(&mesh);
    assert_eq!(volumes.len(), 2);
    assert!(
        (volumes[0] - 4.0 / 3.0 * std::f64::consts::PI * 0.027).abs() < 0.011,
        "{volumes:?}"
    );
}

#[test]
fn a_sweep_that_crosses_itself_cuts_like_its_pieces() {
    let p = |x: f64, y: f64, z: f64| Point::new(x, y, z);
    let points = vec![
        p(-0.1, -0.1, 0.47),
        p(1.1, -0.1, 0.47),
        p(1.1, 1.1, 0.47),
        p(-0.1, 1.1, 0.47),
        p(0.44, -0.1, -0.1),
        p(0.44, 1.1, -0.1),
        p(0.44, 1.1, 1.1),
        p(0.44, -0.1, 1.1),
    ];
    let cross = sweep_of(points, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let (mesh, _) = cut_checked(&shaken_box(4, 0.2, 77), &cross, Method::Hybrid);
    assert_eq!(mesh.pieces().1, 4);
}

#[test]
fn deleting_removes_what_is_touched_and_leaves_a_sound_mesh() {
    let before = shaken_box(4, 0.2, 6);
    let mut mesh = before.clone();
    let outcome = cut_rest(&mut mesh, &plane_z(0.45), Method::Delete);
    mesh.check(true).unwrap();
    assert!(outcome.change.cells_added.len() < outcome.change.cells_removed.len());
    assert_eq!(mesh.pieces().1, 2);
}

#[test]
fn f17_the_last_cell_may_go_and_an_empty_mesh_may_be_cut() {
    let mut mesh = unit_box(1);
    let all = surface(8, |s, t| {
        Point::new(s * 2.0 - 0.5, t * 2.0 - 0.5, 0.5 + 0.02 * (9.0 * s).sin())
    });
    cut_rest(&mut mesh, &all, Method::Delete);
    assert_eq!(mesh.num_cells(), 0);
    assert_eq!(mesh.num_vertices(), 0);
    let outcome = cut_rest(&mut mesh, &all, Method::Hybrid);
    assert!(outcome.change.is_empty());
}

#[test]
fn f19_an_inverted_cell_near_the_sweep_refuses_the_cut_and_keeps_the_mesh() {
    let before = unit_box(3);
    let mut positions = before.rest_positions().to_vec();
    let v = before.vertex_ids().find(|&v| !before.is_boundary_vertex(v)).unwrap();
    positions[v.index()].z += 0.7;
    let tree = BoxTree::of_cells(&before, &positions);
    let mut mesh = before.clone();
    let outcome = cut(&mut mesh, &tree, &positions, &plane_z(0.5), &CutOptions::default()).unwrap();
    assert_eq!(outcome.report.refused.len(), 1);
    assert!(outcome.change.is_empty() && mesh == before);
}

#[test]
fn f19_cutting_a_bar_twisted_by_half_a_turn_keeps_its_rest_volume() {
    let before = generate::box_tets([4.0, 1.0, 1.0], [16, 4, 4], [0.0, -0.5, -0.5]);
    let twist = |p: &Point| {
        let a = std::f64::consts::PI * p.x / 4.0;
        Point::new(p.x, p.y * a.cos() - p.z * a.sin(), p.y * a.sin() + p.z * a.cos())
    };
    let positions: Vec<Point> = before.rest_positions().iter().map(twist).collect();
    let tree = BoxTree::of_cells(&before, &positions);
    for (k, normal) in [
        Point::new(0.2, 0.1, 1.0),
        Point::new(1.0, 0.3, 0.2),
        Point::new(0.0, 1.0, 0.4),
    ]
    .iter()
    .enumerate()
    {
        let mut mesh = before.clone();
        let sweep = rectangle(Point::new(1.9, 0.03, 0.02), normal.normalize(), 5.0, 5.0);
        let outcome = cut(&mut mesh, &tree, &positions, &sweep, &CutOptions::default()).unwrap();
        assert_eq!(outcome.report.refused, []);
        check_cut(&before, &mesh, &outcome).unwrap();
        assert!(mesh.pieces().1 >= 2, "{k}");
        let mut now = positions.clone();
        now.resize(mesh.vertex_slots(), Point::zeros());
        for (v, p) in &outcome.positions {
            now[v.index()] = *p;
        }
        for c in mesh.cell_ids() {
            assert!(quality::tet_volume(&mesh.cell(c).map(|v| now[v.index()])) > 0.0);
        }
    }
}

#[test]
fn bad_input_is_one_clear_error() {
    let mut mesh = unit_box(2);
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&mesh, &positions);
    let options = CutOptions {
        snap: f64::NAN,
        ..CutOptions::default()
    };
    assert!(matches!(
        cut(&mut mesh, &tree, &positions, &plane_z(0.5), &options),
        Err(CutError::BadSnap { .. })
    ));
    let short = cut(&mut mesh, &tree, &positions[1..], &plane_z(0.5), &CutOptions::default());
    assert!(matches!(short, Err(CutError::BadPositions { .. })));
}

#[test]
fn a_closed_sweep_inside_one_cell_frees_nothing() {
    let before = unit_box(2);
    for radius in [0.001, 0.01, 0.03, 0.05] {
        let c = before.cell_rest_positions(kerfem_mesh::CellId(3)).iter().sum::<Point>() / 4.0;
        let sphere = surface(12, |s, t| {
            let (a, b) = (std::f64::consts::TAU * s, std::f64::consts::PI * t);
            c + Point::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos()) * radius
        });
        let (mesh, outcome) = cut_checked(&before, &sphere, Method::Hybrid);
        assert!(mesh == before && outcome.change.is_empty(), "radius {radius}");
    }
}

#[test]
fn snapping_shifts_no_border_between_materials_or_loads() {
    let before = unit_box(4);
    let positions = before.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&before, &positions);
    let side = |c: kerfem_mesh::CellId| before.cell_rest_positions(c).iter().sum::<Point>().x / 4.0 < 0.5;
    let sweep = quad([
        [0.53, -0.1, -0.1],
        [0.53, 1.1, -0.1],
        [0.53, 1.1, 1.1],
        [0.53, -0.1, 1.1],
    ]);
    let left = |mesh: &TetMesh, material: &dyn Fn(kerfem_mesh::CellId) -> bool| {
        mesh.cell_ids()
            .filter(|c| material(*c))
            .map(|c| quality::tet_volume(&mesh.cell_rest_positions(c)))
            .sum::<f64>()
    };
    let volume = left(&before, &side);
    let cell_group = |c| u64::from(side(c));
    // two materials
    let mut mesh = before.clone();
    let borders = kerfem_cutting::Borders {
        cell_group: &cell_group,
        facet_group: &|_, _| 0,
        vertex_group: &|_| 0,
    };
    let outcome =
        kerfem_cutting::cut_within(&mut mesh, &tree, &positions, &sweep, &CutOptions::default(), borders).unwrap();
    check_cut(&before, &mesh, &outcome).unwrap();
    assert_eq!(mesh.pieces().1, 2);
    let parents: std::collections::BTreeMap<_, _> =
        outcome.change.cells_added.iter().map(|c| (c.id, c.parent)).collect();
    let inherited = |c: kerfem_mesh::CellId| side(*parents.get(&c).unwrap_or(&c));
    assert!((left(&mesh, &inherited) - volume).abs() < 1e-14);
    // half of the top loaded
    let mut mesh = before.clone();
    let loaded = |_, v: [kerfem_mesh::VertexId; 3]| {
        u64::from(
            v.iter()
                .all(|v| positions[v.index()].z == 1.0 && positions[v.index()].x <= 0.5),
        )
    };
    let borders = kerfem_cutting::Borders {
        cell_group: &|_| 0,
        facet_group: &loaded,
        vertex_group: &|_| 0,
    };
    let outcome =
        kerfem_cutting::cut_within(&mut mesh, &tree, &positions, &sweep, &CutOptions::default(), borders).unwrap();
    check_cut(&before, &mesh, &outcome).unwrap();
    let area: f64 = mesh
        .boundary_facets()
        .filter_map(|s| {
            let label = mesh.facet_labels(s.cell)[s.local as usize];
            let on = loaded(label, mesh.original_facets()[label.some()?]) == 1;
            let p = mesh.facet_corners(s).map(|v| mesh.rest_position(v));
            on.then(|| (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / 2.0)
        })
        .sum();
    assert!((area - 0.5).abs() < 1e-14, "{area}");
}
