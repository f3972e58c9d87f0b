//! What runs have come to, kept line by line, so that a study that was interrupted goes on.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use kerfem_mesh::io::IoError;
use serde::{Deserialize, Serialize};

use super::spec::Study;
use crate::EngineError;

/// What one run has come to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// Number of its point in the grid.
    pub(super) point: usize,
    pub(super) repeat: usize,
    /// By the clock, files left out.
    pub(super) seconds: f64,
    pub(super) dofs: usize,
    pub(super) cells: usize,
    pub(super) steps: usize,
    pub(super) iterations: usize,
    /// Of each measure that is a number.
    pub(super) values: BTreeMap<String, Option<f64>>,
    /// Why it did not reach its end.
    pub(super) failed: Option<String>,
}

/// What the runs of a study depend on.
#[derive(PartialEq, Serialize, Deserialize)]
struct Head {
    scene: String,
    vary: String,
    measures: String,
}

impl Head {
    fn of(study: &Study) -> Self {
        Head {
            scene: study.scene_text.clone(),
            vary: format!("{:?} {:?}", study.vary, study.together),
            measures: format!("{:?}", study.measure),
        }
    }
}

/// The file of records: a line of JSON each, after a line that says what they are of.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the journal of a study in its folder, and gives back what it holds. A line that was cut short is dropped.
    ///
    /// # Errors
    /// [`EngineError::Scene`] if it is that of another study.
    pub(super) fn open(folder: &Path, study: &Study) -> Result<(Self, Vec<Record>), EngineError> {
        let path = folder.join("runs.jsonl");
        let head = Head::of(study);
        let text = match std::fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(source) => return Err(EngineError::Read(IoError::Read { path, source })),
        };
        let whole = text.split_inclusive('\n').take_while(|l| l.ends_with('\n'));
        let mut kept = 0;
        let mut records = Vec::new();
        for (number, line) in whole.enumerate() {
            if number > 0 {
                let Ok(record) = serde_json::from_str(line) else { break };
                records.push(record);
            } else if serde_json::from_str::<Head>(line).ok() != Some(Head::of(study)) {
                return Err(EngineError::Scene {
                    place: path.display().to_string(),
                    message:
                        "it holds the runs of another study or scene; remove it, or choose another folder with --output"
                            .into(),
                });
            }
            kept += line.len();
        }
        let failed = |source| {
            EngineError::Write(IoError::Write {
                path: path.clone(),
                source,
            })
        };
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(failed)?;
        file.set_len(kept as u64).map_err(failed)?;
        let mut journal = Journal { path, file };
        if kept == 0 {
            journal.line(&head)?;
        }
        Ok((journal, records))
    }

    pub(super) fn add(&mut self, record: &Record) -> Result<(), EngineError> {
        self.line(record)
    }

    fn line(&mut self, what: &impl Serialize) -> Result<(), EngineError> {
        let write = |file: &mut File| {
            let mut line = serde_json::to_vec(what)?;
            line.push(b'\n');
            file.write_all(&line)
        };
        write(&mut self.file).map_err(|source| {
            EngineError::Write(IoError::Write {
                path: self.path.clone(),
                source,
            })
        })
    }
}
