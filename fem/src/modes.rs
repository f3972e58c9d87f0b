//! Natural modes of vibration: the lowest eigenpairs of `K x = w² M x` on the free dofs.
//!
//! Block Lanczos with shift and invert: the space that `(K + s M)^-1 M` spans from a block of vectors grows by a block a step,
//! each vector made `M`-orthogonal to all others twice, and the modes are the best that the space holds (Rayleigh-Ritz on `K` itself,
//! so that errors of the solves and of the orthogonality cost steps and not accuracy). Vectors come in blocks because the
//! frequencies of symmetric bodies, and of equal pieces, coincide: see Golub and Van Loan, "Matrix Computations", 10.3.6, and
//! Ericsson and Ruhe, Math. Comp. 35 (1980), 1251, for the shift.

use nalgebra::DMatrix;

use crate::cholesky::Cholesky;
use crate::vector::{dot, norm};
use crate::{Assembler, BlockMatrix, FemError};

/// The shift `s` as a fraction of [`Problem::smallest_rate`]: the first that lets what nothing holds be factorised. Larger ones make
/// frequencies below them slow to tell apart.
const SHIFTS: [f64; 4] = [1e-11, 1e-9, 1e-7, 1e-5];
/// Vectors in a block beyond the modes that are wanted, and at most in all.
const SPARE: usize = 8;
const LARGEST_BLOCK: usize = 40;
/// Residual at which a mode is found, unless it is below so many roundings of the terms it consists of.
const TOLERANCE: f64 = 1e-9;
const ROUNDINGS: f64 = 64.0;
/// Steps after which what there is must do.
const MOST_STEPS: usize = 60;
/// What is left of a vector made orthogonal to others is rounding below this fraction of it.
const DEPENDENT: f64 = 1e-10;

/// A natural mode of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// Square of its angular frequency (1/s²).
    pub omega_squared: f64,
    /// Its displacements, flat, dof = `3 * vertex + axis`, zero on fixed dofs; `x . M x = 1` (so 1/sqrt(kg)).
    pub shape: Vec<f64>,
    /// `|K x - w² M x| / |K x|` on the free dofs.
    pub residual: f64,
}

/// The problem: matrices on the free dofs.
struct Problem<'a, const N: usize> {
    assembler: &'a Assembler<N>,
    consistent: bool,
    fixed: Vec<bool>,
}

impl<const N: usize> Problem<'_, N> {
    /// Zeros on the fixed dofs.
    fn mask(&self, x: &mut [f64]) {
        x.iter_mut()
            .zip(&self.fixed)
            .filter(|(_, f)| **f)
            .for_each(|(x, _)| *x = 0.0);
    }

    /// `K x`.
    fn stiffness_times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        self.assembler.stiffness().multiply(x, &mut y);
        self.mask(&mut y);
        y
    }

    /// `M x`.
    fn mass_times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        if self.consistent {
            self.assembler.consistent_mass().multiply(x, &mut y);
        } else {
            let masses = self.assembler.lumped_mass();
            y.iter_mut()
                .zip(x)
                .enumerate()
                .for_each(|(d, (y, x))| *y = masses[d / 3] * x);
        }
        self.mask(&mut y);
        y
    }

    /// `K + s M`.
    fn shifted(&self, shift: f64) -> BlockMatrix {
        let mut matrix = self.assembler.stiffness().clone();
        if self.consistent {
            self.assembler.consistent_mass().add_to(shift, &mut matrix);
        } else {
            matrix.add_diagonal(shift, self.assembler.lumped_mass());
        }
        matrix
    }

    /// A diagonal entry of `K` (N/m); none of an empty row.
    fn diagonal(&self, d: usize) -> Option<f64> {
        let (cols, blocks) = self.assembler.stiffness().row(d / 3);
        let k = cols.binary_search(&((d / 3) as u32)).ok()?;
        Some(blocks[k][4 * (d % 3)])
    }

    /// The smallest ratio of diagonal entries of `K` and `M` (1/s²): what the largest cells say, whatever slivers there are.
    fn smallest_rate(&self) -> f64 {
        let free = (0..self.fixed.len()).filter(|d| !self.fixed[*d]);
        let rates = free.filter_map(|d| Some(self.diagonal(d)? / self.assembler.lumped_mass()[d / 3]));
        rates.fold(f64::INFINITY, f64::min)
    }

    /// The residual that rounding leaves of a mode: entries of `K` times displacements cancel where these are smooth.
    fn rounding(&self, x: &[f64]) -> f64 {
        let terms: Vec<f64> = (0..x.len()).map(|d| self.diagonal(d).unwrap_or(0.0) * x[d]).collect();
        ROUNDINGS * f64::EPSILON * norm(&terms) / norm(&self.stiffness_times(x))
    }

    /// `(K + s M)^-1 M` of some vectors.
    fn inverted(&self, factor: &mut Cholesky, vectors: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let solved = vectors.iter().map(|q| {
            let mut x = vec![0.0; q.len()];
            factor.add_solution(&self.mass_times(q), &mut x);
            x
        });
        solved.collect()
    }

    /// The factor of `K + s M` for the least shift that lets there be one.
    fn factor(&self) -> Result<Cholesky, FemError> {
        let mut factor = Cholesky::analyse(self.assembler.stiffness(), &self.fixed)?;
        let mut last = Ok(());
        for shift in SHIFTS {
            last = factor.factor(&self.shifted(shift * self.smallest_rate()));
            if last.is_ok() {
                break;
            }
        }
        last.map(|()| factor)
    }

    /// Vector number `k` to begin with: without order, and the same in every run.
    fn start(&self, k: usize) -> Vec<f64> {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(k as u64 + 1);
        let mut next = || {
            // xorshift64
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..self.fixed.len()).map(|_| next()).collect()
    }

    /// Makes `x` `M`-orthogonal to `others` and of length one; false if it depends on them.
    fn orthonormalise(&self, x: &mut [f64], others: &[&[Vec<f64>]]) -> bool {
        let before = dot(x, &self.mass_times(x)).sqrt();
        for _ in 0..2 {
            let weighted = self.mass_times(x);
            let amounts: Vec<f64> = others
                .iter()
                .flat_map(|o| o.iter())
                .map(|q| dot(q, &weighted))
                .collect();
            for (q, amount) in others.iter().flat_map(|o| o.iter()).zip(amounts) {
                x.iter_mut().zip(q).for_each(|(x, q)| *x -= amount * q);
            }
        }
        let length = dot(x, &self.mass_times(x)).sqrt();
        if !(length > DEPENDENT * before && length.is_finite()) {
            return false;
        }
        x.iter_mut().for_each(|x| *x /= length);
        true
    }
}

