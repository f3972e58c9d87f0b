//! The cases of `kerfem validate`, as that command judges them.

use std::path::{Path, PathBuf};

use kerfem_engine::study::{Study, Verdict, validate, verdict_table};

fn cases() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let files = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let mut cases: Vec<PathBuf> = files.filter(|p| p.to_string_lossy().ends_with(".study.toml")).collect();
    cases.sort();
    cases
}

#[test]
fn every_case_is_met() {
    let folder = tempfile::tempdir().unwrap();
    let mut verdicts: Vec<Verdict> = Vec::new();
    for path in cases() {
        let study = Study::read(&path).unwrap();
        let own = folder.path().join(&study.name);
        let found = validate(&study, &own, &|| true, &mut |_| ()).unwrap().unwrap();
        assert!(!found.is_empty(), "{}: nothing is judged", study.name);
        verdicts.extend(found);
    }
    println!("{}", verdict_table(&verdicts));
    let missed: Vec<Verdict> = verdicts.into_iter().filter(|v| !v.is_met()).collect();
    assert!(missed.is_empty(), "\n{}", verdict_table(&missed));
}

/// On cuts along the mesh the opening of the lips and the energy that a longer cut releases tell the same stress intensity.
#[test]
fn both_ways_to_the_stress_intensity_agree() {
    let path = cases()
        .into_iter()
        .find(|p| p.ends_with("edge_crack_fitted.study.toml"))
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let found = validate(&Study::read(&path).unwrap(), folder.path(), &|| true, &mut |_| ())
        .unwrap()
        .unwrap();
    let of_formula = |measure: &str| {
        let own = found
            .iter()
            .find(|v| v.measure == measure && v.line.starts_with('2'))
            .unwrap();
        own.value.unwrap() / own.reference.unwrap()
    };
    let (opening, energy) = (of_formula("KI"), of_formula("KI by energy"));
    println!("K_I of order 2, of the formula: {opening:.4} by the opening, {energy:.4} by energy");
    assert!((opening / energy - 1.0).abs() < 0.02, "{opening} {energy}");
}

#[test]
fn every_study_can_be_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.to_string_lossy().ends_with(".study.toml") {
            Study::read(&path).unwrap();
            count += 1;
        }
    }
    assert!(count >= 10);
}
