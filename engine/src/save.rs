//! Saves: everything that a simulation needs to go on with the same bits, in one file.
//!
//! The file is `kerfem save\n`, the number of the format, of corners of a cell, the length of what follows and its CRC-32,
//! all little-endian, then the content as MessagePack. It needs no other file: sweeps that wait are in it. What follows from
//! the rest (matrices, search tree, masks) is made anew.

use std::borrow::Cow;
use std::path::Path;

use kerfem_fem::PreconditionerKind;
use kerfem_mesh::io::{IoError, write_atomically};
use kerfem_mesh::{CellId, Midpoints, SimplexMesh, VertexId};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::blades::{self, MovingBlade, StoredBlade};
use crate::conditions::{FixedDofs, FixedSet, Loads};
use crate::past::Past;
use crate::pending::{self, StoredCut};
use crate::probes::Probes;
use crate::report::{CutRecord, Seconds, SolverFigures, VerifyFigures};
use crate::scene::source::Source;
use crate::simulation::{Backlog, Parts};
use crate::{AnySimulation, Energies, EngineError, Scene, Scheme, Simulation, State};

const MAGIC: &[u8] = b"kerfem save\n";

/// Number of the format; a change of what is stored is a new one.
const FORMAT: u32 = 5;

/// Length of what stands before the content: magic, format, corners, length, checksum.
const HEAD: usize = MAGIC.len() + 4 + 4 + 8 + 4;

/// The content of a save; `Extra` is for whoever runs the simulation.
#[derive(Serialize, Deserialize)]
#[serde(bound(
    serialize = "Extra: Serialize + Clone",
    deserialize = "Extra: DeserializeOwned + Clone"
))]
struct Content<'a, const N: usize, Extra: Clone> {
    scene: Cow<'a, Scene>,
    source: Cow<'a, Source>,
    mesh: Cow<'a, SimplexMesh<N>>,
    midpoints: Option<Vec<(VertexId, [VertexId; 2])>>,
    regions: Cow<'a, [u32]>,
    fixed: Cow<'a, [FixedSet]>,
    loads: Cow<'a, Loads>,
    probes: Vec<Option<CellId>>,
    state: Cow<'a, State>,
    past: Cow<'a, Past>,
    pending: Vec<StoredCut>,
    backlog: Cow<'a, [Backlog]>,
    blades: Vec<StoredBlade>,
    pinched: Cow<'a, [VertexId]>,
    energies: Energies,
    unbalanced: Cow<'a, [f64]>,
    force_scale: f64,
    balanced: bool,
    solver: f64,
    records_figures: bool,
    verify: Option<VerifyFigures>,
    cuts: Cow<'a, [CutRecord]>,
    unknowns: usize,
    warnings: Cow<'a, [String]>,
    seconds: Seconds,
    solver_figures: SolverFigures,
    extra: Cow<'a, Extra>,
}