/// The `count` lowest natural modes, by ascending frequency, of a body at rest that is held where `fixed` (one entry a dof), by
/// lumped or consistent mass; fewer if it has no more.
///
/// `rigid` are its motions without strain, of any length, which are left out: all of them must be given. A frequency that
/// belongs to more than `count + 8` modes, at most 40, may be given less often than it occurs.
///
/// # Errors
/// [`FemError::OutOfMemory`] of the factorisation, [`FemError::NotPositiveDefinite`] if masses or stiffnesses are too uneven for it,
/// [`FemError::Length`].
pub fn natural_modes<const N: usize>(
    assembler: &Assembler<N>,
    consistent: bool,
    fixed: &[bool],
    rigid: &[Vec<f64>],
    count: usize,
) -> Result<Vec<Mode>, FemError> {
    let expected = 3 * assembler.lumped_mass().len();
    for found in rigid.iter().map(Vec::len).chain([fixed.len()]) {
        if found != expected {
            let what = "`fixed` or `rigid`";
            return Err(FemError::Length { what, expected, found });
        }
    }
    let massless = |d: usize| assembler.lumped_mass()[d / 3] <= 0.0;
    let problem = Problem {
        assembler,
        consistent,
        fixed: (0..expected).map(|d| fixed[d] || massless(d)).collect(),
    };
    let mut deflated: Vec<Vec<f64>> = Vec::new();
    for motion in rigid {
        let mut motion = motion.clone();
        problem.mask(&mut motion);
        if problem.orthonormalise(&mut motion, &[&deflated]) {
            deflated.push(motion);
        }
    }
    let free = problem.fixed.iter().filter(|f| !**f).count();
    let most = free.saturating_sub(deflated.len());
    let wanted = count.min(most);
    if wanted == 0 {
        return Ok(Vec::new());
    }
    let mut factor = problem.factor()?;

    let width = (wanted + SPARE).min(LARGEST_BLOCK).min(most);
    let mut space = Space::default();
    let mut block: Vec<Vec<f64>> = (0..width).map(|k| problem.start(k)).collect();
    let mut modes = Vec::new();
    for _ in 0..MOST_STEPS {
        let first = space.vectors.len();
        for mut x in block {
            problem.mask(&mut x);
            if problem.orthonormalise(&mut x, &[&deflated, &space.vectors]) {
                space.add(&problem, x);
            }
        }
        let grows = space.vectors.len() > first;
        if !grows || space.vectors.len() >= wanted {
            modes = space.modes(&problem, wanted);
            let found = |m: &Mode| m.residual <= TOLERANCE.max(problem.rounding(&m.shape));
            if !grows || modes.iter().all(found) {
                break;
            }
        }
        block = problem.inverted(&mut factor, &space.vectors[first..]);
    }
    Ok(modes)
}

