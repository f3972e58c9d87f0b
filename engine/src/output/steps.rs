//! `steps.csv`: one row a step, complete lines only.

use std::fs::File;
use std::path::{Path, PathBuf};

use kerfem_mesh::io::IoError;

use crate::{EngineError, Simulation, StepInfo};

const COLUMNS: [&str; 16] = [
    "step",
    "t",
    "dt",
    "cells",
    "vertices",
    "dofs",
    "iterations",
    "residual",
    "kinetic_J",
    "elastic_J",
    "potential_J",
    "dissipated_J",
    "assemble_s",
    "solve_s",
    "cut_s",
    "write_s",
];

/// The table of steps, open for the length of a run.
pub(crate) struct StepTable {
    path: PathBuf,
    rows: csv::Writer<File>,
}

impl StepTable {
    /// The table of an earlier run, cut back to its first `bytes`, to be gone on with.
    pub(crate) fn resumed(folder: &Path, bytes: u64) -> Result<Self, EngineError> {
        let path = folder.join("steps.csv");
        let open = || {
            let file = File::options().append(true).open(&path)?;
            if file.metadata()?.len() < bytes {
                return Err(std::io::Error::other(format!(
                    "it is shorter than when it was saved ({bytes} bytes)"
                )));
            }
            file.set_len(bytes)?;
            Ok(file)
        };
        let file = open().map_err(|e| failed(&path, e))?;
        Ok(StepTable {
            rows: csv::Writer::from_writer(file),
            path,
        })
    }

    /// Length of the file (bytes).
    pub(crate) fn bytes(&self) -> Result<u64, EngineError> {
        let length = self.rows.get_ref().metadata().map(|m| m.len());
        length.map_err(|e| failed(&self.path, e))
    }

    pub(crate) fn new<const N: usize>(folder: &Path, simulation: &Simulation<N>) -> Result<Self, EngineError> {
        let path = folder.join("steps.csv");
        let file = File::create(&path).map_err(|e| failed(&path, e))?;
        let mut table = StepTable {
            rows: csv::Writer::from_writer(file),
            path,
        };
        let probes = simulation
            .probes
            .names()
            .flat_map(|n| ["x", "y", "z"].map(|axis| format!("probe.{n}.{axis}")));
        table.write(COLUMNS.map(str::to_owned).into_iter().chain(probes))?;
        Ok(table)
    }

    /// Adds the row of a step; probes give displacements (m).
    pub(crate) fn add<const N: usize>(
        &mut self,
        s: &Simulation<N>,
        info: &StepInfo,
        write_seconds: f64,
    ) -> Result<(), EngineError> {
        let vertices = s.mesh.num_vertices();
        let counts = [s.mesh.num_cells(), vertices, (N - 1) * vertices, info.iterations];
        let e = info.energies;
        let seconds = [
            info.assemble_seconds,
            info.solve_seconds,
            info.cut_seconds,
            write_seconds,
        ];
        let row = std::iter::once(info.step.to_string())
            .chain([info.time, info.dt].map(|x| x.to_string()))
            .chain(counts.map(|n| n.to_string()))
            .chain([info.residual, e.kinetic, e.elastic, e.potential, e.dissipated].map(|x| format!("{x:e}")))
            .chain(seconds.map(|x| format!("{x:.6}")))
            .chain(
                s.probes
                    .values(&s.mesh, &s.assembler, &s.state.u)
                    .map(|x| format!("{x:e}")),
            );
        self.write(row.collect::<Vec<_>>())
    }

    fn write(&mut self, row: impl IntoIterator<Item = String>) -> Result<(), EngineError> {
        self.rows
            .write_record(row)
            .map_err(|e| failed(&self.path, std::io::Error::other(e)))?;
        self.rows.flush().map_err(|e| failed(&self.path, e))
    }
}

fn failed(path: &Path, source: std::io::Error) -> EngineError {
    EngineError::Write(IoError::Write {
        path: path.into(),
        source,
    })
}
