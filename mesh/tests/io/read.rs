//! Files of other programs. Those that are known to trip readers are among them: raw appended `.vtu` in both orders of bytes,
//! PyVista's `.vtk` with offsets that begin with zero, meshio's default `.vtk` (5.1), names of physical groups in gmsh 2 and
//! 4.1, and entities in several groups.

use kerfem_mesh::io::DataArray;
use kerfem_mesh::{MeshError, Point, VertexId, io, quality};

use crate::shared::{sample, shared_data};

fn error(name: &str) -> String {
    let text = io::read_mesh(sample(name)).unwrap_err().to_string();
    assert!(text.contains(name) && !text.contains('\n'), "{text}");
    text
}

#[test]
fn every_form_of_vtu_gives_the_same_mesh() {
    let mut forms = vec!["meshio_none", "meshio_zlib", "meshio_lzma", "meshio_ascii"]
        .into_iter()
        .chain(["pyvista_binary", "pyvista_ascii", "vtk_appended_none_32_le_raw"])
        .map(String::from)
        .collect::<Vec<_>>();
    for header in ["32_le", "64_be"] {
        forms.push(format!("vtk_ascii_none_{header}"));
        for mode in ["binary", "appended"] {
            for compressor in ["none", "zlib", "lz4", "lzma"] {
                forms.push(format!("vtk_{mode}_{compressor}_{header}"));
            }
        }
    }
    let first = io::read_mesh(sample("meshio_none.vtu")).unwrap();
    assert_eq!(
        (first.points.len(), first.tets.len(), first.triangles.len()),
        (12, 12, 0)
    );
    for form in forms {
        let mesh = io::read_mesh(sample(&format!("{form}.vtu"))).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(mesh.points, first.points, "{form}");
        assert_eq!(mesh.tets, first.tets, "{form}");
        assert_eq!(mesh.cell_arrays["quality"].values.len(), 12, "{form}");
        assert_eq!(mesh.point_arrays["velocity"], first.point_arrays["velocity"], "{form}");
        for (a, b) in mesh.cell_arrays["quality"]
            .values
            .iter()
            .zip(&first.cell_arrays["quality"].values)
        {
            assert!((a - b).abs() < 1e-12, "{form}"); // meshio writes 12 digits in ASCII
        }
        assert_eq!(mesh.cell_arrays["region"], first.cell_arrays["region"], "{form}");
        if !form.starts_with("meshio") {
            assert_eq!(mesh.cell_arrays["flag"].values[..4], [0.0, 1.0, 0.0, 0.0], "{form}");
            for (a, b) in mesh.point_arrays["velocity32"]
                .values
                .iter()
                .zip(&first.point_arrays["velocity"].values)
            {
                assert!((a - b).abs() < 1e-6, "{form}");
            }
        }
    }
    assert_eq!(first.points[11], Point::new(2.0, 1.0, 1.0));
    assert_eq!(first.point_arrays["velocity"].components, 3);
    assert_eq!(first.point_arrays["velocity"].row(11), [2.1, -1.9, 0.6]);
    assert_eq!(first.cell_arrays["region"].values[..4], [0.0, 1.0, 2.0, 0.0]);
    assert!((quality::volume(&first.into_tet_mesh().unwrap()) - 2.0).abs() < 1e-14);
}

#[test]
fn legacy_vtk_of_every_kind_gives_the_same_mesh() {
    let first = io::read_mesh(sample("meshio_none.vtu")).unwrap();
    for writer in ["meshio_42", "meshio_51", "vtk_42", "vtk_51", "pyvista"] {
        for form in ["ascii", "binary"] {
            let name = format!("{writer}_{form}.vtk");
            let mesh = io::read_mesh(sample(&name)).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!((&mesh.points, &mesh.tets), (&first.points, &first.tets), "{name}");
            let tolerance = if form == "ascii" { 1e-11 } else { 0.0 }; // VTK writes eleven digits
            let close = |a: &DataArray, b: &DataArray| {
                assert_eq!((a.components, a.values.len()), (b.components, b.values.len()), "{name}");
                assert!(
                    a.values.iter().zip(&b.values).all(|(a, b)| (a - b).abs() <= tolerance),
                    "{name}"
                );
            };
            close(&mesh.point_arrays["velocity"], &first.point_arrays["velocity"]);
            close(&mesh.cell_arrays["quality"], &first.cell_arrays["quality"]);
            close(&mesh.cell_arrays["region"], &first.cell_arrays["region"]);
        }
    }
}

