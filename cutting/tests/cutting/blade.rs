//! Progressive cuts by a moving blade (METHODS N1, N13, N14, F4, F5, F7, F30): how finely a motion is sampled does not
//! matter, and the incision ends at the blade.

use super::common::*;
use kerfem_cutting::{Blade, CutOptions, Method, Tip, cut};
use kerfem_mesh::{BoxTree, Point, TetMesh, generate, quality};

/// What a motion came to.
struct Progress {
    mesh: TetMesh,
    tip: Tip,
    /// Sum over the cuts (m²).
    area: f64,
    /// Largest distance from the end of the incision to the blade after any sample (m).
    tip_distance: f64,
    refused: usize,
}

fn options(method: Method) -> CutOptions {
    CutOptions::of(method)
}

fn blade(samples: &[(f64, [f64; 3], [f64; 3])]) -> Blade {
    let of = |&(t, h, e): &(f64, [f64; 3], [f64; 3])| (t, [Point::from(h), Point::from(e)]);
    Blade::new(samples.iter().map(of).collect()).unwrap()
}

/// Cuts in the rest frame, stopping at `times`, and checks every invariant after each cut.
fn cut_at(before: &TetMesh, blade: &Blade, times: &[f64], method: Method) -> Progress {
    let mut p = Progress {
        mesh: before.clone(),
        tip: Tip::new(blade.at(times[0])),
        area: 0.0,
        tip_distance: 0.0,
        refused: 0,
    };
    let mut now = times[0];
    for &to in &times[1..] {
        for stop in blade.stops(now, to) {
            go_on(&mut p, blade.at(stop), method, stop == times[times.len() - 1]);
        }
        now = to;
    }
    p
}

fn go_on(p: &mut Progress, line: [Point; 2], method: Method, last: bool) {
    let old = p.mesh.clone();
    let positions = p.mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&p.mesh, &positions);
    let sweep = p.tip.sweep_to(&p.mesh, &tree, &positions, line, &options(method), last);
    if sweep.is_empty() {
        return;
    }
    let outcome = cut(&mut p.mesh, &tree, &positions, &sweep, &options(method)).unwrap();
    if method != Method::Delete {
        check_cut(&old, &p.mesh, &outcome).unwrap();
    }
    p.area += outcome.report.area;
    p.refused += outcome.report.refused.len();
    let positions = p.mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&p.mesh, &positions);
    p.tip.arrive(&p.mesh, &tree, &positions, line, &options(method));
    p.tip_distance = p.tip_distance.max(p.tip.distance());
}

/// `n` equal pieces of the whole motion.
fn equal(blade: &Blade, n: usize) -> Vec<f64> {
    let (a, b) = (blade.start(), blade.end());
    (0..=n).map(|k| a + (b - a) * k as f64 / n as f64).collect()
}

/// Through the whole body, slanted, in the plane `x + 0.1 y - 0.2 z = 0.413`.
fn through() -> Blade {
    let x = |y: f64, z: f64| 0.413 - 0.1 * y + 0.2 * z;
    let at = |y: f64| ([x(y - 0.1, -0.2), y - 0.1, -0.2], [x(y + 0.13, 1.2), y + 0.13, 1.2]);
    let (a, b) = (at(-0.3), at(1.3));
    blade(&[(0.0, a.0, a.1), (1.0, b.0, b.1)])
}

/// `d` of the meshes here (m): the snapping distance at their largest local size.
fn snap_distance(mesh: &TetMesh) -> f64 {
    let largest = mesh.vertex_ids().map(|v| mesh.local_size(v)).fold(0.0, f64::max);
    CutOptions::default().snap * largest
}

fn meshes() -> [TetMesh; 3] {
    [unit_box(4), shaken_box(4, 0.2, 7), curved_body(4)]
}

#[test]
fn a_plane_cut_in_pieces_gives_the_same_parts() {
    for before in meshes() {
        for method in [Method::Subdivide, Method::Hybrid] {
            let whole = cut_at(&before, &through(), &[0.0, 1.0], method);
            let expected = piece_volumes(&whole.mesh);
            assert_eq!((expected.len(), whole.refused), (2, 0));
            for n in [2, 10, 29] {
                let p = cut_at(&before, &through(), &equal(&through(), n), method);
                let (d, volumes) = (snap_distance(&before), piece_volumes(&p.mesh));
                let tolerance = match method {
                    Method::Subdivide if n <= 10 => 1e-12,
                    // what single precision cannot tell from a vertex is one
                    Method::Subdivide => 1e-8,
                    _ => d * whole.area,
                };
                let off = (volumes[0] - expected[0]).abs();
                println!(
                    "{method:?} {n}: off {off:e}, worst {:.4}, tip {:.1e}",
                    worst(&p.mesh),
                    p.tip_distance
                );
                assert_eq!((volumes.len(), p.refused), (2, 0), "{method:?} {n}: {volumes:?}");
                assert!(off <= tolerance, "{method:?} {n}: {volumes:?} {expected:?}");
                let farthest = if method == Method::Subdivide { 1e-5 } else { 2.0 * d };
                assert!(p.tip_distance <= farthest, "{method:?} {n}: {}", p.tip_distance);
            }
        }
    }
}

