//! A body in motion that can be cut: the frame, readable in one place ([`Simulation::step`]).

use std::time::Instant;

use kerfem_cutting::{Borders, CutOptions, CutOutcome, Sweep};
use kerfem_fem::{Assembler, LinearSolver, Material, Model};
use kerfem_mesh::{CellId, Midpoints, Point, SimplexMesh, VertexId};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::audit::pinched_vertices;
use crate::blades::{self, MovingBlade};
use crate::choices::{self, Choices};
use crate::conditions::{FixedDofs, Loads};
use crate::cutter::Cutter;
use crate::energies::Energies;
use crate::equilibrium::{Body, Equilibrium};
use crate::explicit::Explicit;
use crate::input::{self, AnyInput, MeshInput};
use crate::momentum::{self, Inertia};
use crate::past::Past;
use crate::pending::{self, PendingCut};
use crate::probes::Probes;
use crate::report::{CutRecord, Seconds, SolverFigures, VerifyFigures};
use crate::state::{nodal, set_nodal};
use crate::{EngineError, Frame, InitialField, Scene, Scheme, State};

/// How a step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepInfo {
    /// Steps done, this one included.
    pub step: usize,
    /// Time at its end (s).
    pub time: f64,
    /// Its length (s).
    pub dt: f64,
    /// Iterations of the linear solver; of "central-difference", which solves nothing, the steps this one was made of.
    pub iterations: usize,
    /// Newton steps.
    pub newton_steps: usize,
    /// True residual of the equations, relative to the sum of the norms of the forces in them.
    pub residual: f64,
    /// Whether the residual is within the tolerance of the scene, or as small as rounding allows.
    pub converged: bool,
    /// Energies at its end.
    pub energies: Energies,
    /// Seconds spent on matrices, forces and energies.
    pub assemble_seconds: f64,
    /// Seconds spent in the linear solver.
    pub solve_seconds: f64,
    /// Seconds spent on cuts before the step.
    pub cut_seconds: f64,
}

/// A scene being run: mesh, matrices, state, and everything that must follow a cut.
///
/// The body is made of tetrahedra, or, for `N = 3`, of triangles in the plane z = 0: then everything nodal still has three
/// components, and those along z are zero.
#[derive(Debug)]
pub struct Simulation<const N: usize = 4> {
    pub(crate) scene: Scene,
    pub(crate) mesh: SimplexMesh<N>,
    pub(crate) regions: Vec<u32>,
    pub(crate) assembler: Assembler<N>,
    pub(crate) model: Model,
    pub(crate) fixed: FixedDofs<N>,
    pub(crate) loads: Loads,
    pub(crate) probes: Probes<N>,
    pub(crate) state: State,
    /// What "bdf2" remembers.
    pub(crate) past: Past,
    pub(crate) explicit: Explicit,
    pub(crate) energies: Energies,
    pub(crate) equilibrium: Equilibrium,
    pub(crate) solver: LinearSolver,
    pub(crate) buffers: Buffers,
    pub(crate) cutter: Cutter,
    pub(crate) pending: Vec<PendingCut>,
    /// Bad cells that cuts have left over, for later steps.
    pub(crate) backlog: Vec<Backlog>,
    pub(crate) blades: Vec<MovingBlade>,
    /// Vertices that join cells by a point only in the mesh as read, ascending.
    pub(crate) pinched: Vec<VertexId>,
    /// Compares whole-mesh figures before and after each cut; costs work proportional to the mesh.
    pub(crate) records_figures: bool,
    pub(crate) verify: Option<VerifyFigures>,
    pub(crate) cuts: Vec<CutRecord>,
    pub(crate) choices: Choices,
    /// Free dofs when the simulation was made, which its choices went by.
    pub(crate) unknowns: usize,
    pub(crate) warnings: Vec<String>,
    pub(crate) seconds: Seconds,
    pub(crate) solver_figures: SolverFigures,
}

/// What a simulation is assembled from, besides its scene.
pub(crate) struct Parts<const N: usize> {
    pub(crate) mesh: SimplexMesh<N>,
    /// Of order 2.
    pub(crate) midpoints: Option<Midpoints<N>>,
    pub(crate) regions: Vec<u32>,
    pub(crate) fixed: FixedDofs<N>,
    pub(crate) loads: Loads,
    pub(crate) probes: Probes<N>,
    pub(crate) state: State,
    pub(crate) pending: Vec<PendingCut>,
    pub(crate) blades: Vec<MovingBlade>,
    /// See [`Simulation::unknowns`]; none: those there are now.
    pub(crate) unknowns: Option<usize>,
}

