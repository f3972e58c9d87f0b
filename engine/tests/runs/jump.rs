//! The opening of cuts.

use std::path::Path;

use kerfem_engine::{AnySimulation, Scene, Simulation};
use kerfem_mesh::generate;
use kerfem_mesh::io::{VtuGrid, write_vtu};

/// The quantities of a static scene in `folder`, after its only step.
fn quantities(text: &str, folder: &Path) -> std::collections::BTreeMap<String, Option<f64>> {
    fn solved<const N: usize>(mut s: Simulation<N>) -> std::collections::BTreeMap<String, Option<f64>> {
        assert!(s.step(0.0).unwrap().converged);
        s.quantities()
    }
    match AnySimulation::new(Scene::parse(text, folder.join("scene.toml")).unwrap()).unwrap() {
        AnySimulation::Solid(s) => solved(s),
        AnySimulation::Planar(s) => solved(s),
    }
}

const MATERIAL: &str = "[material]\nyoung = 1e5\npoisson = 0.3\ndensity = 1000\n";
const BAR: &str = "box = { size = [2, 1, 1], cells = [8, 3, 3] }";
const PLATE: &str = "plate = { size = [2, 1], cells = [8, 4] }";

/// Across x = 1.02, as a surface and as a line.
const WALL: &str = "v 1.02 -5 -5\nv 1.02 5 -5\nv 1.02 5 5\nv 1.02 -5 5\nf 1 2 3\nf 1 3 4\n";
const LINE: &str = "v 1.02 -5 0\nv 1.02 5 0\nl 1 2\n";

#[test]
fn two_halves_pulled_apart_are_as_far_apart_as_they_were_pulled() {
    let folder = tempfile::tempdir().unwrap();
    for (mesh, sweep, dimension) in [(BAR, WALL, 3), (PLATE, LINE, 2)] {
        std::fs::write(folder.path().join("cut.obj"), sweep).unwrap();
        let vector = |v: [f64; 3]| format!("{:?}", &v[..dimension]);
        let (low, high, at) = ([-0.1, 0.02, 0.3], [0.25, -0.05, 0.1], [1.02, 0.4, 0.6]);
        for method in ["hybrid", "subdivide", "snap", "delete"] {
            let text = format!(
                "name = 'apart'\n[mesh]\n{mesh}\n{MATERIAL}[[fixed]]\nwhere = 'x < 1e-9'\ndisplacement = {}\n[[fixed]]\n\
                 where = 'x > 1.999'\ndisplacement = {}\n[solver]\ntolerance = 1e-12\n[[cut]]\nsweep = 'cut.obj'\n\
                 frame = 'rest'\nmethod = '{method}'\n\
                 [[quantity]]\nname = 'opening'\njump = {{ at = {at}, normal = {} }}\n\
                 [[quantity]]\nname = 'backwards'\njump = {{ at = {at}, normal = {} }}\n\
                 [[quantity]]\nname = 'sliding'\ncomponent = 'uy'\njump = {{ at = {at}, normal = {} }}\n\
                 [[quantity]]\nname = 'along'\njump = {{ at = {at}, normal = {} }}\n\
                 [[quantity]]\nname = 'elsewhere'\njump = {{ at = {}, normal = {} }}\n",
                vector(low),
                vector(high),
                vector([3.0, 0.0, 0.0]),
                vector([-1.0, 0.0, 0.0]),
                vector([1.0, 0.3, 0.0]),
                vector([0.0, 1.0, 0.0]),
                vector([0.4, 0.4, 0.6]),
                vector([1.0, 0.0, 0.0]),
                at = vector(at),
            );
            let q = quantities(&text, folder.path());
            let near = |name: &str, wanted: f64| {
                let found = q[name].unwrap_or(f64::NAN);
                assert!(
                    (found - wanted).abs() < 1e-9,
                    "{dimension} {method} {name}: {found} {wanted}"
                );
            };
            near("opening", 0.35);
            near("backwards", 0.35);
            near("sliding", -0.07);
            assert_eq!((q["along"], q["elsewhere"]), (None, None), "{dimension} {method}");
        }
    }
}

