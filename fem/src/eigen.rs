//! Eigenvalues of small symmetric matrices, several side by side.

/// `N x N` matrices side by side: entry, then lane.
pub(crate) type Lanes<const N: usize, const L: usize> = [[[f64; L]; N]; N];

/// Eigenvalues and eigenvectors (columns) of symmetric matrices by `sweeps` cyclic Jacobi sweeps; in no particular order.
///
/// Convergence is quadratic: 5 sweeps reach round-off for 3x3, 7 for 4x4. The number is fixed so that the bits of a lane do
/// not depend on the others.
#[inline(always)]
pub(crate) fn symmetric_eigen<const N: usize, const L: usize>(
    mut a: Lanes<N, L>,
    sweeps: usize,
) -> ([[f64; L]; N], Lanes<N, L>) {
    let mut v = [[[0.0; L]; N]; N];
    for (i, row) in v.iter_mut().enumerate() {
        row[i] = [1.0; L];
    }
    for _ in 0..sweeps {
        for p in 0..N {
            for q in p + 1..N {
                let (c, s) = jacobi_angle(&a[p][p], &a[q][q], &a[p][q]);
                for row in a.iter_mut().chain(v.iter_mut()) {
                    turn_columns(row, p, q, &c, &s);
                }
                turn_rows(&mut a, p, q, &c, &s);
            }
        }
    }
    let mut values = [[0.0; L]; N];
    for (i, value) in values.iter_mut().enumerate() {
        *value = a[i][i];
    }
    (values, v)
}

/// Cosine and sine of the rotation that makes the entry `pq` vanish.
#[inline(always)]
fn jacobi_angle<const L: usize>(pp: &[f64; L], qq: &[f64; L], pq: &[f64; L]) -> ([f64; L], [f64; L]) {
    let (mut c, mut s) = ([1.0; L], [0.0; L]);
    for l in 0..L {
        let theta = (qq[l] - pp[l]) / (2.0 * pq[l]);
        let tangent = 1.0f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
        // 0/0 where the entry has vanished
        let t = if pq[l] == 0.0 { 0.0 } else { tangent };
        c[l] = 1.0 / (t * t + 1.0).sqrt();
        s[l] = t * c[l];
    }
    (c, s)
}

#[inline(always)]
fn turn_columns<const N: usize, const L: usize>(
    row: &mut [[f64; L]; N],
    p: usize,
    q: usize,
    c: &[f64; L],
    s: &[f64; L],
) {
    for l in 0..L {
        let (x, y) = (row[p][l], row[q][l]);
        row[p][l] = c[l] * x - s[l] * y;
        row[q][l] = s[l] * x + c[l] * y;
    }
}

#[inline(always)]
fn turn_rows<const N: usize, const L: usize>(a: &mut Lanes<N, L>, p: usize, q: usize, c: &[f64; L], s: &[f64; L]) {
    for k in 0..N {
        for l in 0..L {
            let (x, y) = (a[p][k][l], a[q][k][l]);
            a[p][k][l] = c[l] * x - s[l] * y;
            a[q][k][l] = s[l] * x + c[l] * y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<const N: usize>(a: [[f64; N]; N], sweeps: usize) {
        let (values, v) = symmetric_eigen(a.map(|row| row.map(|x| [x])), sweeps);
        let size = a.as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for k in 0..N {
            for i in 0..N {
                let av: f64 = (0..N).map(|j| a[i][j] * v[j][k][0]).sum();
                assert!((av - values[k][0] * v[i][k][0]).abs() <= 4e-15 * size, "{a:?}");
                let dot: f64 = (0..N).map(|j| v[j][k][0] * v[j][i][0]).sum();
                assert!((dot - f64::from(u8::from(i == k))).abs() < 4e-15);
            }
        }
    }

    #[test]
    fn vectors_and_values_to_round_off() {
        let mut state = 1u64;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / (1u64 << 30) as f64 - 1.0
        };
        for round in 0..2000 {
            let (mut a, mut b) = ([[0.0; 3]; 3], [[0.0; 4]; 4]);
            let decay = 10f64.powi(-(round % 12));
            for i in 0..4 {
                for j in 0..=i {
                    // from full to almost diagonal, with and without equal eigenvalues
                    let x = if i == j { (next() * 2.0).round() } else { decay * next() };
                    (b[i][j], b[j][i]) = (x, x);
                    if i < 3 {
                        (a[i][j], a[j][i]) = (x, x);
                    }
                }
            }
            check(a, 5);
            check(b, 7);
        }
        check([[0.0; 3]; 3], 5);
        check([[1.0; 3]; 3], 5);
        check([[1.0; 4]; 4], 7);
    }
}
