//! Mesh files: missing, truncated, not finite, and meshes that are none, in every format.

use super::harness::{SOLID, Wrong, changed, refused, sample};

/// How many places a file is truncated at.
const PLACES: usize = 10;

/// A mesh by the texts of its coordinates and by the corners of its cells, four each or three.
struct Figure<'a> {
    points: &'a [[&'a str; 3]],
    cells: &'a [&'a [usize]],
}

/// A unit tetrahedron and one behind its slanted facet.
const POINTS: [[&str; 3]; 5] = [
    ["0", "0", "0"],
    ["1", "0", "0"],
    ["0", "1", "0"],
    ["0", "0", "1"],
    ["1", "1", "1"],
];

/// Names and contents of files.
type Files = Vec<(String, Vec<u8>)>;

/// The formats written as text.
const FORMATS: [&str; 6] = ["vtu", "vtk", "2.2.msh", "4.1.msh", "mesh", "ele"];

/// The files of a mesh in a format; the first one opens it.
fn files(format: &str, figure: &Figure) -> Vec<(String, String)> {
    let Figure { points, cells } = figure;
    let (n, m) = (points.len(), cells.len());
    let corners = cells.first().map_or(4, |c| c.len());
    let lines = |items: Vec<String>| items.iter().map(|i| format!("{i}\n")).collect::<String>();
    let list = |c: &[usize], first: usize| c.iter().map(|v| (v + first).to_string()).collect::<Vec<_>>().join(" ");
    let plain = lines(points.iter().map(|p| p.join(" ")).collect());
    let numbered = |first: usize| {
        lines(
            points
                .iter()
                .enumerate()
                .map(|(i, p)| format!("{} {}", i + first, p.join(" ")))
                .collect(),
        )
    };
    let one = |text: String| vec![(format!("m.{}", format.rsplit('.').next().unwrap()), text)];
    match format {
        "vtu" => {
            let array = |kind: &str, name: &str, values: String| {
                format!("<DataArray type='{kind}' Name='{name}' format='ascii'>{values}</DataArray>")
            };
            let corners_of = |c: &&[usize]| list(c, 0);
            let connectivity = array(
                "Int64",
                "connectivity",
                cells.iter().map(corners_of).collect::<Vec<_>>().join(" "),
            );
            let offsets = array(
                "Int64",
                "offsets",
                (1..=m).map(|i| format!("{} ", i * corners)).collect(),
            );
            let types = array(
                "UInt8",
                "types",
                (0..m).map(|_| if corners == 4 { "10 " } else { "5 " }).collect(),
            );
            one(format!(
                "<VTKFile type='UnstructuredGrid' byte_order='LittleEndian'><UnstructuredGrid>\n\
                 <Piece NumberOfPoints='{n}' NumberOfCells='{m}'>\n<Points>\
                 <DataArray type='Float64' NumberOfComponents='3' format='ascii'>\n{plain}</DataArray></Points>\n\
                 <Cells>{connectivity}{offsets}{types}</Cells></Piece></UnstructuredGrid></VTKFile>\n"
            ))
        }
        "vtk" => one(format!(
            "# vtk DataFile Version 3.0\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {n} double\n{plain}CELLS {m} {}\n{}\
             CELL_TYPES {m}\n{}",
            m * (corners + 1),
            lines(cells.iter().map(|c| format!("{corners} {}", list(c, 0))).collect()),
            if corners == 4 { "10\n" } else { "5\n" }.repeat(m)
        )),
        "2.2.msh" => one(format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n}\n{}$EndNodes\n$Elements\n{m}\n{}$EndElements\n",
            numbered(1),
            lines(
                cells
                    .iter()
                    .enumerate()
                    .map(|(i, c)| format!("{} {} 0 {}", i + 1, if corners == 4 { 4 } else { 2 }, list(c, 1)))
                    .collect()
            )
        )),
        "4.1.msh" => one(format!(
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 {n} 1 {n}\n3 1 0 {n}\n{}{plain}$EndNodes\n$Elements\n1 {m} 1 {m}\n\
             3 1 {} {m}\n{}$EndElements\n",
            lines((1..=n).map(|i| i.to_string()).collect()),
            if corners == 4 { 4 } else { 2 },
            lines(
                cells
                    .iter()
                    .enumerate()
                    .map(|(i, c)| format!("{} {}", i + 1, list(c, 1)))
                    .collect()
            )
        )),
        "mesh" => one(format!(
            "MeshVersionFormatted 2\nDimension 3\nVertices\n{n}\n{}{}\n{m}\n{}End\n",
            lines(points.iter().map(|p| format!("{} 0", p.join(" "))).collect()),
            if corners == 4 { "Tetrahedra" } else { "Triangles" },
            lines(cells.iter().map(|c| format!("{} 0", list(c, 1))).collect())
        )),
        _ => vec![
            (
                "m.ele".into(),
                format!(
                    "{m} {corners} 0\n{}",
                    lines(
                        cells
                            .iter()
                            .enumerate()
                            .map(|(i, c)| format!("{i} {}", list(c, 0)))
                            .collect()
                    )
                ),
            ),
            ("m.node".into(), format!("{n} 3 0 0\n{}", numbered(0))),
        ],
    }
}