#[test]
fn snapping_in_pieces_no_finer_than_cells_gives_the_same_parts() {
    for before in meshes() {
        for n in [1, 2, 5, 10] {
            let p = cut_at(&before, &through(), &equal(&through(), n), Method::Snap);
            assert_eq!((piece_volumes(&p.mesh).len(), p.refused), (2, 0), "{n}");
        }
    }
}

#[test]
fn deleting_in_pieces_removes_the_same_cells() {
    for before in meshes() {
        let whole = cut_at(&before, &through(), &[0.0, 1.0], Method::Delete).mesh;
        let pieces = cut_at(&before, &through(), &equal(&through(), 7), Method::Delete).mesh;
        assert!(whole.num_cells() < before.num_cells());
        assert_eq!(whole.num_cells(), pieces.num_cells());
        assert!((quality::volume(&whole) - quality::volume(&pieces)).abs() < 1e-12);
    }
}

#[test]
fn f4_a_pivoting_blade_cuts_a_fan() {
    let fan = fan([0.47, -0.7, 0.52], false);
    for before in meshes() {
        let mut volumes = Vec::new();
        for (n, method) in [(10, Method::Subdivide), (10, Method::Hybrid), (20, Method::Hybrid)] {
            let p = cut_at(&before, &fan, &equal(&fan, n), method);
            let all = piece_volumes(&p.mesh);
            println!(
                "{method:?} {n}: {all:?} worst {:.4} tip {:.1e}",
                worst(&p.mesh),
                p.tip_distance
            );
            assert_eq!((all.len(), p.refused), (2, 0), "{method:?} {n}: {all:?}");
            volumes.push(all[0]);
        }
        let tolerance = snap_distance(&before) * 1.05;
        assert!(
            volumes.iter().all(|v| (v - volumes[0]).abs() < tolerance),
            "{volumes:?}"
        );
    }
}

#[test]
fn a_twisted_cut_in_pieces_gives_the_same_parts() {
    let blade = twisted();
    for before in meshes() {
        let mut volumes = Vec::new();
        for (n, method) in [
            (1, Method::Subdivide),
            (10, Method::Subdivide),
            (1, Method::Hybrid),
            (3, Method::Hybrid),
            (10, Method::Hybrid),
            (30, Method::Subdivide),
        ] {
            let p = cut_at(&before, &blade, &equal(&blade, n), method);
            let all = piece_volumes(&p.mesh);
            assert_eq!((all.len(), p.refused), (2, 0), "{method:?} {n}: {all:?}");
            volumes.push(all[0]);
        }
        let tolerance = snap_distance(&before) * 1.05;
        assert!(
            volumes.iter().all(|v| (v - volumes[0]).abs() < tolerance),
            "{volumes:?}"
        );
    }
}

/// Into the body and no farther, in the plane `x = 0.31 + 0.37 y`.
fn into() -> Blade {
    let x = |y: f64| 0.31 + 0.37 * y;
    blade(&[
        (0.0, [x(-0.2), -0.2, 1.3], [x(-0.25), -0.25, 0.41]),
        (1.0, [x(0.63), 0.63, 1.3], [x(0.57), 0.57, 0.37]),
    ])
}