/// Nodal vectors of a step, kept so that a warm step allocates nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Buffers {
    /// External load (N) at the time it was last computed for, until a cut.
    pub(crate) load: Vec<f64>,
    pub(crate) load_time: Option<f64>,
    /// The load whose work is counted over the step (N).
    pub(crate) mean_load: Vec<f64>,
    /// What balances internal forces, besides inertia and damping (N).
    pub(crate) force: Vec<f64>,
    /// Prescribed displacements (m) on fixed dofs.
    pub(crate) prescribed: Vec<f64>,
    /// Displacements (m) and velocities (m/s) that the step sets out from.
    pub(crate) start: Vec<f64>,
    pub(crate) speed: Vec<f64>,
    /// Velocities (m/s) of fixed dofs at the end of the step.
    pub(crate) support_speed: Vec<f64>,
    /// Where inertia alone leads (m).
    pub(crate) target: Vec<f64>,
    /// Solution of a step (m).
    pub(crate) solution: Vec<f64>,
    pub(crate) scratch: Vec<f64>,
}

impl Buffers {
    fn resize(&mut self, dofs: usize) {
        for field in [
            &mut self.load,
            &mut self.mean_load,
            &mut self.force,
            &mut self.start,
            &mut self.speed,
            &mut self.support_speed,
            &mut self.prescribed,
            &mut self.target,
            &mut self.solution,
            &mut self.scratch,
        ] {
            field.resize(dofs, 0.0);
        }
        self.load_time = None;
    }
}

impl Simulation {
    /// Reads the files of a scene, finds what it selects, assembles.
    ///
    /// # Errors
    /// [`EngineError::Scene`] or [`EngineError::Read`] for the first thing that is not accepted; also for a planar mesh, see
    /// [`Simulation::planar`].
    pub fn new(scene: Scene) -> Result<Self, EngineError> {
        let input = MeshInput::read(&scene.mesh, &scene.source)?;
        Self::of(scene, input)
    }
}

impl Simulation<3> {
    /// [`Simulation::new`] for a scene whose mesh is made of triangles in the plane z = 0.
    ///
    /// # Errors
    /// [`EngineError::Scene`] or [`EngineError::Read`] for the first thing that is not accepted; also for tetrahedra.
    pub fn planar(scene: Scene) -> Result<Self, EngineError> {
        let input = MeshInput::read_planar(&scene.mesh, &scene.source)?;
        Self::of(scene, input)
    }
}

/// A simulation of either kind: which one is for the mesh of the scene to say.
#[derive(Debug)]
pub enum AnySimulation {
    /// Of tetrahedra.
    Solid(Simulation),
    /// Of triangles in the plane.
    Planar(Simulation<3>),
}

impl AnySimulation {
    /// [`Simulation::new`] or [`Simulation::planar`], whichever fits the mesh.
    ///
    /// # Errors
    /// As these, for the first thing that is not accepted.
    pub fn new(scene: Scene) -> Result<Self, EngineError> {
        Ok(match AnyInput::read(&scene.mesh, &scene.source)? {
            AnyInput::Solid(input) => AnySimulation::Solid(Simulation::of(scene, input)?),
            AnyInput::Planar(input) => AnySimulation::Planar(Simulation::of(scene, input)?),
        })
    }
}

