//! Results on disk: frames, surfaces, the table of steps, the report, matrices.

mod frames;
mod modes;
mod series;
mod steps;
mod system;

pub use frames::mesh_writer;
pub(crate) use frames::{FrameList, Frames, write_state};
pub(crate) use modes::ModeFiles;
pub(crate) use steps::StepTable;
pub(crate) use system::export_system;

use std::io;
use std::path::Path;

use kerfem_mesh::io::IoError;

use crate::EngineError;

/// Makes the folder of a run, and makes sure that its files can be written there before anything is.
pub(crate) fn open_folder(path: &Path) -> Result<(), EngineError> {
    let fail = |path: &Path, source: io::Error| {
        let path = path.into();
        Err(EngineError::Folder(IoError::Write { path, source }))
    };
    if let Err(e) = std::fs::create_dir_all(path).and_then(|()| tempfile::tempfile_in(path)) {
        return fail(path, e);
    }
    let frames = path.join("frames");
    if frames.exists() && !frames.is_dir() {
        return fail(&frames, io::ErrorKind::NotADirectory.into());
    }
    let table = path.join("steps.csv");
    if table.is_dir() {
        return fail(&table, io::ErrorKind::IsADirectory.into());
    }
    Ok(())
}

/// Removes a file if it is there.
pub(crate) fn remove_file(path: &Path) -> Result<(), EngineError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(EngineError::Write(IoError::Write {
            path: path.into(),
            source,
        })),
        _ => Ok(()),
    }
}

/// Makes a folder for results and what leads to it.
pub(crate) fn make_folder(path: &Path) -> Result<(), EngineError> {
    std::fs::create_dir_all(path).map_err(|source| {
        EngineError::Write(IoError::Write {
            path: path.into(),
            source,
        })
    })
}
