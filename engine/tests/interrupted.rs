//! Runs that are stopped half-way: what they have written can be read, and going on gives the same bits.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const SCENE: &str = "name = 'beam'\n[mesh]\nbox = { size = [2, 1, 1], cells = [8, 4, 4] }\n[material]\nyoung = 2e4\n\
    poisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, 0, -9.81]\n[time]\n\
    scheme = 'backward-euler'\ndt = 0.01\nend = 0.3\n[[cut]]\nat = 0.095\nsweep = 'blade.obj'\n[[cut]]\nat = 0.195\n\
    sweep = 'other.obj'\n[[probe]]\nname = 'tip'\npoint = [1.9, 0.5, 0.5]\n[output]\nevery = 0.02\nsurface = true\n\
    fields = ['displacement', 'von_mises', 'internal_force']\n";
const BLADE: &str = "v 1.07 -5 0.51\nv 1.13 5 0.52\nv 1.11 5 5\nv 1.06 -5 5\nf 1 2 3\nf 1 3 4\n";
const OTHER: &str = "v 0.57 -5 -3\nv 0.63 5 -3\nv 0.61 5 5\nv 0.56 -5 5\nf 1 2 3\nf 1 3 4\n";

fn kerfem(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kerfem"));
    command.current_dir(folder).args(arguments);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (file, text) in [("scene.toml", SCENE), ("blade.obj", BLADE), ("other.obj", OTHER)] {
        std::fs::write(folder.path().join(file), text).unwrap();
    }
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let output = kerfem(folder, arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The table of steps without the seconds, which no two runs share.
fn table(results: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(results.join("steps.csv")).unwrap();
    let rows = text
        .lines()
        .map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
    let mut rows: Vec<Vec<String>> = rows.collect();
    let timed: Vec<bool> = rows[0].iter().map(|name| name.ends_with("_s")).collect();
    for row in &mut rows {
        assert_eq!(row.len(), timed.len(), "{row:?}");
        let mut timed = timed.iter();
        row.retain(|_| !timed.next().unwrap());
    }
    rows
}

/// Everything a run leaves that must not depend on whether it was interrupted.
fn assert_same(results: &Path, unbroken: &Path) {
    let bytes = |folder: &Path, file: &str| std::fs::read(folder.join(file)).unwrap();
    assert!(
        bytes(results, "final.vtu") == bytes(unbroken, "final.vtu"),
        "final.vtu differs"
    );
    for list in ["beam.pvd", "beam_surface.pvd"] {
        assert!(bytes(results, list) == bytes(unbroken, list), "{list} differs");
        for frame in frames(unbroken, list) {
            assert!(bytes(results, &frame) == bytes(unbroken, &frame), "{frame} differs");
        }
    }
    assert_eq!(table(results), table(unbroken));
    let report = |folder: &Path| -> serde_json::Value {
        let mut all: serde_json::Value = serde_json::from_slice(&bytes(folder, "report.json")).unwrap();
        all.as_object_mut().unwrap().remove("seconds");
        for cut in all["cuts"].as_array_mut().unwrap() {
            for key in ["seconds", "tree_nodes"] {
                cut.as_object_mut().unwrap().remove(key);
            }
        }
        all
    };
    assert_eq!(report(results), report(unbroken));
}

/// The files that a list of frames names.
fn frames(results: &Path, list: &str) -> Vec<String> {
    let list = std::fs::read_to_string(results.join(list)).unwrap();
    assert!(list.trim_end().ends_with("</VTKFile>"), "{list}");
    let files = list
        .split("file=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap());
    files.map(str::to_owned).collect()
}

/// What a run that was stopped has left: every frame can be read, and the list names frames that are there.
fn assert_readable(results: &Path) {
    let Ok(entries) = std::fs::read_dir(results.join("frames")) else {
        return;
    };
    for entry in entries {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "vtu") {
            let data = kerfem_mesh::io::read_mesh(&path).unwrap();
            assert!(data.point_arrays.contains_key("displacement") && data.into_tet_mesh().is_ok());
        }
    }
    for list in ["beam.pvd", "beam_surface.pvd"]
        .into_iter()
        .filter(|l| results.join(l).exists())
    {
        frames(results, list)
            .iter()
            .for_each(|f| assert!(results.join(f).is_file(), "{f}"));
    }
}

fn kill(mut child: Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn killed_at_random_moments_a_run_goes_on_with_the_same_bits() {
    let unbroken = folder();
    let clock = Instant::now();
    run(unbroken.path(), &["run", "scene.toml", "--save-every", "0"]);
    let whole = clock.elapsed();
    let mut resumed = 0;
    for k in 0..20u32 {
        let broken = folder();
        let results: PathBuf = broken.path().join("out/beam");
        // two kills in every third run
        for (n, arguments) in [
            &["run", "scene.toml", "--save-every", "0"][..],
            &["run", "scene.toml", "--resume", "--save-every", "0"],
        ]
        .iter()
        .enumerate()
        .take(if k % 3 == 0 { 2 } else { 1 })
        {
            if n == 1 && !results.join("state.kerfem").exists() {
                break;
            }
            let child = kerfem(broken.path(), arguments).spawn().unwrap();
            std::thread::sleep(whole.mul_f64(f64::from((k * 7 + 3) % 20) / 20.0));
            kill(child);
            assert_readable(&results);
        }
        if results.join("state.kerfem").exists() {
            run(broken.path(), &["run", "scene.toml", "--resume"]);
            resumed += 1;
        } else {
            run(broken.path(), &["run", "scene.toml"]);
        }
        assert_same(&results, &unbroken.path().join("out/beam"));
    }
    assert!(resumed >= 10, "only {resumed} of 20 runs had come to their first save");
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_frame_and_leaves_a_run_that_can_go_on() {
    let (unbroken, broken) = (folder(), folder());
    for folder in [&unbroken, &broken] {
        let slower = SCENE.replace("dt = 0.01", "dt = 0.002");
        std::fs::write(folder.path().join("scene.toml"), slower).unwrap();
    }
    run(unbroken.path(), &["run", "scene.toml"]);
    let results = broken.path().join("out/beam");
    let child = kerfem(broken.path(), &["run", "scene.toml"]).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while !results.join("frames/beam_000010.vtu").exists() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(2));
    }
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(130),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_readable(&results);
    let report = std::fs::read_to_string(results.join("report.json")).unwrap();
    assert!(report.contains("\"stopped\": \"interrupted\""), "{report}");
    assert!(kerfem_mesh::io::read_mesh(results.join("final.vtu")).is_ok());
    run(broken.path(), &["run", "scene.toml", "--resume"]);
    assert_same(&results, &unbroken.path().join("out/beam"));
}

#[test]
fn a_run_that_has_ended_can_be_prolonged_and_another_scene_is_refused() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    let refused = |arguments: &[&str]| {
        let output = kerfem(folder.path(), arguments).output().unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), text.lines().count()), (Some(2), 1), "{text}");
        text
    };
    assert!(refused(&["run", "scene.toml", "--resume"]).contains("state.kerfem: there is no save to go on from"));
    assert!(!folder.path().join("out").exists());
    run(folder.path(), &["run", "scene.toml", "--until", "0.1"]);
    std::fs::write(&scene, SCENE.replace("2e4", "3e4")).unwrap();
    let text = refused(&["run", "scene.toml", "--resume"]);
    assert!(
        text.contains("scene.toml:4: material: it differs from the run that was saved"),
        "{text}"
    );
    std::fs::write(&scene, SCENE.replace("end = 0.3", "end = 0.32")).unwrap();
    run(folder.path(), &["run", "scene.toml", "--resume"]);
    let results = folder.path().join("out/beam");
    assert_eq!(table(&results).len(), 1 + 32);
    assert_eq!(frames(&results, "beam.pvd").len(), 17);
    std::fs::write(results.join("state.kerfem"), "kerfem save\n").unwrap();
    assert!(refused(&["run", "scene.toml", "--resume"]).contains("cut short"));
    assert!(refused(&["run", "scene.toml", "--save-every", "-1"]).contains("--save-every"));
}

