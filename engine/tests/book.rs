//! What the book tells a newcomer to do, done.

use std::process::Command;

/// The first block of a language in a page.
fn block<'a>(page: &'a str, language: &str) -> &'a str {
    let start = page.find(&format!("```{language}\n")).expect("a block") + language.len() + 4;
    &page[start..][..page[start..].find("```").expect("its end")]
}

#[test]
fn the_first_cut_runs_as_the_book_says() {
    let page = include_str!("../../docs/book/first_cut.md");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("slit.toml"), block(page, "toml")).unwrap();
    std::fs::write(folder.path().join("blade.obj"), block(page, "obj")).unwrap();
    let commands = page.split("```sh\n").skip(1).flat_map(|b| b.split("```").next());
    let mut ran = 0;
    for line in commands.flat_map(str::lines).filter_map(|l| l.strip_prefix("kerfem ")) {
        let mut kerfem = Command::new(env!("CARGO_BIN_EXE_kerfem"));
        let output = kerfem
            .current_dir(folder.path())
            .args(line.split(' '))
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "kerfem {line}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        if line.starts_with("check") {
            let said = String::from_utf8_lossy(&output.stdout).into_owned();
            let missing = block(page, "text").lines().find(|l| !said.lines().any(|s| s == *l));
            assert_eq!(missing, None, "{said}");
        }
        ran += 1;
    }
    assert_eq!(ran, 2);
    for file in ["slit.pvd", "steps.csv", "report.json", "final.vtu"] {
        assert!(folder.path().join("out/slit").join(file).is_file(), "{file}");
    }
    let report = std::fs::read_to_string(folder.path().join("out/slit/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert!(report["cuts"][0]["area_m2"].as_f64().unwrap() > 1e-3);
    assert_eq!(report["verify"]["invariants"], "ok");
    assert_eq!(report["warnings"].as_array().unwrap().len(), 0);
}
