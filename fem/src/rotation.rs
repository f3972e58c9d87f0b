//! The rotation in a deformation gradient.

use crate::eigen::symmetric_eigen;

/// Below this, `det F` relative to `|F|^3` leaves the fast path (a pure rotation has 0.19).
const SAFE_DETERMINANT: f64 = 1e-5;

/// Steps of Newton's iteration; three to six are taken near a rotation, up to ten at strong stretches.
const NEWTON_STEPS: usize = 16;

/// The rotation `R` closest to `F` (both row-major), of several side by side in vector registers: it maximises `tr(R^T F)`, so `F = R S` with `S` symmetric. If
/// `det F > 0`, `R` is the polar factor and `S` positive definite; if `det F < 0`, the smallest singular value counts as
/// negative, so that `R` goes on continuously through `det F = 0`. `F = 0` gives the identity.
///
/// `R` is unique unless the two smallest signed singular values add up to zero; there it jumps, but stays a rotation. For
/// `F` that is not finite, the identity.
///
/// Away from `det F = 0`: Newton's iteration with scaling by norms (Higham, SIAM J. Sci. Stat. Comput. 7, 1986); else
/// the largest eigenvector of Davenport's matrix (the q-method of attitude determination).
///
/// The bits of each do not depend on the others.
#[inline(always)]
pub(crate) fn rotations<const L: usize>(f: &[[f64; 9]; L]) -> [[f64; 9]; L] {
    let mut x = [[0.0; L]; 9];
    for k in 0..9 {
        for l in 0..L {
            x[k][l] = f[l][k];
        }
    }
    let found = newton(&mut x);
    let mut out = [[0.0; 9]; L];
    for l in 0..L {
        for k in 0..9 {
            out[l][k] = x[k][l];
        }
        if !found[l] {
            out[l] = davenport(&f[l]);
        }
    }
    out
}

/// Rotations of deformation gradients of cells with `N` corners side by side: [`rotations`], of triangles in the plane.
#[inline(always)]
pub(crate) fn rotations_of_cells<const N: usize, const L: usize>(f: &[[f64; 9]; L]) -> [[f64; 9]; L] {
    if N == 3 {
        f.map(|f| planar_rotation(&f))
    } else {
        rotations(f)
    }
}

/// The rotation about z closest to `F` in the plane: it maximises `tr(R^T F)`, so that `F = R S` with `S` symmetric and
/// `tr(S)` in the plane not negative, whatever the sign of `det F`. Unique and continuous unless that trace is zero (`F`
/// vanishes or mirrors without stretching); there, and where `F` is not finite, the identity.
#[inline]
fn planar_rotation(f: &[f64; 9]) -> [f64; 9] {
    let (c, s) = (f[0] + f[4], f[3] - f[1]);
    let size = c.hypot(s);
    let (c, s) = if size > 0.0 && size.is_finite() {
        (c / size, s / size)
    } else {
        (1.0, 0.0)
    };
    [c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0]
}

/// Cofactors of matrices side by side.
#[inline(always)]
fn cofactors<const L: usize>(x: &[[f64; L]; 9]) -> [[f64; L]; 9] {
    const MINORS: [[usize; 4]; 9] = [
        [4, 8, 5, 7],
        [5, 6, 3, 8],
        [3, 7, 4, 6],
        [2, 7, 1, 8],
        [0, 8, 2, 6],
        [1, 6, 0, 7],
        [1, 5, 2, 4],
        [2, 3, 0, 5],
        [0, 4, 1, 3],
    ];
    let mut cof = [[0.0; L]; 9];
    for (cof, [a, b, c, d]) in cof.iter_mut().zip(MINORS) {
        for l in 0..L {
            cof[l] = x[a][l] * x[b][l] - x[c][l] * x[d][l];
        }
    }
    cof
}

#[inline(always)]
fn norms_squared<const L: usize>(x: &[[f64; L]; 9]) -> [f64; L] {
    let mut s = [0.0; L];
    for x in x {
        for l in 0..L {
            s[l] += x[l] * x[l];
        }
    }
    s
}

