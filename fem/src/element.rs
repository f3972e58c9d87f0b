//! The linear simplex (P1): gradients of its shape functions, volume, deformation gradient.
//!
//! A triangle is the same element in the plane: its gradients have no z component, its volume is area times thickness, its
//! first Lamé parameter that of plane strain or plane stress. Displacements along z do nothing.

use kerfem_mesh::Point;
use kerfem_mesh::quality::cell_volume;
use nalgebra::{Matrix3, Vector3};

use crate::material::Lame;
use crate::small::{Block, times};
use crate::{FemError, Material};

/// A vector as it lies in memory.
pub(crate) type Vec3 = [f64; 3];

/// What the rest shape and the material say about one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Element<const N: usize> {
    /// Gradients of the shape functions (1/m); they add up to zero.
    pub(crate) gradients: [Vec3; N],
    /// Rest volume (m³).
    pub(crate) volume: f64,
    /// The law of the cell alone: that of the material, less what a cure of locking gives to the patches of vertices.
    pub(crate) lame: Lame,
    /// Mass (kg).
    pub(crate) mass: f64,
}

impl<const N: usize> Default for Element<N> {
    fn default() -> Self {
        Element {
            gradients: [[0.0; 3]; N],
            volume: 0.0,
            lame: Lame::default(),
            mass: 0.0,
        }
    }
}

impl<const N: usize> Element<N> {
    /// The element over rest positions `p` of cell number `cell`, with all of the material's stiffness.
    pub(crate) fn new(cell: u32, p: &[Point; N], material: &Material) -> Result<Self, FemError> {
        let volume = material.volume_of_cell(p);
        let gradients = shape_gradients(p);
        if !(volume > 0.0 && gradients.as_flattened().iter().all(|g| g.is_finite())) {
            return Err(FemError::InvertedCell { cell, volume });
        }
        Ok(Element {
            gradients,
            volume,
            lame: material.lame::<N>(),
            mass: material.density() * volume,
        })
    }

    /// [`displacement_gradient`] of corner displacements (m).
    #[inline]
    pub(crate) fn displacement_gradient(&self, u: &[Vec3; N]) -> [f64; 9] {
        displacement_gradient::<N>(&self.gradients, |b| u[b])
    }

    /// Deformation gradient `F`, row-major.
    #[inline]
    pub(crate) fn deformation_gradient(&self, u: &[Vec3; N]) -> [f64; 9] {
        let mut f = self.displacement_gradient(u);
        for axis in 0..3 {
            f[4 * axis] += 1.0;
        }
        f
    }

    /// `V stress g_a` for the corners: nodal forces (N) of a first Piola-Kirchhoff stress (Pa), row-major.
    #[inline]
    pub(crate) fn corner_forces(&self, stress: &[f64; 9]) -> [Vec3; N] {
        let mut forces = [[0.0; 3]; N];
        for (force, g) in forces.iter_mut().zip(&self.gradients) {
            *force = times(stress, g);
            force.iter_mut().for_each(|f| *f *= self.volume);
        }
        forces
    }

    /// Largest eigenvalue (1/s²) of the rest stiffness by a law against the lumped mass of the cell alone.
    ///
    /// With `S = sum g_a g_a^T`, of eigenvalues `s`, the nonzero eigenvalues of `Ke / V` are those of `stress -> C sym(stress S)`
    /// for symmetric matrices: in the eigenbasis of `S` shears part, with `mu (s_i + s_j)`, from normal components, with
    /// `2 mu diag(s) + lambda sqrt(s) sqrt(s)^T`.
    pub(crate) fn largest_eigenvalue(&self, lame: &Lame) -> f64 {
        let gram: Matrix3<f64> = self
            .gradients
            .iter()
            .map(|g| Vector3::from(*g))
            .map(|g| g * g.transpose())
            .sum();
        let s = gram.symmetric_eigenvalues().map(|s| s.max(0.0));
        let root = s.map(f64::sqrt);
        let normal = Matrix3::from_diagonal(&s) * (2.0 * lame.mu) + root * root.transpose() * lame.lambda;
        let shear = lame.mu * (s.sum() - s.min());
        let largest = normal.symmetric_eigenvalues().max().max(shear);
        N as f64 * self.volume * largest / self.mass
    }

    /// Stiffness blocks of corner `a` at rest, `K_ab = V (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I)` (N/m).
    #[inline(always)]
    pub(crate) fn rest_blocks(&self, a: usize) -> CornerBlocks<N> {
        CornerBlocks::new(
            self.volume * self.lame.lambda,
            self.volume * self.lame.mu,
            &self.gradients[a],
        )
    }
}

/// The blocks `lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I` of one corner `a` against others `b`; in the plane (`N = 3`)
/// without the row and column of z.
pub(crate) struct CornerBlocks<const N: usize> {
    lambda_ga: Vec3,
    mu_ga: Vec3,
}

impl<const N: usize> CornerBlocks<N> {
    #[inline(always)]
    pub(crate) fn new(lambda: f64, mu: f64, ga: &Vec3) -> Self {
        let [x, y, z] = *ga;
        CornerBlocks {
            lambda_ga: [lambda * x, lambda * y, lambda * z],
            mu_ga: [mu * x, mu * y, mu * z],
        }
    }

