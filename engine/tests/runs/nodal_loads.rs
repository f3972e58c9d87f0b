//! Loads of kind `nodal`.

use std::path::Path;

use kerfem_engine::{AnySimulation, Scene, Simulation};
use kerfem_mesh::io::{VtuArray, VtuGrid, write_vtu};
use kerfem_mesh::{SimplexMesh, generate};

use super::nodal;

const BEAM: &str = "name = 'beam'\n[mesh]\nbox = { size = [2, 1, 1], cells = [2, 1, 1] }\n[material]\nyoung = 1e5\n\
    poisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[solver]\ntolerance = 1e-12\n[[load]]\n";

fn static_displacement(text: &str, folder: &Path) -> Vec<f64> {
    let mut s = Simulation::new(Scene::parse(text, folder.join("scene.toml")).unwrap()).unwrap();
    assert!(s.step(0.0).unwrap().converged);
    s.u().to_vec()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Writes a field "f" over the points of a mesh into `f.vtu`.
fn write_field(mesh: &SimplexMesh<4>, values: Vec<f64>, folder: &Path) {
    let mut grid = VtuGrid::from_tet_mesh(mesh);
    grid.point_arrays = vec![VtuArray::reals("f", 3, values)];
    write_vtu(folder.join("f.vtu"), &grid).unwrap();
}

#[test]
fn forces_one_by_one_are_those_of_other_loads() {
    let folder = tempfile::tempdir().unwrap();
    let with = |load: &str| static_displacement(&format!("{BEAM}{load}"), folder.path());
    let shared = with("vertices = [2, 5, 8, 11]\nforce = [4, 0, -8]");
    let single = with("vertices = [11, 2, 5, 8]\nnodal = [[1, 0, -2], [1, 0, -2], [1, 0, -2], [1, 0, -2]]");
    assert!(largest_difference(&shared, &single) < 1e-15 && shared.iter().any(|u| *u < -1e-4));
    // listed twice: they add up
    let twice =
        with("vertices = [11, 2, 5, 8, 5]\nnodal = [[1, 0, -2], [1, 0, -2], [2, 0.5, -2], [1, 0, -2], [-1, -0.5, 0]]");
    assert!(largest_difference(&shared, &twice) < 1e-15);
    let mesh = generate::box_tets([2.0, 1.0, 1.0], [2, 1, 1], [0.0; 3]);
    let at_end = |i: usize| mesh.rest_positions()[i].x > 1.9;
    let values = (0..12).flat_map(|i| if at_end(i) { [1.0, 0.0, -2.0] } else { [0.0; 3] });
    write_field(&mesh, values.collect(), folder.path());
    let from_file = with("nodal = { file = 'f.vtu', array = 'f' }");
    assert!(largest_difference(&shared, &from_file) < 1e-15);
}

#[test]
fn what_is_wrong_with_forces_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str| {
        let error = Scene::parse(text, folder.path().join("s.toml"))
            .and_then(AnySimulation::new)
            .unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let all = error.to_string();
        all.rsplit_once("s.toml").expect("the file is named").1.to_owned()
    };
    let mesh = generate::box_tets([2.0, 1.0, 1.0], [2, 1, 1], [0.0; 3]);
    let mut values = vec![0.0; 36];
    values[7] = f64::NAN;
    write_field(&mesh, values, folder.path());
    for (load, wanted) in [
        (
            "vertices = [2, 5]\nnodal = [[1, 0, 0]]",
            ":14: load.nodal: 1 forces and 2 vertices are given; as many of each are needed, at least one",
        ),
        (
            "vertices = []\nnodal = []",
            ":14: load.nodal: 0 forces and 0 vertices are given; as many of each are needed, at least one",
        ),
        (
            "nodal = [[1, 0, 0]]",
            ":13: load.nodal: 1 forces and 0 vertices are given; as many of each are needed, at least one",
        ),
        (
            "where = 'x > 1'\nnodal = [[1, 0, 0]]",
            ":13: load.where: forces one by one act on vertices one by one; accepted: \"vertices\"",
        ),
        (
            "vertices = [2]\nnodal = { file = 'f.vtu', array = 'f' }",
            ":13: load.vertices: the array has a force for every vertex; no selection is accepted",
        ),
        (
            "vertices = [2]\nnodal = [[1, 0]]",
            ":14: load.nodal: 2 components are given; 3 are needed",
        ),
        (
            "vertices = [2]\nnodal = [[1, 0, nan]]",
            ":14: load.nodal: NaN is not accepted; finite numbers are needed",
        ),
        (
            "vertices = [12]\nnodal = [[1, 0, 0]]",
            ":13: load.vertices: vertex 12 does not exist; the mesh has vertices 0 to 11",
        ),
        (
            "nodal = { file = 'f.vtu', array = 'g' }",
            ":13: load.nodal: f.vtu has no point array \"g\"; it has \"f\"",
        ),
        (
            "nodal = { file = 'f.vtu', array = 'f' }",
            ":13: load.nodal: array \"f\" is not finite at point 2 (from zero)",
        ),
        (
            "vertices = [2]\nnodal = [[1, 0, 0]]\nforce = [0, 0, 1]",
            ":15: load.force: \"force\", \"nodal\" are given; exactly one of \"gravity\", \"traction\", \"pressure\", \
             \"force\", \"nodal\" is accepted",
        ),
    ] {
        assert_eq!(refused(&format!("{BEAM}{load}")), wanted, "{load}");
    }
    let plate = BEAM.replace(
        "box = { size = [2, 1, 1], cells = [2, 1, 1] }",
        "plate = { size = [2, 1], cells = [2, 1] }",
    );
    assert_eq!(
        refused(&format!("{plate}vertices = [2]\nnodal = [[1, 0, 3]]")),
        ":14: load.nodal: z = 3.0 does not lie in the plane z = 0 of the mesh"
    );
    // a vertex of no cell
    let mut points = mesh.rest_positions().to_vec();
    points.push(kerfem_mesh::Point::new(9.0, 9.0, 9.0));
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index())).collect();
    let loose = SimplexMesh::<4>::new(points, cells).unwrap();
    write_vtu(folder.path().join("loose.vtu"), &VtuGrid::from_tet_mesh(&loose)).unwrap();
    let text = BEAM.replace("box = { size = [2, 1, 1], cells = [2, 1, 1] }", "file = 'loose.vtu'");
    assert_eq!(
        refused(&format!("{text}vertices = [12]\nnodal = [[1, 0, 0]]")),
        ":14: load.nodal: vertex 12 belongs to no cell that could take a force"
    );
    assert_eq!(
        refused(&format!("{text}vertices = [12]\nforce = [1, 0, 0]")),
        ":14: load.force: it acts on vertices of no cell only; at least one must belong to a cell"
    );
}

#[test]
fn forces_one_by_one_cannot_be_replaced_by_one_vector() {
    let text = format!("{BEAM}vertices = [2]\nnodal = [[1, 0, 0]]");
    let mut s = Simulation::new(Scene::parse(&text, "test.toml").unwrap()).unwrap();
    assert!(!s.set_load(0, [1.0, 0.0, 0.0]));
    s.step(0.0).unwrap();
    assert!(nodal(s.u(), 2).x > 0.0);
}
