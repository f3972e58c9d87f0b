//! Every reader on mutated files: no panic, no endless loop, no memory beyond a multiple of the file.
//!
//! `KERFEM_FUZZ_SECONDS` (processor time spent in one reader; default: 300 files each) and `KERFEM_FUZZ_ONLY` (an extension)
//! choose how long and which; `KERFEM_FUZZ_SEED` where to begin. A file that fails is kept, and its name printed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use crate::damaged::{read, samples};
use crate::mutate::{Random, mutate};

/// Words that mean something to a reader.
const WORDS: [&str; 28] = [
    "OFFSETS",
    "CONNECTIVITY",
    "METADATA",
    "FIELD",
    "BINARY",
    "LOOKUP_TABLE",
    "CELL_DATA",
    "POINT_DATA",
    "POINTS",
    "$Nodes",
    "$EndNodes",
    "$Elements",
    "$Entities",
    "End",
    "Tetrahedra",
    "Vertices",
    "Dimension",
    "endsolid",
    "facet",
    "loop",
    "vertex",
    "#",
    "l 1 2",
    "f 1 2 3",
    "</DataArray>",
    "format=\"appended\"",
    "NumberOfComponents=\"0\"",
    "offset=\"99999999\"",
];

/// Of bytes of a file: what a reader may take at most, and a constant for what decoders need. A number of one digit and its
/// separator become two reals of a mesh and its copies; compressed zeros are a thousand times larger than what holds them.
fn most_memory(bytes: &[u8]) -> u64 {
    let compressed = bytes.windows(10).any(|w| w == b"compressor");
    let lzma = bytes.windows(5).any(|w| w == b"vtkLZ");
    let factor = if compressed { 3000 } else { 150 };
    factor * bytes.len() as u64 + if lzma { 160 << 20 } else { 1 << 20 }
}

/// Reads one mutated file; what is wrong with that, in words.
fn attempt(directory: &Path, extension: &str, bytes: &[u8]) -> Result<Duration, String> {
    let clock = Instant::now();
    let mut panicked = false;
    let counted = allocation_counter::measure(|| {
        let result = catch_unwind(AssertUnwindSafe(|| read(directory, extension, bytes)));
        panicked = result.is_err();
        if let Ok(Err(e)) = result {
            assert!(!e.to_string().contains('\n'), "{e}");
        }
    });
    let most = most_memory(bytes);
    match (panicked, counted.bytes_max) {
        (true, _) => Err("a panic".into()),
        (_, peak) if peak > most => Err(format!("{peak} bytes of memory for a file of {}", bytes.len())),
        _ => Ok(clock.elapsed()),
    }
}

#[test]
fn mutated_files_are_read_or_refused_in_bounds() {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let (seconds, only) = (number("KERFEM_FUZZ_SECONDS"), std::env::var("KERFEM_FUZZ_ONLY").ok());
    let directory = tempfile::tempdir().unwrap();
    let samples = samples();
    let mut extensions: Vec<&str> = samples.iter().map(|s| s.1.as_str()).collect();
    extensions.sort_unstable();
    extensions.dedup();
    for extension in extensions.into_iter().filter(|e| only.as_ref().is_none_or(|o| o == e)) {
        let seeds: Vec<Vec<u8>> = samples
            .iter()
            .filter(|s| s.1 == extension)
            .map(|s| s.2.clone())
            .collect();
        let mut random = Random(number("KERFEM_FUZZ_SEED").unwrap_or(0x9e37_79b9));
        let (mut spent, mut count, mut slowest) = (Duration::ZERO, 0, Duration::ZERO);
        while seconds.map_or(count < 300, |s| spent.as_secs() < s) {
            let bytes = mutate(&seeds[random.below(seeds.len())], &seeds, &WORDS, &mut random);
            let outcome = attempt(directory.path(), extension, &bytes);
            // a second is a thousand times what the largest of these files needs
            let outcome = outcome.and_then(|t| match seconds.is_some() && t.as_secs() >= 5 {
                true => Err(format!("{} s", t.as_secs())),
                false => Ok(t),
            });
            match outcome {
                Ok(time) => (spent, slowest) = (spent + time, slowest.max(time)),
                Err(what) => {
                    let kept = std::env::temp_dir().join(format!("kerfem_fuzz.{extension}"));
                    std::fs::write(&kept, &bytes).unwrap();
                    panic!("{extension}: {what}; file {count}, kept as {}", kept.display());
                }
            }
            count += 1;
        }
        println!(
            "{extension}: {count} files in {:.0} s, slowest {:.0} ms",
            spent.as_secs_f64(),
            1e3 * slowest.as_secs_f64()
        );
    }
}
