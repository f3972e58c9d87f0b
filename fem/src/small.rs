//! Algebra of single 3x3 blocks, row-major.

/// A 3x3 block, row-major.
pub(crate) type Block = [f64; 9];

/// The identity.
pub(crate) const IDENTITY: Block = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// `y - B x`.
#[inline(always)]
pub(crate) fn minus_times(y: [f64; 3], b: &Block, x: &[f64; 3]) -> [f64; 3] {
    let p = times(b, x);
    [y[0] - p[0], y[1] - p[1], y[2] - p[2]]
}

/// `y - B^T x`.
#[inline(always)]
pub(crate) fn minus_transposed_times(y: [f64; 3], b: &Block, x: &[f64; 3]) -> [f64; 3] {
    let p = transposed_times(b, x);
    [y[0] - p[0], y[1] - p[1], y[2] - p[2]]
}

/// `B x`.
#[inline(always)]
pub(crate) fn times(b: &Block, x: &[f64; 3]) -> [f64; 3] {
    [
        b[0] * x[0] + b[1] * x[1] + b[2] * x[2],
        b[3] * x[0] + b[4] * x[1] + b[5] * x[2],
        b[6] * x[0] + b[7] * x[1] + b[8] * x[2],
    ]
}

/// `B^T x`.
#[inline(always)]
pub(crate) fn transposed_times(b: &Block, x: &[f64; 3]) -> [f64; 3] {
    [
        b[0] * x[0] + b[3] * x[1] + b[6] * x[2],
        b[1] * x[0] + b[4] * x[1] + b[7] * x[2],
        b[2] * x[0] + b[5] * x[1] + b[8] * x[2],
    ]
}

/// `to += b`.
#[inline(always)]
pub(crate) fn add(to: &mut Block, b: &Block) {
    for k in 0..9 {
        to[k] += b[k];
    }
}

/// `A B^T`.
#[inline(always)]
pub(crate) fn times_transposed(a: &Block, b: &Block) -> Block {
    let mut c = [0.0; 9];
    for i in 0..3 {
        for j in 0..3 {
            c[3 * i + j] = a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2];
        }
    }
    c
}

/// Inverse `G^-1` of the Cholesky factor of a symmetric block `A = G G^T` (lower triangle read), lower triangular; `None`
/// if `A` is not safely positive definite, that is, if a pivot is below `1e-14` of its diagonal entry.
#[inline]
pub(crate) fn inverse_cholesky(a: &Block) -> Option<Block> {
    const LEAST_PIVOT: f64 = 1e-14;
    let good = |pivot: f64, diagonal: f64| pivot > LEAST_PIVOT * diagonal && pivot.is_finite() && pivot > 0.0;
    if !good(a[0], a[0]) {
        return None;
    }
    let g00 = a[0].sqrt();
    let (g10, g20) = (a[3] / g00, a[6] / g00);
    let p1 = a[4] - g10 * g10;
    if !good(p1, a[4]) {
        return None;
    }
    let g11 = p1.sqrt();
    let g21 = (a[7] - g20 * g10) / g11;
    let p2 = a[8] - g20 * g20 - g21 * g21;
    if !good(p2, a[8]) {
        return None;
    }
    let (i0, i1, i2) = (1.0 / g00, 1.0 / g11, 1.0 / p2.sqrt());
    let h10 = -g10 * i0 * i1;
    let h21 = -g21 * i1 * i2;
    let h20 = -(g20 * i0 + g21 * h10) * i2;
    Some([i0, 0.0, 0.0, h10, i1, 0.0, h20, h21, i2])
}

/// The block with the rows marked in `rows` and the columns marked in `cols` set to zero.
#[inline]
pub(crate) fn masked(b: &Block, rows: &[bool], cols: &[bool]) -> Block {
    let mut out = *b;
    for i in 0..3 {
        for j in 0..3 {
            if rows[i] || cols[j] {
                out[3 * i + j] = 0.0;
            }
        }
    }
    out
}

/// A diagonal block with the rows and columns of fixed dofs replaced by those of the identity.
#[inline]
pub(crate) fn masked_diagonal(b: &Block, fixed: &[bool]) -> Block {
    let mut out = masked(b, fixed, fixed);
    for i in 0..3 {
        if fixed[i] {
            out[4 * i] = 1.0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_of_the_cholesky_factor() {
        let a = [4.0, 1.0, -0.5, 1.0, 3.0, 0.2, -0.5, 0.2, 2.0];
        let h = inverse_cholesky(&a).unwrap();
        // H A H^T, A symmetric
        let one = times_transposed(&times_transposed(&h, &a), &h);
        for k in 0..9 {
            assert!((one[k] - IDENTITY[k]).abs() < 1e-15);
        }
        assert!(inverse_cholesky(&[1.0; 9]).is_none());
        assert!(inverse_cholesky(&[f64::NAN; 9]).is_none());
        assert!(inverse_cholesky(&[0.0; 9]).is_none());
    }
}
