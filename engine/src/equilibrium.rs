//! The one nonlinear problem behind statics and every implicit step: the minimum of
//! `inertia/2 |u - target|²_M + viscosity/2 |u - start|²_K + elastic energy(u) - load . u` over the free dofs.

use std::time::Instant;

use kerfem_fem::{Assembler, BlockMatrix, FemError, LinearSolver, Model, Scales, Tangent};
use kerfem_mesh::{Point, SimplexMesh, quality};

use crate::MassKind;
use crate::damping::{Damping, Viscosity};

/// Newton steps before giving up.
const MAX_STEPS: usize = 200;
/// Trial lengths of one line search.
const MAX_TRIALS: usize = 30;
/// Fraction of the promised decrease of energy that a step must bring (Armijo).
const ARMIJO: f64 = 1e-4;
/// Residuals below this many roundings of the terms they consist of cannot be told from zero.
const ROUNDINGS: f64 = 2.0;
/// Relative changes of the energy that strains of about 1e-12 round away.
const UNCERTAIN: f64 = 1e-4;

/// What the terms are computed with.
#[derive(Clone, Copy)]
pub(crate) struct Body<'a, const N: usize> {
    pub(crate) mesh: &'a SimplexMesh<N>,
    pub(crate) assembler: &'a Assembler<N>,
    pub(crate) model: Model,
    pub(crate) mass: MassKind,
}

/// What is sought.
#[derive(Clone, Copy)]
pub(crate) struct Goal<'a> {
    /// Factor of the mass (1/s²); zero for statics.
    pub(crate) inertia: f64,
    /// Where inertia alone would take the body (m).
    pub(crate) target: &'a [f64],
    /// Damping by stiffness.
    pub(crate) viscosity: Viscosity<'a>,
    /// Nodal forces (N): loads, and for a scheme that balances forces of both ends of a step what those at its start leave.
    pub(crate) load: &'a [f64],
    /// Which dofs are prescribed.
    pub(crate) fixed: &'a [bool],
    /// Their displacements (m); other entries are not used.
    pub(crate) prescribed: &'a [f64],
    /// Wanted residual relative to the sum of the norms of the forces that should balance.
    pub(crate) tolerance: f64,
    /// One linear solve with the warped stiffness instead of Newton's method.
    pub(crate) one_step: bool,
}

/// How a problem was solved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Solved {
    /// Iterations of the linear solver, over all Newton steps.
    pub(crate) iterations: usize,
    /// Newton steps.
    pub(crate) newton_steps: usize,
    /// True residual of the nonlinear problem (one step: of the linear system), relative as in [`Goal::tolerance`].
    pub(crate) residual: f64,
    /// Whether the residual is within the tolerance, or as small as rounding allows.
    pub(crate) converged: bool,
    /// The residual is as small as rounding allows, and larger than the tolerance.
    pub(crate) limited_by_rounding: bool,
    /// Seconds spent on matrices, forces and energies.
    pub(crate) assemble_seconds: f64,
    /// Seconds spent in the linear solver.
    pub(crate) solve_seconds: f64,
}

impl Solved {
    /// This attempt and another one after it: the work of both, and what the later one has come to.
    pub(crate) fn then(&self, later: &Solved) -> Solved {
        Solved {
            iterations: self.iterations + later.iterations,
            newton_steps: self.newton_steps + later.newton_steps,
            assemble_seconds: self.assemble_seconds + later.assemble_seconds,
            solve_seconds: self.solve_seconds + later.solve_seconds,
            ..*later
        }
    }
}

/// Memory of the solution process, kept from step to step.
#[derive(Debug)]
pub(crate) struct Equilibrium {
    matrix: BlockMatrix,
    /// The linear model's matrix is still that of these factors of the mass and of the damping.
    matrix_is_for: Option<[f64; 2]>,
    internal: Vec<f64>,
    inertial: Vec<f64>,
    damping: Damping,
    /// Forces that do not balance: load - internal - inertial - damping.
    residual: Vec<f64>,
    du: Vec<f64>,
    trial: Vec<f64>,
    offset: Vec<f64>,
    /// See [`Self::force_scale`].
    scale: f64,
    /// Forces were balanced since the mesh changed.
    balanced: bool,
    /// See [`Self::residuals`].
    residuals: Vec<f64>,
}