/// An `M`-orthonormal basis and `K` in it.
#[derive(Default)]
struct Space {
    vectors: Vec<Vec<f64>>,
    /// Row `i`: `q_i . K q_j` for `j <= i`.
    stiffness: Vec<Vec<f64>>,
}

impl Space {
    fn add<const N: usize>(&mut self, problem: &Problem<'_, N>, x: Vec<f64>) {
        let force = problem.stiffness_times(&x);
        self.vectors.push(x);
        self.stiffness
            .push(self.vectors.iter().map(|q| dot(q, &force)).collect());
    }

    /// The lowest modes that the space holds.
    fn modes<const N: usize>(&self, problem: &Problem<'_, N>, count: usize) -> Vec<Mode> {
        let n = self.vectors.len();
        let entry = |i: usize, j: usize| self.stiffness[i.max(j)][i.min(j)];
        let eigen = DMatrix::from_fn(n, n, entry).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        let modes = order.into_iter().take(count).map(|k| {
            let mut shape = vec![0.0; self.vectors[0].len()];
            for (q, amount) in self.vectors.iter().zip(eigen.eigenvectors.column(k).iter()) {
                shape.iter_mut().zip(q).for_each(|(x, q)| *x += amount * q);
            }
            Mode::of(problem, shape)
        });
        modes.collect()
    }
}

impl Mode {
    /// The mode of a shape, by its Rayleigh quotient.
    fn of<const N: usize>(problem: &Problem<'_, N>, mut shape: Vec<f64>) -> Mode {
        let mass = dot(&shape, &problem.mass_times(&shape)).sqrt();
        shape.iter_mut().for_each(|x| *x /= mass);
        let force = problem.stiffness_times(&shape);
        let omega_squared = dot(&shape, &force);
        let weighted = problem.mass_times(&shape);
        let missing: Vec<f64> = force
            .iter()
            .zip(&weighted)
            .map(|(f, m)| f - omega_squared * m)
            .collect();
        Mode {
            omega_squared,
            residual: norm(&missing) / norm(&force),
            shape,
        }
    }
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::{SimplexMesh, generate};

    use super::*;
    use crate::Material;

    fn assembled<const N: usize>(mesh: &SimplexMesh<N>) -> Assembler<N> {
        let material = Material::new(1e5, 0.3, 1000.0).unwrap();
        Assembler::new(mesh, |_| material).unwrap()
    }

    /// Every eigenvalue on the free dofs, ascending, from dense matrices.
    fn dense<const N: usize>(assembler: &Assembler<N>, consistent: bool, fixed: &[bool]) -> Vec<f64> {
        let problem = Problem {
            assembler,
            consistent,
            fixed: fixed.to_vec(),
        };
        let free: Vec<usize> = (0..fixed.len()).filter(|d| !fixed[*d]).collect();
        let matrix = |times: &dyn Fn(&[f64]) -> Vec<f64>| {
            let columns = free.iter().map(|&d| {
                let mut x = vec![0.0; fixed.len()];
                x[d] = 1.0;
                let y = times(&x);
                free.iter().map(move |&e| y[e]).collect::<Vec<_>>()
            });
            let all: Vec<f64> = columns.flatten().collect();
            DMatrix::from_vec(free.len(), free.len(), all)
        };
        let stiffness = matrix(&|x| problem.stiffness_times(x));
        let mass = matrix(&|x| problem.mass_times(x));
        let inverse = mass.cholesky().unwrap().l().try_inverse().unwrap();
        let mut values: Vec<f64> = (&inverse * stiffness * inverse.transpose())
            .symmetric_eigenvalues()
            .iter()
            .copied()
            .collect();
        values.sort_by(f64::total_cmp);
        values
    }

    fn check<const N: usize>(mesh: &SimplexMesh<N>, fixed: &[bool], rigid: &[Vec<f64>], count: usize) {
        let assembler = assembled(mesh);
        for consistent in [false, true] {
            let wanted = dense(&assembler, consistent, fixed);
            let modes = natural_modes(&assembler, consistent, fixed, rigid, count).unwrap();
            assert_eq!(modes.len(), count.min(wanted.len() - rigid.len()));
            for (mode, wanted) in modes.iter().zip(&wanted[rigid.len()..]) {
                assert!(
                    (mode.omega_squared / wanted - 1.0).abs() < 1e-9,
                    "{} {wanted}",
                    mode.omega_squared
                );
                assert!(mode.residual < 1e-8, "{}", mode.residual);
            }
            assert!(
                wanted[..rigid.len()]
                    .iter()
                    .all(|w| w.abs() < 1e-8 * wanted[rigid.len()])
            );
        }
    }