impl<const N: usize> Simulation<N> {
    fn of(scene: Scene, input: MeshInput<N>) -> Result<Self, EngineError> {
        scene.check_dimension(N - 1)?;
        let mut parts = Parts {
            regions: region_of_cells(&scene, &input)?,
            fixed: FixedDofs::new(&scene, &input)?,
            loads: Loads::new(&scene, &input)?,
            probes: Probes::new(&scene, &input.mesh)?,
            state: initial_state(&scene, input.mesh.rest_positions(), N - 1)?,
            pending: pending::read::<N>(&scene)?,
            blades: blades::of(&scene)?,
            mesh: input.mesh,
            midpoints: None,
            unknowns: None,
        };
        if scene.model.order == 2 {
            parts.midpoints = Some(parts.add_midpoints(&scene)?);
        }
        let mut simulation = Self::assembled(scene, parts)?;
        let (scene, mesh) = (&simulation.scene, &simulation.mesh);
        simulation.loads.check_values(scene, mesh, &simulation.assembler)?;
        let conflicts = simulation.fixed.conflicts(scene, mesh);
        simulation.warnings.splice(..0, conflicts);
        let late = simulation.late_cuts();
        simulation.warnings.extend(late);
        simulation.pinched = pinched_vertices(&simulation.mesh).collect();
        if let Some(v) = simulation.pinched.first() {
            let count = simulation.pinched.len();
            simulation.warn(format!(
                "{count} vertices of the mesh join cells by a point only, vertex {} first; a cut that passes one parts them",
                v.0
            ));
        }
        let frames = simulation.pending.iter().map(|c| c.frame);
        if let Some(first) = frames.chain(simulation.blades.iter().map(|b| b.frame)).next() {
            simulation.cutter.prepare(&simulation.mesh, &simulation.state.u, first);
        }
        simulation.check_quantities()?;
        simulation.measure_energies()?;
        Ok(simulation)
    }

    /// A simulation of what is given, assembled; nothing has been measured yet.
    pub(crate) fn assembled(scene: Scene, parts: Parts<N>) -> Result<Self, EngineError> {
        let (mesh, regions) = (parts.mesh, parts.regions);
        let materials = materials::<N>(&scene)?;
        let mut choices = Choices::new();
        let model = choices::model(&scene, &mut choices);
        let locking = choices::locking::<N>(&scene, &materials, &mut choices);
        let material_of = |c: CellId| materials[regions[c.index()] as usize];
        let assembler = match parts.midpoints {
            Some(midpoints) => Assembler::quadratic(&mesh, midpoints, material_of),
            None => Assembler::with_cure(&mesh, locking, material_of),
        };
        let assembler = assembler.map_err(|e| scene.source.error("mesh", 0, "", e.to_string()))?;
        let free = || parts.fixed.mask().iter().filter(|f| !**f).count();
        let unknowns = parts.unknowns.unwrap_or_else(free);
        let solver = choices::solver(&scene, model, unknowns, &mut choices);
        let mut simulation = Simulation {
            equilibrium: Equilibrium::new(&assembler),
            mesh,
            regions,
            assembler,
            model,
            fixed: parts.fixed,
            loads: parts.loads,
            probes: parts.probes,
            state: parts.state,
            past: Past::default(),
            explicit: Explicit::default(),
            energies: Energies::default(),
            solver,
            buffers: Buffers::default(),
            cutter: Cutter::default(),
            warnings: parts.pending.iter().flat_map(|c| c.warnings.clone()).collect(),
            pending: parts.pending,
            backlog: Vec::new(),
            blades: parts.blades,
            pinched: Vec::new(),
            records_figures: false,
            verify: None,
            cuts: Vec::new(),
            choices,
            seconds: Seconds::default(),
            solver_figures: SolverFigures::default(),
            unknowns,
            scene,
        };
        simulation.buffers.resize(simulation.state.u.len());
        tracing::info!(
            vertices = simulation.mesh.num_vertices(),
            cells = simulation.mesh.num_cells(),
            unknowns,
            regions = simulation.scene.region.len(),
            "assembled"
        );
        for (key, choice) in &simulation.choices {
            tracing::info!("{key} = auto: {} ({})", choice.chosen, choice.why);
        }
        Ok(simulation)
    }