#[test]
fn f7_the_incision_ends_at_the_blade_in_cells_that_it_has_partly_crossed() {
    for before in meshes() {
        for n in [1, 3, 10] {
            let exact = cut_at(&before, &into(), &equal(&into(), n), Method::Subdivide);
            let snapped = cut_at(&before, &into(), &equal(&into(), n), Method::Hybrid);
            println!(
                "{n}: tip {:.1e} and {:.3}, area {:.4} {:.4}, worst {:.4}",
                exact.tip_distance,
                snapped.tip_distance,
                exact.area,
                snapped.area,
                worst(&snapped.mesh)
            );
            assert_eq!(exact.mesh.pieces().1, before.pieces().1);
            assert_eq!(snapped.mesh.pieces().1, before.pieces().1);
            assert!(
                exact.tip_distance < 1e-3 * snap_distance(&before),
                "{n}: {}",
                exact.tip_distance
            );
            // known fault: not within d; an end of an earlier motion is taken for the incision's
            assert!(
                snapped.tip_distance < 3.5 * snap_distance(&before),
                "{n}: {}",
                snapped.tip_distance
            );
            // the tip of the blade is a vertex
            let tip = into().at(1.0)[1];
            let near = exact
                .mesh
                .vertex_ids()
                .map(|v| (exact.mesh.rest_position(v) - tip).norm());
            assert!(near.fold(f64::INFINITY, f64::min) < 1e-12);
        }
    }
}

#[test]
fn a_blade_that_stops_or_goes_back_cuts_nothing_and_goes_on_from_the_end() {
    let [from, to] = [into().at(0.0), into().at(1.0)];
    let beyond = into()
        .at(0.0)
        .map(|p| p + (into().at(1.0)[0] - into().at(0.0)[0]) * 1.9);
    for before in meshes() {
        for method in [Method::Subdivide, Method::Hybrid] {
            let mut p = cut_at(&before, &into(), &equal(&into(), 4), method);
            let there = p.mesh.clone();
            for line in [to, to] {
                go_on(&mut p, line, method, false);
                assert!(p.mesh == there, "{method:?}: a blade that stops cuts nothing");
            }
            for k in (0..8).rev() {
                let g = k as f64 / 8.0;
                go_on(&mut p, [0, 1].map(|i| from[i] + (to[i] - from[i]) * g), method, false);
                assert!(p.mesh == there, "{method:?} {g}: going back cuts nothing");
            }
            for g in [0.3, 0.7, 1.0] {
                go_on(&mut p, [0, 1].map(|i| from[i] + (to[i] - from[i]) * g), method, false);
            }
            let area = p.area;
            go_on(&mut p, beyond, method, true);
            assert_eq!(p.refused, 0);
            assert_eq!(p.mesh.pieces().1, before.pieces().1, "{method:?}");
            assert!(p.area > area + 0.1, "{method:?}: it goes on");
        }
    }
}

#[test]
fn a_blade_leaves_and_enters_again() {
    // over the top, and down into the other side
    let blade = blade(&[
        (0.0, [0.41, -0.2, 1.3], [0.43, -0.2, 0.62]),
        (1.0, [0.41, 0.21, 1.3], [0.43, 0.21, 0.62]),
        (2.0, [0.41, 0.25, 2.3], [0.43, 0.25, 1.62]),
        (3.0, [0.61, 0.95, 2.3], [0.63, 0.95, 1.62]),
        (4.0, [0.61, 1.3, 1.3], [0.63, 1.3, 0.42]),
        (5.0, [0.61, 0.61, 1.3], [0.63, 0.61, 0.42]),
    ]);
    for n in [5, 10, 20] {
        let p = cut_at(&unit_box(4), &blade, &equal(&blade, n), Method::Hybrid);
        let (first, second) = (0.21 * 0.38, 0.39 * 0.58);
        println!("{n}: area {} of {}", p.area, first + second);
        assert_eq!((p.mesh.pieces().1, p.refused), (1, 0));
        assert!(
            (p.area - first - second).abs() < 0.25 * (first + second),
            "{n}: {}",
            p.area
        );
    }
}

#[test]
fn f5_blades_along_edges_facets_and_the_boundary_end_in_finite_steps() {
    let along = [
        // in a layer of facets, along edges
        blade(&[
            (0.0, [0.5, -0.2, -0.2], [0.5, -0.2, 1.2]),
            (1.0, [0.5, 1.2, -0.2], [0.5, 1.2, 1.2]),
        ]),
        // in a face of the box
        blade(&[
            (0.0, [0.0, -0.2, -0.2], [0.0, -0.2, 1.2]),
            (1.0, [0.0, 1.2, -0.2], [0.0, 1.2, 1.2]),
        ]),
        // parallel to the surface, a little under it
        blade(&[
            (0.0, [-0.2, 0.3, 0.99], [1.2, 0.3, 0.99]),
            (1.0, [-0.2, 0.8, 0.99], [1.2, 0.8, 0.99]),
        ]),
        // along itself
        blade(&[
            (0.0, [0.3, 0.3, 2.0], [0.3, 0.3, 1.1]),
            (1.0, [0.3, 0.3, 1.2], [0.3, 0.3, 0.3]),
        ]),
    ];
    let parts = [2, 1, 1, 1];
    for (blade, parts) in along.iter().zip(parts) {
        for method in [Method::Subdivide, Method::Hybrid] {
            for n in [1, 4] {
                let p = cut_at(&unit_box(4), blade, &equal(blade, n), method);
                assert_eq!((p.mesh.pieces().1, p.refused), (parts, 0), "{method:?} {n}");
            }
        }
    }
}

