//! Meshes, sets and fields from files.

use kerfem_engine::{AnySimulation, Scene, Simulation};
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
    assert_eq!(
        s.selections(),
        [
            "region[0] has 6 cells of 1 m3, in [0, 0, 0] .. [1, 1, 1]",
            "fixed[0] holds 4 vertices, xyz, in [0, 0, 0] .. [0, 1, 1]",
            "initial displacement is in [0, 0, -0.4] .. [0.2, 0, 0] m"
        ]
    );
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
        unknown_group.contains("there is no group \"clam\"; did you mean \"clamp\"? the mesh has \"clamp\", \"soft\""),
        "{unknown_group}"
    );
}

/// A scene on a mesh of the samples of kerfem-mesh.
fn on_sample(file: &str, sections: &str) -> Result<AnySimulation, String> {
    let text = format!(
        "name = 'sample'\n[mesh]\nfile = '{file}'\n[material]\nyoung = 1e4\npoisson = 0.3\ndensity = 1\n{sections}\n\
         [time]\nscheme = 'evaluate'\n"
    );
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/../mesh/tests/samples/scene.toml");
    let simulation = Scene::parse(&text, samples).and_then(AnySimulation::new);
    simulation.map_err(|e| e.to_string())
}

#[test]
fn physical_groups_of_gmsh_hold_load_and_are_regions() {
    // two unit cubes side by side
    let sections = "[[region]]\ngroup = 'left half'\ndensity = 3\n[[fixed]]\ngroup = 'clamp'\n[[fixed]]\n\
        group = 'edge'\naxes = 'z'\n[[fixed]]\ngroup = 'between'\naxes = 'y'\n[[load]]\ngroup = 'pull'\n\
        traction = [4, 0, 0]\n[[load]]\ngroup = 'ends'\npressure = 3\n[[load]]\ngroup = 'corner'\nforce = [0, 0, -2]";
    for version in ["2.2", "2.2_binary", "4.1", "4.1_binary"] {
        let file = format!("groups_{version}.msh");
        let Ok(AnySimulation::Solid(s)) = on_sample(&file, sections) else {
            panic!("{version}: not read as tetrahedra");
        };
        assert_eq!(
            s.selections(),
            [
                "region[0] has 24 cells of 1 m3, in [0, 0, 0] .. [1, 1, 1]",
                "fixed[0] holds 5 vertices, xyz, in [0, 0, 0] .. [0, 1, 1]",
                "fixed[1] holds 2 vertices, z, in [2, 0, 0] .. [2, 1, 0]",
                "fixed[2] holds 5 vertices, y, in [1, 0, 0] .. [1, 1, 1]",
                "load[0] (traction) acts on 4 facets of 1 m2, in [2, 0, 0] .. [2, 1, 1]: [4, 0, 0] N in all",
                "load[1] (pressure) acts on 8 facets of 2 m2, in [0, 0, 0] .. [2, 1, 1]: [0, 0, 0] N in all",
                "load[2] (force) acts on 1 vertex, in [2, 0, 0] .. [2, 0, 0]: [0, 0, -2] N in all"
            ],
            "{version}"
        );
        assert!((s.mesh_figures().mass_kg - 4.0).abs() < 1e-12, "{version}");
    }
    let refused = |sections: &str| on_sample("groups_4.1.msh", sections).err().unwrap_or_default();
    let inside = refused("[[load]]\ngroup = 'between'\npressure = 1");
    assert!(
        inside.contains("load.group: [4, 13, 5] is no boundary facet of the mesh"),
        "{inside}"
    );
    let no_cell = refused("[[region]]\ngroup = 'clamp'\nyoung = 1");
    assert!(no_cell.contains("region.group: it selects no cell"), "{no_cell}");
}

#[test]
fn physical_groups_of_a_planar_mesh_are_its_edges() {
    let sections = "[[region]]\ngroup = 'sheet'\ndensity = 3\n[[fixed]]\ngroup = 'left end'\n[[load]]\n\
        group = 'right end'\ntraction = [4, 0]\n[[load]]\ngroup = 'ends'\npressure = 3\n[[load]]\ngroup = 'tip'\n\
        force = [0, -2]";
    for version in ["2.2", "2.2_binary", "4.1", "4.1_binary"] {
        let Ok(AnySimulation::Planar(s)) = on_sample(&format!("planar_{version}.msh"), sections) else {
            panic!("{version}: not read as a planar mesh");
        };
        assert_eq!(
            s.selections(),
            [
                "region[0] has 22 cells of 2 m3, in [0, 0] .. [2, 1]",
                "fixed[0] holds 3 vertices, xy, in [0, 0] .. [0, 1]",
                "load[0] (traction) acts on 2 facets of 1 m2, in [2, 0] .. [2, 1]: [4, 0] N in all",
                "load[1] (pressure) acts on 4 facets of 2 m2, in [0, 0] .. [2, 1]: [0, 0] N in all",
                "load[2] (force) acts on 1 vertex, in [2, 1] .. [2, 1]: [0, -2] N in all"
            ],
            "{version}"
        );
        assert!((s.mesh_figures().mass_kg - 6.0).abs() < 1e-12, "{version}");
    }
}

