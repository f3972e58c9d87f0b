//! Natural frequencies and modes of a scene: small vibrations about its rest, without loads and damping.
//!
//! The body is that of the scene after the cuts that are due before its first step (all of them in statics), held by its
//! `[[fixed]]`; stiffness is that at rest, mass as `model.mass` says. Pieces that nothing holds move rigidly at no frequency at all:
//! these motions are counted, and left out of the modes.

use std::path::Path;

pub use kerfem_fem::Mode;
use kerfem_mesh::Aabb;
use kerfem_mesh::io::write_atomically;
use serde::Serialize;

use crate::output::{self, ModeFiles};
use crate::supports::free_pieces;
use crate::{AnySimulation, EngineError, MassKind, Scene, Simulation};

/// A mode with a larger residual is told of.
const ROUGH: f64 = 1e-6;

/// The largest displacement of a mode as it is written, as a fraction of the size of the body.
const SHOWN: f64 = 0.1;

/// `modes.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModeFigures {
    /// Natural frequencies (Hz), ascending.
    pub frequencies_hz: Vec<f64>,
    /// `|K x - w² M x| / |K x|` of each.
    pub residuals: Vec<f64>,
    /// Rigid motions that nothing hinders: six of a free body, three in the plane.
    pub rigid: usize,
}

impl<const N: usize> Simulation<N> {
    /// The `count` lowest natural modes of the body at rest, and the number of its free rigid motions; makes the cuts that are
    /// due. There are fewer modes if the body has no more.
    ///
    /// # Errors
    /// [`EngineError::Fem`] if the matrix cannot be factorised; errors of the cuts.
    pub fn modes(&mut self, count: usize) -> Result<(Vec<Mode>, usize), EngineError> {
        self.cut_what_is_due(0.0)?;
        let (mesh, fixed) = (&self.mesh, self.fixed.mask());
        let dofs = fixed.len();
        let pieces = free_pieces(mesh, self.assembler.midpoints(), fixed, &vec![0.0; dofs]);
        let pieces = pieces.map_err(|reason| self.stopped(reason))?;
        let rigid: Vec<Vec<f64>> = pieces.iter().flat_map(|p| p.motion_fields(mesh, dofs)).collect();
        let consistent = self.scene.model.mass == MassKind::Consistent;
        let modes = kerfem_fem::natural_modes(&self.assembler, consistent, fixed, &rigid, count)?;
        Ok((modes, rigid.len()))
    }

    fn write_modes(&mut self, count: usize, folder: &Path) -> Result<ModeFigures, EngineError> {
        output::open_folder(folder)?;
        let (modes, rigid) = self.modes(count)?;
        if modes.len() < count {
            self.warn(format!("the body has {} modes, {count} are asked for", modes.len()));
        }
        if let Some(worst) = modes.iter().map(|m| m.residual).filter(|r| *r > ROUGH).reduce(f64::max) {
            self.warn(format!(
                "modes are not found to the tolerance; residuals are up to {worst:.1e}"
            ));
        }
        let points = self.mesh.cell_ids().flat_map(|c| self.mesh.cell_rest_positions(c));
        let bounds = Aabb::around(points);
        let size = (bounds.max - bounds.min).norm();
        let mut files = ModeFiles::new(folder, &self.scene.name)?;
        for mode in &modes {
            let vectors = mode.shape.as_chunks::<3>().0;
            let largest = vectors.iter().map(|u| u.iter().map(|x| x * x).sum::<f64>().sqrt());
            let factor = SHOWN * size / largest.fold(0.0, f64::max);
            let shown: Vec<f64> = mode.shape.iter().map(|x| factor * x).collect();
            files.add(&self.mesh, self.assembler.midpoints(), &shown)?;
        }
        files.finish()?;
        let figures = ModeFigures {
            frequencies_hz: modes.iter().map(frequency).collect(),
            residuals: modes.iter().map(|m| m.residual).collect(),
            rigid,
        };
        let written = write_atomically(folder.join("modes.json"), |out| {
            serde_json::to_writer_pretty(&mut *out, &figures)?;
            writeln!(out)
        });
        written.map_err(EngineError::Write)?;
        Ok(figures)
    }
}

/// Frequency of a mode (Hz).
fn frequency(mode: &Mode) -> f64 {
    mode.omega_squared.max(0.0).sqrt() / (2.0 * std::f64::consts::PI)
}

/// Writes the `count` lowest natural modes of a scene into a folder: `modes.json`, and each shape as `modes/NAME_000001.vtu`, listed
/// by number in `NAME_modes.pvd`, as a displacement whose largest is a tenth of the size of the body. Returns the figures and the
/// warnings of the scene.
///
/// # Errors
/// [`EngineError`] of the scene, its cuts, the factorisation, or the files.
pub fn write(scene: Scene, count: usize, folder: &Path) -> Result<(ModeFigures, Vec<String>), EngineError> {
    match AnySimulation::new(scene)? {
        AnySimulation::Solid(mut s) => Ok((s.write_modes(count, folder)?, s.warnings)),
        AnySimulation::Planar(mut s) => Ok((s.write_modes(count, folder)?, s.warnings)),
    }
}
