//! What can go wrong, and the exit code it means.

use std::fmt::Display;

use kerfem_cutting::CutError;
use kerfem_fem::FemError;
use kerfem_mesh::io::IoError;

/// Errors of this crate; each prints as one line of at most a thousand characters.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// Something in the scene, in a file it names, or in the arguments of the command is not accepted.
    #[error("{}", one_line(format_args!("{place}: {message}")))]
    Scene {
        /// File, line and key.
        place: String,
        /// What is wrong and what is accepted.
        message: String,
    },
    /// A file could not be read.
    #[error("{}", one_line(.0))]
    Read(IoError),
    /// A result could not be written.
    #[error("{}", one_line(.0))]
    Write(IoError),
    /// The place for results is no folder, or cannot be written to.
    #[error("{}", one_line(format_args!("{}; a folder that can be written to is needed", .0)))]
    Folder(IoError),
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
            EngineError::Scene { .. } | EngineError::Read(_) | EngineError::Folder(_) | EngineError::Cut(_) => 2,
            EngineError::Write(_) | EngineError::Stopped { .. } | EngineError::Fem(_) => 3,
        }
    }
}

/// A text as a message quotes it: of a longer one than `most` characters the beginning.
pub(crate) fn beginning(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

/// A text as one line that can be read: what it quotes may hold line ends, escapes, or megabytes.
fn one_line(text: impl Display) -> String {
    const HEAD: usize = 600;
    const TAIL: usize = 400;
    let text = text.to_string();
    let text = match text.char_indices().nth(HEAD + TAIL) {
        None => text,
        Some(_) => {
            let cut = |(i, _): (usize, char)| i;
            let head = text.char_indices().nth(HEAD).map_or(0, cut);
            let tail = text.char_indices().rev().nth(TAIL - 1).map_or(0, cut);
            format!("{} ... {}", &text[..head], &text[tail..])
        }
    };
    let mut line = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '\r' | '\t' => line.push(' '),
            c if c.is_control() => line.extend(c.escape_default()),
            c => line.push(c),
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn texts_become_lines() {
        assert_eq!(one_line("plain: 1 m³"), "plain: 1 m³");
        assert_eq!(one_line("a\nb\u{1b}[31m\0"), "a b\\u{1b}[31m\\u{0}");
        let long = one_line(format!("begins {}é ends", "é".repeat(5000)));
        assert_eq!(long.chars().count(), 1005);
        assert!(long.starts_with("begins é") && long.contains("é ... é") && long.ends_with("é ends"));
    }
}