/// Newton's iteration `X <- (gamma X + X^-T / gamma) / 2` on matrices side by side; false where `det F` is not safely
/// positive. A lane that has converged stays as it is while others go on.
#[inline(always)]
fn newton<const L: usize>(x: &mut [[f64; L]; 9]) -> [bool; L] {
    let mut active = [true; L];
    let mut found = [false; L];
    for step in 0..NEWTON_STEPS {
        let cof = cofactors(x);
        let (size, cof_size) = (norms_squared(x), norms_squared(&cof));
        let (mut keep, mut add) = ([0.0; L], [0.0; L]);
        for l in 0..L {
            let det = x[0][l] * cof[0][l] + x[1][l] * cof[1][l] + x[2][l] * cof[2][l];
            if step == 0 {
                active[l] = det > SAFE_DETERMINANT * size[l] * size[l].sqrt();
            }
            // X^-T = cof / det; gamma^2 = |X^-T| / |X|, one when X is a rotation
            let gamma_squared = (cof_size[l] / size[l]).sqrt() / det;
            let gamma = if (gamma_squared - 1.0).abs() < 1e-2 {
                1.0
            } else {
                gamma_squared.sqrt()
            };
            keep[l] = 0.5 * gamma;
            add[l] = 0.5 / (gamma * det);
        }
        let mut change = [0.0; L];
        for k in 0..9 {
            for l in 0..L {
                let next = keep[l] * x[k][l] + add[l] * cof[k][l];
                let difference = next - x[k][l];
                change[l] += difference * difference;
                x[k][l] = if active[l] { next } else { x[k][l] };
            }
        }
        for l in 0..L {
            // the error after a step is half the square of the one before
            let converged = active[l] & (change[l] < 1e-16);
            found[l] |= converged;
            active[l] &= !converged;
        }
        if active == [false; L] {
            break;
        }
    }
    found
}

