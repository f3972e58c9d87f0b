//! The command: exit codes and files.

use std::path::Path;
use std::process::{Command, Output};

fn kerfem(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kerfem"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

const SCENE: &str = "name = 'beam'\n[mesh]\nbox = { size = [2, 1, 1], cells = [4, 2, 2] }\n[material]\nyoung = 1e5\n\
    poisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -9.81]\n[time]\n\
    scheme = 'backward-euler'\ndt = 0.01\nend = 0.055\n[[cut]]\nat = 0.02\nsweep = 'blade.obj'\n[output]\nevery = 0.02\n\
    fields = ['displacement', 'von_mises', 'quality', 'internal_force', 'mass', 'strain', 'stress', 'region']\n";
const BLADE: &str = "v 1.07 -5 0.51\nv 1.13 5 0.52\nv 1.11 5 5\nv 1.06 -5 5\nf 1 2 3\nf 1 3 4\n";

fn folder_with(scene: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    std::fs::write(folder.path().join("blade.obj"), BLADE).unwrap();
    folder
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_run_writes_all_its_files() {
    let folder = folder_with(SCENE);
    let output = kerfem(
        folder.path(),
        &["run", "scene.toml", "--verify", "--export-system", "--threads", "1"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let result = folder.path().join("out/beam");
    let read = |file: &str| std::fs::read_to_string(result.join(file)).unwrap();
    let report: serde_json::Value = serde_json::from_str(&read("report.json")).unwrap();
    assert_eq!(report["name"], "beam");
    assert_eq!(report["threads"], 1);
    assert_eq!(report["steps"], 6);
    assert_eq!(report["solver"]["unconverged_steps"], 0);
    assert_eq!(report["verify"]["invariants"], "ok");
    assert_eq!(report["cuts"].as_array().unwrap().len(), 1);
    assert_eq!(report["cuts"][0]["at"], 0.02);
    assert!(report["cuts"][0]["area_m2"].as_f64().unwrap() > 0.3);
    let table = read("steps.csv");
    assert_eq!(table.lines().count(), 7);
    let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    assert_eq!(last[0], "6");
    assert!((last[1].parse::<f64>().unwrap() - 0.055).abs() < 1e-15);
    assert!((last[2].parse::<f64>().unwrap() - 0.005).abs() < 1e-12);
    let list = read("beam.pvd");
    assert_eq!(list.matches("<DataSet").count(), 3, "{list}");
    for step in ["000000", "000002", "000004"] {
        assert!(result.join(format!("frames/beam_{step}.vtu")).is_file());
    }
    let data = kerfem_mesh::io::read_mesh(result.join("final.vtu")).unwrap();
    for name in ["displacement", "velocity", "vertex_id", "internal_force", "mass"] {
        assert!(data.point_arrays.contains_key(name), "{name}");
    }
    for name in ["von_mises", "quality", "strain", "stress", "region"] {
        assert!(data.cell_arrays.contains_key(name), "{name}");
    }
    let dofs = 3 * data.points.len();
    for file in ["K.mtx", "K_tangent.mtx", "M.mtx", "M_lumped.mtx"] {
        let text = read(&format!("system/{file}"));
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("%%MatrixMarket matrix coordinate real general"));
        let sizes: Vec<usize> = lines.next().unwrap().split(' ').map(|n| n.parse().unwrap()).collect();
        assert_eq!((sizes[0], sizes[1], sizes[2]), (dofs, dofs, lines.count()), "{file}");
    }
    assert_eq!(read("system/f.mtx").lines().count(), dofs + 2);
}

#[test]
fn the_log_says_what_was_asked_for() {
    let folder = folder_with(SCENE);
    let log = |arguments: &[&str]| {
        let output = kerfem(folder.path(), &[&["run", "scene.toml"], arguments].concat());
        assert_eq!(output.status.code(), Some(0));
        stderr(&output)
    };
    let count = |log: &str, word: &str| log.lines().filter(|l| l.contains(word)).count();
    assert_eq!(log(&[]), "");
    let stages = log(&["-v"]);
    assert!(
        count(&stages, "assembled") == 1 && count(&stages, "cut t=0.02") == 1,
        "{stages}"
    );
    assert_eq!(count(&stages, "step step="), 0, "{stages}");
    assert_eq!(count(&log(&["-vv"]), "step step="), 6);
    assert!(count(&log(&["-vvv"]), "linear solve") >= 6);
    let output = Command::new(env!("CARGO_BIN_EXE_kerfem"))
        .current_dir(folder.path())
        .env("KERFEM_LOG", "kerfem_engine=loud")
        .args(["check", "scene.toml"])
        .output()
        .unwrap();
    assert_eq!((output.status.code(), stderr(&output).lines().count()), (Some(2), 1));
}

#[test]
fn threads_do_not_change_a_byte() {
    let scene = SCENE.replace("[4, 2, 2]", "[16, 8, 8]").replace(
        "[output]",
        "[[cut]]\nat = 0.04\nmethod = 'subdivide'\nframe = 'rest'\nsweep = 'blade.obj'\n[output]",
    );
    let folder = folder_with(&scene);
    let results = |threads: &str| {
        let output = kerfem(
            folder.path(),
            &["run", "scene.toml", "--threads", threads, "-o", threads],
        );
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let results = folder.path().join(threads);
        ["final.vtu", "frames/beam_000002.vtu"].map(|f| std::fs::read(results.join(f)).unwrap())
    };
    let one = results("1");
    assert!(one == results("2") && one == results("8"));
}

#[test]
fn exit_codes_tell_what_happened() {
    let folder = folder_with(&SCENE.replace("poisson = 0.3", "poisson = 0.5"));
    let output = kerfem(folder.path(), &["run", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(stderr(&output).lines().count(), 1);
    assert!(
        stderr(&output).starts_with("kerfem: scene.toml:6: material.poisson: poisson = 0.5"),
        "{}",
        stderr(&output)
    );

    let output = kerfem(folder.path(), &["run", "nothing.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let output = kerfem(folder.path(), &["walk"]);
    assert_eq!(output.status.code(), Some(2));
    let output = kerfem(folder.path(), &["--help"]);
    assert_eq!(output.status.code(), Some(0));

    let free = SCENE
        .replace("[[fixed]]\nwhere = 'x < 1e-9'\n", "")
        .replace("backward-euler", "static");
    let folder = folder_with(&free);
    let output = kerfem(folder.path(), &["run", "scene.toml"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).contains("piece 1 of 1"), "{}", stderr(&output));
    let report = std::fs::read_to_string(folder.path().join("out/beam/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert!(report["stopped"].as_str().unwrap().contains("piece 1 of 1"));
    assert!(folder.path().join("out/beam/final.vtu").is_file());
}

#[test]
fn check_quality_and_cut_print_what_they_find() {
    let more = "[[region]]\nwhere = 'z > 0.5'\nyoung = 2e5\n[[load]]\nwhere = 'x > 1.999'\ntraction = [0, 0, '-100*t']\n\
        [[load]]\nvertices = [4, 9]\nforce = [0, 3, 0]\n[[load]]\nvertices = [4]\nnodal = [[1, 2, 3]]\n\
        [initial]\nvelocity = ['y', 0, 0]\n[[probe]]\nname = 'tip'\npoint = [2, 0.5, 0.5]\n";
    let folder = folder_with(&format!("{SCENE}{more}"));
    let output = kerfem(folder.path(), &["check", "scene.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for line in [
        "vertices 45",
        "cells 96",
        "region[0] has 48 cells of 1 m3, in [0, 0, 0.5] .. [2, 1, 1]",
        "fixed[0] holds 9 vertices, xyz, in [0, 0, 0] .. [0, 1, 1]",
        "load[0] (gravity) acts on 96 cells of 2 m3, in [0, 0, 0] .. [2, 1, 1]: [0, 0, -19620] N in all",
        "load[1] (traction) acts on 8 facets of 1 m2, in [2, 0, 0] .. [2, 1, 1]: [0, 0, 0] N in all at t = 0 s, [0, 0, -5.5] N \
         at t = 0.055 s",
        "load[2] (force) acts on 2 vertices, in [2, 0, 0] .. [2, 0.5, 0]: [0, 3, 0] N in all",
        "load[3] (nodal) acts on 1 vertex, in [2, 0, 0] .. [2, 0, 0]: [1, 2, 3] N in all",
        "initial velocity is in [0, 0, 0] .. [1, 0, 0] m/s",
        "cut[0] at 0.02 s by hybrid with blade.obj, 1 piece in [1.06, -5, 0.51] .. [1.13, 5, 5] (deformed frame): its box meets \
         12 of 96 cells at the start",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
    assert!(
        text.lines()
            .any(|l| l.starts_with("probe tip at [2, 0.5, 0.5] lies in cell ")),
        "{text}"
    );
    assert!(!folder.path().join("out").exists());

    assert_eq!(
        kerfem(folder.path(), &["run", "scene.toml", "--until", "0", "--quiet"])
            .status
            .code(),
        Some(0)
    );
    let mesh = "out/beam/final.vtu";
    let output = kerfem(folder.path(), &["quality", mesh, "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found["cells"], 96);
    assert!((found["volume_m3"].as_f64().unwrap() - 2.0).abs() < 1e-12);

    let call = [
        "cut",
        mesh,
        "--sweep",
        "blade.obj",
        "--method",
        "subdivide",
        "-o",
        "cut.vtu",
        "--json",
    ];
    let output = kerfem(folder.path(), &call);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(found["cells_added"].as_u64().unwrap() > 0);
    assert!((found["after"]["volume_m3"].as_f64().unwrap() - 2.0).abs() < 1e-12);
    assert!(folder.path().join("cut.vtu").is_file());
    let output = kerfem(folder.path(), &["cut", mesh, "--sweep", "blade.obj", "--snap", "0.9"]);
    assert_eq!(output.status.code(), Some(2));
    let output = kerfem(folder.path(), &["quality", "blade.obj"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_cut_mesh_is_written_as_its_ending_says() {
    let plate = "name = 'plate'\n[mesh]\nplate = { size = [2, 1], cells = [4, 2] }\n[material]\nyoung = 1\npoisson = 0\n\
        density = 1\n[time]\nscheme = 'evaluate'\n";
    let folder = folder_with(SCENE);
    std::fs::write(folder.path().join("plate.toml"), plate).unwrap();
    std::fs::write(folder.path().join("line.obj"), "v 1.23 -1 0\nv 1.27 2 0\nl 1 2\n").unwrap();
    for scene in [&["run", "plate.toml"][..], &["run", "scene.toml", "--until", "0"]] {
        assert_eq!(kerfem(folder.path(), scene).status.code(), Some(0));
    }
    let cut = |mesh: &str, sweep: &str, out: &str| {
        let output = kerfem(folder.path(), &["cut", mesh, "--sweep", sweep, "-o", out]);
        (output.status.code(), stderr(&output))
    };
    let (sheet, solid) = ("out/plate/final.vtu", "out/beam/final.vtu");
    let written = |out: &str| {
        assert_eq!(cut(sheet, "line.obj", out), (Some(0), String::new()));
        let data = kerfem_mesh::io::read_mesh(folder.path().join(out)).unwrap();
        assert_eq!(data.cell_arrays["quality"].values.len(), data.triangles.len());
        (data.points, data.triangles)
    };
    let surface = written("cut.vtp");
    assert!(surface.1.len() > 16 && surface == written("cut.VTU"));
    for (mesh, out, message) in [
        (
            sheet,
            "cut.stl",
            "cut.stl: a mesh of triangles is written to .vtu, .vtp files",
        ),
        (sheet, "cut", "cut: a mesh of triangles is written to .vtu, .vtp files"),
        (
            solid,
            "solid.vtp",
            "solid.vtp: a mesh of tetrahedra is written to .vtu files",
        ),
        (
            solid,
            "solid.vtk",
            "solid.vtk: a mesh of tetrahedra is written to .vtu files",
        ),
    ] {
        // the ending is told before the sweep is read
        assert_eq!(
            cut(mesh, "absent.obj", out),
            (Some(2), format!("kerfem: --output: {message}\n"))
        );
        assert!(!folder.path().join(out).exists());
    }
}

#[test]
fn quality_measures_surfaces_in_space() {
    let folder = tempfile::tempdir().unwrap();
    let half = std::f64::consts::FRAC_PI_2;
    let cap = kerfem_mesh::generate::cap_triangles([0.0, 0.0, 1.0], 0.2, half, 8).unwrap();
    let grid = kerfem_mesh::io::VtuGrid::from_tri_mesh(&cap);
    kerfem_mesh::io::write_vtp(folder.path().join("cap.vtp"), &grid).unwrap();
    let output = kerfem(folder.path(), &["quality", "cap.vtp", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&found["cells"], &found["pieces"]), (&384.into(), &1.into()));
    let area = found["area_m2"].as_f64().unwrap();
    let exact = 2.0 * std::f64::consts::PI * 0.04;
    assert!(area < exact && area > 0.99 * exact, "{area}");
    let number = |key: &str| found["quality"][key].as_f64().unwrap();
    assert!(number("min_radius_ratio") > 0.77 && number("max_over_min_edge") < 2.1);
    let text = kerfem(folder.path(), &["quality", "cap.vtp"]).stdout;
    let line = format!("area {:.6e} m2", kerfem_mesh::quality::volume(&cap));
    assert!(String::from_utf8_lossy(&text).lines().any(|l| l == line));
}

#[test]
fn a_run_says_what_it_came_to_and_what_to_know() {
    let late = "[[cut]]\nat = 0.054\nsweep = 'blade.obj'\n[[cut]]\nat = 0.01\nsweep = 'far.obj'\n[output]";
    let folder = folder_with(&SCENE.replace("[output]", late));
    std::fs::write(folder.path().join("far.obj"), BLADE.replace("v 1", "v 91")).unwrap();
    let told = |output: Output| (String::from_utf8_lossy(&output.stdout).into_owned(), stderr(&output));
    let (line, warnings) = told(kerfem(folder.path(), &["run", "scene.toml", "--verify"]));
    assert_eq!(
        line,
        "out/beam: 6 steps, t = 0.055 s, 2 cuts (1 without effect), 1 pieces, verify: ok\n"
    );
    let warnings: Vec<&str> = warnings.lines().collect();
    assert_eq!(
        warnings[0],
        "kerfem: warning: cut[1] at 0.054 s will not be made: the last step begins at 0.05 s"
    );
    assert!(
        warnings
            .iter()
            .any(|w| w.contains("cut at 0.01 s: the sweep changes nothing")),
        "{warnings:?}"
    );
    assert!(
        warnings.iter().all(|w| w.starts_with("kerfem: warning: ")),
        "{warnings:?}"
    );
    assert_eq!(
        told(kerfem(folder.path(), &["run", "scene.toml", "--quiet"])),
        Default::default()
    );
    let (text, _) = told(kerfem(folder.path(), &["check", "scene.toml"]));
    assert!(text.contains("\nwarning: cut[1] at 0.054 s will not be made"), "{text}");
    assert!(text.contains("\nbox [0, 0, 0] .. [2, 1, 1]\n"), "{text}");
    let hard = folder_with(
        &SCENE
            .replace(
                "[output]",
                "[solver]\nmax_iterations = 1\ntolerance = 1e-12\nkind = 'cg'\n[output]",
            )
            .replace("end = 0.055", "end = 0.055\nnonlinear = 'one-step'"),
    );
    let (line, _) = told(kerfem(hard.path(), &["run", "scene.toml"]));
    assert!(
        line.contains("6 steps missed the tolerance (residuals up to "),
        "{line}"
    );
}

#[test]
fn quality_lists_what_a_scene_can_name() {
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/../mesh/tests/samples/groups_4.1.msh");
    let folder = tempfile::tempdir().unwrap();
    let text = String::from_utf8_lossy(&kerfem(folder.path(), &["quality", sample]).stdout).into_owned();
    assert!(text.contains("box [0.0, 0.0, 0.0] .. [2.0, 1.0, 1.0]\n"), "{text}");
    for group in ["group \"body\": ", "group \"between\": "] {
        assert!(text.contains(group), "{text}");
    }
    let json = kerfem(folder.path(), &["quality", sample, "--json"]).stdout;
    let found: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert!(found["groups"]["body"]["tetrahedra"].as_u64().unwrap() > 0, "{found}");
}

#[test]
fn modes_are_listed_and_written() {
    let scene = "name = 'cube'\n[mesh]\nbox = { size = [1, 1, 1], cells = [2, 2, 2] }\n[material]\nyoung = 1e5\npoisson = 0.3\n\
        density = 1000\n";
    let folder = folder_with(scene);
    let output = kerfem(folder.path(), &["modes", "scene.toml", "--count", "6"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(said.lines().filter(|l| l.contains(" Hz  residual ")).count(), 6);
    assert!(said.ends_with("cube: 6 modes, 6 rigid motions\n"), "{said}");
    let results = folder.path().join("out/cube");
    for file in [
        "modes.json",
        "cube_modes.pvd",
        "modes/cube_000001.vtu",
        "modes/cube_000006.vtu",
    ] {
        assert!(results.join(file).is_file(), "{file}");
    }
    let quiet = kerfem(
        folder.path(),
        &["modes", "scene.toml", "--count", "2", "-o", "m", "--quiet"],
    );
    assert!(quiet.status.success() && quiet.stdout.is_empty() && quiet.stderr.is_empty());
    let none = kerfem(folder.path(), &["modes", "scene.toml", "--count", "0"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(
        stderr(&none).contains("a whole number from 1 to 1000 is needed"),
        "{}",
        stderr(&none)
    );
}