#[test]
fn without_a_cut_nothing_jumps() {
    for (mesh, at, normal) in [(BAR, "[1.02, 0.4, 0.6]", "[1, 0, 0]"), (PLATE, "[1.02, 0.4]", "[1, 0]")] {
        let text = format!(
            "name = 'whole'\n[mesh]\n{mesh}\n{MATERIAL}[[fixed]]\nwhere = 'x < 1e-9'\n[[quantity]]\nname = 'jump'\n\
             jump = {{ at = {at}, normal = {normal} }}\n"
        );
        assert_eq!(quantities(&text, Path::new("."))["jump"], None);
    }
}

#[test]
fn a_slit_under_tension_opens_and_closes_at_its_front() {
    let folder = tempfile::tempdir().unwrap();
    let surface = "v -1 -1 0.52\nv 0.5 -1 0.52\nv 0.5 2 0.52\nv -1 2 0.52\nf 1 2 3\nf 1 3 4\n";
    for (mesh, sweep, place) in [
        (
            "box = { size = [1, 0.5, 1], cells = [8, 2, 8] }",
            surface,
            ["0.25, 0.52", "z"],
        ),
        (
            "plate = { size = [1, 1], cells = [16, 16] }",
            "v -1 0.52 0\nv 0.5 0.52 0\nl 1 2\n",
            ["0.52", "y"],
        ),
    ] {
        std::fs::write(folder.path().join("cut.obj"), sweep).unwrap();
        let [rest, axis] = place;
        let normal = if axis == "z" { "[0, 0, 1]" } else { "[0, 1]" };
        let pull = if axis == "z" { "[0, 0, 50]" } else { "[0, 50]" };
        let push = pull.replace("50", "-50");
        let jump = |name: &str, x: f64| {
            format!("[[quantity]]\nname = '{name}'\njump = {{ at = [{x}, {rest}], normal = {normal} }}\n")
        };
        let text = format!(
            "name = 'slit'\n[mesh]\n{mesh}\n{MATERIAL}[model]\nkind = 'linear'\n[[load]]\nwhere = '{axis} > 0.999'\ntraction = {pull}\n[[load]]\n\
             where = '{axis} < 1e-9'\ntraction = {push}\n[[cut]]\nsweep = 'cut.obj'\nframe = 'rest'\n{}{}{}{}",
            jump("mouth", 0.0),
            jump("middle", 0.25),
            jump("front", 0.5),
            jump("ahead", 0.8),
        );
        let q = quantities(&text, folder.path());
        let (mouth, middle, front) = (q["mouth"].unwrap(), q["middle"].unwrap(), q["front"].unwrap());
        println!("{axis}: opening {mouth:e} m at the mouth, {middle:e} m half-way, {front:e} m at the front");
        // a crack in a half space opens by 4 s a / E' at least
        assert!(mouth > 4.0 * 50.0 * 0.5 * 0.91 / 1e5 && mouth < 0.01 && middle < mouth && middle > 0.3 * mouth);
        assert!(front.abs() < 0.02 * mouth, "{front}");
        assert_eq!(q["ahead"], None);
    }
}

#[test]
fn a_slit_of_the_mesh_file_counts_as_well() {
    // two boxes whose faces meet without being joined
    let half = |x: f64| generate::box_tets([1.0; 3], [2; 3], [x, 0.0, 0.0]);
    let (left, right) = (half(0.0), half(1.0));
    let points: Vec<_> = left
        .rest_positions()
        .iter()
        .chain(right.rest_positions())
        .copied()
        .collect();
    let shifted = |c: [usize; 4]| c.map(|v| v + left.vertex_slots());
    let corners = |m: &kerfem_mesh::TetMesh| m.cell_ids().map(|c| m.cell(c).map(|v| v.index())).collect::<Vec<_>>();
    let cells: Vec<_> = corners(&left)
        .into_iter()
        .chain(corners(&right).into_iter().map(shifted))
        .collect();
    let mesh = kerfem_mesh::TetMesh::new(points, cells).unwrap();
    let folder = tempfile::tempdir().unwrap();
    write_vtu(folder.path().join("halves.vtu"), &VtuGrid::from_tet_mesh(&mesh)).unwrap();
    let text = format!(
        "name = 'halves'\n[mesh]\nfile = 'halves.vtu'\n{MATERIAL}[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > 1.999'\n\
         displacement = [0.2, 0, 0]\n[[quantity]]\nname = 'jump'\njump = {{ at = [0.97, 0.3, 0.7], normal = [1, 0, 0] }}\n"
    );
    let found = quantities(&text, folder.path())["jump"].unwrap();
    assert!((found - 0.2).abs() < 1e-9, "{found}");
}