#[test]
fn f30_an_entry_near_a_corner_takes_finite_steps() {
    let e = 1e-3 / 4.0;
    let blade = blade(&[
        (0.0, [e, -0.2, 1.3], [e, -0.2, -0.3]),
        (1.0, [0.3, 1.2, 1.3], [0.3, 1.2, -0.3]),
    ]);
    for before in meshes() {
        for method in [Method::Subdivide, Method::Hybrid] {
            for n in [1, 10] {
                let p = cut_at(&before, &blade, &equal(&blade, n), method);
                assert_eq!((p.mesh.pieces().1, p.refused), (2, 0), "{method:?} {n}");
            }
        }
    }
}

#[test]
fn what_is_no_motion_of_a_blade_is_refused() {
    let (p, q) = (Point::zeros(), Point::x());
    let nan = Point::new(0.0, f64::NAN, 0.0);
    for (samples, words) in [
        (vec![], "0 samples are given; at least 2 are needed"),
        (vec![(0.0, [p, q])], "1 samples are given; at least 2 are needed"),
        (
            vec![(0.0, [p, q]), (0.0, [p, q])],
            "sample 1 (from zero) is at 0.0 s, not after the one before",
        ),
        (
            vec![(0.0, [p, q]), (1.0, [nan, q])],
            "sample 1 (from zero) is not finite",
        ),
        (vec![(0.0, [p, p]), (1.0, [q, q])], "no length at any time"),
    ] {
        let error = Blade::new(samples).unwrap_err().to_string();
        assert!(error.starts_with(words) || error.contains(words), "{error}");
    }
    let turning = Blade::new(vec![(1.0, [p, q]), (3.0, [p, p]), (4.0, [q, p])]).unwrap();
    assert_eq!((turning.start(), turning.end(), turning.num_samples()), (1.0, 4.0, 3));
    assert_eq!(turning.at(2.0), [p, q / 2.0]);
    assert_eq!((turning.at(0.0), turning.at(9.0)), ([p, q], [q, p]));
    assert_eq!(turning.stops(1.5, 4.0), [3.0, 4.0]);
}

/// A fan: one end fixed, the other on a circle.
fn fan(pivot: [f64; 3], inside: bool) -> Blade {
    let at = |k: usize| {
        let a = -0.9 + 0.1 * k as f64 * 1.8;
        let reach = if inside { 0.75 } else { 2.6 };
        let tip = [
            pivot[0] + 0.05 * reach * a,
            pivot[1] + reach * a.cos(),
            pivot[2] + reach * a.sin(),
        ];
        (k as f64 / 10.0, pivot, tip)
    };
    blade(&(0..=10).map(at).collect::<Vec<_>>())
}

/// Turning about its own axis as it goes: the surface is twisted.
fn twisted() -> Blade {
    let at = |k: usize| {
        let (t, y) = (k as f64 / 6.0, -0.3 + 1.6 * k as f64 / 6.0);
        let x = |z: f64| 0.45 + (z - 0.5) * (0.5 - t) * 0.8 + 0.1 * (3.0 * y).sin();
        (t, [x(-0.2), y, -0.2], [x(1.2), y + 0.1, 1.2])
    };
    blade(&(0..=6).map(at).collect::<Vec<_>>())
}

#[test]
fn a_pivot_inside_the_body_keeps_every_invariant() {
    for pivot in [[0.47, -0.2, 0.52], [0.47, 0.3, 0.52]] {
        let fan = fan(pivot, true);
        for before in meshes() {
            for n in [10, 20] {
                let p = cut_at(&before, &fan, &equal(&fan, n), Method::Hybrid);
                assert_eq!((p.mesh.pieces().1, p.refused), (before.pieces().1, 0), "{n}");
                assert!(p.area > 0.2, "{}", p.area);
            }
        }
    }
}

/// Of an area: how much more or less may be opened than is swept, where the edge of a shallow cut is snapped by up to `d`.
fn rough(method: Method) -> f64 {
    if method == Method::Subdivide { 0.02 } else { 0.25 }
}