    /// One frame: the cuts that are due, then one step of the scene's scheme.
    ///
    /// A cut is due before the first step with `t >= at - 1e-9 dt`, and a blade sweeps what it moves until `t + dt`; statics
    /// and "evaluate" do all cuts first. For
    /// "static" the step is the equilibrium at `t + dt`, for "evaluate" it only moves the clock.
    ///
    /// # Errors
    /// [`EngineError::Stopped`] where the simulation cannot go on; the state is then that of the last finished step.
    pub fn step(&mut self, dt: f64) -> Result<StepInfo, EngineError> {
        let cut_seconds = self.cut_what_is_due(dt)?;
        let solved = match self.scene.time.scheme {
            Scheme::Evaluate => self.evaluate(dt)?,
            Scheme::Static => self.find_equilibrium(dt)?,
            Scheme::BackwardEuler => self.backward_euler(dt)?,
            Scheme::Midpoint => self.midpoint(dt)?,
            Scheme::Newmark => self.newmark(dt)?,
            Scheme::Bdf2 => self.bdf2(dt)?,
            Scheme::CentralDifference => self.central_difference(dt)?,
        };
        self.state.step += 1;
        self.seconds.assemble += solved.assemble_seconds;
        self.seconds.solve += solved.solve_seconds;
        self.note_solve(&solved);
        tracing::debug!(
            step = self.state.step,
            t = self.state.time,
            newton_steps = solved.newton_steps,
            iterations = solved.iterations,
            residual = solved.residual,
            converged = solved.converged,
            "step"
        );
        Ok(StepInfo {
            step: self.state.step,
            time: self.state.time,
            dt,
            iterations: solved.iterations,
            newton_steps: solved.newton_steps,
            residual: solved.residual,
            converged: solved.converged,
            energies: self.energies,
            assemble_seconds: solved.assemble_seconds,
            solve_seconds: solved.solve_seconds,
            cut_seconds,
        })
    }

    pub(crate) fn cut_what_is_due(&mut self, dt: f64) -> Result<f64, EngineError> {
        let clock = Instant::now();
        self.work_on_backlog()?;
        let at_once = matches!(self.scene.time.scheme, Scheme::Static | Scheme::Evaluate);
        let due = |c: &PendingCut, t: f64| at_once || t >= c.at - 1e-9 * dt;
        let mut seconds = 0.0;
        while self.pending.first().is_some_and(|c| due(c, self.state.time)) {
            let cut = self.pending.remove(0);
            let record = self.cut_in_frame(cut.frame, &cut.sweep, &cut.options)?;
            seconds += record.seconds.find + record.seconds.remesh + record.seconds.update;
        }
        seconds += self.move_blades(dt)?;
        // without figures the clock tells the same as the sum of the parts
        Ok(if self.records_figures {
            seconds
        } else {
            clock.elapsed().as_secs_f64()
        })
    }

    /// Cuts the body by a surface at its current positions.
    ///
    /// A refused cut, or one that touches nothing, changes nothing and says so in the record.
    ///
    /// # Errors
    /// [`EngineError::Cut`] for options out of range.
    pub fn cut(&mut self, sweep: &Sweep, options: &CutOptions) -> Result<CutRecord, EngineError> {
        self.cut_in_frame(Frame::Deformed, sweep, options)
    }

    /// [`Self::cut`] with the surface given at current or at rest positions.
    ///
    /// # Errors
    /// As [`Self::cut`].
    pub fn cut_in_frame(
        &mut self,
        frame: Frame,
        sweep: &Sweep,
        options: &CutOptions,
    ) -> Result<CutRecord, EngineError> {
        let prepare_seconds = self.prepare_cut(frame);
        let mut record = self.cut_prepared(frame, sweep, options, true)?;
        record.seconds.find += prepare_seconds;
        self.cuts.push(record.clone());
        Ok(record)
    }

    /// Brings the positions to cut at to a frame; returns the seconds it took.
    pub(crate) fn prepare_cut(&mut self, frame: Frame) -> f64 {
        let clock = Instant::now();
        self.cutter.prepare(&self.mesh, &self.state.u, frame);
        let seconds = clock.elapsed().as_secs_f64();
        self.seconds.cut += seconds;
        seconds
    }

    /// Cuts in a frame that was prepared; the warnings of the cut are told if `tells`.
    pub(crate) fn cut_prepared(
        &mut self,
        frame: Frame,
        sweep: &Sweep,
        options: &CutOptions,
        tells: bool,
    ) -> Result<CutRecord, EngineError> {
        let audit = self.audit_before(options.method);
        let clock = Instant::now();
        let (cutter, mesh) = (&mut self.cutter, &mut self.mesh);
        let outcome = with_borders(&self.regions, &self.loads, &self.fixed, |borders| {
            cutter.cut(mesh, sweep, options, borders)
        })?;
        let cut_seconds = clock.elapsed().as_secs_f64();
        let followed = self.follow(&outcome)?;
        let mut record = pending::record(self.state.time, options.method, &outcome);
        record.seconds.update = clock.elapsed().as_secs_f64() - cut_seconds;
        record.rows_updated = followed.rows;
        record.cells_updated = followed.cells;
        record.area_m2 *= self.thickness();
        record.velocity_correction = followed.correction.size;
        self.seconds.cut += cut_seconds;
        self.seconds.update += record.seconds.update;
        if !outcome.report.unfinished.is_empty() {
            self.backlog.push(Backlog {
                cells: outcome.report.unfinished.clone(),
                options: *options,
                frame,
            });
        }
        let told: &[String] = if tells { &outcome.report.warnings } else { &[] };
        for text in told.iter().chain(&record.refused) {
            self.warn(format!("cut at {} s: {text}", self.state.time));
        }
        // outside the timed seconds: work proportional to the mesh, as part of every step
        if !outcome.change.is_empty() {
            self.measure_energies()?;
        }
        self.audit_after(audit, &followed.correction, &mut record)?;
        tracing::info!(
            t = record.at,
            method = record.method,
            cells_removed = record.cells_removed,
            cells_added = record.cells_added,
            vertices_moved = record.vertices_moved,
            rows_updated = record.rows_updated,
            area_m2 = record.area_m2,
            refused = record.refused.len(),
            "cut"
        );
        Ok(record)
    }

