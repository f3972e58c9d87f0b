//! Conjugate gradients (faer) on a block matrix with fixed dofs.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::matrix_free::{InitialGuessStatus, LinOp, Precond};
use faer::{MatMut, MatRef, Par};

use crate::parts::Rows;
use crate::preconditioner::Preconditioner;
use crate::vector::norm;
use crate::{BlockMatrix, FemError};

/// A matrix as it acts on the free dofs of some rows: what it gives at fixed ones is set to zero. Its arguments are zero there.
#[derive(Debug)]
struct Operator<'a> {
    matrix: &'a BlockMatrix,
    rows: Rows<'a>,
    fixed: &'a [bool],
}

#[derive(Debug)]
struct Inverse<'a> {
    preconditioner: &'a Preconditioner,
    rows: Rows<'a>,
}

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
        3 * self.rows.len()
    }

    fn ncols(&self) -> usize {
        3 * self.rows.len()
    }

    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        with_columns(out, rhs, |x, y| self.matrix.multiply_rows(self.rows, self.fixed, x, y));
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
        3 * self.rows.len()
    }

    fn ncols(&self) -> usize {
        3 * self.rows.len()
    }

    fn apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, _: Par, _: &mut MemStack) {
        with_columns(out, rhs, |r, z| self.preconditioner.apply(self.rows, r, z));
    }

    fn conj_apply(&self, out: MatMut<'_, f64>, rhs: MatRef<'_, f64>, par: Par, stack: &mut MemStack) {
        self.apply(out, rhs, par, stack);
    }
}

impl Precond<f64> for Inverse<'_> {}

/// Rounds of conjugate gradients: another one starts when round-off has let the recurrence claim more than the true
/// residual holds.
const ROUNDS: usize = 3;

/// Memory of the iteration, kept between solves.
pub(crate) struct Workspace {
    buffer: MemBuffer,
    b: Vec<f64>,
    x: Vec<f64>,
    residual: Vec<f64>,
}

impl Default for Workspace {
    fn default() -> Self {
        Workspace {
            buffer: MemBuffer::new(StackReq::EMPTY),
            b: Vec::new(),
            x: Vec::new(),
            residual: Vec::new(),
        }
    }
}

impl std::fmt::Debug for Workspace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Workspace")
    }
}

/// Solves `A x = b` on the free dofs of some rows that no others are coupled to, from the values of `x` there, until the norm of the
/// true residual is below `target`, for `max_iterations`, or until round-off lets it come no closer; the number of iterations. `b` and
/// `x` are those of all rows.
///
/// # Errors
/// [`FemError::NotPositiveDefinite`] if a direction of negative curvature (or a NaN) turns up; `x` is then as it was.
#[allow(clippy::too_many_arguments)]
pub(crate) fn solve(
    matrix: &BlockMatrix,
    rows: Rows<'_>,
    fixed: &[bool],
    preconditioner: &Preconditioner,
    b: &[f64],
    x: &mut [f64],
    target: f64,
    max_iterations: usize,
    workspace: &mut Workspace,
) -> Result<usize, FemError> {
    let n = 3 * rows.len();
    let dofs = || rows.iter().flat_map(|i| 3 * i..3 * i + 3);
    let Workspace {
        buffer,
        b: own_b,
        x: own_x,
        residual: r,
    } = workspace;
    let gather = |v: &[f64], own: &mut Vec<f64>| {
        own.clear();
        own.extend(dofs().map(|d| if fixed[d] { 0.0 } else { v[d] }));
    };
    gather(b, own_b);
    gather(x, own_x);
    r.resize(n, 0.0);
    let operator = Operator { matrix, rows, fixed };
    let inverse = Inverse { preconditioner, rows };
    let need = conjugate_gradient_scratch(&inverse, &operator, 1, Par::Seq);
    if !MemStack::new(buffer).can_hold(need) {
        *buffer = MemBuffer::new(need);
    }
    let mut iterations = 0;
    for _ in 0..ROUNDS {
        let before = iterations;
        let params = CgParams {
            // `Zero` would leave faer's residual uninitialised
            initial_guess: InitialGuessStatus::MaybeNonZero,
            abs_tolerance: target.max(f64::MIN_POSITIVE),
            rel_tolerance: 0.0,
            max_iters: max_iterations - iterations,
            ..CgParams::default()
        };
        let result = conjugate_gradient(
            MatMut::from_column_major_slice_mut(own_x, n, 1),
            &inverse,
            &operator,
            MatRef::from_column_major_slice(own_b, n, 1),
            params,
            |_| iterations += 1,
            Par::Seq,
            MemStack::new(buffer),
        );
        match result {
            Ok(_) | Err(CgError::NoConvergence { .. }) => {}
            Err(CgError::NonPositiveDefiniteOperator | CgError::NonPositiveDefinitePreconditioner) => {
                return Err(FemError::NotPositiveDefinite {
                    found_by: "conjugate gradients",
                });
            }
        }
        let is_over = iterations == before || iterations >= max_iterations;
        if is_over || residual(matrix, rows, fixed, own_b, own_x, r) <= target {
            break;
        }
    }
    for (d, own) in dofs().zip(own_x) {
        if !fixed[d] {
            x[d] = *own;
        }
    }
    Ok(iterations)
}

/// `r := b - A x` on the free dofs of some rows, for vectors of these rows; its norm. `b` and `x` are zero at `fixed` dofs.
pub(crate) fn residual(
    matrix: &BlockMatrix,
    rows: Rows<'_>,
    fixed: &[bool],
    b: &[f64],
    x: &[f64],
    r: &mut [f64],
) -> f64 {
    matrix.multiply_rows(rows, fixed, x, r);
    r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
    norm(r)
}
