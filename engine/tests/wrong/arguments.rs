//! The command line.

use super::harness::{SOLID, Wrong, kerfem, refused};
use super::meshes::vtu_of_a_tetrahedron;

/// Calls beside a scene, a mesh and a file that is none of these.
fn call(name: &str, call: &str) -> Wrong {
    let wrong = Wrong::calls(name, &[call]).file("scene.toml", SOLID);
    wrong.file("m.vtu", vtu_of_a_tetrahedron()).file("file.txt", "words\n")
}

#[test]
fn calls_and_names_of_arguments() {
    let usage = "Usage: kerfem run";
    refused([
        call("no call", "").says(&[
            "requires a subcommand",
            "[subcommands: run, check, quality, cut, modes, study, validate]",
        ]),
        call("a call that does not exist", "rum scene.toml").says(&[
            "unrecognized subcommand 'rum'",
            "similar",
            "'run'",
        ]),
        call("an argument that does not exist", "run scene.toml --thread 2").says(&[
            "unexpected argument '--thread' found",
            "a similar argument exists: '--threads'",
            usage,
        ]),
        call("an argument of another call", "check scene.toml --verify")
            .says(&["unexpected argument '--verify' found", "Usage: kerfem check"]),
        call("no scene", "run").says(&["arguments were not provided: <SCENE>", usage]),
        call("two scenes", "check scene.toml scene.toml")
            .says(&["unexpected argument 'scene.toml' found", "Usage: kerfem check"]),
        call("no mesh", "quality").says(&["arguments were not provided: <MESH>", "Usage: kerfem quality"]),
        call("no study", "study").says(&["arguments were not provided: <STUDY>", "Usage: kerfem study"]),
        call("no sweep", "cut m.vtu").says(&["arguments were not provided: --sweep <SWEEP>", "Usage: kerfem cut"]),
        call("an argument without its value", "run scene.toml --threads").says(&["a value is required for '--threads"]),
        call("an argument twice", "run scene.toml --threads 1 --threads 2")
            .says(&["'--threads <THREADS>' cannot be used multiple times", usage]),
        call("a value for a switch", "run scene.toml --verify=yes")
            .says(&["unexpected value 'yes' for '--verify'", usage]),
    ]);
}

#[test]
fn values_of_arguments() {
    let threads = "a whole number from 1 to 1024 is needed";
    let until = "a time from 0 (s) is needed";
    let snap = "a fraction from 0 to 0.45 is needed";
    let run = |name: &str, arguments: &str, place: &str, parts: &[&str]| {
        call(name, &format!("run scene.toml {arguments}")).at(place).says(parts)
    };
    let cut = |name: &str, arguments: &str, place: &str, parts: &[&str]| {
        call(name, &format!("cut m.vtu --sweep blade.obj {arguments}"))
            .at(place)
            .says(parts)
    };
    let modes = |name: &str, count: &str| {
        let parts = [
            format!("\"{count}\" is not accepted"),
            "a whole number from 1 to 1000".into(),
        ];
        call(name, &format!("modes scene.toml --count {count}"))
            .at("--count")
            .says(&parts.each_ref().map(String::as_str))
    };
    refused([
        run(
            "no threads",
            "--threads 0",
            "--threads",
            &["\"0\" is not accepted", threads],
        ),
        run(
            "too many threads",
            "--threads 100000",
            "--threads",
            &["\"100000\" is not accepted", threads],
        ),
        run(
            "one thread too many",
            "--threads 1025",
            "--threads",
            &["\"1025\" is not accepted", threads],
        ),
        run(
            "threads below 0",
            "--threads -1",
            "--threads",
            &["\"-1\" is not accepted", threads],
        ),
        run(
            "threads beyond 64 bits",
            "--threads 99999999999999999999",
            "--threads",
            &[threads],
        ),
        run(
            "half a thread",
            "--threads 1.5",
            "--threads",
            &["\"1.5\" is not accepted", threads],
        ),
        run(
            "threads in words",
            "--threads many",
            "--threads",
            &["\"many\" is not accepted", threads],
        ),
        run(
            "a time before the start",
            "--until -0.5",
            "--until",
            &["\"-0.5\" is not accepted", until],
        ),
        run(
            "a time that is not a number",
            "--until nan",
            "--until",
            &["\"nan\" is not accepted", until],
        ),
        run(
            "a time below everything",
            "--until -inf",
            "--until",
            &["\"-inf\" is not accepted", until],
        ),
        run(
            "a time in words",
            "--until 1s",
            "--until",
            &["\"1s\" is not accepted", until],
        ),
        modes("no modes", "0"),
        modes("modes below 0", "-3"),
        modes("too many modes", "1001"),
        modes("half a mode", "1.5"),
        cut(
            "snap too large",
            "--snap 0.46",
            "--snap",
            &["\"0.46\" is not accepted", snap],
        ),
        cut(
            "snap below 0",
            "--snap -0.1",
            "--snap",
            &["\"-0.1\" is not accepted", snap],
        ),
        cut(
            "snap that is not a number",
            "--snap NaN",
            "--snap",
            &["\"NaN\" is not accepted", snap],
        ),
        cut(
            "a method that does not exist",
            "--method hybird",
            "--method",
            &[
                "unknown value \"hybird\"; did you mean \"hybrid\"?",
                "accepted: \"delete\", \"subdivide\", \"snap\", \"hybrid\", \"collapse\", \"merge\"",
            ],
        ),
        cut(
            "a method that is not available yet",
            "--method delaunay",
            "--method",
            &[
                "\"delaunay\" is not available yet; accepted: \"delete\", \"subdivide\", \"snap\", \"hybrid\", \"collapse\", \"merge\"",
            ],
        ),
    ]);
}

