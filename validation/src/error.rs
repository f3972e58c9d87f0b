//! What can go wrong with a reference.

use std::path::PathBuf;

use kerfem_cutting::CutError;
use kerfem_fem::FemError;
use kerfem_mesh::{MeshError, io::IoError};

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
pub enum ValidationError {
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// What a file holds is no mesh.
    #[error("{path}: {problem}")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: MeshError,
    },
    /// A reference lacks an array, or it has another number of components.
    #[error("{path}: point data \"{array}\" with 3 components is needed")]
    Array {
        /// The file.
        path: PathBuf,
        /// The array.
        array: &'static str,
    },
    /// A sweep that cannot be cut with.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// A cut was refused.
    #[error("the cut \"{name}\" was refused: {why}")]
    Refused {
        /// Which cut.
        name: String,
        /// Why.
        why: String,
    },
    /// A mesh that cannot be assembled.
    #[error(transparent)]
    Fem(#[from] FemError),
}
