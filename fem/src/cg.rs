//! Conjugate gradients (faer) on a block matrix with fixed dofs.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::matrix_free::{InitialGuessStatus, LinOp, Precond};
use faer::{MatMut, MatRef, Par};

use crate::preconditioner::Preconditioner;
use crate::{BlockMatrix, FemError};

/// A matrix as it acts on the free dofs: what it gives at fixed ones is set to zero. Its arguments are zero there.
#[derive(Debug)]
struct Operator<'a> {
    matrix: &'a BlockMatrix,
    fixed: &'a [bool],
}

#[derive(Debug)]
struct Inverse<'a>(&'a Preconditioner, usize);

/// The single column of each, as slices.
fn with_columns(out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, f: impl FnOnce(&[f64], &mut [f64])) {
    let out = out.col_mut(0).try_as_col_major_mut().map(|c| c.as_slice_mut());
    let rhs = rhs.col(0).try_as_col_major().map(|c| c.as_slice());
    debug_assert!(out.is_some() && rhs.is_some(), "columns are contiguous");
    if let (Some(out), Some(rhs)) = (out, rhs) {
        f(rhs, out);
    }
}

impl LinOp<f64> for Operator<'_> {
    fn apply_scratch(&self, _: usize, _: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.fixed.len()
    }

    fn ncols(&self) -> usize {
        self.fixed.len()
    }

    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        with_columns(out, rhs, |x, y| masked_multiply(self.matrix, self.fixed, x, y));
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

impl LinOp<f64> for Inverse<'_> {
    fn apply_scratch(&self, _: usize, _: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.1
    }

    fn ncols(&self) -> usize {
        self.1
    }

    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        with_columns(out, rhs, |r, z| self.0.apply(r, z));
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

impl Precond<f64> for Inverse<'_> {}

/// `y := A x`, zero at fixed dofs.
pub(crate) fn masked_multiply(a: &BlockMatrix, fixed: &[bool], x: &[f64], y: &mut [f64]) {
    a.multiply(x, y);
    for (y, &fixed) in y.iter_mut().zip(fixed) {
        if fixed {
            *y = 0.0;
        }
    }
}

/// Memory of the iteration, kept between solves.
pub(crate) struct Workspace {
    buffer: MemBuffer,
}

impl Default for Workspace {
    fn default() -> Self {
        Workspace {
            buffer: MemBuffer::new(StackReq::EMPTY),
        }
    }
}

impl std::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Workspace")
    }
}

/// Iterates on `A x = b` from `x` until the residual is below `tolerance * |b|` or for `max_iterations`; the number of
/// iterations. `x` and `b` are zero at fixed dofs.
///
/// # Errors
/// [`FemError::NotPositiveDefinite`] if a direction of negative curvature (or a NaN) turns up.
#[allow(clippy::too_many_arguments)]
pub(crate) fn iterate(
    matrix: &BlockMatrix,
    fixed: &[bool],
    preconditioner: &Preconditioner,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
    workspace: &mut Workspace,
) -> Result<usize, FemError> {
    let n = b.len();
    let operator = Operator { matrix, fixed };
    let inverse = Inverse(preconditioner, n);
    let need = conjugate_gradient_scratch(&inverse, &operator, 1, Par::Seq);
    if !MemStack::new(&mut workspace.buffer).can_hold(need) {
        workspace.buffer = MemBuffer::new(need);
    }
    let params = CgParams {
        // `Zero` would leave faer's residual uninitialised
        initial_guess: InitialGuessStatus::MaybeNonZero,
        abs_tolerance: f64::MIN_POSITIVE,
        rel_tolerance: tolerance,
        max_iters: max_iterations,
        ..CgParams::default()
    };
    let mut iterations = 0;
    let result = conjugate_gradient(
        MatMut::from_column_major_slice_mut(x, n, 1),
        &inverse,
        &operator,
        MatRef::from_column_major_slice(b, n, 1),
        params,
        |_| iterations += 1,
        Par::Seq,
        MemStack::new(&mut workspace.buffer),
    );
    match result {
        Ok(_) | Err(CgError::NoConvergence { .. }) => Ok(iterations),
        Err(CgError::NonPositiveDefiniteOperator | CgError::NonPositiveDefinitePreconditioner) => {
            Err(FemError::NotPositiveDefinite {
                found_by: "conjugate gradients",
            })
        }
    }
}