impl Equilibrium {
    pub(crate) fn new<const N: usize>(assembler: &Assembler<N>) -> Self {
        let mut own = Equilibrium {
            matrix: assembler.new_matrix(),
            matrix_is_for: None,
            internal: Vec::new(),
            inertial: Vec::new(),
            damping: Damping::default(),
            residual: Vec::new(),
            du: Vec::new(),
            trial: Vec::new(),
            offset: Vec::new(),
            scale: 0.0,
            balanced: false,
            residuals: Vec::with_capacity(MAX_STEPS + 1),
        };
        own.mesh_changed(3 * assembler.lumped_mass().len());
        own
    }

    /// Makes room for new dofs; the matrix is filled anew before it is used.
    pub(crate) fn mesh_changed(&mut self, dofs: usize) {
        self.matrix_is_for = None;
        self.balanced = false;
        for field in [
            &mut self.internal,
            &mut self.inertial,
            &mut self.residual,
            &mut self.du,
            &mut self.trial,
            &mut self.offset,
        ] {
            field.resize(dofs, 0.0);
        }
    }

    /// The operator of the last linear solve, if there was one since the mesh changed.
    pub(crate) fn matrix(&self) -> Option<&BlockMatrix> {
        self.matrix_is_for.map(|_| &self.matrix)
    }

    /// Size (N) of the forces that were balanced last: internal, inertial, of damping and loads.
    pub(crate) fn force_scale(&self) -> f64 {
        self.scale
    }

    /// Forces (N) that do not balance after the last solve, `load - internal - inertial - damping`: on prescribed dofs minus
    /// the reactions.
    pub(crate) fn unbalanced(&self) -> &[f64] {
        &self.residual
    }

    /// Whether forces were balanced since the mesh changed.
    pub(crate) fn is_balanced(&self) -> bool {
        self.balanced
    }

    /// Relative residuals, as in [`Solved::residual`], that Newton's method met in the last solve, in order: that of the start
    /// unless it has yet to take prescribed displacements along, then one for each step that moved.
    pub(crate) fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// The forces that were balanced were twice what acts: halves [`Self::unbalanced`] and [`Self::force_scale`].
    pub(crate) fn halve(&mut self) {
        self.residual.iter_mut().for_each(|r| *r *= 0.5);
        self.scale *= 0.5;
    }

    /// Takes note of forces that were balanced elsewhere: see [`Self::unbalanced`] and [`Self::force_scale`].
    pub(crate) fn note(&mut self, unbalanced: &[f64], scale: f64) {
        self.residual.copy_from_slice(unbalanced);
        (self.scale, self.balanced) = (scale, true);
    }

    /// Takes back what [`Self::unbalanced`], [`Self::force_scale`] and [`Self::is_balanced`] gave.
    pub(crate) fn recall(&mut self, unbalanced: Vec<f64>, scale: f64, balanced: bool) {
        (self.residual, self.scale, self.balanced) = (unbalanced, scale, balanced);
    }

    /// What the supports exert on the prescribed dofs (N), after the last solve; none if the mesh has changed since.
    pub(crate) fn reaction(&self, dof: usize) -> Option<f64> {
        self.balanced.then(|| -self.residual[dof])
    }