/// Largest eigenvector of Davenport's 4x4 matrix, as a rotation.
#[cold]
fn davenport(f: &[f64; 9]) -> [f64; 9] {
    let size = f
        .iter()
        .fold(0.0, |m: f64, x| if x.is_nan() { f64::INFINITY } else { m.max(x.abs()) });
    if !(size.is_finite() && size > 0.0) {
        return [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    }
    let m = f.map(|x| x / size);
    // quadratic form q -> tr(R(q)^T F), q = (w, x, y, z)
    let (wx, wy, wz) = (m[7] - m[5], m[2] - m[6], m[3] - m[1]);
    let (xy, xz, yz) = (m[1] + m[3], m[2] + m[6], m[5] + m[7]);
    let a = [
        [m[0] + m[4] + m[8], wx, wy, wz],
        [wx, m[0] - m[4] - m[8], xy, xz],
        [wy, xy, m[4] - m[0] - m[8], yz],
        [wz, xz, yz, m[8] - m[0] - m[4]],
    ];
    let (values, vectors) = symmetric_eigen(a.map(|row| row.map(|x| [x])), 7);
    let best = (1..4).fold(0, |b, k| if values[k] > values[b] { k } else { b });
    rotation_of_quaternion([0, 1, 2, 3].map(|i| vectors[i][best][0]))
}

fn rotation_of_quaternion(q: [f64; 4]) -> [f64; 9] {
    let n = q.iter().map(|x| x * x).sum::<f64>();
    let s = 2.0 / n;
    let [w, x, y, z] = q;
    [
        1.0 - s * (y * y + z * z),
        s * (x * y - w * z),
        s * (x * z + w * y),
        s * (x * y + w * z),
        1.0 - s * (x * x + z * z),
        s * (y * z - w * x),
        s * (x * z - w * y),
        s * (y * z + w * x),
        1.0 - s * (x * x + y * y),
    ]
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};

    use super::*;
    use crate::element::matrix;

    fn rotation(f: &[f64; 9]) -> [f64; 9] {
        rotations(&[*f])[0]
    }

    fn row_major(m: &Matrix3<f64>) -> [f64; 9] {
        m.transpose().as_slice().try_into().unwrap()
    }

    fn turn(axis: [f64; 3], degrees: f64) -> Matrix3<f64> {
        Rotation3::new(Vector3::from(axis).normalize() * degrees.to_radians()).into_inner()
    }

    fn assert_rotation(r: &Matrix3<f64>) {
        assert!((r.transpose() * r - Matrix3::identity()).norm() < 1e-14, "{r}");
        assert!((r.determinant() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn polar_factor_to_round_off() {
        for degrees in [0.0, 1e-9, 10.0, 30.0, 90.0, 179.0, 180.0] {
            let r = turn([1.0, -2.0, 0.5], degrees);
            for stretch in [
                [1.0, 1.0, 1.0],
                [1.1, 0.9, 1.02],
                [3.0, 0.5, 0.2],
                [100.0, 1.0, 0.5],
                [1e-3, 2e-3, 1e-3],
            ] {
                let q = turn([0.3, 0.1, 0.9], 40.0);
                let s = q * Matrix3::from_diagonal(&Vector3::from(stretch)) * q.transpose();
                let f = row_major(&(r * s));
                assert_eq!(newton(&mut f.map(|x| [x])), [true]);
                for found in [matrix(&rotation(&f)), matrix(&davenport(&f))] {
                    assert_rotation(&found);
                    let gap = stretch[1].min(stretch[0]) / stretch[0].max(stretch[2]);
                    assert!(
                        (found - r).norm() < 4e-15 / gap.clamp(1e-4, 1.0),
                        "{degrees} {stretch:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn inversion_is_continuous_and_the_smallest_value_is_flipped() {
        let (r, q) = (turn([1.0, 1.0, 0.2], 50.0), turn([0.0, 1.0, 0.3], 20.0));
        let mut last: Option<Matrix3<f64>> = None;
        for step in -100..=100 {
            let smallest = 1e-3 * f64::from(step);
            let s = q * Matrix3::from_diagonal(&Vector3::new(1.2, smallest, 0.8)) * q.transpose();
            let found = matrix(&rotation(&row_major(&(r * s))));
            assert_rotation(&found);
            assert!((found - r).norm() < 1e-13, "{smallest}: {}", (found - r).norm());
            if let Some(before) = last {
                assert!((found - before).norm() < 1e-12);
            }
            last = Some(found);
        }
    }

    #[test]
    fn many_at_once_give_the_bits_of_one() {
        let stretches = [
            [1.0, 1.0, 1.0],
            [3.0, 0.2, 0.5],
            [1.0, 1.0, -0.1],
            [0.0, 0.0, 0.0],
            [1.1, 0.9, 1.3],
        ];
        let f =
            stretches.map(|s| row_major(&(turn([1.0, 0.2, 0.0], 30.0) * Matrix3::from_diagonal(&Vector3::from(s)))));
        assert_eq!(rotations(&f), f.map(|f| rotation(&f)));
    }

    #[test]
    fn in_the_plane_the_trace_of_the_stretch_is_kept_positive() {
        // stretches with positive sum, one of them negative or zero: an inverted or flat triangle
        for stretch in [
            [1.0, 1.0],
            [3.0, 0.2],
            [1.2, 0.0],
            [1.2, -0.5],
            [1e-200, 1e-200],
            [1e200, 3e199],
        ] {
            for degrees in [0.0, 1e-9, 30.0, 90.0, 135.0, 180.0, -60.0] {
                let (r, q) = (turn([0.0, 0.0, 1.0], degrees), turn([0.0, 0.0, 1.0], 25.0));
                let s = q * Matrix3::from_diagonal(&Vector3::new(stretch[0], stretch[1], 1.0)) * q.transpose();
                let found = matrix(&planar_rotation(&row_major(&(r * s))));
                assert_rotation(&found);
                assert!((found - r).norm() < 1e-14, "{stretch:?} {degrees}: {found}");
                if stretch[1] > 1e-3 && stretch[0] < 1e3 {
                    assert!((found - matrix(&rotation(&row_major(&(r * s))))).norm() < 1e-13);
                }
            }
        }
        let identity = row_major(&Matrix3::identity());
        let mirror = row_major(&Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0)));
        for f in [[0.0; 9], [f64::NAN; 9], [f64::INFINITY; 9], mirror] {
            assert_eq!(planar_rotation(&f), identity);
        }
    }

    #[test]
    fn degenerate_gradients_give_rotations() {
        assert_eq!(rotation(&[0.0; 9]), row_major(&Matrix3::identity()));
        assert_eq!(rotation(&[f64::NAN; 9]), row_major(&Matrix3::identity()));
        let cases = [
            Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 0.0)),
            Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, -1.0)),
            Matrix3::from_diagonal(&Vector3::new(1.0, 0.5, -0.5)),
            Matrix3::repeat(1.0),
            Matrix3::repeat(1e-200),
            Matrix3::repeat(1e200),
        ];
        for f in cases {
            assert_rotation(&matrix(&rotation(&row_major(&f))));
        }
    }
}
