//! The schemes: how one step is turned into one problem of equilibrium and its solution into a state.

use std::time::Instant;

use crate::damping::Viscosity;
use crate::equilibrium::{Body, Goal, Solved, dot};
use crate::supports::{self, FreePiece};
use crate::{DampingSpec, EngineError, Nonlinear, Simulation};

/// What an implicit step adds to a problem of equilibrium; nothing for statics.
#[derive(Clone, Copy, Default)]
struct Motion {
    /// Factor of the mass (1/s²).
    inertia: f64,
    /// Factor of the stiffness that damps.
    viscosity: f64,
    /// Half the length of the step (s).
    half: f64,
}

impl<const N: usize> Simulation<N> {
    /// "evaluate": nothing is solved.
    pub(crate) fn evaluate(&mut self, dt: f64) -> Result<Solved, EngineError> {
        self.state.advance_clock(dt);
        self.measure_energies()?;
        Ok(Solved {
            converged: true,
            ..Solved::default()
        })
    }

    /// "static": the displacements at which internal forces balance the loads of `t + dt`. A piece that nothing holds is
    /// solved for modulo its rigid motions, if its loads balance.
    pub(crate) fn find_equilibrium(&mut self, dt: f64) -> Result<Solved, EngineError> {
        let t = self.state.time_after(dt);
        self.set_load_and_supports(t, t)?;
        let pieces = supports::free_pieces(&self.mesh, self.fixed.mask(), &self.buffers.load);
        let pieces = pieces.map_err(|reason| self.stopped(reason))?;
        let mut fixed = self.fixed.mask().to_vec();
        for &dof in pieces.iter().flat_map(|p| &p.held) {
            fixed[dof] = true;
            self.buffers.prescribed[dof] = self.state.u[dof];
        }
        self.buffers.solution.clone_from(&self.state.u);
        let solved = self.solve(Motion::default(), Some(&fixed))?;
        // what comes close is used, and flagged
        let close = solved.residual <= self.scene.solver.tolerance.sqrt();
        if !solved.converged && !close {
            return Err(self.stopped(format!(
                "no equilibrium was found: residual {:e} after {} Newton steps and {} iterations of the linear solver, {:e} \
                 is wanted",
                solved.residual, solved.newton_steps, solved.iterations, self.scene.solver.tolerance
            )));
        }
        self.release(&pieces)?;
        self.state.u.clone_from(&self.buffers.solution);
        self.state.v.fill(0.0);
        self.state.advance_clock(dt);
        self.measure_energies()?;
        Ok(solved)
    }

    /// Judges what held the free pieces: it must have carried nothing. Takes their rigid motions out of a linear solution.
    fn release(&mut self, pieces: &[FreePiece]) -> Result<(), EngineError> {
        if pieces.is_empty() {
            return Ok(());
        }
        let unbalanced = self.equilibrium.unbalanced();
        let size = self.equilibrium.force_scale();
        let held = pieces.iter().flat_map(|p| &p.held);
        let reaction = held.map(|&d| unbalanced[d].abs()).fold(0.0, f64::max);
        if reaction > 1e-6 * size {
            return Err(self.stopped(format!(
                "a free piece has no equilibrium near its place: after it has deformed, its loads do not balance by {reaction:e} N"
            )));
        }
        if self.model == kerfem_fem::Model::Linear {
            for piece in pieces {
                let (fixed, masses) = (self.fixed.mask(), self.assembler.lumped_mass());
                piece.remove_motions(&self.mesh, fixed, masses, &mut self.buffers.solution);
            }
        }
        Ok(())
    }

    /// Backward Euler: `M ((v' - v) / dt + alpha v') + beta K v' + internal(u') = load(t + dt)`, `u' = u + dt v'`; for `K` see
    /// [`crate::damping`].
    pub(crate) fn backward_euler(&mut self, dt: f64) -> Result<Solved, EngineError> {
        let t = self.state.time_after(dt);
        self.set_load_and_supports(t, t)?;
        let solved = self.implicit_part(dt, 0.5 * dt)?;
        let before = self.energies;
        let work = self.work_of_step(1.0);
        for ((u, v), new) in self
            .state
            .u
            .iter_mut()
            .zip(&mut self.state.v)
            .zip(&self.buffers.solution)
        {
            *v = (new - *u) / dt;
            *u = *new;
        }
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(solved)
    }

    /// Implicit midpoint: the state half way, `u + dt/2 v_m`, obeys a backward Euler step of half the length with the load
    /// of half time; the end lies as far beyond it.
    pub(crate) fn midpoint(&mut self, dt: f64) -> Result<Solved, EngineError> {
        let t = self.state.time_after(dt);
        self.set_load_and_supports(self.state.time + 0.5 * dt, t)?;
        let mask = self.fixed.mask();
        for (d, p) in self.buffers.prescribed.iter_mut().enumerate().filter(|(d, _)| mask[*d]) {
            *p = 0.5 * (*p + self.state.u[d]);
        }
        let solved = self.implicit_part(0.5 * dt, 0.5 * dt)?;
        let before = self.energies;
        let work = self.work_of_step(2.0);
        let mask = self.fixed.mask();
        for (d, middle) in self.buffers.solution.iter().enumerate() {
            let (u, v) = (&mut self.state.u[d], &mut self.state.v[d]);
            let half = middle - *u;
            *v = if mask[d] { 2.0 * half / dt } else { 4.0 * half / dt - *v };
            *u += 2.0 * half;
        }
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(solved)
    }

