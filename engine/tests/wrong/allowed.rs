//! What looks wrong and is not: it runs, and where a user should know of it, says so.

use super::harness::{BLADE, LINE, SOLID, changed, kerfem};

/// Checks and runs a scene; the warnings of `check`, and the report.
fn accepted(scene: &str, files: &[(&str, &str)]) -> (Vec<String>, serde_json::Value) {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files
        .iter()
        .chain(&[("scene.toml", scene), ("blade.obj", BLADE), ("line.obj", LINE)])
    {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    let call = |words: &[&str]| {
        let output = kerfem(
            folder.path(),
            &words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>(),
        );
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{scene}");
        let told = stderr.lines().all(|l| l.starts_with("kerfem: warning: "));
        assert!(told, "{scene}\n{stderr}");
        String::from_utf8(output.stdout).unwrap()
    };
    let checked = call(&["check", "scene.toml"]);
    let warnings = checked
        .lines()
        .filter_map(|l| l.strip_prefix("warning: "))
        .map(str::to_owned)
        .collect();
    call(&["run", "scene.toml", "-o", "out"]);
    let report = std::fs::read_to_string(folder.path().join("out/report.json")).unwrap();
    (warnings, serde_json::from_str(&report).unwrap())
}

#[test]
fn the_scenes_of_the_cases_run() {
    let (warnings, report) = accepted(SOLID, &[]);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(report["cuts"].as_array().unwrap().len(), 1);
    assert!(report["quantities"]["sag"].as_f64().unwrap() < 0.0);
    let (warnings, report) = accepted(super::harness::PLANAR, &[]);
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(report["cuts"].as_array().unwrap().len(), 1);
}

#[test]
fn a_step_longer_than_the_run_is_shortened() {
    let (_, report) = accepted(&changed(SOLID, "dt = 0.01", "dt = 5"), &[]);
    assert_eq!(
        (report["steps"].as_u64(), report["time"].as_f64()),
        (Some(1), Some(0.02))
    );
}

#[test]
fn a_vertex_of_no_cell_is_kept() {
    let vtu = super::meshes::vtu_of_a_tetrahedron().replace("NumberOfPoints='4'", "NumberOfPoints='5'");
    let vtu = vtu.replace("</DataArray></Points>", "7 7 7\n</DataArray></Points>");
    let scene = changed(SOLID, "box = { size = [2, 1, 1], cells = [2, 1, 1] }", "file = 'm.vtu'");
    let scene = scene.split("[[cut]]").next().unwrap();
    let (_, report) = accepted(scene, &[("m.vtu", &vtu)]);
    assert_eq!(report["mesh"]["final"]["vertices"], 5);
    assert_eq!(report["mesh"]["final"]["cells"], 1);
}

#[test]
fn fixed_sets_that_disagree_are_a_warning() {
    let fixed = |sections: &str| changed(SOLID, "[[load]]", &format!("{sections}[[load]]"));
    let pulled = fixed("[[fixed]]\nwhere = 'x < 1e-9 && y < 1e-9'\naxes = 'x'\ndisplacement = ['0.1 * t']\n");
    let (warnings, report) = accepted(&pulled, &[]);
    let wanted = "fixed[0] and fixed[1] prescribe different displacements at 2 vertices, along x at vertex 0 first (0 and 0.0005 m \
                  at t = 0.005 s): the later one wins";
    assert_eq!(warnings, [wanted]);
    assert_eq!(report["warnings"], serde_json::json!([wanted]));

    let (warnings, _) = accepted(
        &fixed("[[fixed]]\nwhere = 'x < 1e-9'\naxes = 'x'\n[[fixed]]\nvertices = [0]\ndisplacement = ['x', 0, 0]\n"),
        &[],
    );
    assert!(warnings.is_empty(), "{warnings:?}");
    let apart = fixed("[[fixed]]\nwhere = 'x > 1.999'\ndisplacement = [0.1, 0, 0]\n");
    assert!(accepted(&apart, &[]).0.is_empty());
    let three = fixed(
        "[[fixed]]\nvertices = [0, 3]\ndisplacement = [1e-3, 0, 0]\n[[fixed]]\nvertices = [3]\ndisplacement = [2e-3, 0, 0]\n",
    );
    let (warnings, _) = accepted(&three, &[]);
    assert_eq!(warnings.len(), 3, "{warnings:?}");
    assert!(warnings[2].starts_with("fixed[1] and fixed[2] prescribe different displacements at 1 vertex, along x at vertex 3 first (0.001 and 0.002 m at t = 0 s)"), "{warnings:?}");
}

#[test]
fn ten_megabytes_of_comments_are_read() {
    let scene = format!("{}{SOLID}", "# nothing but words, words, words\n".repeat(300_000));
    let (warnings, _) = accepted(&scene, &[]);
    assert!(warnings.is_empty());
}

#[test]
fn lines_and_triangles_beside_tetrahedra_are_no_cells() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.vtu"), super::harness::sample("mixed.vtu")).unwrap();
    let scene = changed(SOLID, "box = { size = [2, 1, 1], cells = [2, 1, 1] }", "file = 'm.vtu'");
    let scene = changed(
        scene.split("[[cut]]").next().unwrap(),
        "where = 'x < 1e-9'",
        "group = 'number'",
    );
    std::fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let output = kerfem(folder.path(), &["check", "scene.toml"].map(str::to_owned));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert!(
        text.contains("cells 12\n") && text.contains("fixed[0] holds 12 vertices"),
        "{text}"
    );
}

#[test]
fn a_load_that_fails_on_the_way_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let scene = changed(SOLID, "gravity = [0, 0, -9.81]", "gravity = [0, 0, '1/(0.01 - t)']");
    std::fs::write(folder.path().join("scene.toml"), scene.split("[[cut]]").next().unwrap()).unwrap();
    let output = kerfem(folder.path(), &["run", "scene.toml"].map(str::to_owned));
    assert_eq!(output.status.code(), Some(3));
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "kerfem: stopped at t = 0 s: load[0].gravity: \"1/(0.01 - t)\" has no finite value at t = 0.01 s\n"
    );
    let report = std::fs::read_to_string(folder.path().join("out/beam/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert!(report["stopped"].as_str().unwrap().contains("load[0].gravity"));
}
