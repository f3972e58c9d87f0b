//! Meshes, sets and fields from files.

use kerfem_engine::{Scene, Simulation};
use kerfem_mesh::generate;
use kerfem_mesh::io::{VtuArray, VtuGrid, write_vtu};

use super::nodal;

#[test]
fn sets_and_initial_fields_come_from_arrays_of_the_mesh_file() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = generate::box_tets([2.0, 1.0, 1.0], [2, 1, 1], [0.0; 3]);
    let points = mesh.rest_positions();
    let mut grid = VtuGrid::from_tet_mesh(&mesh);
    let clamp: Vec<f64> = points.iter().map(|p| f64::from(u8::from(p.x == 0.0))).collect();
    let u0: Vec<f64> = points.iter().flat_map(|p| [0.1 * p.x, 0.0, -0.2 * p.x]).collect();
    let soft: Vec<f64> = mesh.cell_ids().map(|c| f64::from(u8::from(c.0 < 6))).collect();
    grid.point_arrays = vec![VtuArray::reals("clamp", 1, clamp), VtuArray::reals("u0", 3, u0)];
    grid.cell_arrays = vec![VtuArray::reals("soft", 1, soft)];
    write_vtu(folder.path().join("mesh.vtu"), &grid).unwrap();
    let text = "name = 'files'\n[mesh]\nfile = 'mesh.vtu'\n[material]\nyoung = 1e4\npoisson = 0.3\ndensity = 1\n\
        [[region]]\ngroup = 'soft'\ndensity = 3\n[[fixed]]\ngroup = 'clamp'\n[initial]\n\
        displacement = { file = 'mesh.vtu', array = 'u0' }\n[time]\nscheme = 'evaluate'\n";
    let path = folder.path().join("scene.toml");
    let s = Simulation::new(Scene::parse(text, &path).unwrap()).unwrap();
    assert_eq!(s.selections(), ["fixed[0] holds 4 vertices"]);
    assert_eq!(nodal(s.u(), 2), nalgebra::Vector3::new(0.2, 0.0, -0.4));
    assert!((s.mesh_figures().mass_kg - 4.0).abs() < 1e-12);

    let refused = |from: &str, to: &str| {
        let scene = Scene::parse(&text.replace(from, to), &path).unwrap();
        Simulation::new(scene).unwrap_err().to_string()
    };
    let unknown_array = refused("array = 'u0'", "array = 'u1'");
    assert!(
        unknown_array.contains("mesh.vtu has no point array \"u1\"; it has \"clamp\", \"u0\""),
        "{unknown_array}"
    );
    let wrong_rows = refused("array = 'u0'", "array = 'clamp'");
    assert!(
        wrong_rows.contains("array \"clamp\" has 12 rows of 1; 12 rows of 3 are needed"),
        "{wrong_rows}"
    );
    let unknown_group = refused("group = 'clamp'", "group = 'clam'");
    assert!(
        unknown_group.contains("there is no group \"clam\"; the mesh has \"clamp\", \"soft\""),
        "{unknown_group}"
    );
}