    /// Translations and rotations of all vertices.
    fn rigid_motions(points: &[kerfem_mesh::Point]) -> Vec<Vec<f64>> {
        let along = |k: usize| {
            points
                .iter()
                .flat_map(move |_| (0..3).map(move |i| f64::from(u8::from(i == k))))
        };
        let about = |k: usize| {
            let axis = kerfem_mesh::Point::ith(k, 1.0);
            points.iter().flat_map(move |p| {
                let c = axis.cross(p);
                [c.x, c.y, c.z]
            })
        };
        (0..3)
            .map(|k| along(k).collect())
            .chain((0..3).map(|k| about(k).collect()))
            .collect()
    }

    #[test]
    fn held_and_free_bodies_have_the_modes_of_their_matrices() {
        let bar = generate::box_tets([2.0, 0.5, 0.4], [4, 2, 2], [0.0; 3]);
        let points = bar.rest_positions().to_vec();
        let clamped: Vec<bool> = (0..3 * points.len()).map(|d| points[d / 3].x < 1e-9).collect();
        check(&bar, &clamped, &[], 12);
        check(&bar, &vec![false; clamped.len()], &rigid_motions(&points), 10);
    }

    #[test]
    fn frequencies_that_coincide_are_all_found() {
        // four equal bars, each of a square section: every frequency of bending eight times
        let mut points = Vec::new();
        let mut cells = Vec::new();
        let bar = generate::box_tets([2.0, 0.5, 0.5], [4, 1, 1], [0.0; 3]);
        for k in 0..4 {
            let first = points.len();
            points.extend(
                bar.rest_positions()
                    .iter()
                    .map(|p| p + kerfem_mesh::Point::new(0.0, 2.0 * f64::from(k), 0.0)),
            );
            cells.extend(bar.cell_ids().map(|c| bar.cell(c).map(|v| first + v.index())));
        }
        let mesh = kerfem_mesh::TetMesh::new(points.clone(), cells).unwrap();
        let clamped: Vec<bool> = (0..3 * points.len()).map(|d| points[d / 3].x < 1e-9).collect();
        check(&mesh, &clamped, &[], 16);
    }

    #[test]
    fn slivers_do_not_hide_the_slow_modes() {
        // a layer of vertices very close to the next one
        let bar = generate::box_tets([2.0, 0.5, 0.4], [4, 2, 2], [0.0; 3]);
        let mut points = bar.rest_positions().to_vec();
        points
            .iter_mut()
            .filter(|p| (p.x - 1.5).abs() < 1e-9)
            .for_each(|p| p.x = 1.0 + 1e-5);
        let cells = bar.cell_ids().map(|c| bar.cell(c).map(|v| v.index())).collect();
        let mesh = kerfem_mesh::TetMesh::new(points.clone(), cells).unwrap();
        let assembler = assembled(&mesh);
        let motions = rigid_motions(&points);
        let modes = natural_modes(&assembler, false, &vec![false; 3 * points.len()], &motions, 4).unwrap();
        let coarse = natural_modes(&assembled(&bar), false, &vec![false; 3 * points.len()], &motions, 4).unwrap();
        for (mode, other) in modes.iter().zip(&coarse) {
            assert!(
                (mode.omega_squared / other.omega_squared).ln().abs() < 1.0,
                "{}",
                mode.omega_squared
            );
            assert!(mode.residual < 1e-4, "{}", mode.residual);
        }
    }

    #[test]
    fn a_body_has_no_more_modes_than_free_dofs() {
        let cube = generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
        check(&cube, &[false; 24], &rigid_motions(cube.rest_positions()), 40);
        assert!(
            natural_modes(&assembled(&cube), false, &[true; 24], &[], 3)
                .unwrap()
                .is_empty()
        );
    }

    #[test]
    fn a_planar_body_vibrates_in_its_plane() {
        let plate = generate::rect_triangles([2.0, 0.5], [8, 2], [0.0; 2]).unwrap();
        let points = plate.rest_positions().to_vec();
        let held: Vec<bool> = (0..3 * points.len())
            .map(|d| d % 3 == 2 || points[d / 3].x < 1e-9)
            .collect();
        check(&plate, &held, &[], 8);
        let free: Vec<bool> = (0..3 * points.len()).map(|d| d % 3 == 2).collect();
        let motions = rigid_motions(&points);
        check(
            &plate,
            &free,
            &[motions[0].clone(), motions[1].clone(), motions[5].clone()],
            8,
        );
    }
}