/// A `.vtu` of one tetrahedron, or, for five rows, two, with an array of points of three components.
pub(crate) fn vtu_with_array(name: &str, rows: &[&str]) -> String {
    let cells: &[&[usize]] = &[&[0, 1, 2, 3], &[1, 2, 3, 4]];
    let figure = Figure {
        points: &POINTS[..rows.len()],
        cells: &cells[..rows.len() - 3],
    };
    let array = format!(
        "<PointData><DataArray type='Float64' Name='{name}' NumberOfComponents='3' format='ascii'>{}</DataArray></PointData>",
        rows.join(" ")
    );
    files("vtu", &figure)
        .remove(0)
        .1
        .replace("<Points>", &format!("{array}<Points>"))
}

/// A `.vtu` of one tetrahedron.
pub(crate) fn vtu_of_a_tetrahedron() -> String {
    let figure = Figure {
        points: &POINTS[..4],
        cells: &[&[0, 1, 2, 3]],
    };
    files("vtu", &figure).remove(0).1
}

/// A scene of a mesh file, up to its sections.
fn scene_of(file: &str) -> String {
    let base = SOLID.split("[[cut]]").next().unwrap();
    changed(
        base,
        "box = { size = [2, 1, 1], cells = [2, 1, 1] }",
        &format!("file = '{file}'"),
    )
}

/// The same file in a scene, and given to `quality` and `cut`; `fault` is the one that is named.
fn in_scene_and_alone(name: &str, files: &[(String, Vec<u8>)], fault: &str, parts: &[&str]) -> [Wrong; 2] {
    let opened = &files[0].0;
    let in_scene = Wrong::scene(name, scene_of(opened)).at("scene.toml:3: mesh.file");
    let calls = [
        format!("quality {opened}"),
        format!("cut {opened} --sweep blade.obj -o out.vtu"),
    ];
    let alone = Wrong::calls(name, &calls.each_ref().map(String::as_str)).at(fault);
    let with = |case: Wrong| {
        files
            .iter()
            .fold(case, |case, (name, content)| case.file(name, content.clone()))
    };
    [with(in_scene).says(&[fault]).says(parts), with(alone).says(parts)]
}

/// A figure in a format; its points are at fault, or its cells.
fn in_format(name: &str, format: &str, figure: &Figure, fault: Fault, parts: &[&str]) -> [Wrong; 2] {
    let files = files(format, figure).into_iter();
    let files: Files = files.map(|(n, t)| (n, t.into_bytes())).collect();
    let file = match fault {
        Fault::Points => &files[files.len() - 1].0,
        Fault::Cells => &files[0].0,
    };
    in_scene_and_alone(&format!("{name} in .{format}"), &files, file, parts)
}

#[derive(Clone, Copy)]
enum Fault {
    Points,
    Cells,
}

fn in_every_format(name: &str, figure: &Figure, fault: Fault, parts: &[&str]) -> Vec<Wrong> {
    FORMATS
        .iter()
        .flat_map(|format| in_format(name, format, figure, fault, parts))
        .collect()
}

fn with_point(vertex: usize, place: [&'static str; 3]) -> [[&'static str; 3]; 5] {
    let mut points = POINTS;
    points[vertex] = place;
    points
}