#[test]
fn surfaces_and_lines_are_read_as_sweeps() {
    let points: Vec<Point> = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.]]
        .map(Point::from)
        .to_vec();
    for form in ["ascii", "binary"] {
        for extension in ["vtk", "vtp"] {
            let sweep = io::read_sweep(sample(&format!("pyvista_surface_{form}.{extension}"))).unwrap();
            assert_eq!(sweep.points, points, "{form} {extension}");
            assert_eq!(sweep.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 4]], "{form} {extension}");
        }
        let stl = io::read_sweep(sample(&format!("pyvista_surface_{form}.stl"))).unwrap();
        let area = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|k| stl.points[k]);
            (b - a).cross(&(c - a)).norm() / 2.0
        };
        assert!(
            stl.points.len() == 5 && stl.triangles.iter().map(area).eq([0.5; 3]),
            "{form}"
        );
        let stl = io::read_sweep(sample(&format!("meshio_surface_{form}.stl"))).unwrap();
        assert_eq!(
            (stl.points.len(), stl.triangles.len()),
            (4, 2),
            "{form}: equal corners are one point"
        );
    }
    let strip = io::read_sweep(sample("pyvista_strip.vtp")).unwrap();
    assert_eq!(strip.triangles, [[0, 1, 2], [1, 2, 3]]);
    for extension in ["vtk", "vtp", "vtu"] {
        let line = io::read_sweep(sample(&format!("pyvista_line.{extension}"))).unwrap();
        assert_eq!(line.segments, [[0, 1], [1, 2], [2, 3]], "{extension}");
        assert!(line.triangles.is_empty() && line.points[1] == Point::new(1.0, 0.5, 0.0));
    }
}

