//! Studies and validation by the command: tables, interruptions, runs that fail, cases that miss.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

const SCENE: &str = r#"
name = "beam"
[mesh]
box = { size = [4, 1, 1], cells = [8, 2, 2] }
[material]
young = 1e6
poisson = 0.3
density = 1000.0
[model]
kind = "linear"
[[fixed]]
where = "x < 1e-9"
[[load]]
where = "x > 4 - 1e-9"
traction = [0, 0, -100]
[time]
scheme = "static"
[[quantity]]
name = "tip"
mean = "uz"
where = "x > 4 - 1e-9"
"#;

const STUDY: &str = r#"
name = "small"
about = "Small & < quick"
scene = "beam.toml"
along = "mesh.box.cells"
[vary]
"model.order" = [1, 2]
"material.poisson" = [0.3, 0.5]
"mesh.box.cells" = [[4, 1, 1], [8, 2, 2], [16, 4, 4]]
[measure]
quantity = "tip"
reference = "finest"
repeats = 2
[[chart]]
title = "over seconds"
[[chart]]
x = "mesh.box.cells"
y = "material.poisson"
color = "error"
"#;

fn kerfem(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kerfem"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

fn with(study: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("beam.toml"), SCENE).unwrap();
    std::fs::write(folder.path().join("small.toml"), study).unwrap();
    folder
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The columns of `study.csv` that do not depend on the clock.
fn table(folder: &Path) -> Vec<Vec<String>> {
    let mut reader = csv::Reader::from_path(folder.join("study.csv")).unwrap();
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let kept = |row: csv::StringRecord| {
        let cells = names.iter().zip(&row).filter(|(n, _)| !n.starts_with("seconds"));
        cells.map(|(_, c)| c.to_owned()).collect::<Vec<_>>()
    };
    reader.records().map(|r| kept(r.unwrap())).collect()
}

#[test]
fn a_run_that_fails_is_a_row_and_all_files_are_there() {
    let folder = with(STUDY);
    let output = kerfem(folder.path(), &["study", "small.toml", "-o", "out"]);
    assert!(output.status.success(), "{}", said(&output));
    let rows = table(&folder.path().join("out"));
    assert_eq!(rows.len(), 12);
    let (failed, fine): (Vec<_>, Vec<_>) = rows.iter().partition(|r| r[1] == "0.5");
    assert!(
        failed
            .iter()
            .all(|r| r.last().unwrap().starts_with("beam.toml: material.poisson: ") && r[5].is_empty()),
        "{failed:?}"
    );
    // value, reference, error: the finest is the reference, coarser ones are worse
    let error = |order: &str, cells: &str| {
        let row = fine.iter().find(|r| r[0] == order && r[2] == cells).unwrap();
        row[5].parse::<f64>().unwrap()
    };
    assert_eq!(error("2", "16 x 4 x 4"), 0.0);
    assert!(error("1", "4 x 1 x 1") > 1.3 * error("1", "8 x 2 x 2") && error("1", "8 x 2 x 2") > 0.1);
    let page = std::fs::read_to_string(folder.path().join("out/index.html")).unwrap();
    for part in [
        "Small &amp; &lt; quick",
        "<svg",
        "Pareto front",
        "16 x 4 x 4",
        "poisson",
        "</html>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        !page.contains("src=") && !page.contains("href="),
        "the page needs nothing else"
    );
    assert!(folder.path().join("out/chart.png").metadata().unwrap().len() > 5000);
}

#[test]
fn runs_side_by_side_and_other_threads_give_the_same_table() {
    let folder = with(&STUDY.replace("repeats = 2", "repeats = 1"));
    for (out, more) in [("one", ["--threads", "1"]), ("two", ["--parallel", "2"])] {
        let output = kerfem(folder.path(), &["study", "small.toml", "-o", out, more[0], more[1]]);
        assert!(output.status.success(), "{}", said(&output));
    }
    assert_eq!(table(&folder.path().join("one")), table(&folder.path().join("two")));
}

/// Killed without warning at several moments, each time later; the journal may end in half a line.
#[test]
fn a_study_that_is_killed_goes_on_to_the_same_table() {
    let folder = with(STUDY);
    let whole = kerfem(folder.path(), &["study", "small.toml", "-o", "whole"]);
    assert!(whole.status.success());
    let mut killed = 0;
    for wait in [40, 90, 160, 250] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_kerfem"))
            .current_dir(folder.path())
            .args(["study", "small.toml", "-o", "parts"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait));
        let _ = child.kill();
        killed += usize::from(!child.wait().unwrap().success());
    }
    let journal = folder.path().join("parts/runs.jsonl");
    if let Ok(text) = std::fs::read_to_string(&journal) {
        // as if it had been killed while it wrote
        std::fs::write(&journal, &text[..text.len() - text.len().min(20)]).unwrap();
    }
    let rest = kerfem(folder.path(), &["study", "small.toml", "-o", "parts"]);
    assert!(rest.status.success(), "{}", said(&rest));
    assert!(killed > 0, "no run was killed");
    assert_eq!(table(&folder.path().join("parts")), table(&folder.path().join("whole")));
}