#[test]
fn a_run_that_begins_anew_leaves_nothing_of_an_earlier_one() {
    let folder = folder();
    let results = folder.path().join("out/beam");
    run(folder.path(), &["run", "scene.toml"]);
    // another scene of the same name, killed before its first minute
    let other = SCENE.replace("dt = 0.01", "dt = 0.002");
    std::fs::write(folder.path().join("scene.toml"), other).unwrap();
    std::fs::remove_file(results.join("steps.csv")).unwrap();
    let child = kerfem(folder.path(), &["run", "scene.toml"]).spawn().unwrap();
    let lines = || std::fs::read_to_string(results.join("steps.csv")).map_or(0, |t| t.lines().count());
    let deadline = Instant::now() + Duration::from_secs(60);
    while lines() < 3 && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    kill(child);
    assert!(!results.join("final.vtu").exists() && !results.join("report.json").exists());
    run(folder.path(), &["run", "scene.toml", "--resume"]);
    let steps = table(&results);
    assert_eq!(steps.len(), 1 + 150);
    assert!(
        steps
            .iter()
            .skip(1)
            .enumerate()
            .all(|(k, row)| row[0] == (k + 1).to_string()),
        "{steps:?}"
    );
    let listed = frames(&results, "beam.pvd");
    assert_eq!(std::fs::read_dir(results.join("frames")).unwrap().count(), listed.len());
}