/// Into the top of a beam nearly along itself, along the beam, and out again.
fn slit() -> Blade {
    blade(&[
        (0.0, [0.30, 0.09, 0.40], [0.32, 0.10, 0.22]),
        (0.06, [0.30, 0.09, 0.28], [0.36, 0.10, 0.08]),
        (0.18, [0.60, 0.11, 0.28], [0.66, 0.10, 0.08]),
        (0.24, [0.66, 0.11, 0.40], [0.68, 0.10, 0.22]),
    ])
}

/// A cut that ends inside, in so many pieces by every method: it opens what is swept (m²) and ends at the blade.
fn opens_what_it_sweeps(before: &TetMesh, blade: &Blade, pieces: [usize; 3], swept: f64) {
    for method in [Method::Subdivide, Method::Hybrid, Method::Collapse, Method::Merge] {
        for n in pieces {
            let p = cut_at(before, blade, &equal(blade, n), method);
            let tip = p.tip_distance / snap_distance(before);
            println!("{method:?} {n}: area {:.4} of {swept}, tip {tip:.2e} d", p.area);
            assert_eq!((p.mesh.pieces().1, p.refused), (1, 0), "{method:?} {n}");
            assert!(
                (p.area - swept).abs() < rough(method) * swept,
                "{method:?} {n}: {}",
                p.area
            );
            assert!(tip < 1.25, "{method:?} {n}: {tip} d");
        }
    }
}

#[test]
fn a_blade_that_goes_in_along_itself_draws_a_slit() {
    let before = generate::box_tets([1.0, 0.2, 0.2], [15, 3, 3], [0.0; 3]);
    // what it sweeps under the top: .3 along the beam, .12 deep, and a triangle on its way out
    let swept = 0.036 + 0.0032;
    opens_what_it_sweeps(&before, &slit(), [4, 12, 30], swept);
}

#[test]
fn a_blade_that_goes_straight_in_and_draws_cuts_a_rectangle() {
    let before = generate::box_tets([1.0, 0.2, 0.2], [15, 3, 3], [0.0; 3]);
    let stab = blade(&[
        (0.0, [0.31, 0.09, 0.5], [0.31, 0.09, 0.21]),
        (1.0, [0.31, 0.09, 0.4], [0.31, 0.09, 0.08]),
        (2.0, [0.61, 0.11, 0.4], [0.61, 0.11, 0.08]),
        (3.0, [0.61, 0.11, 0.5], [0.61, 0.11, 0.21]),
    ]);
    let swept = 0.12 * 0.3;
    opens_what_it_sweeps(&before, &stab, [3, 10, 30], swept);
}

#[test]
fn a_blade_that_goes_back_through_its_incision_cuts_beyond_the_other_end() {
    let before = generate::box_tets([1.0, 0.2, 0.2], [15, 3, 3], [0.0; 3]);
    let at = |t: f64, x: f64, z: f64| {
        let y = 0.1 + 0.1 * (x - 0.5);
        (t, [x - 0.01, y - 0.001, z + 0.32], [x, y, z])
    };
    let to_and_fro = blade(&[
        at(0.0, 0.5, 0.21),
        at(1.0, 0.5, 0.08),
        at(2.0, 0.6, 0.08),
        at(4.0, 0.3, 0.08),
        at(5.0, 0.3, 0.21),
    ]);
    let swept = 0.12 * 0.3;
    for method in [Method::Subdivide, Method::Hybrid, Method::Collapse, Method::Merge] {
        for n in [5, 20, 40] {
            let p = cut_at(&before, &to_and_fro, &equal(&to_and_fro, n), method);
            println!("{method:?} {n}: area {:.4} of {swept}", p.area);
            assert_eq!((p.mesh.pieces().1, p.refused), (1, 0), "{method:?} {n}");
            assert!(
                (p.area - swept).abs() < rough(method) * swept,
                "{method:?} {n}: {}",
                p.area
            );
        }
    }
}

/// Through the whole body in the plane `x + 0.1 y - 0.2 z = place`, leaning forward or back.
fn leaning(by: f64, place: f64) -> Blade {
    let x = |y: f64, z: f64| place - 0.1 * y + 0.2 * z;
    let at = |y: f64| {
        let (y, w) = (y - 0.7 * by, y + 0.7 * by);
        ([x(y, -0.2), y, -0.2], [x(w, 1.2), w, 1.2])
    };
    let far = 0.7 * by.abs() + 0.2;
    let (a, b) = (at(-far), at(1.0 + far));
    blade(&[(0.0, a.0, a.1), (1.0, b.0, b.1)])
}