    /// Goes on with the bad cells that the oldest cut has left over, with as many operations as one step is allowed.
    fn work_on_backlog(&mut self) -> Result<(), EngineError> {
        if self.backlog.is_empty() {
            return Ok(());
        }
        let mut backlog = self.backlog.remove(0);
        let clock = Instant::now();
        self.cutter.prepare(&self.mesh, &self.state.u, backlog.frame);
        let (cutter, mesh) = (&mut self.cutter, &mut self.mesh);
        let outcome = with_borders(&self.regions, &self.loads, &self.fixed, |borders| {
            cutter.improve(mesh, &backlog.cells, &backlog.options, borders)
        })?;
        self.seconds.cut += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        self.follow(&outcome)?;
        self.seconds.update += clock.elapsed().as_secs_f64();
        tracing::debug!(
            operations = outcome.report.operations,
            left = outcome.report.unfinished.len(),
            "cells improved"
        );
        if !outcome.report.unfinished.is_empty() {
            backlog.cells = outcome.report.unfinished;
            self.backlog.insert(0, backlog);
        }
        if !outcome.change.is_empty() {
            self.measure_energies()?;
            if self.verify.is_some() {
                self.note_verification(None);
            }
        }
        Ok(())
    }

    /// Carries a change of the mesh through everything that depends on it, in the order of dependence. The search tree has
    /// followed already.
    fn follow(&mut self, outcome: &CutOutcome<N>) -> Result<Followed, EngineError> {
        let mut followed = Followed::default();
        followed.correction.complete = true;
        if outcome.change.is_empty() {
            return Ok(followed);
        }
        let change = &*self.assembler.follow_midpoints(&mut self.mesh, &outcome.change);
        let old = self.state.apply(&self.mesh, change);
        self.fixed.follow(&self.mesh, self.assembler.midpoints(), change);
        self.loads.follow(&self.mesh, change);
        self.probes.follow(&self.mesh, change);
        self.regions.resize(self.mesh.cell_slots(), 0);
        for c in &change.cells_added {
            self.regions[c.id.index()] = self.regions[c.parent.index()];
        }
        let touched = self.assembler.update(&self.mesh, change)?;
        self.solver.pattern_changed();
        self.buffers.resize(self.state.u.len());
        self.equilibrium.mesh_changed(self.state.u.len());
        self.past.forget(self.state.u.len());
        self.explicit.follow(&self.mesh, &self.assembler, change);
        followed.rows = touched.rows;
        followed.cells = touched.cells;
        let inertia = self.inertia();
        let state = &mut self.state;
        followed.correction =
            momentum::restore(&self.mesh, &self.assembler, &inertia, &self.fixed, change, &old, state);
        Ok(followed)
    }

    /// The mesh.
    pub fn mesh(&self) -> &SimplexMesh<N> {
        &self.mesh
    }

    /// Displacements, velocities and the clock.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Displacement (m), flat, three a vertex slot.
    pub fn u(&self) -> &[f64] {
        &self.state.u
    }

    /// Velocity (m/s), flat, three a vertex slot.
    pub fn v(&self) -> &[f64] {
        &self.state.v
    }

    /// Current positions (m) by vertex slot.
    pub fn positions(&self) -> Vec<Point> {
        let mut positions = Vec::new();
        self.positions_into(&mut positions);
        positions
    }