impl<const N: usize> Simulation<N> {
    /// Writes a save: whole or not at all. What goes on from it has the same bits, except with the preconditioner "multigrid",
    /// whose levels depend on what came before and are not part of a save.
    ///
    /// # Errors
    /// [`EngineError::Write`].
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), EngineError> {
        self.save_with(path.as_ref(), &())
    }

    /// [`Self::save`] with something to be given back.
    pub(crate) fn save_with<Extra: Serialize + Clone>(&self, path: &Path, extra: &Extra) -> Result<(), EngineError> {
        let content = Content {
            scene: Cow::Borrowed(&self.scene),
            source: Cow::Borrowed(&self.scene.source),
            mesh: Cow::Borrowed(&self.mesh),
            midpoints: self.assembler.midpoints().map(Midpoints::edges),
            regions: Cow::Borrowed(&self.regions),
            fixed: Cow::Borrowed(self.fixed.sets()),
            loads: Cow::Borrowed(&self.loads),
            probes: self.probes.cells(),
            state: Cow::Borrowed(&self.state),
            past: Cow::Borrowed(&self.past),
            pending: self.pending.iter().map(|c| c.stored.clone()).collect(),
            backlog: Cow::Borrowed(&self.backlog),
            blades: self.blades.iter().map(MovingBlade::stored).collect(),
            pinched: Cow::Borrowed(&self.pinched),
            energies: self.energies,
            unbalanced: Cow::Borrowed(self.equilibrium.unbalanced()),
            force_scale: self.equilibrium.force_scale(),
            balanced: self.equilibrium.is_balanced(),
            solver: self.solver.memory(),
            records_figures: self.records_figures,
            verify: self.verify.clone(),
            cuts: Cow::Borrowed(&self.cuts),
            unknowns: self.unknowns,
            warnings: Cow::Borrowed(&self.warnings),
            seconds: self.seconds,
            solver_figures: self.solver_figures,
            extra: Cow::Borrowed(extra),
        };
        let written = write_atomically(path, |out| {
            let bytes = rmp_serde::to_vec(&content).map_err(std::io::Error::other)?;
            out.write_all(MAGIC)?;
            out.write_all(&FORMAT.to_le_bytes())?;
            out.write_all(&(N as u32).to_le_bytes())?;
            out.write_all(&(bytes.len() as u64).to_le_bytes())?;
            out.write_all(&crc32fast::hash(&bytes).to_le_bytes())?;
            out.write_all(&bytes)
        });
        tracing::debug!(path = %path.display(), t = self.state.time, "save");
        written.map_err(EngineError::Write)
    }

    /// A simulation from the content of a save; `adopt` turns the saved scene into the one to go on with.
    fn from_content<Extra: DeserializeOwned + Clone>(
        path: &Path,
        bytes: &[u8],
        adopt: impl FnOnce(Scene) -> Result<Scene, EngineError>,
    ) -> Result<(Self, Extra), EngineError> {
        let damaged = |message: String| refused(path, &message);
        let content: Content<'_, N, Extra> = rmp_serde::from_slice(bytes).map_err(|e| damaged(e.to_string()))?;
        let mut scene = content.scene.into_owned();
        scene.source = content.source.into_owned();
        let scene = adopt(scene)?;
        scene.check()?;
        scene.check_dimension(N - 1)?;
        let mesh = content.mesh.into_owned();
        let (regions, state) = (content.regions.into_owned(), content.state.into_owned());
        let dofs = 3 * mesh.vertex_slots();
        let loads = content.loads.into_owned();
        let fits = regions.len() == mesh.cell_slots()
            && regions.iter().all(|&r| r as usize <= scene.region.len())
            && [state.u.len(), state.v.len(), content.unbalanced.len()] == [dofs; 3]
            && content.past.fits(dofs)
            && state.u.iter().chain(&state.v).all(|x| x.is_finite())
            && content.fixed.len() == scene.fixed.len()
            && loads.len() == scene.load.len()
            && loads.fit(&mesh);
        if !fits {
            return Err(damaged("its parts do not fit each other".into()));
        }
        let midpoints = content.midpoints.map(|edges| Midpoints::restored(&mesh, &edges));
        let midpoints = midpoints.transpose().map_err(damaged)?;
        if midpoints.is_some() != (scene.model.order == 2) {
            return Err(damaged("it is of another order than its scene".into()));
        }
        let parts = Parts {
            fixed: FixedDofs::restored(&scene, content.fixed.into_owned(), &mesh, midpoints.as_ref())
                .map_err(damaged)?,
            probes: Probes::restored(&scene, &mesh, &content.probes).map_err(damaged)?,
            pending: pending::of::<N>(&scene, content.pending)?,
            blades: blades::restored(&scene, content.blades, mesh.vertex_slots()).map_err(damaged)?,
            mesh,
            midpoints,
            regions,
            loads,
            state,
            unknowns: Some(content.unknowns),
        };
        let mut simulation = Self::assembled(scene, parts)?;
        // what another scheme than the next one remembers is of another step than the last
        if simulation.scene.time.scheme == Scheme::Bdf2 {
            simulation.past = content.past.into_owned();
        }
        simulation.backlog = content.backlog.into_owned();
        simulation.pinched = content.pinched.into_owned();
        simulation.energies = content.energies;
        let unbalanced = content.unbalanced.into_owned();
        let equilibrium = &mut simulation.equilibrium;
        equilibrium.recall(unbalanced, content.force_scale, content.balanced);
        simulation.solver.recall(content.solver);
        simulation.records_figures = content.records_figures;
        simulation.verify = content.verify;
        simulation.cuts = content.cuts.into_owned();
        simulation.warnings = content.warnings.into_owned();
        simulation.seconds = content.seconds;
        simulation.solver_figures = content.solver_figures;
        if simulation.solver.options().preconditioner == PreconditionerKind::Multigrid {
            simulation.warn(
                "the levels of multigrid are set up anew after a restart: results agree to the tolerance of the solver, \
                 not to the bit"
                    .into(),
            );
        }
        Ok((simulation, content.extra.into_owned()))
    }
}

