//! `kerfem modes`.

use std::path::Path;

use kerfem_engine::{EngineError, Scene, modes};

use super::ModesArguments;
use super::arguments::{bad, start_threads};

pub(super) fn modes(arguments: &ModesArguments) -> Result<u8, EngineError> {
    start_threads(arguments.threads)?;
    let scene = Scene::read(&arguments.scene)?;
    let folder = arguments
        .output
        .clone()
        .unwrap_or_else(|| Path::new("out").join(&scene.name));
    let (figures, warnings) = modes::write(scene, arguments.count, &folder).map_err(|e| match e {
        EngineError::Folder(_) if arguments.output.is_some() => bad("--output", e.to_string()),
        e => e,
    })?;
    if arguments.quiet {
        return Ok(0);
    }
    warnings.iter().for_each(|w| eprintln!("kerfem: warning: {w}"));
    let modes = figures.frequencies_hz.iter().zip(&figures.residuals);
    for (number, (frequency, residual)) in (1..).zip(modes) {
        say!("{number:4}  {frequency:.9e} Hz  residual {residual:.1e}");
    }
    say!(
        "{}: {} modes, {} rigid motions",
        folder.display(),
        figures.frequencies_hz.len(),
        figures.rigid
    );
    Ok(0)
}
