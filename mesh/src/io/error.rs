//! What can be wrong with a file.

use std::path::{Path, PathBuf};

/// Why a file could not be read or written: one line that names the file, the place, what is wrong and what is accepted.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The file could not be opened or read.
    #[error("{}: cannot be read: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file could not be written.
    #[error("{}: cannot be written: {source}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The extension names no format that is read.
    #[error("{}: {what} is read from {accepted} files", .path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What should be read.
        what: &'static str,
        /// The extensions that are accepted.
        accepted: String,
    },
    /// The content is wrong.
    #[error("{}: {place}: {problem}", .path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Line, section or array.
        place: String,
        /// What is wrong there, and what is accepted.
        problem: String,
    },
    /// An array that should be written does not fit its grid.
    #[error("{}: array '{array}': {problem}", .path.display())]
    Array {
        /// The file.
        path: PathBuf,
        /// Name of the array.
        array: String,
        /// What does not fit.
        problem: String,
    },
}

impl IoError {
    pub(super) fn extension(path: &Path, what: &'static str, accepted: &[&str]) -> Self {
        IoError::Extension {
            path: path.into(),
            what,
            accepted: accepted.join(", "),
        }
    }
}

/// What is wrong where in the bytes of a file.
#[derive(Debug)]
pub(super) struct Problem {
    place: String,
    problem: String,
}

impl Problem {
    pub(super) fn new(place: impl Into<String>, problem: impl Into<String>) -> Self {
        // what a damaged file says may hold line ends
        let one_line = |text: String| text.replace(char::is_control, " ");
        Problem {
            place: one_line(place.into()),
            problem: one_line(problem.into()),
        }
    }

    pub(super) fn in_file(self, path: &Path) -> IoError {
        IoError::Content {
            path: path.into(),
            place: self.place,
            problem: self.problem,
        }
    }
}