    /// Solves for `u`: on entry the start, on return the solution; prescribed dofs get their values.
    ///
    /// Newton's method, from the target of inertia if the energy is less there, with the exact Hessian and a backtracking line
    /// search on the energy; where the Hessian is not positive definite or leads nowhere, it is projected. The first step takes
    /// the prescribed displacements along and is not shortened where they change. Not reaching the tolerance is no error.
    ///
    /// # Errors
    /// [`FemError`] of the linear solver.
    pub(crate) fn solve<const N: usize>(
        &mut self,
        body: &Body<'_, N>,
        goal: &Goal<'_>,
        solver: &mut LinearSolver,
        u: &mut [f64],
    ) -> Result<Solved, FemError> {
        let mut done = Solved::default();
        self.residuals.clear();
        set_positions(body, solver, u);
        let mut tangent = if goal.one_step { Tangent::Warped } else { Tangent::Exact };
        let clock = Instant::now();
        self.damping.begin(body, &goal.viscosity);
        if goal.inertia > 0.0 && !goal.one_step {
            self.leap(body, goal, u);
        }
        let mut carries = self.start(goal, u);
        body.assembler
            .internal_force(body.mesh, body.model, u, &mut self.internal);
        let scale = self.balance(body, goal, u);
        done.assemble_seconds += clock.elapsed().as_secs_f64();
        if !carries && self.is_solved(goal, u, body.mesh, scale, &mut done) {
            return Ok(done);
        }
        while done.newton_steps < MAX_STEPS {
            let clock = Instant::now();
            self.fill_matrix(body, goal, tangent, u);
            done.assemble_seconds += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            if !carries {
                self.du.fill(0.0);
            }
            let solved = solver.solve(&self.matrix, goal.fixed, &self.residual, &mut self.du);
            done.solve_seconds += clock.elapsed().as_secs_f64();
            if tangent == Tangent::Exact && matches!(solved, Err(FemError::NotPositiveDefinite { .. })) {
                tangent = Tangent::Projected;
                continue;
            }
            let info = solved?;
            done.iterations += info.iterations;
            done.newton_steps += 1;
            tracing::trace!(
                iterations = info.iterations,
                residual = info.residual,
                ?tangent,
                before = done.residual,
                "linear solve"
            );

            let clock = Instant::now();
            let full = goal.one_step || carries || body.model == Model::Linear;
            if full {
                add(u, 1.0, &self.du);
            }
            let moved = full || self.line_search(body, goal, u);
            body.assembler
                .internal_force(body.mesh, body.model, u, &mut self.internal);
            let scale = self.balance(body, goal, u);
            done.assemble_seconds += clock.elapsed().as_secs_f64();
            if goal.one_step {
                (done.residual, done.converged) = (info.residual, info.converged);
                return Ok(done);
            }
            let before = done.residual;
            if moved && self.is_solved(goal, u, body.mesh, scale, &mut done) {
                return Ok(done);
            }
            // a linear problem gains nothing once refinement stalls, nor any from a step that leads nowhere
            let stalls =
                body.model == Model::Linear && !carries && done.newton_steps > 1 && done.residual > 0.5 * before;
            if stalls || (!moved && tangent == Tangent::Projected) {
                return Ok(done);
            }
            tangent = if moved { Tangent::Exact } else { Tangent::Projected };
            carries = false;
        }
        Ok(done)
    }

