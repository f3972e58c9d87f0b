//! Linear systems with prescribed values: conjugate gradients or Cholesky factorisation.

use crate::cg::{self, Workspace};
use crate::cholesky::Cholesky;
use crate::multigrid::MultigridWork;
use crate::parts::Parts;
use crate::preconditioner::Preconditioner;
use crate::vector::{first_not_finite, norm};
use crate::{BlockMatrix, FemError};

/// Steps of iterative refinement after a Cholesky solve.
const REFINEMENTS: usize = 2;

/// What conjugate gradients are preconditioned with.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum PreconditionerKind {
    /// Nothing.
    None,
    /// The diagonal.
    Jacobi,
    /// The 3x3 diagonal blocks.
    #[default]
    BlockJacobi,
    /// Incomplete Cholesky factorisation by 3x3 blocks, without fill.
    BlockIc0,
    /// Smoothed aggregation multigrid: iterations hardly depend on the size of the mesh. Needs
    /// [`LinearSolver::set_positions`].
    Multigrid,
}

/// How systems are solved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SolverKind {
    /// Preconditioned conjugate gradients.
    #[default]
    Cg,
    /// Sparse Cholesky factorisation.
    Cholesky,
}

/// Choices for a [`LinearSolver`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SolverOptions {
    /// Iterative or direct.
    pub kind: SolverKind,
    /// Used by conjugate gradients.
    pub preconditioner: PreconditionerKind,
    /// Largest residual, relative to the right-hand side on the free dofs (prescribed values moved over to it).
    pub tolerance: f64,
    /// Most iterations of conjugate gradients, for each part of a body in pieces.
    pub max_iterations: usize,
}

impl Default for SolverOptions {
    fn default() -> Self {
        SolverOptions {
            kind: SolverKind::Cg,
            preconditioner: PreconditionerKind::BlockJacobi,
            tolerance: 1e-8,
            max_iterations: 2000,
        }
    }
}

/// How a solve went.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SolveInfo {
    /// Iterations of conjugate gradients (the most that a part took, where a body in pieces is solved part by part), or steps
    /// of refinement after a factorisation.
    pub iterations: usize,
    /// True residual `|b - A x| / |b|` on the free dofs, with `b` less the part of prescribed values, computed from `x` as
    /// returned.
    pub residual: f64,
    /// Whether the residual is within the tolerance.
    pub converged: bool,
}

/// Solves systems, and keeps between solves what can be used again: memory, the pattern of a factor.
#[derive(Debug)]
pub struct LinearSolver {
    options: SolverOptions,
    preconditioner: Preconditioner,
    cholesky: Option<Cholesky>,
    workspace: Workspace,
    parts: Parts,
    /// Fixed dofs and those of empty rows.
    fixed: Vec<bool>,
    b: Vec<f64>,
    x: Vec<f64>,
    residual: Vec<f64>,
}