#[test]
fn groups_of_every_format_are_regions_and_hold() {
    // twelve cells of a volume of 1/6; four of them are in the group
    for (file, group) in [
        ("meshio.node", "2"),
        ("meshio.mesh", "2"),
        ("pyvista_binary.vtk", "flag"),
        ("pyvista_ascii.vtu", "flag"),
    ] {
        let sections = format!("[[region]]\ngroup = '{group}'\ndensity = 4\n[[fixed]]\ngroup = '{group}'");
        let Ok(AnySimulation::Solid(s)) = on_sample(file, &sections) else {
            panic!("{file} is not read as tetrahedra");
        };
        assert!((s.mesh_figures().mass_kg - 4.0).abs() < 1e-12, "{file}");
        let held = s.selections().remove(1);
        assert!(
            (4..12).any(|n| held.starts_with(&format!("fixed[0] holds {n} vertices, xyz, in "))),
            "{file}: {held}"
        );
    }
}

#[test]
fn a_group_of_edges_holds_no_edge_between_its_ends() {
    // a strip one cell high: the short ends join vertices of the two long sides, but belong to neither
    let folder = tempfile::tempdir().unwrap();
    let mesh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"long sides\"\n$EndPhysicalNames\n\
        $Nodes\n6\n1 0 0 0\n2 1 0 0\n3 2 0 0\n4 0 1 0\n5 1 1 0\n6 2 1 0\n$EndNodes\n$Elements\n8\n\
        1 1 2 1 1 1 2\n2 1 2 1 1 2 3\n3 1 2 1 2 4 5\n4 1 2 1 2 5 6\n\
        5 2 2 2 1 1 2 5\n6 2 2 2 1 1 5 4\n7 2 2 2 1 2 3 6\n8 2 2 2 1 2 6 5\n$EndElements\n";
    std::fs::write(folder.path().join("strip.msh"), mesh).unwrap();
    let text = "name = 'strip'\n[mesh]\nfile = 'strip.msh'\n[material]\nyoung = 1e4\npoisson = 0.3\ndensity = 1\n[[load]]\n\
        group = 'long sides'\npressure = 1\n[time]\nscheme = 'evaluate'\n";
    let scene = Scene::parse(text, folder.path().join("scene.toml")).unwrap();
    assert_eq!(
        Simulation::planar(scene).unwrap().selections(),
        [
            "nothing is held",
            "load[0] (pressure) acts on 4 facets of 4 m2, in [0, 0] .. [2, 1]: [0, 0] N in all"
        ]
    );
}

#[test]
fn arrays_of_cells_mark_cells_facets_and_lines() {
    // gmsh numbers the entities of all cells, lines and points included, in one array
    for file in ["planar.vtk", "planar_binary.vtk"] {
        let Ok(AnySimulation::Planar(s)) = on_sample(file, "[[load]]\ngroup = 'CellEntityIds'\npressure = 1") else {
            panic!("{file} is not read as a planar mesh");
        };
        let load = "load[0] (pressure) acts on 4 facets of 2 m2, in [0, 0] .. [2, 1]: [0, 0] N in all";
        assert_eq!(s.selections(), ["nothing is held", load], "{file}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mesh.vtk");
    let text = "# vtk DataFile Version 2.0\nlines beside tetrahedra\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n\
        0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\nCELLS 4 17\n4 0 1 2 3\n4 1 2 3 4\n3 0 1 2\n2 1 4\nCELL_TYPES 4\n10\n10\n5\n3\n\
        CELL_DATA 4\nSCALARS wire int 1\nLOOKUP_TABLE default\n0\n0\n0\n7\nSCALARS floor int 1\nLOOKUP_TABLE default\n\
        0\n0\n7\n0\n";
    std::fs::write(&file, text).unwrap();
    let text = "name = 'wire'\n[mesh]\nfile = 'mesh.vtk'\n[material]\nyoung = 1e4\npoisson = 0.3\ndensity = 1\n[[fixed]]\n\
        group = 'wire'\n[[load]]\ngroup = 'floor'\npressure = 1\n[time]\nscheme = 'evaluate'\n";
    let scene = Scene::parse(text, folder.path().join("scene.toml")).unwrap();
    assert_eq!(
        Simulation::new(scene).unwrap().selections(),
        [
            "fixed[0] holds 2 vertices, xyz, in [1, 0, 0] .. [1, 1, 1]",
            "load[0] (pressure) acts on 1 facet of 0.5 m2, in [0, 0, 0] .. [1, 1, 0]: [0, 0, 0.5] N in all"
        ]
    );
}
