//! Numbered files of a run, and the `.pvd` that lists them with their times.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use kerfem_mesh::io::{IoError, write_atomically};

use crate::EngineError;

/// The list is written anew with each of the first files, and then with every so many.
const LIST_EVERY: usize = 64;

/// Times (s) and files, relative to the folder of results.
pub(super) type FileList = Vec<(f64, String)>;

/// Files `FOLDER/NAME_000123.ENDING`, where the number is that of the step, and their list.
pub(super) struct Series {
    results: PathBuf,
    name: String,
    kind: Kind,
    written: FileList,
}

/// What a series is made of.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    /// Its folder among the results.
    folder: &'static str,
    ending: &'static str,
    /// What its list is called, after the name of the scene.
    list: &'static str,
}

impl Kind {
    pub(super) const FRAMES: Kind = Kind {
        folder: "frames",
        ending: "vtu",
        list: "",
    };
    pub(super) const MODES: Kind = Kind {
        folder: "modes",
        ending: "vtu",
        list: "_modes",
    };
    pub(super) const SURFACES: Kind = Kind {
        folder: "surface",
        ending: "vtp",
        list: "_surface",
    };

    fn list_path(self, results: &Path, name: &str) -> PathBuf {
        results.join(format!("{name}{}.pvd", self.list))
    }

    /// Removes what an earlier run of the scene left, except `kept`: its files would be taken for this one's.
    pub(super) fn remove_old(self, results: &Path, name: &str, kept: &FileList) -> Result<(), EngineError> {
        let kept: HashSet<&Path> = kept.iter().map(|(_, file)| Path::new(file)).collect();
        let folder = results.join(self.folder);
        let remove = || -> std::io::Result<()> {
            let mut any = false;
            for entry in std::fs::read_dir(&folder)? {
                let entry = entry?;
                let file = entry.file_name().to_string_lossy().into_owned();
                let number = file
                    .strip_prefix(name)
                    .and_then(|f| f.strip_prefix('_'))
                    .and_then(|f| f.strip_suffix(self.ending))
                    .and_then(|f| f.strip_suffix('.'));
                let own = number.is_some_and(|n| n.chars().all(|c| c.is_ascii_digit()));
                if own && !kept.contains(Path::new(self.folder).join(&file).as_path()) {
                    std::fs::remove_file(entry.path())?;
                    any = true;
                }
            }
            match any && kept.is_empty() {
                true => std::fs::remove_file(self.list_path(results, name)),
                false => Ok(()),
            }
        };
        match remove() {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(EngineError::Write(IoError::Write {
                path: folder,
                source: e,
            })),
            _ => Ok(()),
        }
    }
}

impl Series {
    /// A series that goes on from the files `written`, in a folder of its own that is made if need be.
    pub(super) fn new(kind: Kind, results: &Path, name: &str, written: FileList) -> Result<Self, EngineError> {
        super::make_folder(&results.join(kind.folder))?;
        let series = Series {
            results: results.to_owned(),
            name: name.to_owned(),
            kind,
            written,
        };
        // first the list, which must name no file that is not there
        if !series.written.is_empty() {
            series.write_list()?;
        }
        kind.remove_old(results, name, &series.written)?;
        Ok(series)
    }

    /// The files so far.
    pub(super) fn written(&self) -> &FileList {
        &self.written
    }

    /// Lets `write` make the file of a step at a time (s).
    pub(super) fn add(
        &mut self,
        step: usize,
        time: f64,
        write: impl FnOnce(&Path) -> Result<(), EngineError>,
    ) -> Result<(), EngineError> {
        let file = format!("{}/{}_{step:06}.{}", self.kind.folder, self.name, self.kind.ending);
        write(&self.results.join(&file))?;
        tracing::debug!(file, t = time, "written");
        self.written.push((time, file));
        if self.written.len() <= LIST_EVERY || self.written.len().is_multiple_of(LIST_EVERY) {
            self.write_list()?;
        }
        Ok(())
    }

    /// Writes the list.
    pub(super) fn write_list(&self) -> Result<(), EngineError> {
        let written = write_atomically(self.kind.list_path(&self.results, &self.name), |out| {
            writeln!(out, "<?xml version=\"1.0\"?>")?;
            writeln!(
                out,
                "<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>"
            )?;
            for (time, file) in &self.written {
                writeln!(
                    out,
                    "<DataSet timestep=\"{time}\" part=\"0\" file=\"{}\"/>",
                    escaped(file)
                )?;
            }
            writeln!(out, "</Collection>\n</VTKFile>")
        });
        written.map_err(EngineError::Write)
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