#[test]
fn leaning_blades_give_the_same_parts_in_any_number_of_pieces() {
    for before in meshes() {
        for by in [-1.4, 0.7] {
            let blade = leaning(by, 0.413);
            for method in [Method::Subdivide, Method::Hybrid, Method::Collapse, Method::Merge] {
                for n in [1, 2, 10, 30] {
                    let p = cut_at(&before, &blade, &equal(&blade, n), method);
                    let all = piece_volumes(&p.mesh);
                    println!(
                        "{by} {method:?} {n}: {all:?} tip {:.2} d",
                        p.tip_distance / snap_distance(&before)
                    );
                    assert_eq!((all.len(), p.refused), (2, 0), "{by} {method:?} {n}: {all:?}");
                }
            }
        }
    }
}

#[test]
fn fronts_that_branch_fall_apart_or_stay_behind_leave_no_bridge() {
    let [cube, shaken, curved] = meshes();
    for (before, by, place, method, n) in [
        // one end of it where chips hang on both sides
        (&curved, 0.7, 0.413, Method::Hybrid, 23),
        (&curved, 1.3, 0.413, Method::Hybrid, 30),
        (&curved, 0.7, 0.437, Method::Collapse, 23),
        (&curved, 1.3, 0.437, Method::Hybrid, 23),
        // an older one is longer
        (&cube, 1.3, 0.381, Method::Collapse, 30),
        (&shaken, 1.3, 0.381, Method::Collapse, 23),
        // two parts that lie beside each other in part
        (&shaken, -0.9, 0.437, Method::Collapse, 23),
        (&cube, -0.9, 0.437, Method::Hybrid, 30),
    ] {
        let blade = leaning(by, place);
        let p = cut_at(before, &blade, &equal(&blade, n), method);
        let all = piece_volumes(&p.mesh);
        assert_eq!((all.len(), p.refused), (2, 0), "{by} {place} {method:?} {n}: {all:?}");
    }
}

#[test]
fn a_wide_motion_that_opens_next_to_nothing_is_part_of_the_way() {
    let before = generate::box_tets([1.0, 0.2, 0.2], [15, 3, 3], [0.0; 3]);
    for (forward, back) in [(0.0, 0.02), (0.02, 0.01), (0.03, 0.01)] {
        // in askew by a threshold or two, along the beam, and out again
        let stab = blade(&[
            (0.0, [0.31, 0.09, 0.5], [0.31 - back, 0.09, 0.21]),
            (1.0, [0.31, 0.09, 0.4], [0.31 + forward, 0.09, 0.08]),
            (2.0, [0.61, 0.11, 0.4], [0.61 + forward, 0.11, 0.08]),
            (3.0, [0.61, 0.11, 0.5], [0.61 + forward, 0.11, 0.21]),
        ]);
        let swept = 0.12 * (0.3 + (forward + back) / 2.0);
        opens_what_it_sweeps(&before, &stab, [3, 10, 30], swept);
    }
}

#[test]
fn a_blade_goes_on_from_a_refused_cut_by_the_way_that_it_came() {
    let line = |x: f64, y: f64| [Point::new(x, y, -0.2), Point::new(x, y, 1.2)];
    // in along y, then across x
    let [from, turn, to] = [line(0.31, -0.2), line(0.32, 0.42), line(0.73, 0.41)];
    for before in meshes() {
        for method in [Method::Subdivide, Method::Hybrid] {
            let progress = || Progress {
                mesh: before.clone(),
                tip: Tip::new(from),
                area: 0.0,
                tip_distance: 0.0,
                refused: 0,
            };
            let mut whole = progress();
            go_on(&mut whole, turn, method, false);
            go_on(&mut whole, to, method, true);
            let mut refused = progress();
            let positions = before.rest_positions().to_vec();
            let tree = BoxTree::of_cells(&before, &positions);
            let sweep = (refused.tip).sweep_to(&before, &tree, &positions, turn, &options(method), false);
            assert!(!sweep.is_empty());
            go_on(&mut refused, to, method, true);
            println!("{method:?}: {} and {}", refused.area, whole.area);
            // the crease of one surface cuts the corner in the cells that it passes; straight on would be half of it
            let off = (refused.area - whole.area).abs();
            assert!(off < 0.25 * whole.area, "{method:?}: {off}");
        }
    }
}
