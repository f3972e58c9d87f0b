//! Where methods fail (METHODS F3, F5, F14, F26, F27, F30, F33), by every method with and without maintenance.

use super::common::*;
use kerfem_cutting::{CutOptions, CutOutcome, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, FacetLabel, Point, TetMesh};

fn variants() -> Vec<CutOptions> {
    let both = |(_, method)| {
        [false, true].map(|improve| CutOptions {
            improve,
            ..CutOptions::of(method)
        })
    };
    Method::NAMES.into_iter().flat_map(both).collect()
}

fn keeps_cells(options: &CutOptions) -> bool {
    options.method != Method::Delete
}

/// Cuts a copy, which must not be refused, and checks every invariant.
fn cut_by(before: &TetMesh, sweep: &Sweep, options: &CutOptions) -> (TetMesh, CutOutcome) {
    let mut mesh = before.clone();
    let positions = before.rest_positions().to_vec();
    let outcome = cut(
        &mut mesh,
        &BoxTree::of_cells(before, &positions),
        &positions,
        sweep,
        options,
    )
    .unwrap();
    assert_eq!(outcome.report.refused, [], "{options:?}");
    check_cut_by(options.method, before, &mesh, &outcome).unwrap_or_else(|e| panic!("{options:?}: {e}"));
    (mesh, outcome)
}

fn plane_z(z: f64) -> Sweep {
    rectangle(Point::new(0.5, 0.5, z), Point::z(), 0.63, 0.63)
}

#[test]
fn f3_a_plane_through_a_layer_of_facets_is_nothing_but_a_separation() {
    let before = unit_box(4);
    for options in variants() {
        for at in [0.5, 0.25] {
            let (mesh, outcome) = cut_by(&before, &plane_z(at), &options);
            assert_eq!(mesh.num_cells(), before.num_cells(), "{options:?}");
            if keeps_cells(&options) {
                assert_eq!(mesh.pieces().1, 2, "{options:?}");
                assert_eq!(mesh.num_vertices(), before.num_vertices() + 25);
                assert!(outcome.change.vertices_moved.is_empty() && outcome.report.area == 1.0);
            }
        }
        for at in [0.0, -0.0, 1.0] {
            assert!(
                cut_by(&before, &plane_z(at), &options).1.change.is_empty(),
                "{options:?}"
            );
        }
    }
}

/// F5: parallel to a face, along edges of the body, tangent to a curved one: the same bits twice, nothing broken.
#[test]
fn f5_grazing_sweeps_are_decided_once_and_for_all() {
    let (cube, round) = (unit_box(4), curved_body(4));
    let top = round.vertex_ids().map(|v| round.rest_position(v).z).fold(0.0, f64::max);
    let mut sweeps = Vec::new();
    for depth in [0.0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3] {
        sweeps.push((&cube, plane_z(1.0 - depth)));
        sweeps.push((&round, plane_z(top - depth)));
        // through an edge of the body, aslant
        let n = Point::new(1.0, 0.0, 1.0).normalize();
        sweeps.push((&cube, rectangle(Point::new(1.0 - depth, 0.5, 1.0 - depth), n, 1.0, 1.0)));
        // ends exactly in a face
        let side = rectangle(Point::new(0.5, 0.4137, 0.5 - depth), Point::y(), 0.5, 0.5);
        sweeps.push((&cube, side));
    }
    for (before, sweep) in sweeps {
        for options in variants() {
            let mut runs = [0, 1].map(|_| {
                let mut mesh = before.clone();
                let positions = before.rest_positions().to_vec();
                let tree = BoxTree::of_cells(before, &positions);
                let outcome = cut(&mut mesh, &tree, &positions, &sweep, &options).unwrap();
                check_cut_by(options.method, before, &mesh, &outcome).unwrap_or_else(|e| panic!("{options:?}: {e}"));
                (mesh, outcome.change)
            });
            assert!(runs[0] == runs[1], "{options:?}");
            let (mesh, _) = &mut runs[0];
            assert!(
                mesh.num_cells() < 4 * before.num_cells(),
                "{options:?}: {} cells",
                mesh.num_cells()
            );
        }
    }
}

#[test]
fn f14_where_two_cuts_cross_every_link_is_connected() {
    let before = shaken_box(4, 0.2, 2);
    let across = rectangle(Point::new(0.41, 0.5, 0.5), Point::x(), 0.63, 0.63);
    for options in variants() {
        let (mesh, _) = cut_by(&before, &plane_z(0.513), &options);
        let (mesh, _) = cut_by(&mesh, &across, &options);
        assert_eq!(mesh.pieces().1, 4, "{options:?}");
    }
}