#[test]
fn places_for_results() {
    let folder = "a folder that can be written to is needed";
    let run = |name: &str, output: &str| call(name, &format!("run scene.toml -o {output}")).at("--output");
    let cut = |name: &str, output: &str| call(name, &format!("cut m.vtu --sweep blade.obj -o {output}")).at("--output");
    refused([
        run("a file as a folder", "file.txt").says(&["file.txt: ", folder]),
        run("a folder inside a file", "file.txt/out").says(&["file.txt/out: ", folder]),
        run("a folder that cannot be", "/proc/none/out").says(&["/proc/none/out: ", folder]),
        run("a folder with a file where frames go", "taken")
            .file("taken/frames", "x")
            .says(&["taken/frames: ", folder]),
        run("a folder with a folder where the table goes", "taken")
            .file("taken/steps.csv/a", "x")
            .says(&["taken/steps.csv: "]),
        run("a folder of an endless name", &"x".repeat(300)).says(&["xxx: ", folder]),
        Wrong::calls("a file where results go", &["run scene.toml"])
            .file("scene.toml", SOLID)
            .file("out", "x")
            .at("out/beam")
            .says(&[folder]),
        cut("an extension that is not written", "out.stl")
            .says(&["out.stl: ", "a mesh of tetrahedra is written to .vtu files"]),
        cut("no extension", "out").says(&["out: ", "a mesh of tetrahedra is written to .vtu files"]),
        cut("an extension in capitals that is not written", "out.VTK")
            .says(&["a mesh of tetrahedra is written to .vtu files"]),
        cut("a folder that does not exist", "none/out.vtu")
            .says(&["none/out.vtu: ", "a file in a folder that can be written to is needed"]),
        cut("a file as the folder of a mesh", "file.txt/out.vtu")
            .says(&["a file in a folder that can be written to is needed"]),
        cut("a folder as a mesh", "dir.vtu")
            .file("dir.vtu/a", "x")
            .says(&["a file in a folder that can be written to is needed"]),
        cut("a folder in which nothing can be written", "/proc/out.vtu")
            .says(&["/proc/out.vtu: ", "a file in a folder that can be written to is needed"]),
    ]);
}

#[test]
fn file_names_with_line_ends_and_escapes() {
    let name = "a\nb\u{1b}[31m.toml";
    for call in [["check", name], ["run", name], ["quality", name]] {
        let folder = tempfile::tempdir().unwrap();
        let output = kerfem(folder.path(), &call.map(str::to_owned));
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(line.starts_with("kerfem: a b\\u{1b}[31m.toml: "), "{line}");
        assert_eq!(line.chars().filter(|c| c.is_control()).count(), 1, "{line}");
    }
}

#[test]
fn arguments_with_line_ends_and_escapes() {
    for call in [
        ["run", "a.toml", "--threads=1\n\u{1b}[31m"],
        ["run", "a.toml", "b\n\u{1b}[31m"],
    ] {
        let folder = tempfile::tempdir().unwrap();
        let output = kerfem(folder.path(), &call.map(str::to_owned));
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert_eq!(line.chars().filter(|c| c.is_control()).count(), 1, "{line}");
    }
}

#[test]
fn questions_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    for call in [&["--help"][..], &["run", "--help"], &["--version"], &["cut", "-h"]] {
        let call: Vec<String> = call.iter().map(|c| (*c).to_owned()).collect();
        let output = kerfem(folder.path(), &call);
        assert_eq!(output.status.code(), Some(0));
        assert!(output.stderr.is_empty() && !output.stdout.is_empty());
    }
}