#[test]
fn cells_that_make_no_mesh() {
    let figure = |name: &str, cells: &[&[usize]], parts: &[&str]| {
        in_every_format(name, &Figure { points: &POINTS, cells }, Fault::Cells, parts)
    };
    let flat = with_point(3, ["0.5", "0.5", "0"]);
    let folded = with_point(4, ["0.1", "0.1", "0.1"]);
    let six = [
        POINTS[0],
        POINTS[1],
        POINTS[2],
        POINTS[3],
        ["1", "1", "1"],
        ["0.9", "0.9", "0.9"],
    ];
    let flat = Figure {
        points: &flat,
        cells: &[&[0, 1, 2, 3], &[1, 2, 3, 4]],
    };
    let folded = Figure {
        points: &folded,
        cells: &[&[0, 1, 2, 3], &[1, 3, 2, 4]],
    };
    let fan = Figure {
        points: &six,
        cells: &[&[0, 1, 2, 3], &[1, 2, 3, 4], &[1, 2, 3, 5]],
    };
    let cases = [
        figure(
            "an inverted cell",
            &[&[0, 1, 2, 3], &[1, 3, 2, 4], &[0, 1, 2, 4]],
            &["cell 1 is inverted"],
        ),
        in_every_format(
            "a cell of no volume",
            &flat,
            Fault::Cells,
            &["cell 0 has no volume", "[0, 1, 2, 3]"],
        ),
        figure(
            "a cell twice",
            &[&[0, 1, 2, 3], &[0, 1, 2, 3]],
            &["cells 0 and 1 have the same corners [0, 1, 2, 3]"],
        ),
        figure(
            "a cell twice, its corners in another order",
            &[&[0, 1, 2, 3], &[1, 2, 0, 3]],
            &["cells 0 and 1 have the same corners"],
        ),
        figure(
            "a cell that repeats a corner",
            &[&[0, 1, 2, 2]],
            &["cell 0 names vertex 2 twice; its corners must differ"],
        ),
        in_every_format(
            "a facet of three cells",
            &fan,
            Fault::Cells,
            &["facet [1, 2, 3] is shared by more than two cells"],
        ),
        in_every_format(
            "cells that overlap",
            &folded,
            Fault::Cells,
            &["cells 0 and 1 lie on the same side of the facet [1, 2, 3] they share: they overlap"],
        ),
    ];
    refused(cases.into_iter().flatten());
}

#[test]
fn corners_out_of_range_and_no_cells() {
    let beyond = Figure {
        points: &POINTS,
        cells: &[&[0, 1, 2, 3], &[1, 2, 3, 7]],
    };
    let no_cells = Figure {
        points: &POINTS,
        cells: &[],
    };
    let nothing = Figure {
        points: &[],
        cells: &[],
    };
    let neither = &["neither tetrahedra nor triangles"];
    let corners = FORMATS.iter().flat_map(|format| {
        let one_based = format.ends_with("msh") || *format == "mesh";
        let named = if one_based { "8" } else { "7" };
        in_format(
            "a corner out of range",
            format,
            &beyond,
            Fault::Cells,
            &["names", named],
        )
    });
    let no_cells = in_every_format("a mesh of no cells", &no_cells, Fault::Cells, neither);
    let nothing = in_every_format("an empty mesh", &nothing, Fault::Cells, neither);
    refused(corners.chain(no_cells).chain(nothing));
}