/// F26: growth is bounded by the area cut over the size of cells squared.
#[test]
fn f26_twenty_random_planes_in_one_cube() {
    let n = 3;
    for options in variants() {
        if options.method == Method::Subdivide && !options.improve {
            continue; // cells grow with every crossing of planes: that is how it fails
        }
        let mut mesh = unit_box(n);
        let cells = mesh.num_cells();
        let (mut random, mut area) = (Random(26), 0.0);
        for _ in 0..20 {
            let middle = Point::from_fn(|_, _| random.range(0.3, 0.7));
            let (next, outcome) = cut_by(&mesh, &rectangle(middle, random.direction(), 2.0, 2.0), &options);
            (mesh, area) = (next, area + outcome.report.area);
        }
        let growth = mesh.num_cells() as f64 - cells as f64;
        // a layer of cells of the size h has about 12 tets per h^2; edges that would be hinges add some
        let bound = 13.0 * area * (n * n) as f64;
        println!(
            "{options:?}: {cells} cells and {growth} more, {area:.1} m2 cut, worst {:.1e}",
            worst(&mesh)
        );
        assert!(growth < bound, "{options:?}: {growth} more cells, {bound}");
        if options.method == Method::Hybrid && options.improve {
            assert!(mesh.pieces().1 > 20 && worst(&mesh) > 0.02);
        }
    }
}

/// F27: a slice a tenth as thick as a cell between two cuts. Methods that split have it exactly; those that snap take the
/// second cut for the first or leave a slice within `d` of the right one, and lose no volume.
#[test]
fn f27_a_thin_slice_between_parallel_cuts() {
    let before = unit_box(4);
    let slice = 0.1 * 0.25;
    for options in variants().into_iter().filter(keeps_cells) {
        let (mesh, _) = cut_by(&before, &plane_z(0.41), &options);
        let (mesh, _) = cut_by(&mesh, &plane_z(0.41 + slice), &options);
        let volumes = piece_volumes(&mesh);
        assert!((2..=3).contains(&volumes.len()), "{options:?}: {volumes:?}");
        if options.method == Method::Subdivide && !options.improve {
            assert_eq!(volumes.len(), 3);
            assert!((volumes[0] - slice).abs() < 1e-12, "{volumes:?}");
        }
        let d = options.snap * 0.35;
        let lower = if volumes.len() == 3 { volumes[1] } else { volumes[0] };
        assert!((lower - 0.41).abs() < 2.0 * d + slice, "{options:?}: {volumes:?}");
    }
}

/// F30: a blade that enters a thousandth of a cell from a corner.
#[test]
fn f30_an_entry_beside_a_corner() {
    let before = unit_box(4);
    for options in variants() {
        for near in [1e-3, 1e-6, 1e-9] {
            let at = near * 0.25;
            // vertical, through the edge beside the corner (1, 1, 1) and into the body, ending inside
            let n = Point::new(0.8, -0.6, 0.0);
            let entry = Point::new(1.0 - at, 1.0, 0.8);
            let along = Point::new(0.6, 0.8, 0.0);
            let sweep = rectangle_from(entry + along * 0.1, -along * 0.55, Point::z() * 0.6, n);
            let (mesh, outcome) = cut_by(&before, &sweep, &options);
            assert!(
                !keeps_cells(&options) || outcome.report.area > 0.2,
                "{options:?}, {near}"
            );
            assert!(
                mesh.num_cells() < 2 * before.num_cells(),
                "{options:?}, {near}: {}",
                mesh.num_cells()
            );
        }
    }
}

/// A parallelogram with its middle line from `start` along `a`, half as wide as `b` to both sides.
fn rectangle_from(start: Point, a: Point, b: Point, normal: Point) -> Sweep {
    assert!(a.dot(&normal).abs() < 1e-12 && b.dot(&normal).abs() < 1e-12);
    let places = [start - b, start + a - b, start + a + b, start + b];
    sweep_of(places.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// F33: cells grow 1:20 along every axis; vertices of the new faces are within `d` of the sweep as measured by the cells
/// there, so a tenth of the largest cell is no threshold for the smallest.
#[test]
fn f33_thresholds_are_those_of_the_place() {
    let before = graded_box(6, 20.0);
    let corner = before.local_size(before.vertex_ids().next().unwrap());
    for options in variants().into_iter().filter(keeps_cells) {
        // through the small cells, and through all
        let planes = [
            rectangle(
                Point::repeat(1.3 * corner),
                Point::new(0.5, 0.6, 0.62).normalize(),
                2.0,
                2.0,
            ),
            rectangle(Point::repeat(0.3), Point::new(0.1, -0.7, 0.7).normalize(), 2.0, 2.0),
        ];
        for sweep in planes {
            let (mesh, _) = cut_by(&before, &sweep, &options);
            assert_eq!(mesh.pieces().1, 2, "{options:?}");
            let reach = match options.method {
                Method::Snap => 1.2, // an end of a crossed edge, however long
                _ => options.snap,
            };
            for side in mesh.boundary_facets() {
                if mesh.facet_labels(side.cell)[side.local as usize] != FacetLabel::NONE {
                    continue;
                }
                for v in mesh.facet_corners(side) {
                    let (far, size) = (sweep.distance(&mesh.rest_position(v)), mesh.local_size(v));
                    assert!(far <= reach * size, "{options:?}: {far} where edges are {size}");
                }
            }
        }
    }
}
