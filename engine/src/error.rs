//! What can go wrong, and the exit code it means.

use kerfem_cutting::CutError;
use kerfem_fem::FemError;
use kerfem_mesh::io::IoError;

/// Errors of this crate; each prints as one line.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// Something in the scene, or in a file it names, is not accepted.
    #[error("{place}: {message}")]
    Scene {
        /// File, line and key.
        place: String,
        /// What is wrong and what is accepted.
        message: String,
    },
    /// A file could not be read.
    #[error("{0}")]
    Read(IoError),
    /// A result could not be written.
    #[error("{0}")]
    Write(IoError),
    /// The simulation cannot go on.
    #[error("stopped at t = {time} s: {reason}")]
    Stopped {
        /// Time of the last finished step (s).
        time: f64,
        /// Why, and where in the mesh.
        reason: String,
    },
    /// A surface that cannot be cut with.
    #[error("the sweep is not accepted: {0}")]
    Cut(#[from] CutError),
    /// Numbers that the elements or the solvers do not accept.
    #[error("{0}")]
    Fem(#[from] FemError),
}

impl EngineError {
    /// Exit code of the command: 2 for input that is not accepted, 3 where the simulation could not go on.
    pub fn exit_code(&self) -> u8 {
        match self {
            EngineError::Scene { .. } | EngineError::Read(_) | EngineError::Cut(_) => 2,
            EngineError::Write(_) | EngineError::Stopped { .. } | EngineError::Fem(_) => 3,
        }
    }
}
