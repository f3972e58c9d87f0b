//! The corotated model of one cell: energy, stress and what its tangent needs.
//!
//! With `F = R S`, energy `V (mu |F - R|^2 + lambda/2 tr^2(S - I))`. Its gradient is exact with `R` held fixed, because
//! the rotation maximises `tr(R^T F)`. The second derivative adds the turning of `R`.

use crate::eigen::symmetric_eigen;
use crate::element::{CornerBlocks, Element, Vec3};
use crate::material::Lame;
use crate::small::{Block, times};

/// Least sum of two signed stretches in the tangent; smaller ones (collapse, inversion) would make it unbounded.
const LEAST_STRETCH_SUM: f64 = 1e-2;

/// `tr(S - I)` of `F` and its rotation, row-major.
#[inline]
fn stretch_trace(f: &[f64; 9], r: &[f64; 9]) -> f64 {
    let mut t = 0.0;
    for k in 0..9 {
        t += r[k] * (f[k] - r[k]);
    }
    t
}

/// Energy of a `volume` (m³) of a material (J).
#[inline]
pub(crate) fn energy(lame: &Lame, volume: f64, f: &[f64; 9], r: &[f64; 9]) -> f64 {
    let t = stretch_trace(f, r);
    let mut d = 0.0;
    for k in 0..9 {
        d += (f[k] - r[k]) * (f[k] - r[k]);
    }
    volume * (lame.mu * d + 0.5 * lame.lambda * t * t)
}

/// First Piola-Kirchhoff stress `2 mu (F - R) + lambda tr(S - I) R` (Pa), row-major.
#[inline]
pub(crate) fn stress(lame: &Lame, f: &[f64; 9], r: &[f64; 9]) -> [f64; 9] {
    let pressure = lame.lambda * stretch_trace(f, r);
    let mut p = [0.0; 9];
    for k in 0..9 {
        p[k] = 2.0 * lame.mu * (f[k] - r[k]) + pressure * r[k];
    }
    p
}

/// What the tangent of one cell is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CellTangent<const N: usize> {
    /// `R g_a`.
    rotated: [Vec3; N],
    /// `V lambda` times the scale of the matrix.
    lambda: f64,
    /// `V mu` times the scale of the matrix.
    mu: f64,
    /// What the turning of `R` adds, see [`twists`]: upper triangle by rows.
    twist: [f64; 6],
}

impl<const N: usize> Default for CellTangent<N> {
    fn default() -> Self {
        CellTangent {
            rotated: [[0.0; 3]; N],
            lambda: 0.0,
            mu: 0.0,
            twist: [0.0; 6],
        }
    }
}

impl<const N: usize> CellTangent<N> {
    /// The warped tangent: `R` is held fixed.
    #[inline]
    pub(crate) fn warped(e: &Element<N>, r: &[f64; 9], scale: f64) -> Self {
        CellTangent {
            rotated: e.gradients.each_ref().map(
                #[inline(always)]
                |g| times(r, g),
            ),
            lambda: scale * e.volume * e.lame.lambda,
            mu: scale * e.volume * e.lame.mu,
            twist: [0.0; 6],
        }
    }

    /// The exact tangent; `twist` from [`twists`], which may project it to be positive semidefinite.
    #[inline]
    pub(crate) fn exact(e: &Element<N>, r: &[f64; 9], twist: &[f64; 6], scale: f64) -> Self {
        let mut out = CellTangent::warped(e, r, scale);
        for (to, from) in out.twist.iter_mut().zip(twist) {
            *to = scale * e.volume * from;
        }
        out
    }

    /// Blocks of corner `a` with `R` held fixed.
    #[inline(always)]
    pub(crate) fn warped_blocks(&self, a: usize) -> CornerBlocks<N> {
        CornerBlocks::new(self.lambda, self.mu, &self.rotated[a])
    }

    /// What the exact blocks of corner `a` have beyond the warped ones.
    #[inline(always)]
    pub(crate) fn twist_blocks(&self, a: usize) -> TwistBlocks {
        TwistBlocks::new(&self.twist, &self.rotated[a])
    }

