//! What the command prints of its own work: `-v`, `-vv`, `-vvv`, or the variable `KERFEM_LOG`.

use kerfem_engine::EngineError;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::prelude::*;

use super::bad;

/// Prints events of the kerfem crates to standard error: from information (1) over each step (2) to each solve (3). The
/// variable `KERFEM_LOG` chooses by module, such as `kerfem_engine::equilibrium=trace`, and goes before.
pub(super) fn start(verbosity: u8) -> Result<(), EngineError> {
    let level = match verbosity {
        0 => LevelFilter::OFF,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    let filter = match std::env::var("KERFEM_LOG") {
        Ok(text) if !text.is_empty() => text.parse::<Targets>().map_err(|e| {
            let message =
                format!("\"{text}\": {e}; a level, or modules with levels such as kerfem_engine=debug, is accepted");
            bad("KERFEM_LOG", message)
        })?,
        _ => Targets::new().with_target("kerfem", level),
    };
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(false);
    // a second start in one process is no harm
    let _ = tracing_subscriber::registry()
        .with(lines.with_filter(filter))
        .try_init();
    Ok(())
}
