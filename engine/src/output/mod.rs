//! Results on disk: frames, surfaces, the table of steps, the report, matrices.

mod frames;
mod series;
mod steps;
mod system;

pub use frames::mesh_writer;
pub(crate) use frames::{FrameList, Frames, write_state};
pub(crate) use steps::StepTable;
pub(crate) use system::export_system;

use std::path::Path;

use kerfem_mesh::io::IoError;

use crate::EngineError;

/// Makes a folder for results and what leads to it.
pub(crate) fn make_folder(path: &Path) -> Result<(), EngineError> {
    std::fs::create_dir_all(path).map_err(|source| {
        EngineError::Write(IoError::Write {
            path: path.into(),
            source,
        })
    })
}