    /// [`Self::positions`] in place of what `positions` held; allocates only if that had no room.
    pub fn positions_into(&self, positions: &mut Vec<Point>) {
        let moved = self.mesh.rest_positions().iter().zip(self.state.u.as_chunks::<3>().0);
        positions.clear();
        positions.extend(moved.map(|(p, u)| p + Point::from(*u)));
    }

    /// Energies of the present state.
    pub fn energies(&self) -> Energies {
        self.energies
    }

    /// Relative residuals, as in [`StepInfo::residual`], that Newton's method met in the last step, in order: that of the start,
    /// unless it had yet to take prescribed displacements along, then one for each Newton step that led somewhere. Of a step that
    /// took several attempts or stages those of the last; of a semi-implicit step that of the start only.
    pub fn newton_residuals(&self) -> &[f64] {
        self.equilibrium.residuals()
    }

    /// What each "auto" chose and why.
    pub fn choices(&self) -> &Choices {
        &self.choices
    }

    /// Records of the cuts made so far; of a blade those of its motions that changed something or were refused.
    pub fn cuts(&self) -> &[CutRecord] {
        &self.cuts
    }

    /// What the user should know, so far.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Replaces the displacement (m) that the `[[fixed]]` number `index` (from zero) prescribes; false if there is none, or
    /// it is not finite or leaves the plane of a planar body.
    pub fn set_fixed(&mut self, index: usize, displacement: [f64; 3]) -> bool {
        accepts::<N>(displacement) && self.fixed.set_displacement(index, displacement)
    }

    /// Replaces the vector of the `[[load]]` number `index` (from zero): gravity (m/s²), traction (Pa) or total force (N);
    /// false if there is none, or it is a pressure, or the vector is not finite or leaves the plane of a planar body.
    pub fn set_load(&mut self, index: usize, vector: [f64; 3]) -> bool {
        self.buffers.load_time = None;
        accepts::<N>(vector) && self.loads.set_vector(index, vector)
    }

    /// Lets every cut record volume, quality, pieces and energies before and after (work proportional to the mesh).
    pub fn record_figures(&mut self, on: bool) {
        self.records_figures = on;
    }

    /// Checks every invariant after each cut; see [`Self::verification`].
    pub fn verify(&mut self, on: bool) {
        self.verify = on.then(VerifyFigures::default);
    }

    /// What the checks found, where they were asked for.
    pub fn verification(&self) -> Option<&VerifyFigures> {
        self.verify.as_ref()
    }

    /// Thickness of a planar body (m), else 1.
    pub(crate) fn thickness(&self) -> f64 {
        self.scene.material.thickness.unwrap_or(1.0)
    }

    /// The mass that momenta are of.
    pub(crate) fn inertia(&self) -> Inertia {
        momentum::inertia(&self.assembler, self.scene.model.mass)
    }

    pub(crate) fn body(&self) -> Body<'_, N> {
        Body {
            mesh: &self.mesh,
            assembler: &self.assembler,
            model: self.model,
            mass: self.scene.model.mass,
        }
    }

    /// A warning, once.
    pub(crate) fn warn(&mut self, text: String) {
        if !self.warnings.contains(&text) {
            tracing::warn!("{text}");
            self.warnings.push(text);
        }
    }

    /// An error that ends the run, at the present time.
    pub(crate) fn stopped(&self, reason: impl Into<String>) -> EngineError {
        EngineError::Stopped {
            time: self.state.time,
            reason: reason.into(),
        }
    }
}

/// Does something within the borders that materials and conditions draw.
fn with_borders<R, const N: usize>(
    regions: &[u32],
    loads: &Loads,
    fixed: &FixedDofs<N>,
    act: impl FnOnce(Borders<'_>) -> R,
) -> R {
    act(Borders {
        cell_group: &|c| u64::from(regions[c.index()]),
        facet_group: &|label, corners| loads.on_facet(label) << 3 | fixed.on_facet(corners),
        vertex_group: &|v| u64::from(loads.on_vertex(v) || fixed.holds(v)),
    })
}

/// Bad cells that a cut has left over because the operations it was allowed were used up.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Backlog {
    cells: Vec<CellId>,
    options: CutOptions,
    frame: Frame,
}

/// What [`Simulation::follow`] did.
#[derive(Clone, Copy, Debug, Default)]
struct Followed {
    rows: usize,
    cells: usize,
    correction: momentum::Correction,
}

