//! Sweeps: missing, truncated, not finite, of the wrong kind.

use super::harness::{BLADE, LINE, PLANAR, SOLID, Wrong, changed, refused, sample};
use super::meshes::truncated;

/// The same sweep in a scene, and given to `cut`, which cuts a mesh of one tetrahedron.
fn in_scene_and_alone(name: &str, file: &str, content: &[u8], parts: &[&str]) -> [Wrong; 2] {
    let scene = changed(SOLID, "'blade.obj'", &format!("'{file}'"));
    let in_scene = Wrong::scene(name, scene).at("scene.toml:18: cut.sweep").says(&[file]);
    let call = format!("cut m.vtu --sweep {file} -o out.vtu");
    let alone = Wrong::calls(name, &[&call]).file("m.vtu", super::meshes::vtu_of_a_tetrahedron());
    let alone = alone.at("--sweep").says(&[file]);
    [in_scene, alone].map(|case| case.file(file, content).says(parts))
}

#[test]
fn sweeps_that_are_none() {
    let cases = [
        in_scene_and_alone("a vertex that is not a number", "b.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", &["line 2", "accepted"]),
        in_scene_and_alone("an infinite vertex", "b.obj", b"v 0 0 0\nv 1 0 -inf\nv 0 1 0\nf 1 2 3\n", &["line 2", "accepted"]),
        in_scene_and_alone("a vertex that overflows", "b.obj", b"v 0 0 1e999\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &["line 1", "accepted"]),
        in_scene_and_alone("a face of a vertex that does not exist", "b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", &["line 4", "4"]),
        in_scene_and_alone("a face of the vertex 0", "b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", &["line 4"]),
        in_scene_and_alone("a face of two vertices", "b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", &["line 4"]),
        in_scene_and_alone("a face of half a vertex", "b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3.5\n", &["line 4"]),
        in_scene_and_alone("points only", "b.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", &["no triangle, polygon or line"]),
        in_scene_and_alone("an empty file", "b.obj", b"", &["no triangle, polygon or line"]),
        in_scene_and_alone("an empty .stl", "b.stl", b"", &["accepted"]),
        in_scene_and_alone("an .stl of no triangle", "b.stl", b"solid a\nendsolid a\n", &["no triangle, polygon or line"]),
        in_scene_and_alone(
            "an .stl that is not finite",
            "b.stl",
            b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex nan 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n",
            &["line 5", "accepted"],
        ),
        in_scene_and_alone("an unknown extension", "b.ply", b"ply\n", &["a sweep is read from .obj, .stl, .vtu, .vtp, .vtk files"]),
        in_scene_and_alone("a mesh format that holds no sweep", "b.msh", b"", &["a sweep is read from .obj, .stl, .vtu, .vtp, .vtk files"]),
        in_scene_and_alone("lines for tetrahedra", "l.obj", LINE.as_bytes(), &["it holds no triangle or polygon; tetrahedra are cut by a surface"]),
        in_scene_and_alone("tetrahedra as a sweep", "t.vtu", super::meshes::vtu_of_a_tetrahedron().as_bytes(), &["accepted"]),
    ];
    refused(cases.into_iter().flatten());
}

#[test]
fn sweeps_that_are_not_finite() {
    let mut stl = sample("pyvista_surface_binary.stl");
    stl[84 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let vtp = String::from_utf8(sample("pyvista_surface_ascii.vtp")).unwrap();
    let vtp = |place: &str| changed(&vtp, "1 1 0 0 1 0", &format!("1 {place} 0 0 1 0"));
    let cases = [
        in_scene_and_alone("NaN in a binary .stl", "s.stl", &stl, &["NaN"]),
        in_scene_and_alone(
            "NaN in a .vtp",
            "s.vtp",
            vtp("nan").as_bytes(),
            &["(1, NaN, 0) is not finite"],
        ),
        in_scene_and_alone(
            "infinity in a .vtp",
            "s.vtp",
            vtp("-inf").as_bytes(),
            &["(1, -inf, 0) is not finite"],
        ),
        in_scene_and_alone(
            "a word in a .vtp",
            "s.vtp",
            vtp("one").as_bytes(),
            &["'one'; a number is accepted"],
        ),
    ];
    refused(cases.into_iter().flatten());
}

#[test]
fn sweeps_and_meshes_that_do_not_fit() {
    let plate = "MeshVersionFormatted 2\nDimension 2\nVertices 3\n0 0 0\n2 0 0\n0 2 0\nTriangles 1\n1 2 3 0\nEnd\n";
    let shell = plate
        .replace("Dimension 2", "Dimension 3")
        .replace("0 0 0\n2 0 0\n0 2 0\n", "0 0 0 0\n2 0 0 0\n0 2 1 0\n");
    refused([
        Wrong::calls("a surface for a plate", &["cut m.mesh --sweep blade.obj -o out.vtu"])
            .file("m.mesh", plate)
            .at("--sweep")
            .says(&["blade.obj: it holds no line segment; triangles in the plane are cut by line segments"]),
        Wrong::calls("a surface in space", &["cut m.mesh --sweep blade.obj -o out.vtu"])
            .file("m.mesh", shell)
            .at("m.mesh")
            .says(&["a surface in space (z = 1) cannot be cut yet; accepted: tetrahedra, triangles with z = 0"]),
    ]);
}

#[test]
fn sweeps_that_are_missing_or_do_not_fit() {
    let none = "cannot be read: No such file or directory";
    let second = format!("{SOLID}[[cut]]\nsweep = 'other.obj'\n");
    let mesh = super::meshes::vtu_of_a_tetrahedron();
    refused([
        Wrong::scene("a missing sweep", changed(SOLID, "blade.obj", "none.obj"))
            .at("scene.toml:18: cut.sweep")
            .says(&["none.obj: ", none, "relative to the scene"]),
        Wrong::scene("the sweep of the second cut", second)
            .at("scene.toml:27: cut[1].sweep")
            .says(&["other.obj: ", none]),
        Wrong::scene("a directory as a sweep", changed(SOLID, "blade.obj", "d.obj"))
            .file("d.obj/a", "")
            .at("scene.toml:18: cut.sweep")
            .says(&["d.obj: cannot be read: Is a directory"]),
        Wrong::calls("a missing sweep", &["cut m.vtu --sweep none.obj -o out.vtu"])
            .file("m.vtu", mesh)
            .at("--sweep")
            .says(&["none.obj: ", none]),
        Wrong::scene("triangles for a plate", changed(PLANAR, "line.obj", "blade.obj"))
            .at("scene.toml:16: cut.sweep")
            .says(&["blade.obj: it holds no line segment; triangles in the plane are cut by line segments"]),
        Wrong::scene("a line out of the plane", PLANAR)
            .file("line.obj", "v 1.07 0.4 0\nv 1.13 5 0.5\nl 1 2\n")
            .at("scene.toml:16: cut.sweep")
            .says(&["line.obj: "]),
    ]);
}

#[test]
fn truncated_sweeps() {
    let mut cases = Vec::new();
    for name in [
        "pyvista_surface_ascii.vtp",
        "pyvista_surface_binary.vtp",
        "pyvista_surface_ascii.stl",
        "pyvista_surface_binary.stl",
        "meshio_surface_ascii.stl",
        "surface.vtu",
    ] {
        let file = format!("s.{}", name.rsplit('.').next().unwrap());
        for (k, bytes) in truncated(&sample(name), None).enumerate() {
            let [in_scene, alone] = in_scene_and_alone(&format!("{name}, {k} tenths of it"), &file, &bytes, &[]);
            cases.push(if k % 2 == 0 { in_scene } else { alone });
        }
    }
    for name in ["pyvista_surface_ascii.vtk", "pyvista_surface_binary.vtk"] {
        for (k, bytes) in truncated(&sample(name), Some("POLYGONS")).enumerate() {
            cases.extend(in_scene_and_alone(
                &format!("{name}, {k} tenths before its polygons"),
                "s.vtk",
                &bytes,
                &[],
            ));
        }
    }
    // a file of lines says nowhere how many there are: only a line that stops early can be seen
    for end in [
        "v 1.07 -5 0.51",
        "v 1.13 5 0.52",
        "v 1.11 5",
        "v 1.06",
        "f 1 2",
        "f 1 3",
    ] {
        let at = BLADE.find(end).unwrap() + end.rfind(' ').unwrap();
        cases.extend(in_scene_and_alone(
            &format!("an .obj that stops in \"{end}\""),
            "s.obj",
            &BLADE.as_bytes()[..at],
            &[],
        ));
    }
    refused(cases);
}