    /// `R g_b`.
    #[inline(always)]
    pub(crate) fn rotated(&self, b: usize) -> &Vec3 {
        &self.rotated[b]
    }
}

/// The blocks `[h_a]x D [h_b]x^T`, `h = R g`, of one corner `a` against others `b`.
pub(crate) struct TwistBlocks {
    /// `[h_a]x D`.
    turned: [Vec3; 3],
}

impl TwistBlocks {
    /// For the corner `a` with `h_a`, and the upper triangle of `D` by rows.
    #[inline(always)]
    pub(crate) fn new(twist: &[f64; 6], ha: &Vec3) -> Self {
        let [x, y, z] = *ha;
        let [d00, d01, d02, d11, d12, d22] = *twist;
        TwistBlocks {
            turned: [
                [y * d02 - z * d01, y * d12 - z * d11, y * d22 - z * d12],
                [z * d00 - x * d02, z * d01 - x * d12, z * d02 - x * d22],
                [x * d01 - y * d00, x * d11 - y * d01, x * d12 - y * d02],
            ],
        }
    }

    /// The block against a corner with `h`, row-major.
    #[inline(always)]
    pub(crate) fn block(&self, h: &Vec3) -> Block {
        let [x, y, z] = *h;
        let mut out = [0.0; 9];
        for (i, m) in self.turned.iter().enumerate() {
            out[3 * i] = m[2] * y - m[1] * z;
            out[3 * i + 1] = m[0] * z - m[2] * x;
            out[3 * i + 2] = m[1] * x - m[0] * y;
        }
        out
    }
}

/// `D = W + mu I`, where `W` carries the second derivative of the energy along the three ways to turn `R` (twist modes),
/// as in Smith, de Goes, Kim: Analytic Eigensystems for Isotropic Distortion Energies, ACM TOG 38 (2019).
///
/// Turning about the principal axis `n` of the spatial stretch `F R^T`, across the stretches `s_i`, `s_j`, has the
/// curvature `w = (lambda tr(S - I) - 2 mu) / (s_i + s_j)`; the cell is positive semidefinite if `w >= -mu`, so `projected`
/// clamps smaller ones. `W = sum w n n^T`; at rest `W = -mu I` and `D = 0`.
#[inline(always)]
fn twists<const L: usize>(lames: &[Lame; L], f: &[[f64; 9]; L], r: &[[f64; 9]; L], projected: bool) -> [[f64; 6]; L] {
    // the spatial stretch F R^T
    let mut stretch = [[[0.0; L]; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            for l in 0..L {
                for k in 0..3 {
                    stretch[i][j][l] += 0.5 * (f[l][3 * i + k] * r[l][3 * j + k] + f[l][3 * j + k] * r[l][3 * i + k]);
                }
            }
        }
    }
    let (s, n) = symmetric_eigen(stretch, 5);
    let mut out = [[0.0; 6]; L];
    for k in 0..3 {
        for l in 0..L {
            let Lame { lambda, mu } = lames[l];
            let trace = s[0][l] + s[1][l] + s[2][l];
            let sum = (trace - s[k][l]).max(LEAST_STRETCH_SUM);
            let w = (lambda * (trace - 3.0) - 2.0 * mu) / sum + mu;
            let w = if projected { w.max(0.0) } else { w };
            let [x, y, z] = [n[0][k][l], n[1][k][l], n[2][k][l]];
            for (entry, product) in out[l].iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                *entry += w * product;
            }
        }
    }
    out
}

/// [`twists`] in the plane: `R` turns about z alone, across the stretches in the plane, whose sum is `tr(S)` less the one
/// along z.
#[inline(always)]
fn planar_twists<const L: usize>(
    lames: &[Lame; L],
    f: &[[f64; 9]; L],
    r: &[[f64; 9]; L],
    projected: bool,
) -> [[f64; 6]; L] {
    let mut out = [[0.0; 6]; L];
    for l in 0..L {
        let Lame { lambda, mu } = lames[l];
        let trace = stretch_trace(&f[l], &r[l]);
        let w = (lambda * trace - 2.0 * mu) / (trace + 2.0).max(LEAST_STRETCH_SUM) + mu;
        out[l][5] = if projected { w.max(0.0) } else { w };
    }
    out
}

