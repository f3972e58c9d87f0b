//! How the arguments of the command are read, and what is said of one that is not accepted.

use std::path::Path;
use std::time::Duration;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use kerfem_engine::{EngineError, MethodName};

/// Most threads: more than any machine has cores, and few enough to be started.
const MOST_THREADS: usize = 1024;

/// A mistake in the arguments.
pub(super) fn bad(place: impl Into<String>, message: impl Into<String>) -> EngineError {
    EngineError::Scene {
        place: place.into(),
        message: message.into(),
    }
}

/// A number of threads.
pub(super) fn threads(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=MOST_THREADS).contains(n));
    number.ok_or_else(|| format!("\"{text}\" is not accepted; a whole number from 1 to {MOST_THREADS} is needed"))
}

/// Starts so many threads, if it was said how many.
pub(super) fn start_threads(threads: Option<usize>) -> Result<(), EngineError> {
    let Some(threads) = threads else { return Ok(()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|e| bad("--threads", e.to_string()))
}

/// A number of modes.
pub(super) fn count(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|n| (1..=1000).contains(n));
    number.ok_or_else(|| format!("\"{text}\" is not accepted; a whole number from 1 to 1000 is needed"))
}

/// A time (s).
pub(super) fn time(text: &str) -> Result<f64, String> {
    let time = text.parse().ok().filter(|t| *t >= 0.0);
    time.ok_or_else(|| format!("\"{text}\" is not accepted; a time from 0 (s) is needed"))
}

/// Seconds by the clock.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().and_then(|s| Duration::try_from_secs_f64(s).ok());
    seconds.ok_or_else(|| format!("\"{text}\" is not accepted; a number of seconds from 0 is needed"))
}

/// A snapping distance.
pub(super) fn snap(text: &str) -> Result<f64, String> {
    let snap = text.parse().ok().filter(|s| (0.0..=0.45).contains(s));
    snap.ok_or_else(|| format!("\"{text}\" is not accepted; a fraction from 0 to 0.45 is needed"))
}

/// A radius ratio to be reached.
pub(super) fn quality(text: &str) -> Result<f64, String> {
    let quality = text.parse().ok().filter(|q| (0.0..=0.7).contains(q));
    quality.ok_or_else(|| format!("\"{text}\" is not accepted; a radius ratio from 0 to 0.7 is needed"))
}

/// A method of cutting.
pub(super) fn method(text: &str) -> Result<MethodName, String> {
    text.parse()
}

/// Refuses a place where no mesh can be written, before anything is done.
pub(super) fn check_output(path: &Path) -> Result<(), EngineError> {
    let fail = |message: String| Err(bad("--output", format!("{}: {message}", path.display())));
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let needed = "a file in a folder that can be written to is needed";
    match tempfile::tempfile_in(folder) {
        Err(e) => fail(format!("cannot be written: {e}; {needed}")),
        Ok(_) if path.is_dir() => fail(format!("it is a folder; {needed}")),
        Ok(_) => Ok(()),
    }
}

/// What is wrong with arguments that clap does not accept, in one line.
pub(crate) fn mistake(error: &clap::Error) -> String {
    let source = std::error::Error::source(error);
    let text = match (error.kind(), source, error.get(ContextKind::InvalidArg)) {
        (ErrorKind::ValueValidation, Some(reason), Some(ContextValue::String(argument))) => {
            let name = argument.split(' ').next().unwrap_or(argument);
            format!("{name}: {reason}")
        }
        _ => in_one_line(&error.to_string()),
    };
    text.replace(char::is_control, " ")
}

/// What clap says over several lines, without the hint at the help.
fn in_one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim);
    let lines = lines.filter(|l| !l.is_empty() && !l.starts_with("For more information"));
    let mut line = String::new();
    for part in lines {
        let between = if line.is_empty() || line.ends_with(':') {
            " "
        } else {
            "; "
        };
        line = format!("{line}{between}{part}");
    }
    line.trim().trim_start_matches("error: ").to_owned()
}