impl LinearSolver {
    /// A solver with the given choices.
    pub fn new(options: SolverOptions) -> Self {
        LinearSolver {
            preconditioner: Preconditioner::new(options.preconditioner),
            options,
            cholesky: None,
            workspace: Workspace::default(),
            parts: Parts::default(),
            fixed: Vec::new(),
            b: Vec::new(),
            x: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// The choices.
    pub fn options(&self) -> &SolverOptions {
        &self.options
    }

    /// What the solver has learnt and the next solve depends on, so that a solver that recalls it goes on with the same bits:
    /// the shift of the incomplete factorisation.
    pub fn memory(&self) -> f64 {
        match &self.preconditioner {
            Preconditioner::BlockIc0(factor) => factor.shift(),
            _ => 0.0,
        }
    }

    /// Takes over what [`Self::memory`] gave. A shift that is not finite or negative is left out.
    pub fn recall(&mut self, memory: f64) {
        if let Preconditioner::BlockIc0(factor) = &mut self.preconditioner
            && memory.is_finite()
            && memory >= 0.0
        {
            factor.set_shift(memory);
        }
    }

    /// Where the vertices are (m), one position a vertex slot: needed by [`PreconditionerKind::Multigrid`], before its first solve
    /// and after every change of the mesh; others do not look at them. With [`crate::Model::Corotated`] best the current
    /// positions: they are read when the levels are set up.
    pub fn set_positions(&mut self, positions: impl IntoIterator<Item = [f64; 3]>) {
        if let Preconditioner::Multigrid(levels) = &mut self.preconditioner {
            levels.set_positions(positions);
        }
    }

    /// What the multigrid preconditioner has done so far, if that is the one.
    pub fn multigrid_work(&self) -> Option<MultigridWork> {
        match &self.preconditioner {
            Preconditioner::Multigrid(levels) => Some(levels.work()),
            _ => None,
        }
    }

    /// Frees what belongs to the old pattern, after a cut. Not needed for correctness: a new pattern is recognised.
    pub fn pattern_changed(&mut self) {
        self.cholesky = None;
    }

    /// Solves `A x = b` on the free dofs, `A` symmetric positive definite there. `fixed` has one entry per dof; `x` holds
    /// start values at free dofs and prescribed values, which stay, at fixed ones. Dofs of empty rows count as fixed.
    ///
    /// At `max_iterations`, `x` is the last iterate and `converged` false. No free dof or `b = 0`: no iterations.
    ///
    /// # Errors
    /// [`FemError::Length`] (also of missing positions), [`FemError::NotFinite`], [`FemError::NotPositiveDefinite`] (a free
    /// piece in statics), [`FemError::OutOfMemory`]; `x` is then as it was.
    pub fn solve(&mut self, a: &BlockMatrix, fixed: &[bool], b: &[f64], x: &mut [f64]) -> Result<SolveInfo, FemError> {
        check(a, fixed, b, x)?;
        self.prepare(a, fixed, b, x);
        let size = norm(&self.b);
        let info = if size == 0.0 {
            self.x.fill(0.0);
            SolveInfo {
                iterations: 0,
                residual: 0.0,
                converged: true,
            }
        } else {
            let iterations = match self.options.kind {
                SolverKind::Cg => self.conjugate_gradients(a, size),
                SolverKind::Cholesky => self.direct(a, size),
            }
            .map_err(|e| nan_in_matrix(a).unwrap_or(e))?;
            let residual = self.true_residual(a, size);
            if !residual.is_finite() {
                return Err(FemError::NotFinite {
                    what: "the solution",
                    index: first_not_finite(&self.x).unwrap_or(0),
                });
            }
            SolveInfo {
                iterations,
                residual,
                converged: residual <= self.options.tolerance,
            }
        };
        for ((to, from), fixed) in x.iter_mut().zip(&self.x).zip(&self.fixed) {
            if !fixed {
                *to = *from;
            }
        }
        Ok(info)
    }

    /// Moves prescribed values to the right-hand side: `self.b`, and `self.x` zero at fixed dofs.
    fn prepare(&mut self, a: &BlockMatrix, fixed: &[bool], b: &[f64], x: &[f64]) {
        self.fixed.clear();
        self.fixed.extend_from_slice(fixed);
        for (i, fixed) in self.fixed.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            if a.pattern.range(i).is_empty() {
                *fixed = [true; 3];
            }
        }
        let fixed = &self.fixed;
        let prescribed = |d: usize| fixed[d] && x[d] != 0.0 && !a.pattern.range(d / 3).is_empty();
        self.b.clear();
        self.b.extend_from_slice(b);
        self.x.clear();
        self.x.extend_from_slice(x);
        self.residual.resize(b.len(), 0.0);
        if (0..x.len()).any(prescribed) {
            for (x, fixed) in self.x.iter_mut().zip(fixed) {
                if !fixed {
                    *x = 0.0;
                }
            }
            a.multiply(&self.x, &mut self.residual);
            self.b.iter_mut().zip(&self.residual).for_each(|(b, r)| *b -= r);
            self.x.copy_from_slice(x);
        }
        for (d, fixed) in fixed.iter().enumerate() {
            if *fixed {
                self.b[d] = 0.0;
                self.x[d] = 0.0;
            }
        }
    }

    /// Each part of the body is solved by itself if the preconditioner can do so; together they meet the tolerance.
    fn conjugate_gradients(&mut self, a: &BlockMatrix, size: f64) -> Result<usize, FemError> {
        self.preconditioner.refresh(a, &self.fixed)?;
        let count = match self.preconditioner.takes_all() {
            true => 1,
            false => self.parts.find(a, &self.fixed),
        };
        let target = self.options.tolerance * size / (count as f64).sqrt();
        let mut iterations = 0;
        for k in 0..count {
            let rows = match count {
                1 => self.parts.all(a),
                _ => self.parts.part(k),
            };
            let own = cg::solve(
                a,
                rows,
                &self.fixed,
                &self.preconditioner,
                &self.b,
                &mut self.x,
                target,
                self.options.max_iterations,
                &mut self.workspace,
            )?;
            iterations = iterations.max(own);
        }
        self.preconditioner.note_iterations(iterations);
        Ok(iterations)
    }

    fn direct(&mut self, a: &BlockMatrix, size: f64) -> Result<usize, FemError> {
        let mut cholesky = match self.cholesky.take().filter(|c| c.fits(a, &self.fixed)) {
            Some(known) => known,
            None => Cholesky::analyse(a, &self.fixed)?,
        };
        cholesky.factor(a)?;
        self.x.fill(0.0);
        cholesky.add_solution(&self.b, &mut self.x);
        let mut refinements = 0;
        while self.true_residual(a, size) > self.options.tolerance && refinements < REFINEMENTS {
            cholesky.add_solution(&self.residual, &mut self.x);
            refinements += 1;
        }
        self.cholesky = Some(cholesky);
        Ok(refinements)
    }

    /// `self.residual := b - A x` on the free dofs; its norm over `size`.
    fn true_residual(&mut self, a: &BlockMatrix, size: f64) -> f64 {
        let all = self.parts.all(a);
        cg::residual(a, all, &self.fixed, &self.b, &self.x, &mut self.residual) / size
    }
}

fn check(a: &BlockMatrix, fixed: &[bool], b: &[f64], x: &[f64]) -> Result<(), FemError> {
    let expected = 3 * a.rows();
    for (what, found) in [("`fixed`", fixed.len()), ("`b`", b.len()), ("`x`", x.len())] {
        if found != expected {
            return Err(FemError::Length { what, expected, found });
        }
    }
    for (what, values) in [("`b`", b), ("`x`", x)] {
        if let Some(index) = first_not_finite(values) {
            return Err(FemError::NotFinite { what, index });
        }
    }
    Ok(())
}

/// The row of a matrix that holds a NaN or an infinite entry, if one does.
fn nan_in_matrix(a: &BlockMatrix) -> Option<FemError> {
    let row = (0..a.rows()).find(|&i| first_not_finite(a.row(i).1.as_flattened()).is_some())?;
    Some(FemError::NotFinite {
        what: "the matrix",
        index: 3 * row,
    })
}
