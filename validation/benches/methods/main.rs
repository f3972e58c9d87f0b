//! All cutting methods side by side: `cargo bench -p kerfem-validation --bench methods`.
//!
//! Three sections, chosen by name (`-- compare f1 claims`), all by default: `compare` makes the same cuts by every method, with
//! and without quality maintenance, and measures what is left; `f1` cuts ever closer to a layer of vertices (METHODS F1); `claims`
//! prints what the papers of the methods claim beside what is measured here (S14, G6, Y10, Y11).
//!
//! `n=12` chooses how many cells the bodies of `compare` have along a side (default 6), `repeats=5` how often a cut is timed
//! (default 3), `out=DIR` where tables (.md) and pictures (.svg, .png) go (default `out/methods` beside this crate). One thread.

mod cases;
mod claims;
mod compare;
mod f1;
mod measure;

use std::path::PathBuf;

/// What the arguments chose.
pub(crate) struct Settings {
    cells: usize,
    repeats: usize,
    out: PathBuf,
}

type Section = fn(&Settings) -> Result<String, Box<dyn std::error::Error>>;

const SECTIONS: [(&str, Section); 3] = [("compare", compare::run), ("f1", f1::run), ("claims", claims::run)];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global()?;
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let value = |name: &str| arguments.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('='));
    let number = |name: &str, default| value(name).map_or(Ok(default), str::parse::<usize>);
    let settings = Settings {
        cells: number("n", 6)?.max(2),
        repeats: number("repeats", 3)?.max(1),
        out: value("out").map_or_else(
            || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../out/methods")),
            PathBuf::from,
        ),
    };
    std::fs::create_dir_all(&settings.out)?;
    let named: Vec<&String> = arguments.iter().filter(|a| !a.contains('=')).collect();
    if let Some(unknown) = named.iter().find(|a| !SECTIONS.iter().any(|(name, _)| name == **a)) {
        return Err(format!("there is no section \"{unknown}\"; accepted: compare, f1, claims").into());
    }
    for (name, section) in SECTIONS {
        if named.is_empty() || named.iter().any(|a| *a == name) {
            let table = section(&settings)?;
            println!("{table}");
            std::fs::write(settings.out.join(format!("{name}.md")), table)?;
        }
    }
    println!("tables and pictures are in {}", settings.out.display());
    Ok(())
}