impl Simulation {
    /// A simulation of tetrahedra from a save; it goes on with the same bits as the one that was saved.
    ///
    /// # Errors
    /// [`EngineError::Read`] or [`EngineError::Scene`] for a file that is not a whole save of this version, or of a planar
    /// body ([`AnySimulation::restore`] takes both).
    pub fn restore(path: impl AsRef<Path>) -> Result<Self, EngineError> {
        match AnySimulation::restore(path.as_ref())? {
            AnySimulation::Solid(simulation) => Ok(simulation),
            AnySimulation::Planar(_) => Err(refused(path.as_ref(), "it is the save of a planar body")),
        }
    }
}

impl AnySimulation {
    /// [`Simulation::restore`] for either kind.
    ///
    /// # Errors
    /// As there.
    pub fn restore(path: impl AsRef<Path>) -> Result<Self, EngineError> {
        Self::restore_with(path.as_ref(), Ok).map(|(simulation, ())| simulation)
    }

    /// [`Self::restore`] with what [`Simulation::save_with`] was given; `adopt` turns the saved scene into the one to go on
    /// with.
    pub(crate) fn restore_with<Extra: DeserializeOwned + Clone>(
        path: &Path,
        adopt: impl FnOnce(Scene) -> Result<Scene, EngineError>,
    ) -> Result<(Self, Extra), EngineError> {
        let bytes = std::fs::read(path).map_err(|source| {
            EngineError::Read(IoError::Read {
                path: path.into(),
                source,
            })
        })?;
        let (corners, content) = open(&bytes).map_err(|message| refused(path, &message))?;
        Ok(if corners == 4 {
            let (simulation, extra) = Simulation::<4>::from_content(path, content, adopt)?;
            (AnySimulation::Solid(simulation), extra)
        } else {
            let (simulation, extra) = Simulation::<3>::from_content(path, content, adopt)?;
            (AnySimulation::Planar(simulation), extra)
        })
    }
}

/// Corners of a cell, and the content.
fn open(bytes: &[u8]) -> Result<(u32, &[u8]), String> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err("it is not a save of kerfem".into());
    };
    let cut_short = || "the file is cut short".to_owned();
    let (&format, rest) = rest.split_first_chunk().ok_or_else(cut_short)?;
    let format = u32::from_le_bytes(format);
    if format != FORMAT {
        return Err(format!("it is a save of format {format}; this version reads {FORMAT}"));
    }
    let (&corners, rest) = rest.split_first_chunk().ok_or_else(cut_short)?;
    let (&length, rest) = rest.split_first_chunk().ok_or_else(cut_short)?;
    let (&sum, content) = rest.split_first_chunk().ok_or_else(cut_short)?;
    let (length, sum) = (u64::from_le_bytes(length), u32::from_le_bytes(sum));
    if content.len() as u64 != length {
        let found = content.len();
        return Err(format!("{found} bytes follow byte {HEAD} where {length} are announced"));
    }
    if crc32fast::hash(content) != sum {
        return Err("the file is damaged: its checksum differs".into());
    }
    match u32::from_le_bytes(corners) {
        corners @ (3 | 4) => Ok((corners, content)),
        other => Err(format!("its cells have {other} corners; 3 or 4 are accepted")),
    }
}

fn refused(path: &Path, message: &str) -> EngineError {
    // a message may quote what the file holds
    let message: String = message.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    EngineError::Scene {
        place: path.display().to_string(),
        message: format!("{message}; a whole save of this version is needed"),
    }
}