    /// Solves for the end of a backward Euler step of length `dt`, into `buffers.solution`; `half` of the step of the scheme
    /// lies half-way through it.
    fn implicit_part(&mut self, dt: f64, half: f64) -> Result<Solved, EngineError> {
        let DampingSpec { mass, stiffness } = self.scene.material.damping;
        let inertia = (1.0 / dt + mass) / dt;
        let reach = 1.0 / (dt * inertia);
        let moved = self.state.u.iter().zip(&self.state.v);
        for (target, (u, v)) in self.buffers.target.iter_mut().zip(moved) {
            *target = u + reach * v;
        }
        self.buffers.solution.clone_from(&self.state.u);
        let motion = Motion {
            inertia,
            viscosity: stiffness / dt,
            half,
        };
        let solved = self.solve(motion, None)?;
        if self.buffers.solution.iter().all(|u| u.is_finite()) {
            Ok(solved)
        } else {
            Err(self.stopped("displacements are not finite; a smaller dt may help"))
        }
    }

    /// Solves into `buffers.solution`, which holds the start; `held` stands in for the prescribed dofs.
    fn solve(&mut self, motion: Motion, held: Option<&[bool]>) -> Result<Solved, EngineError> {
        let goal = Goal {
            inertia: motion.inertia,
            target: &self.buffers.target,
            viscosity: Viscosity {
                factor: motion.viscosity,
                start: &self.state.u,
                velocity: &self.state.v,
                half: motion.half,
            },
            load: &self.buffers.load,
            fixed: held.unwrap_or(self.fixed.mask()),
            prescribed: &self.buffers.prescribed,
            tolerance: self.scene.solver.tolerance,
            one_step: self.scene.time.nonlinear == Nonlinear::OneStep && motion.inertia > 0.0,
        };
        let body = Body {
            mesh: &self.mesh,
            assembler: &self.assembler,
            model: self.model,
            mass: self.scene.model.mass,
        };
        let solved = self
            .equilibrium
            .solve(&body, &goal, &mut self.solver, &mut self.buffers.solution);
        solved.map_err(|e| EngineError::Stopped {
            time: self.state.time,
            reason: e.to_string(),
        })
    }

    /// The loads at one time and the prescribed displacements at another.
    fn set_load_and_supports(&mut self, load_time: f64, support_time: f64) -> Result<(), EngineError> {
        let clock = Instant::now();
        self.form_load(load_time)?;
        let prescribed = &mut self.buffers.prescribed;
        let result = self.fixed.prescribe(&self.mesh, support_time, prescribed);
        self.seconds.assemble += clock.elapsed().as_secs_f64();
        result.map_err(|reason| self.stopped(reason))
    }

    /// The external load at a time, unless it is known.
    fn form_load(&mut self, t: f64) -> Result<(), EngineError> {
        let known = self
            .buffers
            .load_time
            .is_some_and(|known| known == t || !self.loads.uses_time());
        if !known {
            let formed = self.loads.force(&self.mesh, &self.assembler, t, &mut self.buffers.load);
            formed.map_err(|e| self.stopped(e.to_string()))?;
            self.buffers.load_time = Some(t);
        }
        Ok(())
    }

    /// Work (J) of loads and supports over the step whose solution, `factor` times as far from the present state, is its
    /// end.
    fn work_of_step(&self, factor: f64) -> f64 {
        let unbalanced = self.equilibrium.unbalanced();
        let mask = self.fixed.mask();
        let moved = self
            .buffers
            .solution
            .iter()
            .zip(&self.state.u)
            .map(|(new, u)| factor * (new - u));
        let forces = self.buffers.load.iter().zip(unbalanced).zip(mask);
        let forces = forces.map(|((load, unbalanced), fixed)| if *fixed { load - unbalanced } else { *load });
        moved.zip(forces).map(|(du, f)| du * f).sum()
    }

    /// Moves the clock and closes the balance of energy.
    fn finish(&mut self, dt: f64, work: f64, mechanical_before: f64) -> Result<(), EngineError> {
        self.state.advance_clock(dt);
        self.measure_energies()?;
        self.energies.dissipated += work - (self.energies.kinetic + self.energies.elastic - mechanical_before);
        Ok(())
    }

    /// Kinetic, elastic and potential energy of the state as it is.
    pub(crate) fn measure_energies(&mut self) -> Result<(), EngineError> {
        let clock = Instant::now();
        let mut scratch = std::mem::take(&mut self.buffers.scratch);
        self.energies = self
            .energies
            .measured(&self.body(), &self.state.u, &self.state.v, &mut scratch);
        self.buffers.scratch = scratch;
        self.form_load(self.state.time)?;
        self.energies.potential = -dot(&self.buffers.load, &self.state.u);
        self.seconds.assemble += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// Keeps count of a solve.
    pub(crate) fn note_solve(&mut self, solved: &Solved) {
        let figures = &mut self.solver_figures;
        figures.iterations_total += solved.iterations;
        figures.iterations_max = figures.iterations_max.max(solved.iterations);
        figures.newton_steps_total += solved.newton_steps;
        figures.residual_max = figures.residual_max.max(solved.residual);
        if solved.limited_by_rounding {
            self.warn("solver.tolerance is less than rounding allows; residuals are reported as they are".into());
        }
        if !solved.converged {
            self.solver_figures.unconverged_steps += 1;
            self.warn("a step missed the tolerance; see solver.unconverged_steps".into());
        }
    }
}