    /// Moves `u` to the target of inertia if the energy is less there.
    fn leap<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &mut [f64]) {
        let (here, _) = self.energy(body, goal, u);
        let (there, _) = self.energy(body, goal, goal.target);
        if there < here {
            u.copy_from_slice(goal.target);
        }
    }

    /// Puts the prescribed increments into `du`; whether there are any.
    fn start(&mut self, goal: &Goal<'_>, u: &[f64]) -> bool {
        let mut any = false;
        for (d, du) in self.du.iter_mut().enumerate() {
            *du = if goal.fixed[d] { goal.prescribed[d] - u[d] } else { 0.0 };
            any |= *du != 0.0;
        }
        any
    }

    /// Fills the matrix at `u`. That of a linear model stays as it is from step to step.
    fn fill_matrix<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, tangent: Tangent, u: &[f64]) {
        let factors = Some([goal.inertia, goal.viscosity.factor]);
        if body.model == Model::Linear && self.matrix_is_for == factors {
            return;
        }
        let lumped = body.mass == MassKind::Lumped;
        let scales = Scales {
            stiffness: 1.0,
            mass: if lumped { goal.inertia } else { 0.0 },
        };
        body.assembler
            .linearize(body.mesh, body.model, tangent, u, scales, &mut self.matrix, None);
        if !lumped && goal.inertia != 0.0 {
            body.assembler.consistent_mass().add_to(goal.inertia, &mut self.matrix);
        }
        self.damping.add_to(body, &goal.viscosity, &mut self.matrix);
        self.matrix_is_for = factors;
    }

    /// Forms the forces that do not balance at `u` from the internal forces there; the sum of the norms of the terms.
    fn balance<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &[f64]) -> f64 {
        self.weigh_offset(body, goal, u);
        let terms = self.internal.iter().zip(&self.inertial).zip(goal.load);
        for (r, ((internal, inertial), load)) in self.residual.iter_mut().zip(terms) {
            *r = load - internal - inertial;
        }
        self.damping.weigh(body, &goal.viscosity, u);
        let damping = self.damping.force();
        self.residual.iter_mut().zip(damping).for_each(|(r, f)| *r -= f);
        self.scale = norm(&self.internal) + norm(&self.inertial) + norm(damping) + norm(goal.load);
        self.balanced = true;
        self.scale
    }

    /// `inertial := inertia M (u - target)`, by way of `offset := u - target`.
    fn weigh_offset<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &[f64]) {
        if goal.inertia == 0.0 {
            return self.inertial.fill(0.0);
        }
        for (o, (a, b)) in self.offset.iter_mut().zip(u.iter().zip(goal.target)) {
            *o = a - b;
        }
        mass_times(body, &self.offset, &mut self.inertial);
        self.inertial.iter_mut().for_each(|f| *f *= goal.inertia);
    }

    /// Records the relative residual on the free dofs; whether it is small enough.
    fn is_solved<const N: usize>(
        &mut self,
        goal: &Goal<'_>,
        u: &[f64],
        mesh: &SimplexMesh<N>,
        scale: f64,
        done: &mut Solved,
    ) -> bool {
        let size = free_norm(&self.residual, goal.fixed);
        let before = std::mem::replace(&mut done.residual, if scale > 0.0 { size / scale } else { size });
        self.residuals.push(done.residual);
        let within = done.residual <= goal.tolerance;
        // what rounding allows is costly to tell and of interest only where the residual no longer falls
        let stalls = done.newton_steps > 0 && done.residual > 0.1 * before;
        done.limited_by_rounding = !within && stalls && size <= self.rounding(goal, u, mesh);
        done.converged = within || done.limited_by_rounding;
        done.converged
    }

    /// Norm of the rounding errors that the residual at `u` cannot be free of: each force is a sum of entries of the matrix
    /// times displacements and cell sizes, whose roundings are independent.
    fn rounding<const N: usize>(&self, goal: &Goal<'_>, u: &[f64], mesh: &SimplexMesh<N>) -> f64 {
        let cells = mesh.num_cells().max(1) as f64;
        let size = quality::volume(mesh).abs() / cells;
        let h = if N == 3 {
            (3.0 * size).sqrt()
        } else {
            (12.0 * size).cbrt()
        };
        let mut sum = 0.0;
        for i in 0..self.matrix.rows() {
            let (columns, blocks) = self.matrix.row(i);
            for axis in (0..3).filter(|a| !goal.fixed[3 * i + a]) {
                for (j, block) in columns.iter().zip(blocks) {
                    for k in 0..3 {
                        let term = block[3 * axis + k] * (u[3 * *j as usize + k].abs() + h);
                        sum += term * term;
                    }
                }
            }
        }
        ROUNDINGS * f64::EPSILON * sum.sqrt()
    }

    /// Moves `u` along `du` so far that the energy decreases; false if no length does.
    fn line_search<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &mut [f64]) -> bool {
        let slope = -dot_free(&self.residual, &self.du, goal.fixed);
        let (start, size) = self.energy(body, goal, u);
        let noise = 64.0 * f64::EPSILON * size;
        if slope.abs() <= noise {
            // too close to the minimum for energies to tell
            add(u, 1.0, &self.du);
            return true;
        }
        if slope > 0.0 {
            return false;
        }
        self.trial.copy_from_slice(u);
        let mut length = 1.0;
        for _ in 0..MAX_TRIALS {
            u.copy_from_slice(&self.trial);
            add(u, length, &self.du);
            let (energy, _) = self.energy(body, goal, u);
            let change = energy - start;
            let falls = change <= ARMIJO * length * slope + noise;
            // at small strains forces are far more exact than energies: where those cannot tell, a slope that flattens does
            if falls || (change.abs() <= UNCERTAIN * size && self.slope(body, goal, u).abs() <= 0.5 * slope.abs()) {
                return true;
            }
            // minimum of the parabola through both energies with the slope at the start
            let parabola = -0.5 * slope * length * length / (change - slope * length);
            length = if parabola.is_finite() {
                parabola.clamp(0.1 * length, 0.5 * length)
            } else {
                0.1 * length
            };
        }
        u.copy_from_slice(&self.trial);
        false
    }

    /// The derivative of the energy along `du` at `u`; forms the forces there.
    fn slope<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &[f64]) -> f64 {
        body.assembler
            .internal_force(body.mesh, body.model, u, &mut self.internal);
        self.balance(body, goal, u);
        -dot_free(&self.residual, &self.du, goal.fixed)
    }

    /// The energy that is minimised (J), and the sum of the sizes of its parts.
    fn energy<const N: usize>(&mut self, body: &Body<'_, N>, goal: &Goal<'_>, u: &[f64]) -> (f64, f64) {
        let elastic = body.assembler.energy(body.mesh, body.model, u);
        let work = dot(goal.load, u);
        self.weigh_offset(body, goal, u);
        let inertial = if goal.inertia == 0.0 {
            0.0
        } else {
            0.5 * dot(&self.inertial, &self.offset)
        };
        self.damping.weigh(body, &goal.viscosity, u);
        let viscous = self.damping.energy();
        let size = elastic.abs() + work.abs() + inertial + viscous;
        (elastic + inertial + viscous - work, size)
    }
}

