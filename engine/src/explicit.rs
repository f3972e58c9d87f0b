//! Central differences in time: explicit, with lumped mass, and with the longest step that is stable.
//!
//! A step takes half of the change of velocity at its start and half at its end (velocity Verlet, the leapfrog with velocities
//! at full steps): `v+ = v + h/2 a(u, v)`, `u' = u + h v+`, `v' = v+ + h/2 a(u', v')`. Damping by mass is solved for in the last
//! of these; damping by stiffness takes the velocity foretold there, `v + h a`, which keeps the second order. Between steps only
//! the state is kept, so a cut or a restart needs nothing else.
//!
//! With largest eigenvalue `w²` of `M^-1 K` the scheme is stable up to `h² w² + 2 h beta w² = 4`, which is
//! `h = 2/w (sqrt(1 + x²) - x)` with `x = beta w / 2` (Belytschko, Liu, Moran, "Nonlinear Finite Elements", 6.2). `w²` is bounded by
//! the largest eigenvalue of any one cell, [`Assembler::largest_eigenvalue`]: a cut changes it where it changes cells. A corotated
//! body is taken for as stiff as at rest, which holds for small strains, and the tenth that is kept in reserve is for others.

use std::time::Instant;

use kerfem_fem::{Assembler, BlockMatrix, Model, Tangent};
use kerfem_mesh::{CellId, MeshChange, SimplexMesh};

use crate::equilibrium::{Body, Solved, norm};
use crate::simulation::Buffers;
use crate::{DampingSpec, EngineError, Simulation};

/// Fraction of the stable step that is used.
const USED: f64 = 0.9;
/// A step of the scene is made of so many at most.
const MOST_STEPS: f64 = 1e6;

/// Memory of the scheme; none while another one is in use.
#[derive(Debug, Default)]
pub(crate) struct Explicit {
    /// Largest eigenvalue of each cell slot (1/s²).
    rates: Vec<f64>,
    /// The cell with the largest of all, and that; none until it is looked for.
    fastest: Option<(CellId, f64)>,
    /// Internal force (N) and warped stiffness at the present displacements, if they are known.
    internal: Vec<f64>,
    warped: Option<BlockMatrix>,
    known: bool,
    /// Whether it was said that steps are made of several.
    told: bool,
    /// What damping by stiffness exerts (N).
    viscous: Vec<f64>,
    /// Acceleration (m/s²) of the free dofs by everything but damping by mass.
    acceleration: Vec<f64>,
}

impl Explicit {
    /// Follows a change of the mesh, by what it touches.
    pub(crate) fn follow<const N: usize>(
        &mut self,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
        change: &MeshChange<N>,
    ) {
        self.known = false;
        if self.rates.is_empty() {
            return;
        }
        self.rates.resize(mesh.cell_slots(), 0.0);
        change.cells_removed.iter().for_each(|c| self.rates[c.id.index()] = 0.0);
        let added = change.cells_added.iter().map(|c| c.id);
        let around = change.vertices_moved.iter().flat_map(|v| mesh.cells_of_vertex(v.id));
        for c in added.chain(around.copied()) {
            self.rates[c.index()] = assembler.largest_eigenvalue(c);
        }
        self.fastest = None;
    }

    /// Makes ready for a step.
    fn prepare<const N: usize>(&mut self, body: &Body<'_, N>, dofs: usize) {
        if self.rates.is_empty() {
            self.rates.resize(body.mesh.cell_slots(), 0.0);
            for c in body.mesh.cell_ids() {
                self.rates[c.index()] = body.assembler.largest_eigenvalue(c);
            }
        }
        if self.fastest.is_none() {
            let all = self.rates.iter().enumerate();
            let fastest = all.max_by(|a, b| a.1.total_cmp(b.1));
            self.fastest = fastest.map(|(c, rate)| (CellId(c as u32), *rate));
        }
        for field in [&mut self.internal, &mut self.viscous, &mut self.acceleration] {
            field.resize(dofs, 0.0);
        }
    }