#[test]
fn tetgen_and_medit_give_the_same_mesh_with_their_marks() {
    let first = io::read_mesh(sample("meshio_none.vtu")).unwrap();
    for name in ["meshio.node", "meshio.ele"] {
        let mesh = io::read_mesh(sample(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((&mesh.points, &mesh.tets), (&first.points, &first.tets), "{name}");
        assert_eq!(
            mesh.cell_arrays["region"].values, first.cell_arrays["region"].values,
            "{name}"
        );
        assert_eq!(mesh.groups["2"].tets, [2, 5, 8, 11], "{name}");
    }
    let mesh = io::read_mesh(sample("meshio.mesh")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(
        (&mesh.points, &mesh.tets, mesh.triangles.len()),
        (&first.points, &first.tets, 12)
    );
    assert_eq!(
        (&mesh.groups["2"].tets, &mesh.groups["9"].triangles),
        (&vec![2, 5, 8, 11], &vec![2, 5, 8, 11])
    );
}

#[test]
fn planar_meshes_keep_the_groups_of_their_boundary() {
    let first = io::read_mesh(sample("planar_4.1.msh")).unwrap();
    assert!(first.tets.is_empty() && first.triangles.len() > 10);
    for version in ["2.2", "2.2_binary", "4.1_binary"] {
        let mesh = io::read_mesh(sample(&format!("planar_{version}.msh"))).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (&mesh.triangles, &mesh.segments),
            (&first.triangles, &first.segments),
            "{version}"
        );
        assert_eq!(mesh.groups, first.groups, "{version}");
    }
    let [left, ends, tip] = ["left end", "ends", "tip"].map(|name| &first.groups[name]);
    assert_eq!(
        ends.segments,
        [first.groups["right end"].segments.as_slice(), &left.segments].concat()
    );
    assert!(tip.vertices.len() == 1 && first.points[tip.vertices[0]] == Point::new(2.0, 1.0, 0.0));
    assert!(left.segments.len() >= 2 && left.vertices.iter().all(|&v| first.points[v].x == 0.0));
    assert_eq!(first.groups["sheet"].triangles.len(), first.triangles.len());
    let mesh = first.clone().into_tri_mesh().unwrap();
    mesh.check(true).unwrap();
    assert!(mesh.is_planar() && (quality::volume(&mesh) - 2.0).abs() < 1e-12);
    // gmsh writes all entities into these, so that the four sides are there too
    for name in ["planar.mesh", "planar.vtk", "planar_binary.vtk"] {
        let other = io::read_mesh(sample(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(other.triangles.len(), first.triangles.len(), "{name}");
        let area = quality::volume(&other.into_tri_mesh().unwrap());
        assert!((area - 2.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn cell_arrays_have_the_rows_of_tetrahedra_triangles_and_segments() {
    let mesh = io::read_mesh(sample("mixed.vtu")).unwrap();
    assert_eq!(
        (mesh.tets.len(), mesh.triangles.len(), mesh.segments.len()),
        (12, 12, 12)
    );
    let expected: Vec<f64> = (0..36).map(|k| f64::from(k % 12 + 100 * (k / 12))).collect();
    assert_eq!(mesh.cell_arrays["number"].values, expected);
}

#[test]
fn every_version_of_gmsh_gives_the_same_mesh() {
    let first = io::read_mesh(sample("gmsh_4.1.msh")).unwrap();
    assert_eq!(
        (first.points.len(), first.tets.len(), first.triangles.len()),
        (44, 90, 14)
    );
    for version in ["1.0", "2.2", "2.2_binary", "4.1_binary"] {
        let mesh = io::read_mesh(sample(&format!("gmsh_{version}.msh"))).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(mesh.points.len(), first.points.len(), "{version}");
        for (a, b) in mesh.points.iter().zip(&first.points) {
            assert!((a - b).norm() < 1e-15, "{version}"); // the text forms have 16 digits
        }
        assert_eq!(mesh.tets, first.tets, "{version}");
        assert_eq!(mesh.triangles, first.triangles, "{version}");
        let (body, side) = if version == "1.0" {
            ("3", "7")
        } else {
            ("body", "left side")
        };
        assert_eq!(mesh.groups[body], first.groups["body"], "{version}");
        assert_eq!(mesh.groups[side], first.groups["left side"], "{version}");
        assert_eq!(mesh.groups["12"].vertices, [0], "{version}");
    }
    assert_eq!(first.groups["body"].tets, (0..90).collect::<Vec<_>>());
    let side = &first.groups["left side"];
    assert_eq!(side.triangles, (0..14).collect::<Vec<_>>());
    assert!(side.vertices.iter().all(|&v| first.points[v].x == 0.0));
    assert!((quality::volume(&first.into_tet_mesh().unwrap()) - 2.0).abs() < 1e-12);
}

#[test]
fn groups_of_every_dimension_share_entities() {
    let mut meshes = Vec::new();
    // version 2 writes an element once for each of its groups
    for version in ["2.2", "2.2_binary", "4.1", "4.1_binary"] {
        let mesh = io::read_mesh(sample(&format!("groups_{version}.msh"))).unwrap_or_else(|e| panic!("{e}"));
        let names: Vec<&str> = mesh.groups.keys().map(String::as_str).collect();
        let wanted = [
            "between",
            "body",
            "clamp",
            "corner",
            "edge",
            "ends",
            "left half",
            "pull",
        ];
        assert_eq!(names, wanted, "{version}");
        let (group, count) = (|name: &str| &mesh.groups[name], mesh.tets.len());
        assert_eq!(group("body").tets, (0..count).collect::<Vec<_>>(), "{version}");
        let middle = |t: &usize| mesh.tets[*t].iter().map(|&v| mesh.points[v].x).sum::<f64>() < 4.0;
        assert_eq!(
            group("left half").tets,
            (0..count).filter(middle).collect::<Vec<_>>(),
            "{version}"
        );
        let (clamp, pull, ends) = (group("clamp"), group("pull"), group("ends"));
        assert_eq!(
            ends.triangles,
            [clamp.triangles.as_slice(), &pull.triangles].concat(),
            "{version}"
        );
        for (name, x) in [("clamp", 0.0), ("between", 1.0), ("pull", 2.0)] {
            let area = |k: &usize| {
                let [a, b, c] = mesh.triangles[*k].map(|v| mesh.points[v]);
                assert!([a, b, c].iter().all(|p| p.x == x), "{version}: {name}");
                (b - a).cross(&(c - a)).norm() / 2.0
            };
            let area: f64 = group(name).triangles.iter().map(area).sum();
            assert!((area - 1.0).abs() < 1e-14, "{version}: {name}");
        }
        let at = |name: &str| group(name).vertices.iter().map(|&v| mesh.points[v]).collect::<Vec<_>>();
        assert_eq!(at("corner"), [Point::new(2.0, 0.0, 0.0)], "{version}");
        assert!(group("edge").segments == [0] && at("edge").iter().all(|p| (p.x, p.z) == (2.0, 0.0)));
        meshes.push(mesh);
    }
    assert!(meshes.iter().all(|m| m == &meshes[0]));
    let volume = quality::volume(&meshes.swap_remove(0).into_tet_mesh().unwrap());
    assert!((volume - 2.0).abs() < 1e-14);
}

#[test]
fn an_element_twice_in_one_group_is_no_second_group() {
    let text = std::fs::read_to_string(sample("groups_2.2.msh")).unwrap();
    // the second group of the first tetrahedron becomes its first
    let twice = text.replace("24 4 2 2 1 13 15 17 16", "24 4 2 1 1 13 15 17 16");
    assert_ne!(twice, text);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.msh"), twice).unwrap();
    let mesh = io::read_mesh(folder.path().join("a.msh")).unwrap().into_tet_mesh();
    assert!(matches!(
        mesh,
        Err(MeshError::DuplicateCell {
            first: 0,
            second: 1,
            ..
        })
    ));
}

#[test]
fn gmsh_files_of_meshio_are_those_of_gmsh() {
    let first = io::read_mesh(sample("gmsh_4.1.msh")).unwrap();
    for version in ["2.2_ascii", "2.2_binary", "4.1_ascii", "4.1_binary"] {
        let mesh = io::read_mesh(sample(&format!("meshio_{version}.msh"))).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (&mesh.points, &mesh.tets, &mesh.triangles),
            (&first.points, &first.tets, &first.triangles),
            "{version}"
        );
        assert_eq!(mesh.groups["left side"], first.groups["left side"], "{version}");
        // in version 4.1 meshio leaves out which group a volume belongs to
        let body = version.starts_with('2').then_some(&first.groups["body"]);
        assert_eq!(mesh.groups.get("body"), body, "{version}");
    }
}

#[test]
fn other_files_are_refused_with_what_is_accepted() {
    let accepted = "tetrahedra and triangles of order 1 are accepted, and lines and points beside them";
    assert!(error("hexahedron.vtu").contains("cell 12 (from zero): is a hexahedron (VTK cell type 12); tetrahedra"));
    assert!(error("gmsh_order2.msh").contains("of order 2 (gmsh element type"));
    assert!(error("gmsh_order2.msh").ends_with(accepted));
    assert!(error("gmsh_4.0.msh").contains("line 2, $MeshFormat: version 4, file type 0, data size 8; gmsh 1 ($NOD)"));
    assert!(error("absent.vtu").contains("cannot be read"));
    let text = io::read_mesh("mesh.stl").unwrap_err().to_string();
    assert_eq!(
        text,
        "mesh.stl: a mesh is read from .vtu, .vtp, .vtk, .msh, .mesh, .node, .ele files"
    );
    let text = io::read_sweep(sample("mixed.vtu")).unwrap_err().to_string();
    assert!(
        text.contains("is a tetrahedron (VTK cell type 10); a sweep is a surface"),
        "{text}"
    );
}

#[test]
fn the_organ_of_the_examples_is_sound_and_its_blades_are_read() {
    let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scenes");
    let data = io::read_mesh(scenes.join("organ.msh")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(data.groups["body"].tets, (0..data.tets.len()).collect::<Vec<_>>());
    let clamp = data.groups["clamp"].clone();
    let mesh = data.into_tet_mesh().unwrap();
    mesh.check(true).unwrap();
    assert!((2500..5000).contains(&mesh.num_cells()) && mesh.pieces().1 == 1);
    assert!(
        clamp.vertices.len() > 50
            && clamp
                .vertices
                .iter()
                .all(|&v| mesh.is_boundary_vertex(VertexId(v as u32)))
    );
    let report = quality::report(&mesh, mesh.rest_positions());
    assert!(
        report.min_radius_ratio > 0.4 && report.max_over_min_edge < 6.0,
        "{report:?}"
    );
    let half = io::read_sweep(scenes.join("blade.obj")).unwrap();
    let through = io::read_sweep(scenes.join("blade_through.obj")).unwrap();
    assert_eq!((half.triangles.len(), through.triangles.len()), (288, 720));
}

#[test]
fn polygons_of_a_sweep_become_triangles() {
    let sweep = io::read_sweep(sample("surface.vtu")).unwrap();
    let expected = [[0, 1, 4], [1, 2, 5], [1, 5, 4], [0, 1, 4], [0, 4, 9], [0, 9, 6]];
    assert_eq!(sweep.triangles, expected);
}

#[test]
fn shared_meshes_have_the_counts_of_their_list() {
    let Some(data) = shared_data() else { return };
    for (name, points, tets, triangles) in [
        ("liver.msh", 181, 596, 0),
        ("liver2.msh", 507, 1493, 860),
        ("torus_low_res.msh", 264, 862, 408),
        ("cylinder_8x30x6.msh", 1446, 6750, 0),
        ("raptorTetra_8418.vtu", 2996, 8418, 0),
    ] {
        let mesh = io::read_mesh(data.join("meshes").join(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (mesh.points.len(), mesh.tets.len(), mesh.triangles.len()),
            (points, tets, triangles),
            "{name}"
        );
        let mesh = mesh.into_tet_mesh().unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!(quality::volume(&mesh) > 0.0);
        mesh.check(false).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
    let sweep = io::read_sweep(data.join("meshes/liver-smooth.obj")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((sweep.points.len(), sweep.triangles.len()), (2194, 4384));
}

#[test]
fn shared_cases_are_read_and_their_cuts_agree() {
    let Some(data) = shared_data() else { return };
    let mut counts = (0, 0, 0);
    let mut folders: Vec<_> = std::fs::read_dir(data.join("cases"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .collect();
    folders.sort();
    for folder in folders.iter().filter(|f| f.is_dir()) {
        let mesh = io::read_mesh(folder.join("mesh.vtu")).unwrap_or_else(|e| panic!("{e}"));
        for other in ["mesh22.msh", "mesh41.msh"]
            .map(|n| folder.join(n))
            .iter()
            .filter(|p| p.exists())
        {
            let same = io::read_mesh(other).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(same.tets, mesh.tets, "{}", other.display());
            assert_eq!(same.points.len(), mesh.points.len(), "{}", other.display());
            assert!(
                same.points
                    .iter()
                    .zip(&mesh.points)
                    .all(|(a, b)| (a - b).norm() < 1e-14),
                "{}",
                other.display()
            );
        }
        if folder.join("reference.vtu").exists() {
            let reference = io::read_mesh(folder.join("reference.vtu")).unwrap_or_else(|e| panic!("{e}"));
            assert!(!reference.point_arrays.is_empty(), "{}", folder.display());
        }
        if mesh.tets.is_empty() {
            assert!(mesh.into_tri_mesh().is_ok(), "{}", folder.display());
            counts.0 += 1;
            continue;
        }
        mesh.into_tet_mesh()
            .unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        counts.1 += 1;
        for name in ["cut", "cut0", "cut1", "cut_exact"] {
            let obj = folder.join(name).with_extension("obj");
            if obj.exists() {
                let sweep = io::read_sweep(&obj).unwrap_or_else(|e| panic!("{e}"));
                let vtu = obj.with_extension("vtu");
                if vtu.exists() {
                    let same = io::read_sweep(&vtu).unwrap_or_else(|e| panic!("{e}"));
                    assert_eq!(same.triangles.len(), sweep.triangles.len(), "{}", vtu.display());
                }
                counts.2 += 1;
            }
        }
    }
    eprintln!(
        "{} planar meshes, {} meshes of tetrahedra, {} sweeps",
        counts.0, counts.1, counts.2
    );
    assert!(counts.1 > 0 && counts.2 > 0);
}