/// Tells the solver where the vertices are that the matrix is about: at `u`, or at rest for the linear model.
fn set_positions<const N: usize>(body: &Body<'_, N>, solver: &mut LinearSolver, u: &[f64]) {
    let moved = body.mesh.rest_positions().iter().zip(u.as_chunks().0);
    solver.set_positions(moved.map(|(p, u)| match body.model {
        Model::Linear => (*p).into(),
        Model::Corotated => (p + Point::from(*u)).into(),
    }));
}

/// `out := M x` with the mass of the body.
pub(crate) fn mass_times<const N: usize>(body: &Body<'_, N>, x: &[f64], out: &mut [f64]) {
    match body.mass {
        MassKind::Lumped => {
            let masses = body.assembler.lumped_mass();
            for (i, (o, x)) in out.iter_mut().zip(x).enumerate() {
                *o = masses[i / 3] * x;
            }
        }
        MassKind::Consistent => body.assembler.consistent_mass().multiply(x, out),
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn dot_free(a: &[f64], b: &[f64], fixed: &[bool]) -> f64 {
    a.iter()
        .zip(b)
        .zip(fixed)
        .filter(|(_, f)| !**f)
        .map(|((a, b), _)| a * b)
        .sum()
}

fn free_norm(a: &[f64], fixed: &[bool]) -> f64 {
    dot_free(a, a, fixed).sqrt()
}

pub(crate) fn add(u: &mut [f64], factor: f64, du: &[f64]) {
    u.iter_mut().zip(du).for_each(|(u, du)| *u += factor * du);
}