    /// Forms the internal force at `u`, and what damps there.
    fn weigh<const N: usize>(&mut self, body: &Body<'_, N>, damps: bool, u: &[f64]) {
        body.assembler
            .internal_force(body.mesh, body.model, u, &mut self.internal);
        if damps && body.model == Model::Corotated {
            let warped = self.warped.get_or_insert_with(|| body.assembler.new_matrix());
            body.assembler
                .tangent(body.mesh, body.model, Tangent::Warped, u, warped);
        }
    }

    /// Forms the accelerations at velocities `v`, where [`Self::weigh`] was called.
    fn accelerate<const N: usize>(&mut self, body: &Body<'_, N>, beta: f64, load: &[f64], fixed: &[bool], v: &[f64]) {
        if beta > 0.0 {
            let stiffness = self.warped.as_ref().unwrap_or(body.assembler.stiffness());
            stiffness.multiply(v, &mut self.viscous);
            self.viscous.iter_mut().for_each(|f| *f *= beta);
        }
        for (d, a) in self.acceleration.iter_mut().enumerate() {
            let mass = body.assembler.lumped_mass()[d / 3];
            let force = load[d] - self.internal[d] - self.viscous[d];
            // a vertex without cells has no mass, and nothing moves it
            *a = if fixed[d] || mass == 0.0 { 0.0 } else { force / mass };
        }
    }
}

/// The longest stable step (s) where the largest eigenvalue is `rate` (1/s²), damped by `beta` (s) times the stiffness.
fn longest_step(rate: f64, beta: f64) -> f64 {
    4.0 / (rate * ((beta * beta + 4.0 / rate).sqrt() + beta))
}

impl<const N: usize> Simulation<N> {
    /// The longest step (s) for which "central-difference" is stable, by a bound on the frequencies of the body as it is now, cuts
    /// included; infinite for a body without cells. Nine tenths of it are made at once.
    pub fn stable_step(&mut self) -> f64 {
        let mut explicit = std::mem::take(&mut self.explicit);
        explicit.prepare(&self.body(), self.state.u.len());
        self.explicit = explicit;
        match self.explicit.fastest {
            Some((_, rate)) if rate > 0.0 => longest_step(rate, self.scene.material.damping.stiffness),
            _ => f64::INFINITY,
        }
    }

    /// Central differences: as many equal steps as stability needs, one if possible. See [`crate::explicit`].
    pub(crate) fn central_difference(&mut self, dt: f64) -> Result<Solved, EngineError> {
        let count = self.count_steps(dt)?;
        let clock = Instant::now();
        let before = self.energies;
        self.buffers.solution.copy_from_slice(&self.state.u);
        self.buffers.speed.copy_from_slice(&self.state.v);
        let (start, end, h) = (self.state.time, self.state.time_after(dt), dt / count as f64);
        let time = |k: usize| if k == count { end } else { start + k as f64 * h };
        let mut explicit = std::mem::take(&mut self.explicit);
        let mut work = 0.0;
        for k in 0..count {
            work += self.explicit_step(&mut explicit, [time(k), time(k + 1)], h)?;
        }
        let assemble_seconds = clock.elapsed().as_secs_f64();
        if !self.buffers.speed.iter().all(|v| v.is_finite()) {
            return Err(self.stopped("velocities are not finite; a smaller dt may help"));
        }
        let scale = norm(&explicit.internal) + norm(&explicit.viscous) + norm(&self.buffers.load);
        self.explicit = explicit;
        self.equilibrium.note(&self.buffers.force, scale);
        self.state.u.copy_from_slice(&self.buffers.solution);
        self.state.v.copy_from_slice(&self.buffers.speed);
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(Solved {
            iterations: count,
            converged: true,
            assemble_seconds,
            ..Solved::default()
        })
    }

