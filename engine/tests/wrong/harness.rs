//! Calls of the command that must be refused.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A beam that is clamped, hangs, and is cut; with a probe and a quantity.
pub(crate) const SOLID: &str = "name = 'beam'
[mesh]
box = { size = [2, 1, 1], cells = [2, 1, 1] }
[material]
young = 1e5
poisson = 0.3
density = 1000
[[fixed]]
where = 'x < 1e-9'
[[load]]
gravity = [0, 0, -9.81]
[time]
scheme = 'backward-euler'
dt = 0.01
end = 0.02
[[cut]]
at = 0.01
sweep = 'blade.obj'
[[probe]]
name = 'tip'
point = [2, 0.5, 0.5]
[[quantity]]
name = 'sag'
mean = 'uz'
where = 'x > 1.999'
";

/// A plate that is clamped and pulled; statics.
pub(crate) const PLANAR: &str = "name = 'plate'
[mesh]
plate = { size = [2, 1], cells = [4, 2] }
[material]
young = 1e5
poisson = 0.3
density = 1000
plane = 'stress'
thickness = 0.1
[[fixed]]
where = 'x < 1e-9'
[[load]]
where = 'x > 1.999'
traction = [10, 0]
[[cut]]
sweep = 'line.obj'
";

/// Cuts [`SOLID`].
pub(crate) const BLADE: &str = "v 1.07 -5 0.51\nv 1.13 5 0.52\nv 1.11 5 5\nv 1.06 -5 5\nf 1 2 3\nf 1 3 4\n";
/// Cuts [`PLANAR`].
pub(crate) const LINE: &str = "v 1.07 0.4 0\nv 1.13 5 0\nl 1 2\n";

/// A mistake: the calls that make it, with the files they find, and what the one line must say.
pub(crate) struct Wrong {
    name: String,
    files: BTreeMap<String, Vec<u8>>,
    calls: Vec<Vec<String>>,
    place: String,
    parts: Vec<String>,
}

impl Wrong {
    /// Calls of the command (words separated by spaces) beside a blade and a line.
    pub(crate) fn calls(name: &str, calls: &[&str]) -> Self {
        let words = |call: &&str| call.split_whitespace().map(str::to_owned).collect();
        let wrong = Wrong {
            name: name.into(),
            files: BTreeMap::new(),
            calls: calls.iter().map(words).collect(),
            place: String::new(),
            parts: Vec::new(),
        };
        wrong.file("blade.obj", BLADE).file("line.obj", LINE)
    }

    /// A scene that `check` and `run` must refuse alike.
    pub(crate) fn scene(name: &str, text: impl Into<Vec<u8>>) -> Self {
        Self::calls(name, &["check scene.toml", "run scene.toml"]).file("scene.toml", text)
    }

    /// Another file in the folder.
    pub(crate) fn file(mut self, name: &str, content: impl Into<Vec<u8>>) -> Self {
        self.files.insert(name.into(), content.into());
        self
    }

    /// What the line begins with after the name of the command: file, line and key; nothing for a call that is none.
    pub(crate) fn at(mut self, place: &str) -> Self {
        self.place = place.into();
        self
    }

    /// What follows: all of these, what is wrong and what is accepted.
    pub(crate) fn says(mut self, parts: &[&str]) -> Self {
        self.parts.extend(parts.iter().map(|p| (*p).to_owned()));
        self
    }

    fn mistakes(&self) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in &self.files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, content).unwrap();
        }
        let before = listing(folder.path());
        let mut mistakes = Vec::new();
        for call in &self.calls {
            let output = kerfem(folder.path(), call);
            let what = self.faults_of(&output).into_iter();
            mistakes.extend(what.map(|w| format!("{} ({}): {w}\n  {}", self.name, call.join(" "), shown(&output))));
            if listing(folder.path()) != before {
                mistakes.push(format!("{} ({}): it wrote something", self.name, call.join(" ")));
            }
        }
        mistakes
    }

    fn faults_of(&self, output: &Output) -> Vec<String> {
        let mut faults = Vec::new();
        if output.status.code() != Some(2) {
            faults.push(format!("exit code {:?}", output.status));
        }
        if !output.stdout.is_empty() {
            faults.push("it printed to stdout".into());
        }
        let Ok(text) = std::str::from_utf8(&output.stderr) else {
            faults.push("stderr is not UTF-8".into());
            return faults;
        };
        let line = text.strip_suffix('\n').unwrap_or(text);
        if line.is_empty() || line.chars().any(char::is_control) || line.chars().count() > 1500 {
            faults.push("not one line that can be read".into());
        }
        let between = if self.place.is_empty() { "" } else { ": " };
        let start = format!("kerfem: {}{between}", self.place);
        match line.strip_prefix(&start) {
            None => faults.push(format!("it does not begin with \"{start}\"")),
            Some(rest) => {
                let missing = self.parts.iter().filter(|p| !rest.contains(*p));
                faults.extend(missing.map(|p| format!("it does not say \"{p}\"")));
            }
        }
        faults
    }
}

/// Calls the command in a folder.
pub(crate) fn kerfem(folder: &Path, arguments: &[String]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kerfem"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

/// All of the cases must be refused, and say what they should.
pub(crate) fn refused(cases: impl IntoIterator<Item = Wrong>) {
    let (mut count, mut mistakes) = (0, Vec::new());
    for case in cases {
        assert!(!case.parts.is_empty(), "{}: nothing is expected", case.name);
        mistakes.extend(case.mistakes());
        count += 1;
    }
    assert!(
        mistakes.is_empty(),
        "{} faults in {count} cases:\n{}",
        mistakes.len(),
        mistakes.join("\n")
    );
    println!("{count} cases");
}

/// A row of a table: a name, a part of a scene and what stands in its place, the place, and what is said.
pub(crate) type Row<'a> = (&'a str, &'a str, &'a str, &'a str, &'a [&'a str]);

/// The cases of a table of changes to a scene.
pub(crate) fn changes<'a>(base: &'a str, rows: &'a [Row<'a>]) -> impl Iterator<Item = Wrong> + 'a {
    rows.iter()
        .map(|(name, from, to, place, parts)| Wrong::scene(name, changed(base, from, to)).at(place).says(parts))
}

/// A scene with its only `from` replaced.
pub(crate) fn changed(base: &str, from: &str, to: &str) -> String {
    assert_eq!(base.matches(from).count(), 1, "{from}");
    base.replacen(from, to, 1)
}

/// A sample of the mesh crate.
pub(crate) fn sample(name: &str) -> Vec<u8> {
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../mesh/tests/samples");
    std::fs::read(samples.join(name)).unwrap()
}

/// Every file below a folder, with what it holds.
fn listing(folder: &Path) -> BTreeMap<PathBuf, Option<Vec<u8>>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(listing(&path));
            all.insert(path, None);
        } else {
            let content = std::fs::read(&path).unwrap();
            all.insert(path, Some(content));
        }
    }
    all
}

fn shown(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    text.chars().take(600).collect::<String>().escape_debug().to_string()
}
