//! The schemes: how one step is turned into one problem of equilibrium and its solution into a state.

use std::time::Instant;

use kerfem_fem::Model;

use crate::damping::Viscosity;
use crate::equilibrium::{Body, Goal, Solved, add, dot};
use crate::simulation::Buffers;
use crate::supports::{self, FreePiece};
use crate::{DampingSpec, EngineError, Nonlinear, Simulation};

/// A step of two-step differences may be so many times as long as the one before; a longer one starts anew. (They are stable up
/// to 1 + sqrt(2).)
const LARGEST_RATIO: f64 = 2.0;

/// The shortest stage of statics, as a fraction of all that loads and supports change.
const SHORTEST_STAGE: f64 = 1.0 / 32.0;

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
        let pieces = supports::free_pieces(
            &self.mesh,
            self.assembler.midpoints(),
            self.fixed.mask(),
            &self.buffers.load,
        );
        let pieces = pieces.map_err(|reason| self.stopped(reason))?;
        let mut fixed = self.fixed.mask().to_vec();
        for &dof in pieces.iter().flat_map(|p| &p.held) {
            fixed[dof] = true;
            self.buffers.prescribed[dof] = self.state.u[dof];
        }
        self.buffers.solution.clone_from(&self.state.u);
        let mut solved = self.solve(Motion::default(), Some(&fixed))?;
        if !solved.converged && self.model == Model::Corotated {
            solved = self.find_in_stages(&fixed, solved)?;
        }
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

    /// Equilibrium where Newton's method from the present state has failed: loads and supports change in stages, from those that
    /// the present state balances, each stage half as long as the last where it fails and twice as long where it does not.
    /// If no stage is short enough, what was found directly stays.
    fn find_in_stages(&mut self, fixed: &[bool], direct: Solved) -> Result<Solved, EngineError> {
        let (solution, supports) = (self.buffers.solution.clone(), self.buffers.prescribed.clone());
        let mut balanced = vec![0.0; solution.len()];
        self.assembler
            .internal_force(&self.mesh, self.model, &self.state.u, &mut balanced);
        let mut last = self.state.u.clone();
        let (mut reached, mut stage) = (0.0, 0.5);
        let mut total = direct;
        while reached < 1.0 && stage >= SHORTEST_STAGE {
            let to = f64::min(reached + stage, 1.0);
            let between = |a: f64, b: f64| if to < 1.0 { a + to * (b - a) } else { b };
            let Buffers {
                load,
                force,
                prescribed,
                solution,
                ..
            } = &mut self.buffers;
            for d in 0..last.len() {
                force[d] = between(balanced[d], load[d]);
                prescribed[d] = between(self.state.u[d], supports[d]);
            }
            solution.copy_from_slice(&last);
            let solved = self.solve(Motion::default(), Some(fixed))?;
            tracing::debug!(
                to,
                converged = solved.converged,
                newton_steps = solved.newton_steps,
                "a stage"
            );
            total = total.then(&solved);
            if solved.converged {
                last.copy_from_slice(&self.buffers.solution);
                (reached, stage) = (to, 2.0 * stage);
            } else {
                stage *= 0.5;
            }
        }
        if reached < 1.0 {
            let Buffers { load, force, .. } = &mut self.buffers;
            force.copy_from_slice(load);
            self.buffers.prescribed = supports;
            self.buffers.solution = solution;
            total = total.then(&self.solve(Motion::default(), Some(fixed))?);
        }
        Ok(total)
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
        if self.model == Model::Linear {
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
        self.set_start(0.0);
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
        self.set_start(0.0);
        self.set_speed_of_supports(dt)?;
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
            *v = if mask[d] {
                self.buffers.support_speed[d]
            } else {
                4.0 * half / dt - *v
            };
            *u += 2.0 * half;
        }
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(solved)
    }

    /// Newmark's method with beta 1/4 and gamma 1/2: the mean of the forces at both ends changes the velocity, and the mean of
    /// the velocities the displacement. Damping acts on that mean, so `K` is the same as half-way, see [`crate::damping`].
    ///
    /// Twice that mean is balanced at `u'`, which leaves `internal(u')` as it is. The accelerations at both ends follow from the
    /// states there and are never formed: nothing has to be carried over a cut, or solved for with a consistent mass.
    pub(crate) fn newmark(&mut self, dt: f64) -> Result<Solved, EngineError> {
        self.set_loads_and_supports_of_both_ends(dt)?;
        let clock = Instant::now();
        let Buffers {
            force,
            mean_load,
            scratch,
            ..
        } = &mut self.buffers;
        self.assembler
            .internal_force(&self.mesh, self.model, &self.state.u, scratch);
        for (force, (load, internal)) in force.iter_mut().zip(mean_load.iter().zip(&*scratch)) {
            *force = 2.0 * load - internal;
        }
        self.seconds.assemble += clock.elapsed().as_secs_f64();
        self.set_start(0.0);
        self.set_speed_of_supports(dt)?;
        self.buffers.speed.iter_mut().for_each(|v| *v *= 2.0);
        let solved = self.implicit_part(0.5 * dt, 0.25 * dt)?;
        self.equilibrium.halve();
        let before = self.energies;
        let work = self.work_of_step(1.0);
        let mask = self.fixed.mask();
        for (d, new) in self.buffers.solution.iter().enumerate() {
            let (u, v) = (&mut self.state.u[d], &mut self.state.v[d]);
            *v = match mask[d] {
                true => self.buffers.support_speed[d],
                false => 2.0 * (new - *u) / dt - *v,
            };
            *u = *new;
        }
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(solved)
    }

    /// Backward differences over two steps, of lengths `dt` and `dt / r`: a backward Euler step of length `g dt` from the state
    /// extrapolated by `c` times its last increment, `g = (1 + r) / (1 + 2 r)`, `c = r² / (1 + 2 r)`. Where no step is remembered
    /// it is one of backward Euler, `g = 1`, `c = 0`: an error of the second order, made once.
    pub(crate) fn bdf2(&mut self, dt: f64) -> Result<Solved, EngineError> {
        let dofs = self.state.u.len();
        self.past.du.resize(dofs, 0.0);
        self.past.dv.resize(dofs, 0.0);
        let ratio = dt / self.past.dt;
        let goes_on = self.past.dt > 0.0 && ratio <= LARGEST_RATIO;
        let (length, increments, half) = match goes_on {
            true => {
                let length = dt * (1.0 + ratio) / (1.0 + 2.0 * ratio);
                // damping acts at the end, where the extrapolated state gets in this time
                (length, ratio * ratio / (1.0 + 2.0 * ratio), length)
            }
            false => (dt, 0.0, 0.5 * dt),
        };
        self.set_loads_and_supports_of_both_ends(dt)?;
        self.set_start(increments);
        let solved = self.implicit_part(length, half)?;
        let before = self.energies;
        let work = self.work_of_step(1.0);
        let ends = self.buffers.solution.iter().zip(&self.buffers.start);
        for (d, (new, start)) in ends.enumerate() {
            let (u, v) = (&mut self.state.u[d], &mut self.state.v[d]);
            let speed = (new - start) / length;
            (self.past.du[d], self.past.dv[d]) = (new - *u, speed - *v);
            (*u, *v) = (*new, speed);
        }
        self.past.dt = dt;
        self.finish(dt, work, before.kinetic + before.elastic)?;
        Ok(solved)
    }

    /// Puts the state, extrapolated by `increments` of the last step, into `buffers.start` and `buffers.speed`.
    fn set_start(&mut self, increments: f64) {
        let Buffers { start, speed, .. } = &mut self.buffers;
        start.copy_from_slice(&self.state.u);
        speed.copy_from_slice(&self.state.v);
        if increments != 0.0 {
            add(start, increments, &self.past.du);
            add(speed, increments, &self.past.dv);
        }
    }

    /// Finds the velocities that supports have at the end of a step, and lets them set out so that their accelerations are
    /// right: a free dof sets out with the mean velocity of the step less half of what it gains.
    fn set_speed_of_supports(&mut self, dt: f64) -> Result<(), EngineError> {
        let t = self.state.time_after(dt);
        let gain = &mut self.buffers.support_speed;
        let result = self.fixed.prescribe_gain(&self.mesh, t, dt, gain);
        result.map_err(|reason| self.stopped(reason))?;
        let Buffers {
            prescribed,
            speed,
            support_speed,
            ..
        } = &mut self.buffers;
        for d in (0..speed.len()).filter(|d| self.fixed.mask()[*d]) {
            let mean = (prescribed[d] - self.state.u[d]) / dt;
            support_speed[d] += mean;
            speed[d] = mean - 0.5 * (support_speed[d] - speed[d]);
        }
        Ok(())
    }

    /// Solves for the end of a backward Euler step of length `dt` from `buffers.start` and `buffers.speed`, into
    /// `buffers.solution`; where the speed leads in the time `half`, cells are turned as they are while damping acts.
    fn implicit_part(&mut self, dt: f64, half: f64) -> Result<Solved, EngineError> {
        let DampingSpec { mass, stiffness } = self.scene.material.damping;
        let inertia = (1.0 / dt + mass) / dt;
        let reach = 1.0 / (dt * inertia);
        let moved = self.buffers.start.iter().zip(&self.buffers.speed);
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
                start: &self.buffers.start,
                velocity: &self.buffers.speed,
                half: motion.half,
            },
            load: &self.buffers.force,
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
    pub(crate) fn set_load_and_supports(&mut self, load_time: f64, support_time: f64) -> Result<(), EngineError> {
        let clock = Instant::now();
        self.form_load(load_time)?;
        let prescribed = &mut self.buffers.prescribed;
        let result = self.fixed.prescribe(&self.mesh, support_time, prescribed);
        let Buffers {
            load, force, mean_load, ..
        } = &mut self.buffers;
        force.copy_from_slice(load);
        mean_load.copy_from_slice(load);
        self.seconds.assemble += clock.elapsed().as_secs_f64();
        result.map_err(|reason| self.stopped(reason))
    }

    /// The loads and the prescribed displacements at the end of a step, and the mean of the loads at both ends.
    fn set_loads_and_supports_of_both_ends(&mut self, dt: f64) -> Result<(), EngineError> {
        self.form_load(self.state.time)?;
        self.buffers.scratch.copy_from_slice(&self.buffers.load);
        let t = self.state.time_after(dt);
        self.set_load_and_supports(t, t)?;
        let Buffers { mean_load, scratch, .. } = &mut self.buffers;
        for (mean, earlier) in mean_load.iter_mut().zip(&*scratch) {
            *mean = 0.5 * (*mean + earlier);
        }
        Ok(())
    }

    /// The external load at a time, unless it is known.
    pub(crate) fn form_load(&mut self, t: f64) -> Result<(), EngineError> {
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
        let forces = self.buffers.mean_load.iter().zip(unbalanced).zip(mask);
        let forces = forces.map(|((load, unbalanced), fixed)| if *fixed { load - unbalanced } else { *load });
        moved.zip(forces).map(|(du, f)| du * f).sum()
    }

    /// Moves the clock and closes the balance of energy.
    pub(crate) fn finish(&mut self, dt: f64, work: f64, mechanical_before: f64) -> Result<(), EngineError> {
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