    /// Of how many steps one of length `dt` is made.
    fn count_steps(&mut self, dt: f64) -> Result<usize, EngineError> {
        let step = USED * self.stable_step();
        let count = (dt / step - 1e-9).ceil().max(1.0);
        if count > 1.0 {
            let cell = self.explicit.fastest.map_or(0, |(c, _)| c.0);
            tracing::debug!(count, step, cell, "a step is made of several");
            if count > MOST_STEPS {
                let reason = format!(
                    "cell {cell} is stable for steps of {step:e} s only: {count} would be needed for one of {dt} s"
                );
                return Err(self.stopped(reason));
            }
            if !std::mem::replace(&mut self.explicit.told, true) {
                let text = "time.dt is longer than \"central-difference\" is stable for; steps are made of several, see iterations \
                            in steps.csv";
                self.warn(text.into());
            }
        }
        Ok(count as usize)
    }

    /// One step of length `h` of `buffers.solution` and `buffers.speed`, from one time to another; returns the work (J) of loads
    /// and supports, and leaves what does not balance in `buffers.force`.
    fn explicit_step(&mut self, explicit: &mut Explicit, [from, to]: [f64; 2], h: f64) -> Result<f64, EngineError> {
        let DampingSpec {
            mass: alpha,
            stiffness: beta,
        } = self.scene.material.damping;
        self.form_load(from)?;
        if !std::mem::take(&mut explicit.known) {
            explicit.weigh(&self.body(), beta > 0.0, &self.buffers.solution);
        }
        let (fixed, buffers) = (self.fixed.mask(), &self.buffers);
        explicit.accelerate(&self.body(), beta, &buffers.load, fixed, &buffers.speed);
        self.buffers.start.copy_from_slice(&self.buffers.load);
        self.set_load_and_supports(to, to)?;
        let gain = &mut self.buffers.support_speed;
        let result = self.fixed.prescribe_gain(&self.mesh, to, h, gain);
        result.map_err(|reason| self.stopped(reason))?;

        let Buffers {
            load,
            start: earlier_load,
            prescribed,
            solution,
            speed,
            target: foretold,
            scratch: moved,
            force,
            support_speed: gain,
            ..
        } = &mut self.buffers;
        let (fixed, masses) = (self.fixed.mask(), self.assembler.lumped_mass());
        let mut work = 0.0;
        for (d, (u, v)) in solution.iter_mut().zip(speed.iter_mut()).enumerate() {
            if fixed[d] {
                moved[d] = prescribed[d] - *u;
                let end = moved[d] / h + gain[d];
                // what a support has to do for the mass it holds
                force[d] -= masses[d / 3] * ((end - *v) / h + alpha * end);
                (foretold[d], *v, *u) = (end, end, prescribed[d]);
            } else {
                let push = explicit.acceleration[d] - alpha * *v;
                foretold[d] = *v + h * push;
                *v += 0.5 * h * push;
                moved[d] = h * *v;
                *u += moved[d];
            }
            work += 0.5 * moved[d] * (earlier_load[d] + load[d]);
        }

        explicit.weigh(&self.body(), beta > 0.0, &self.buffers.solution);
        explicit.known = true;
        let (fixed, buffers) = (self.fixed.mask(), &self.buffers);
        explicit.accelerate(&self.body(), beta, &buffers.load, fixed, &buffers.target);
        let Buffers {
            speed,
            scratch: moved,
            force,
            ..
        } = &mut self.buffers;
        for (d, v) in speed.iter_mut().enumerate() {
            if fixed[d] {
                force[d] -= explicit.internal[d] + explicit.viscous[d];
                work -= moved[d] * force[d];
            } else {
                *v = (*v + 0.5 * h * explicit.acceleration[d]) / (1.0 + 0.5 * h * alpha);
                force[d] = 0.0;
            }
        }
        Ok(work)
    }
}