/// What turning `R` adds to the tangents of cells side by side, see [`twists`]: of triangles, turning in the plane.
#[inline(always)]
pub(crate) fn twists_of_cells<const N: usize, const L: usize>(
    lames: &[Lame; L],
    f: &[[f64; 9]; L],
    r: &[[f64; 9]; L],
    projected: bool,
) -> [[f64; 6]; L] {
    if N == 3 {
        planar_twists(lames, f, r, projected)
    } else {
        twists(lames, f, r, projected)
    }
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::Point;
    use nalgebra::{DMatrix, SymmetricEigen};

    use super::*;
    use crate::rotation::rotations_of_cells;
    use crate::small::add;
    use crate::{Material, Plane, Tangent};

    const REST: [[f64; 3]; 4] = [[0.1, 0.0, 0.2], [1.0, 0.1, 0.0], [0.2, 0.9, 0.1], [0.0, 0.2, 1.1]];

    fn material(plane: Plane) -> Material {
        Material::new(3.0, 0.3, 1.0).unwrap().in_plane(plane, 0.3).unwrap()
    }

    fn tetrahedron() -> Element<4> {
        Element::new(0, &REST.map(Point::from), &material(Plane::Strain)).unwrap()
    }

    fn triangle(plane: Plane) -> Element<3> {
        let p = [0, 1, 2].map(|k| Point::new(REST[k][0], REST[k][1], 0.0));
        Element::new(0, &p, &material(plane)).unwrap()
    }

    /// Corner displacements of `x -> F x` with the given F (rows); in the plane for a triangle.
    fn displacements<const N: usize>(f: [[f64; 3]; 3]) -> [Vec3; N] {
        let mut u = [[0.0; 3]; N];
        for (u, x) in u.iter_mut().zip(REST) {
            for i in 0..N - 1 {
                u[i] = (0..N - 1).map(|j| f[i][j] * x[j]).sum::<f64>() - x[i];
            }
        }
        u
    }

    fn state<const N: usize>(e: &Element<N>, u: &[Vec3; N]) -> ([f64; 9], [f64; 9]) {
        let f = e.deformation_gradient(u);
        (f, rotations_of_cells::<N, 1>(&[f])[0])
    }

    fn energy_of<const N: usize>(e: &Element<N>, u: &[Vec3; N]) -> f64 {
        let (f, r) = state(e, u);
        energy(&e.lame, e.volume, &f, &r)
    }

    fn force_of<const N: usize>(e: &Element<N>, u: &[Vec3; N]) -> [Vec3; N] {
        let (f, r) = state(e, u);
        e.corner_forces(&stress(&e.lame, &f, &r))
    }

    fn hessian<const N: usize>(e: &Element<N>, u: &[Vec3; N], tangent: Tangent) -> DMatrix<f64> {
        let (f, r) = state(e, u);
        let twist = twists_of_cells::<N, 1>(&[e.lame], &[f], &[r], tangent == Tangent::Projected)[0];
        let cell = match tangent {
            Tangent::Warped => CellTangent::warped(e, &r, 1.0),
            Tangent::Exact | Tangent::Projected => CellTangent::exact(e, &r, &twist, 1.0),
        };
        let mut k = DMatrix::zeros(3 * N, 3 * N);
        for (a, b) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))) {
            let mut block = cell.warped_blocks(a).block(cell.rotated(b));
            add(&mut block, &cell.twist_blocks(a).block(cell.rotated(b)));
            for ij in 0..9 {
                k[(3 * a + ij / 3, 3 * b + ij % 3)] = block[ij];
            }
        }
        k
    }

    const STRETCHED: [[f64; 3]; 3] = [[1.2, -0.5, 0.1], [0.4, 1.3, 0.2], [0.0, 0.3, 1.25]];
    const COMPRESSED: [[f64; 3]; 3] = [[0.6, -0.3, 0.1], [0.4, 0.7, 0.2], [0.0, 0.3, 0.5]];
    const INVERTED: [[f64; 3]; 3] = [[1.1, -0.3, 0.1], [0.4, 0.9, 0.2], [0.0, 0.3, -0.4]];
    const INVERTED_IN_THE_PLANE: [[f64; 3]; 3] = [[1.1, -0.3, 0.0], [0.4, -0.6, 0.0], [0.0, 0.0, 1.0]];

    /// Calls a function with the tetrahedron and the triangles in plane strain and stress.
    macro_rules! for_each_element {
        ($check:ident) => {
            $check(&tetrahedron());
            $check(&triangle(Plane::Strain));
            $check(&triangle(Plane::Stress));
        };
    }

    #[test]
    fn force_is_the_gradient_of_the_energy() {
        fn check<const N: usize>(e: &Element<N>) {
            for state in [STRETCHED, COMPRESSED, INVERTED, INVERTED_IN_THE_PLANE] {
                let u = displacements(state);
                let f = force_of(e, &u);
                let scale = f.as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                for (a, i) in (0..N).flat_map(|a| (0..3).map(move |i| (a, i))) {
                    let h = 1e-5;
                    let mut ends = [u, u];
                    ends[0][a][i] -= h;
                    ends[1][a][i] += h;
                    let slope = (energy_of(e, &ends[1]) - energy_of(e, &ends[0])) / (2.0 * h);
                    assert!((slope - f[a][i]).abs() < 1e-8 * scale, "{a} {i}: {slope} {}", f[a][i]);
                }
            }
        }
        for_each_element!(check);
    }

    #[test]
    fn exact_tangent_is_the_gradient_of_the_force() {
        fn check<const N: usize>(e: &Element<N>) {
            // projecting changes nothing where the cell is stretched
            for (state, tangent) in [
                (STRETCHED, Tangent::Exact),
                (STRETCHED, Tangent::Projected),
                (COMPRESSED, Tangent::Exact),
            ] {
                let u = displacements(state);
                let k = hessian(e, &u, tangent);
                for col in 0..3 * N {
                    let h = 1e-5;
                    let mut ends = [u, u];
                    ends[0][col / 3][col % 3] -= h;
                    ends[1][col / 3][col % 3] += h;
                    let [low, high] = ends.map(|u| force_of(e, &u));
                    for row in 0..3 * N {
                        let slope = (high[row / 3][row % 3] - low[row / 3][row % 3]) / (2.0 * h);
                        let entry = k[(row, col)];
                        assert!(
                            (slope - entry).abs() < 1e-7 * k.amax(),
                            "{tangent:?} {row} {col}: {slope} {entry}"
                        );
                    }
                }
            }
        }
        for_each_element!(check);
    }

    #[test]
    fn tangents_are_positive_semidefinite_everywhere() {
        fn check<const N: usize>(e: &Element<N>) {
            let collapsed = [[0.0; 3]; 3];
            for state in [STRETCHED, COMPRESSED, INVERTED, INVERTED_IN_THE_PLANE, collapsed] {
                for tangent in [Tangent::Warped, Tangent::Projected] {
                    let k = hessian(e, &displacements(state), tangent);
                    assert!((&k - k.transpose()).amax() < 1e-13 * k.amax());
                    let size = k.amax();
                    let least = SymmetricEigen::new(k).eigenvalues.min();
                    assert!(least > -1e-13 * size, "{state:?} {tangent:?}: {least}");
                }
            }
        }
        for_each_element!(check);
    }

    #[test]
    fn tangents_agree_with_the_linear_stiffness_at_rest() {
        fn check<const N: usize>(e: &Element<N>) {
            let rest = [[0.0; 3]; N];
            let (warped, exact) = (hessian(e, &rest, Tangent::Warped), hessian(e, &rest, Tangent::Exact));
            assert!((&warped - exact).amax() < 1e-14 * warped.amax());
            for (a, b, ij) in (0..N).flat_map(|a| (0..N).flat_map(move |b| (0..9).map(move |ij| (a, b, ij)))) {
                let k = e.rest_blocks(a).block(&e.gradients[b])[ij];
                assert!((k - warped[(3 * a + ij / 3, 3 * b + ij % 3)]).abs() < 1e-14 * warped.amax());
            }
        }
        for_each_element!(check);
    }
}