#[test]
fn mistakes_in_a_study_are_named() {
    for (from, to, wanted) in [
        ("\"small\"", "\"../small\"", "it names files"),
        ("scene = ", "scenes = ", "did you mean \"scene\"?"),
        ("beam.toml", "none.toml", "none.toml: the scene cannot be read"),
        (
            "\"tip\"",
            "\"top\"",
            "\"top\" is no [[quantity]] of the scene; accepted: tip",
        ),
        ("[1, 2]", "[]", "a list of values is needed"),
        ("[1, 2]", "[3, 4]", "order"),
        ("\"model.order\"", "\"model.ordre\"", "did you mean \"order\"?"),
        ("\"model.order\"", "\"cut.0.method\"", "[[cut]] has none"),
        ("\"finest\"", "\"x + 1\"", "has no one value"),
        (
            "reference = \"finest\"",
            "reference = { exact = [\"x\", \"y\", \"z\"] }",
            "only \"field\" is compared",
        ),
        (
            "quantity = \"tip\"",
            "quantity = \"tip\"\nsteps = \"t\"",
            "exactly one of",
        ),
        (
            "along = \"mesh.box.cells\"",
            "along = \"mesh.cells\"",
            "a key of [vary] is needed",
        ),
        ("repeats = 2", "repeats = 0", "once or more often"),
        ("color = \"error\"", "color = \"eror\"", "\"eror\" is not accepted"),
        (
            "along =",
            "together = [[\"model.order\", \"mesh.box.cells\"]]\nalong =",
            "must be of one length",
        ),
    ] {
        let folder = with(&STUDY.replacen(from, to, 1));
        let output = kerfem(folder.path(), &["study", "small.toml", "-o", "out"]);
        let said = said(&output);
        assert!(said.contains(wanted) && said.lines().count() == 1, "{to}: {said}");
        assert_eq!(output.status.code(), Some(2), "{to}: {said}");
        assert!(!folder.path().join("out").exists(), "{to}");
    }
}

#[test]
fn results_of_another_study_are_not_lost() {
    let folder = with(&STUDY.replace("[[4, 1, 1], [8, 2, 2], [16, 4, 4]]", "[[2, 1, 1]]"));
    assert!(
        kerfem(folder.path(), &["study", "small.toml", "-o", "out"])
            .status
            .success()
    );
    let scene = SCENE.replace("1e6", "2e6");
    std::fs::write(folder.path().join("beam.toml"), scene).unwrap();
    let output = kerfem(folder.path(), &["study", "small.toml", "-o", "out"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("another study or scene"), "{}", said(&output));
}

#[test]
fn a_case_that_misses_is_exit_1_and_the_table_says_so() {
    let case = STUDY
        .replace("[0.3, 0.5]", "[0.3]")
        .replace("[1, 2]", "[1]")
        .replace("repeats = 2", "tolerance = 0.01\nrate = 0.5")
        .replace("\"finest\"", "\"-400 / (3 * 1e6 / 12) * 16\"");
    for (tolerance, code, word) in [("0.5", 0, "ok"), ("1e-6", 1, "MISSED")] {
        let folder = with(&case.replace("0.01", tolerance));
        std::fs::rename(folder.path().join("small.toml"), folder.path().join("small.study.toml")).unwrap();
        let output = kerfem(folder.path(), &["validate", "--cases", ".", "small"]);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{}{}",
            said(&output),
            String::from_utf8_lossy(&output.stdout)
        );
        let table = std::fs::read_to_string(folder.path().join("out/validate/validation.md")).unwrap();
        assert!(table.contains(word), "{table}");
    }
    let folder = with(&case);
    let output = kerfem(folder.path(), &["validate", "--cases", ".", "small"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("it holds none"), "{}", said(&output));
}