    /// The block against a corner with gradient `g`, row-major.
    #[inline(always)]
    pub(crate) fn block(&self, g: &Vec3) -> Block {
        let (l, m) = (&self.lambda_ga, &self.mu_ga);
        let d = m[0] * g[0] + m[1] * g[1] + m[2] * g[2];
        [
            l[0] * g[0] + m[0] * g[0] + d,
            l[0] * g[1] + m[1] * g[0],
            l[0] * g[2] + m[2] * g[0],
            l[1] * g[0] + m[0] * g[1],
            l[1] * g[1] + m[1] * g[1] + d,
            l[1] * g[2] + m[2] * g[1],
            l[2] * g[0] + m[0] * g[2],
            l[2] * g[1] + m[1] * g[2],
            if N == 3 { 0.0 } else { l[2] * g[2] + m[2] * g[2] + d },
        ]
    }
}

/// Displacement gradient `H = sum u_a g_a^T = F - I`, row-major, of nodes with gradients `g` (1/m) that add up to zero and
/// displacements `u` (m); in the plane for cells of three corners.
#[inline(always)]
pub(crate) fn displacement_gradient<const N: usize>(gradients: &[Vec3], u: impl Fn(usize) -> Vec3) -> [f64; 9] {
    let mut h = [0.0; 9];
    // differences to the first node: a translation gives exactly zero
    let origin = u(0);
    for b in 1..gradients.len() {
        let u = u(b);
        for i in 0..N - 1 {
            let d = u[i] - origin[i];
            for j in 0..N - 1 {
                h[3 * i + j] += d * gradients[b][j];
            }
        }
    }
    h
}

/// Gradients (1/m) of the shape functions; in the plane for a triangle.
fn shape_gradients<const N: usize>(p: &[Point; N]) -> [Vec3; N] {
    let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
    let [g1, g2, g3] = if N == 3 {
        let two_a = 2.0 * cell_volume(p);
        [
            Point::new(e2.y, -e2.x, 0.0) / two_a,
            Point::new(-e1.y, e1.x, 0.0) / two_a,
            Point::zeros(),
        ]
    } else {
        let (e3, six_v) = (p[3] - p[0], 6.0 * cell_volume(p));
        [e2.cross(&e3), e3.cross(&e1), e1.cross(&e2)].map(|g| g / six_v)
    };
    let all = [-(g1 + g2 + g3), g1, g2, g3];
    std::array::from_fn(|k| all[k].into())
}

/// A row-major 3x3 array as a matrix.
#[inline]
pub(crate) fn matrix(a: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_row_slice(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_reproduce_linear_fields() {
        let p = [
            Point::new(0.1, 0.0, 0.2),
            Point::new(1.0, 0.1, 0.0),
            Point::new(0.2, 0.9, 0.1),
            Point::new(0.0, 0.2, 1.1),
        ];
        let material = Material::new(2.0, 0.25, 3.0).unwrap();
        let e = Element::new(0, &p, &material).unwrap();
        let a = Matrix3::new(0.1, 0.2, -0.3, 0.4, 0.5, 0.6, -0.7, 0.8, 0.9);
        let u = p.map(|x| (a * x).into());
        assert!((matrix(&e.displacement_gradient(&u)) - a).norm() < 1e-14);
        let shifted = p.map(|_| [0.3, -7.0, 11.0]);
        assert_eq!(e.displacement_gradient(&shifted), [0.0; 9]);
        assert!((e.mass - 3.0 * cell_volume(&p)).abs() < 1e-15);
    }

    #[test]
    fn an_inverted_cell_is_named() {
        let p = [Point::x(), Point::zeros(), Point::y(), Point::z()];
        let material = Material::new(2.0, 0.25, 3.0).unwrap();
        match Element::new(17, &p, &material) {
            Err(FemError::InvertedCell { cell: 17, volume }) => assert!((volume + 1.0 / 6.0).abs() < 1e-15),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_largest_eigenvalue_is_that_of_the_matrix() {
        let p = [
            Point::new(0.1, 0.0, 0.2),
            Point::new(1.0, 0.1, 0.0),
            Point::new(0.2, 0.9, 0.1),
            Point::new(0.0, 0.2, 1.1),
        ];
        let flat = [0, 1, 2].map(|k| Point::new(p[k].x, p[k].y, 0.0));
        for poisson in [-0.9, -0.3, 0.0, 0.3, 0.499] {
            let material = Material::new(2.0, poisson, 3.0).unwrap();
            check_largest_eigenvalue(&Element::new(0, &p, &material).unwrap());
            let sheet = material.in_plane(crate::Plane::Stress, 0.1).unwrap();
            check_largest_eigenvalue(&Element::new(0, &flat, &sheet).unwrap());
        }
    }

    fn check_largest_eigenvalue<const N: usize>(e: &Element<N>) {
        let unit = |d: usize| {
            let mut u = [[0.0; 3]; N];
            u[d / 3][d % 3] = 1.0;
            u
        };
        let column = |d: usize| e.corner_forces(&e.lame.linear_stress(&e.displacement_gradient(&unit(d))));
        let stiffness = nalgebra::DMatrix::from_fn(3 * N, 3 * N, |i, d| column(d)[i / 3][i % 3]);
        let exact = stiffness.symmetric_eigenvalues().max() * N as f64 / e.mass;
        assert!((e.largest_eigenvalue(&e.lame) / exact - 1.0).abs() < 1e-12);
    }
}