/// Whether a vector is finite, and in the plane for a planar body.
fn accepts<const N: usize>(vector: [f64; 3]) -> bool {
    vector.iter().all(|d| d.is_finite()) && (N == 4 || vector[2] == 0.0)
}

/// The materials of a scene: that of `[material]`, then one for each region.
fn materials<const N: usize>(scene: &Scene) -> Result<Vec<Material>, EngineError> {
    let m = &scene.material;
    let regions = scene.region.iter().map(|r| {
        let or = |own: Option<f64>, common: f64| own.unwrap_or(common);
        Material::new(or(r.young, m.young), or(r.poisson, m.poisson), or(r.density, m.density))
    });
    let all = std::iter::once(Material::new(m.young, m.poisson, m.density)).chain(regions);
    let (plane, thickness) = (m.plane.unwrap_or_default().into(), m.thickness.unwrap_or(1.0));
    let placed = all.map(|material| {
        if N == 3 {
            material?.in_plane(plane, thickness)
        } else {
            material
        }
    });
    Ok(placed.collect::<Result<_, _>>()?)
}

/// Number of the material of each cell: zero, or one more than the index of its region.
fn region_of_cells<const N: usize>(scene: &Scene, input: &MeshInput<N>) -> Result<Vec<u32>, EngineError> {
    let mut regions = vec![0; input.mesh.cell_slots()];
    for (i, spec) in scene.region.iter().enumerate() {
        let fail = |key: &str, message: String| Err(scene.source.error("region", i, key, message));
        let mut selected = 0;
        let mut select = |cell: usize| {
            regions[cell] = i as u32 + 1;
            selected += 1;
        };
        let key = match (&spec.group, &spec.r#where) {
            (Some(name), _) => {
                match input.set(name) {
                    Ok(set) => set.cells.iter().for_each(|c| select(*c)),
                    Err(message) => return fail("group", message),
                }
                "group"
            }
            (None, condition) => {
                for c in input.mesh.cell_ids() {
                    let centroid = input.mesh.cell_rest_positions(c).iter().sum::<Point>() / N as f64;
                    if condition.as_ref().is_some_and(|w| w.0.holds(&centroid)) {
                        select(c.index());
                    }
                }
                "where"
            }
        };
        if selected == 0 {
            return fail(key, "it selects no cell; a selection must not be empty".into());
        }
    }
    Ok(regions)
}

fn initial_state(scene: &Scene, points: &[Point], dimension: usize) -> Result<State, EngineError> {
    let mut state = State::at_rest(points.len());
    let fields = [
        ("displacement", &scene.initial.displacement, &mut state.u),
        ("velocity", &scene.initial.velocity, &mut state.v),
    ];
    for (key, spec, field) in fields {
        if let Some(spec) = spec {
            *field = input::initial_values(spec, key, points, dimension, &scene.source)?;
        }
    }
    Ok(state)
}

impl<const N: usize> Parts<N> {
    /// Adds the mid-edge vertices of order 2 to the mesh and to what is kept by vertex. Initial values are those of an
    /// expression there, else the means of those at the ends.
    fn add_midpoints(&mut self, scene: &Scene) -> Result<Midpoints<N>, EngineError> {
        let midpoints = Midpoints::new(&mut self.mesh);
        self.fixed.add_midpoints(&self.mesh, &midpoints);
        let edges = midpoints.edges();
        let places: Vec<Point> = edges.iter().map(|(v, _)| self.mesh.rest_position(*v)).collect();
        let initial = &scene.initial;
        let state = &mut self.state;
        for (key, spec, field) in [
            ("displacement", &initial.displacement, &mut state.u),
            ("velocity", &initial.velocity, &mut state.v),
        ] {
            field.resize(3 * self.mesh.vertex_slots(), 0.0);
            let own = match spec {
                Some(spec @ InitialField::Here(_)) => {
                    Some(input::initial_values(spec, key, &places, N - 1, &scene.source)?)
                }
                _ => None,
            };
            for (k, (v, [a, b])) in edges.iter().enumerate() {
                let value = match &own {
                    Some(own) => Vector3::from_column_slice(&own[3 * k..][..3]),
                    None => (nodal(field, *a) + nodal(field, *b)) / 2.0,
                };
                set_nodal(field, *v, &value);
            }
        }
        Ok(midpoints)
    }
}