#[test]
fn coordinates_that_are_not_finite() {
    let texts: [(&str, [&'static str; 3], &str); 5] = [
        ("a coordinate that is not a number", ["0", "nan", "0"], "finite"),
        ("an infinite coordinate", ["inf", "0", "0"], "finite"),
        ("a coordinate that overflows", ["0", "0", "-1e999"], "finite"),
        (
            "a coordinate that is no number at all",
            ["0", "x", "0"],
            "number is accepted",
        ),
        (
            "a coordinate that is too large",
            ["0", "1e100", "0"],
            "from -1e90 to 1e90",
        ),
    ];
    let cases = texts.into_iter().flat_map(|(name, place, says)| {
        let points = with_point(2, place);
        let figure = Figure {
            points: &points,
            cells: &[&[0, 1, 2, 3], &[1, 2, 3, 4]],
        };
        let fault = if name.ends_with("too large") {
            Fault::Cells
        } else {
            Fault::Points
        };
        in_every_format(name, &figure, fault, &[says])
    });
    refused(cases);
}

#[test]
fn binary_coordinates_that_are_not_finite() {
    let patched = |sample_name: &str, after: &[u8], skip: usize, value: [u8; 8]| {
        let mut bytes = sample(sample_name);
        let start = bytes.windows(after.len()).position(|w| w == after).expect("the marker") + after.len();
        let line = bytes[start..].iter().position(|b| *b == b'\n').unwrap() + 1;
        bytes[start + line + skip..][..8].copy_from_slice(&value);
        bytes
    };
    let mut cases = Vec::new();
    for (value, says) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        for (name, after, skip, big) in [
            ("meshio_42_binary.vtk", "POINTS", 24, true),
            ("meshio_51_binary.vtk", "POINTS", 24, true),
            ("gmsh_2.2_binary.msh", "$Nodes\n", 4, false),
            ("gmsh_4.1_binary.msh", "$Nodes", 60, false),
        ] {
            let value = if big { value.to_be_bytes() } else { value.to_le_bytes() };
            let file = format!("m.{}", name.rsplit('.').next().unwrap());
            let content = patched(name, after.as_bytes(), skip, value);
            let files = [(file.clone(), content)];
            cases.extend(in_scene_and_alone(&format!("{says} in {name}"), &files, &file, &[says]));
        }
    }
    refused(cases);
}

/// The samples, each up to where it could be whole if it stopped there.
const SAMPLES: [(&str, Option<&str>); 27] = [
    ("meshio_ascii.vtu", None),
    ("meshio_none.vtu", None),
    ("meshio_zlib.vtu", None),
    ("meshio_lzma.vtu", None),
    ("vtk_ascii_none_32_le.vtu", None),
    ("vtk_binary_lz4_64_be.vtu", None),
    ("vtk_appended_none_32_le.vtu", None),
    ("vtk_appended_zlib_64_be.vtu", None),
    ("vtk_appended_lzma_32_le.vtu", None),
    ("meshio_42_ascii.vtk", Some("CELL_TYPES")),
    ("meshio_42_binary.vtk", Some("CELL_TYPES")),
    ("meshio_51_ascii.vtk", Some("CELL_TYPES")),
    ("meshio_51_binary.vtk", Some("CELL_TYPES")),
    ("pyvista_binary.vtk", Some("CELL_TYPES")),
    ("vtk_51_binary.vtk", Some("CELL_TYPES")),
    ("planar.vtk", Some("CELL_TYPES")),
    ("gmsh_1.0.msh", None),
    ("gmsh_2.2.msh", None),
    ("gmsh_2.2_binary.msh", None),
    ("gmsh_4.0.msh", None),
    ("gmsh_4.1.msh", None),
    ("gmsh_4.1_binary.msh", None),
    ("planar_2.2_binary.msh", None),
    ("planar_4.1.msh", None),
    ("meshio.mesh", None),
    ("planar.mesh", None),
    ("pyvista_strip.vtp", None),
];

/// The first bytes of a file, at ten places.
pub(crate) fn truncated(whole: &[u8], until: Option<&str>) -> impl Iterator<Item = Vec<u8>> {
    let end = until.map_or(whole.trim_ascii_end().len(), |marker| {
        whole
            .windows(marker.len())
            .position(|w| w == marker.as_bytes())
            .expect("the marker")
    });
    let whole = whole.to_vec();
    (0..PLACES).map(move |k| whole[..k * end / PLACES + usize::from(k > 0)].to_vec())
}

#[test]
fn truncated_files() {
    let mut cases = Vec::new();
    for (name, until) in SAMPLES {
        let file = format!("m.{}", name.rsplit('.').next().unwrap());
        for (k, bytes) in truncated(&sample(name), until).enumerate() {
            let name = format!("{name}, {k} tenths of it");
            // a call of each kind would say the same: one after the other
            let [in_scene, alone] = in_scene_and_alone(&name, &[(file.clone(), bytes)], &file, &[" "]);
            let case = if k % 2 == 0 { in_scene } else { alone };
            cases.push(case);
        }
    }
    // each of TetGen's two beside the other, whole one
    for (own, other) in [("node", "ele"), ("ele", "node")] {
        for (k, bytes) in truncated(&sample(&format!("meshio.{own}")), None).enumerate() {
            let files = [("m.node", &bytes), ("m.ele", &sample("meshio.ele"))];
            let files = if own == "node" {
                files
            } else {
                [("m.ele", &bytes), ("m.node", &sample("meshio.node"))]
            };
            let case = files.iter().fold(
                Wrong::calls(&format!("meshio.{own}, {k} tenths of it"), &["quality m.ele"]),
                |c, (n, b)| c.file(n, (*b).clone()),
            );
            let _ = other;
            cases.push(case.at(&format!("m.{own}")).says(&[" "]));
        }
    }
    refused(cases);
}

#[test]
fn files_that_are_no_mesh() {
    let hexahedron = "MeshVersionFormatted 2\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n1 1 1 0\n0 1 1 0\n\
        Hexahedra\n1\n1 2 3 4 5 6 7 8 0\nEnd\n";
    let second_order = format!(
        "# vtk DataFile Version 3.0\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 double\n{}CELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\n\
         CELL_TYPES 1\n24\n",
        "0 0 0\n".repeat(10)
    );
    let mixed = format!(
        "# vtk DataFile Version 3.0\nmesh\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n{}CELLS 2 14\n4 0 1 2 3\n\
         8 0 1 2 3 4 5 6 7\nCELL_TYPES 2\n10\n12\n",
        "0 0 0\n".repeat(8)
    );
    let file = |name: &str, content: &[u8]| vec![(name.to_owned(), content.to_vec())];
    let surface = POINTS.map(|p| p);
    let surface = files(
        "vtu",
        &Figure {
            points: &surface,
            cells: &[&[0, 1, 4]],
        },
    );
    let mut cases = vec![
        Wrong::scene("no file", scene_of("none.vtu"))
            .at("scene.toml:3: mesh.file")
            .says(&[
                "none.vtu: cannot be read: No such file or directory",
                "relative to the scene",
            ]),
        Wrong::calls("no file", &["quality none.vtu", "cut none.vtu --sweep blade.obj"])
            .at("none.vtu")
            .says(&["cannot be read: No such file or directory"]),
        Wrong::scene("a directory", scene_of("m.vtu"))
            .file("m.vtu/a", "")
            .at("scene.toml:3: mesh.file")
            .says(&["m.vtu: cannot be read: Is a directory"]),
        Wrong::scene("no name of a file", scene_of(""))
            .at("scene.toml:3: mesh.file")
            .says(&["is read from .vtu, .vtp, .vtk, .msh, .mesh, .node, .ele files"]),
        Wrong::scene("one of TetGen's files alone", scene_of("m.node"))
            .file("m.node", "0 3 0 0\n")
            .at("scene.toml:3: mesh.file")
            .says(&["m.ele: cannot be read: No such file"]),
        Wrong::scene("a surface in space", scene_of("m.vtu"))
            .file("m.vtu", surface[0].1.clone())
            .at("scene.toml:3: mesh.file")
            .says(&[
                "a planar mesh lies in the plane z = 0",
                "tetrahedra or triangles in that plane are needed",
            ]),
    ];
    let rows: Vec<(&str, Files, &[&str])> = vec![
        (
            "an unknown extension",
            file("m.stp", b"x"),
            &["a mesh is read from .vtu, .vtp, .vtk, .msh, .mesh, .node, .ele files"],
        ),
        (
            "no extension",
            file("mesh", b"x"),
            &["a mesh is read from .vtu, .vtp, .vtk, .msh, .mesh, .node, .ele files"],
        ),
        (
            "a sweep as a mesh",
            file("m.obj", b"v 0 0 0\n"),
            &["a mesh is read from .vtu"],
        ),
        (
            "hexahedra in .vtu",
            file("m.vtu", &sample("hexahedron.vtu")),
            &["hexahedron"],
        ),
        (
            "second order in .vtk",
            file("m.vtk", second_order.as_bytes()),
            &["cell 0 (from zero)", "accepted"],
        ),
        (
            "a hexahedron among tetrahedra",
            file("m.vtk", mixed.as_bytes()),
            &["cell 1 (from zero)", "hexahedron", "accepted"],
        ),
        (
            "second order in .msh",
            file("m.msh", &sample("gmsh_order2.msh")),
            &["accepted"],
        ),
        (
            "hexahedra in .mesh",
            file("m.mesh", hexahedron.as_bytes()),
            &["tetrahedra and triangles of order 1 are accepted"],
        ),
        ("a scene as a mesh", file("m.vtu", SOLID.as_bytes()), &["not XML"]),
        (
            "a mesh of another format",
            file("m.vtk", &sample("meshio_ascii.vtu")),
            &["accepted"],
        ),
        (
            "bytes as a .msh",
            file("m.msh", &[0, 159, 146, 150, 10, 13, 27, 91, 49, 109]),
            &["accepted"],
        ),
        ("nothing as a .vtu", file("m.vtu", b""), &["is not an XML document"]),
    ];
    for (name, files, parts) in rows {
        cases.extend(in_scene_and_alone(name, &files, &files[0].0, parts));
    }
    let scaled = scene_of("m.vtu").replace("file = 'm.vtu'", "file = 'm.vtu'\nscale = 1e308");
    let far = files(
        "vtu",
        &Figure {
            points: &with_point(3, ["0", "0", "10"])[..4],
            cells: &[&[0, 1, 2, 3]],
        },
    );
    cases.push(
        Wrong::scene("a scale that is too large", scaled)
            .file("m.vtu", far[0].1.clone())
            .at("scene.toml:3: mesh.file")
            .says(&["vertex 1 has a coordinate that is too large", "from -1e90 to 1e90"]),
    );
    refused(cases);
}
