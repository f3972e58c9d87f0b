//! Mutated scenes: read, checked, and where they are accepted stepped once. No panic, no endless loop, no memory beyond what
//! the text and the mesh ask for, and every refusal one line.
//!
//! `KERFEM_FUZZ_SECONDS` (default: 2000 scenes) chooses how long, `KERFEM_FUZZ_SEED` where to begin. A scene that fails is
//! kept, and its name printed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use kerfem_engine::{AnySimulation, EngineError, Scene};

use super::harness::{BLADE, LINE, PLANAR, SOLID};
use super::mutate::{Random, WILD, mutate};

/// A scene of a mesh file with a group, and of most keys that there are.
const RICH: &str = "name = \"rich\"
[mesh]
file = \"groups.msh\"
scale = 0.5
[material]
young = 5.0e3
poisson = 0.45
density = 1050.0
damping = { mass = 0.1, stiffness = 0.0 }
[[region]]
group = \"tumour\"
young = 2.0e4
[[region]]
where = \"x + y > 0.2\"
density = 900
[model]
kind = \"linear\"
mass = \"consistent\"
order = 1
locking = \"none\"
accuracy = 0.01
[[fixed]]
group = \"clamped\"
axes = \"xz\"
displacement = [\"0.1 * min(t, 0.4)\", \"if(x > 1 && y < 2, 3, 4)\"]
[[fixed]]
vertices = [0, 2]
[[load]]
facets = [[0, 1, 2]]
pressure = \"50 * sin(2 * pi * t)\"
[[load]]
vertices = [4]
force = [0, 0, \"t\"]
[[load]]
group = \"clamped\"
traction = [\"x\", \"y^2\", 1]
[initial]
velocity = [\"y\", \"-x\", 0]
displacement = { file = \"fields.vtu\", array = \"u0\" }
[time]
scheme = \"midpoint\"
dt = 1e-3
end = 1.0
nonlinear = \"one-step\"
[solver]
kind = \"cg\"
preconditioner = \"block-jacobi\"
tolerance = 1e-6
max_iterations = 50
[[cut]]
at = 0.2
method = \"snap\"
sweep = \"blade.obj\"
frame = \"rest\"
snap = 0.1
[[probe]]
name = \"p\"
point = [0.1, 0.1, 0.1]
[[quantity]]
name = \"a\"
max = \"ux\"
[[quantity]]
name = \"b\"
reaction = \"z\"
where = \"x < 1e-9\"
[[quantity]]
name = \"c\"
point = [0.1, 0.1, 0.1]
component = \"uy\"
[output]
every = 0.02
fields = [\"von_mises\", \"stress\", \"region\"]
";

const BALL: &str = "name = 'ball'\nmesh = { ball = { radius = 1, layers = 1, center = [0, 0, 1] } }\n\
    material = { young = 1, poisson = 0, density = 1 }\nfixed = [{ where = 'z < 0.5' }]\nload = [{ gravity = [0, 0, -1] }]\n";

/// Words that mean something in a scene.
const WORDS: [&str; 60] = [
    "[mesh]",
    "[material]",
    "[[fixed]]",
    "[[load]]",
    "[time]",
    "[[cut]]",
    "[[probe]]",
    "[[quantity]]",
    "[[region]]",
    "[initial]",
    "[solver]",
    "[output]",
    "[model]",
    "[fixed]",
    "file",
    "box",
    "plate",
    "ball",
    "layers",
    "size",
    "cells",
    "origin",
    "scale",
    "young",
    "poisson",
    "density",
    "where",
    "vertices",
    "group",
    "facets",
    "axes",
    "displacement",
    "gravity",
    "traction",
    "pressure",
    "force",
    "scheme",
    "dt",
    "end",
    "sweep",
    "snap",
    "at",
    "mean",
    "max",
    "reaction",
    "energy",
    "point",
    "component",
    "t",
    "x <",
    "sqrt(",
    "if(",
    "&&",
    "^",
    "1/0",
    "'''",
    "\"",
    "{ ",
    "[[",
    "= ",
];

/// What a key may be given in place of its value.
const VALUES: [&str; 42] = [
    "0",
    "-1",
    "1",
    "1e300",
    "1e-300",
    "-0.0",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "9223372036854775807",
    "true",
    "''",
    "'x'",
    "'x < 1'",
    "'t'",
    "'1/0'",
    "'x < t'",
    "'sqrt(-1)'",
    "[]",
    "[0]",
    "[0, 0, 0]",
    "[1, 2]",
    "['x', 'y', 'z']",
    "[[0, 1, 2]]",
    "{}",
    "{ file = 'fields.vtu', array = 'u0' }",
    "'static'",
    "'evaluate'",
    "'midpoint'",
    "'bdf2'",
    "'central-difference'",
    "'linear'",
    "'uz'",
    "'z'",
    "'blade.obj'",
    "'line.obj'",
    "'groups.msh'",
    "'fields.vtu'",
    "'clamped'",
    "'xyz'",
    "1979-05-27",
];

/// A scene with one or two lines doubled, removed, exchanged, taken from another, or given another value.
fn mutate_lines(text: &str, others: &[String], random: &mut Random) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..1 + random.below(2) {
        if lines.is_empty() {
            break;
        }
        let (i, j) = (random.below(lines.len()), random.below(lines.len()));
        match random.below(6) {
            0 => drop(lines.remove(i)),
            1 => lines.insert(j, lines[i].clone()),
            2 => lines.swap(i, j),
            3 => {
                let other: Vec<&str> = others[random.below(others.len())].lines().collect();
                let from = random.below(other.len());
                let to = (from + 1 + random.below(4)).min(other.len());
                lines.splice(i..i, other[from..to].iter().map(|l| (*l).to_owned()));
            }
            _ => {
                if let Some((key, _)) = lines[i].split_once('=') {
                    let value = match random.below(3) {
                        0 => WILD[random.below(WILD.len())],
                        _ => VALUES[random.below(VALUES.len())],
                    };
                    lines[i] = format!("{key}= {value}");
                }
            }
        }
    }
    lines.join("\n")
}

/// Whether a scene is small enough to be built many times a second; how large meshes may be is checked elsewhere.
fn is_small(scene: &Scene) -> bool {
    let mesh = &scene.mesh;
    let cells = mesh
        .r#box
        .iter()
        .flat_map(|b| b.cells)
        .chain(mesh.plate.iter().flat_map(|p| p.cells));
    cells.map(|n| n as f64).product::<f64>() <= 60.0 && mesh.ball.as_ref().is_none_or(|b| b.layers <= 2)
}

/// Reads a scene and builds what it says; nothing for one that is too large.
fn build(folder: &Path, text: &str) -> Result<Option<(AnySimulation, f64)>, EngineError> {
    let mut scene = Scene::parse(text, folder.join("scene.toml"))?;
    if !is_small(&scene) {
        return Ok(None);
    }
    scene.solver.max_iterations = scene.solver.max_iterations.min(100);
    let dt = scene.time.dt.or(scene.time.end).unwrap_or(0.0);
    AnySimulation::new(scene).map(|simulation| Some((simulation, dt)))
}

/// One step; whether it could be made.
fn step((simulation, dt): (AnySimulation, f64)) -> Result<(), EngineError> {
    match simulation {
        AnySimulation::Solid(mut s) => s.step(dt).map(drop),
        AnySimulation::Planar(mut s) => s.step(dt).map(drop),
    }
}

/// How a scene was taken.
#[derive(Clone, Copy, Debug, Default)]
struct Taken {
    accepted: bool,
    /// How long it took to read, check and build; a step under absurd loads may take longer.
    reading: Duration,
    all: Duration,
}

/// What is wrong with how a scene is taken, in words.
fn attempt(folder: &Path, text: &str) -> Result<Taken, String> {
    let clock = Instant::now();
    let mut taken = Taken::default();
    let mut tried = Ok(Ok(()));
    let counted = allocation_counter::measure(|| {
        tried = catch_unwind(AssertUnwindSafe(|| {
            let built = build(folder, text);
            taken.reading = clock.elapsed();
            taken.accepted = matches!(built, Ok(Some(_)));
            built?.map_or(Ok(()), step)
        }));
    });
    taken.all = clock.elapsed();
    let most = 400 * text.len() as u64 + (8 << 20);
    if counted.bytes_max > most {
        return Err(format!(
            "{} bytes of memory for a scene of {}",
            counted.bytes_max,
            text.len()
        ));
    }
    let Err(error) = tried.map_err(|_| "a panic")? else {
        return Ok(taken);
    };
    match error.to_string() {
        line if line.chars().any(char::is_control) || line.chars().count() > 1100 => Err(format!("no line: {line:?}")),
        line if error.exit_code() == 3 && !line.starts_with("stopped at t = ") => Err(format!("exit code 3: {line}")),
        _ => Ok(taken),
    }
}

#[test]
fn mutated_scenes_are_taken_or_refused_in_bounds() {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let seconds = number("KERFEM_FUZZ_SECONDS");
    let folder = tempfile::tempdir().unwrap();
    let fields = super::meshes::vtu_with_array("u0", &["0 0 0"; 5]);
    for (name, content) in [
        ("blade.obj", BLADE),
        ("line.obj", LINE),
        ("groups.msh", super::selections::GROUPS),
        ("fields.vtu", &fields),
    ] {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    let mut seeds: Vec<String> = [SOLID, PLANAR, RICH, BALL].map(str::to_owned).to_vec();
    for seed in &seeds {
        // the first time, the libraries of the solver take what they keep: 64 MiB
        let _ = attempt(folder.path(), seed);
        let taken = attempt(folder.path(), seed);
        assert!(taken.as_ref().is_ok_and(|t| t.accepted), "{seed}: {taken:?}");
    }
    seeds.extend(super::wrong_scenes());
    let bytes: Vec<Vec<u8>> = seeds.iter().map(|s| s.clone().into_bytes()).collect();
    let mut random = Random(number("KERFEM_FUZZ_SEED").unwrap_or(0x9e37_79b9));
    let (mut spent, mut count, mut accepted, mut slowest) = (Duration::ZERO, 0, 0, Duration::ZERO);
    while seconds.map_or(count < 2000, |s| spent.as_secs() < s) {
        // half begin with a scene that is accepted
        let among = if random.below(2) == 0 { 4 } else { seeds.len() };
        let k = random.below(among);
        let text = match random.below(3) {
            0 => String::from_utf8_lossy(&mutate(&bytes[k], &bytes, &WORDS, &mut random)).into_owned(),
            _ => mutate_lines(&seeds[k], &seeds, &mut random),
        };
        let outcome = attempt(folder.path(), &text).and_then(|taken| match taken.reading.as_secs() {
            s if seconds.is_some() && s >= 5 => Err(format!("{s} s")),
            _ => Ok(taken),
        });
        match outcome {
            Ok(taken) => {
                (spent, slowest) = (spent + taken.all, slowest.max(taken.reading));
                accepted += usize::from(taken.accepted);
            }
            Err(what) => {
                let kept = std::env::temp_dir().join("kerfem_fuzz.toml");
                std::fs::write(&kept, &text).unwrap();
                panic!("{what}; scene {count}, kept as {}", kept.display());
            }
        }
        count += 1;
    }
    println!(
        "{count} scenes, {accepted} of them accepted, in {:.0} s, slowest to be read {:.0} ms",
        spent.as_secs_f64(),
        1e3 * slowest.as_secs_f64()
    );
}
