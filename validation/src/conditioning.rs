//! What the cells of a mesh ask of iterative solvers and explicit time steps.

use kerfem_fem::{Assembler, FemError, LinearSolver, Material, PreconditionerKind, SolverKind, SolverOptions};
use kerfem_mesh::{Point, TetMesh};

/// Iterations that the power method takes at least, at most, and how little (relative) the eigenvalue must change for how
/// many of them in a row.
const POWER: (usize, usize, f64, usize) = (30, 3000, 1e-6, 10);

fn assemble(mesh: &TetMesh) -> Result<Assembler, FemError> {
    let material = Material::new(1e5, 0.3, 1000.0)?;
    Assembler::new(mesh, |_| material)
}

/// Loads that iterations are counted for: they depend on it by a tenth.
const LOADS: usize = 12;

/// What a mesh costs solvers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Iterations of conjugate gradients, see [`jacobi_iterations`], for each load.
    pub iterations: [usize; LOADS],
    /// Longest stable step (s) of the free body, see [`stable_step`].
    pub step: f64,
}

/// The cost of a mesh, of that of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostRatios {
    /// The smallest ratio of iterations, over the loads.
    pub least: f64,
    /// The mean ratio of iterations.
    pub mean: f64,
    /// The largest ratio of iterations.
    pub largest: f64,
    /// The ratio of the stable steps.
    pub step: f64,
}

impl Cost {
    /// Of a mesh that is held where `held` (of rest positions) says.
    ///
    /// # Errors
    /// [`FemError`] if a cell has no volume.
    pub fn of(mesh: &TetMesh, held: impl Fn(Point) -> bool) -> Result<Cost, FemError> {
        Ok(Cost {
            iterations: jacobi_iterations(mesh, held)?,
            step: stable_step(mesh)?,
        })
    }

    /// Mean of the iterations over the loads.
    pub fn mean_iterations(&self) -> f64 {
        self.iterations.iter().sum::<usize>() as f64 / LOADS as f64
    }

    /// This cost, of another.
    pub fn over(&self, other: &Cost) -> CostRatios {
        let pairs = self.iterations.iter().zip(&other.iterations);
        let ratios = pairs.map(|(own, other)| *own as f64 / *other as f64);
        CostRatios {
            least: ratios.clone().fold(f64::INFINITY, f64::min),
            mean: ratios.clone().sum::<f64>() / LOADS as f64,
            largest: ratios.fold(0.0, f64::max),
            step: self.step / other.step,
        }
    }
}

/// Iterations of conjugate gradients with the diagonal as preconditioner to a relative residual of 1e-8, for the linear
/// stiffness at rest (Poisson ratio 0.3) with the vertices where `held` (of rest positions) fixed, and those of pieces that
/// have no such vertex, for each of a dozen loads.
///
/// Pieces are solved each by itself, and the largest count is taken: parting a body costs nothing by itself.
///
/// The loads have no symmetry and no direction: on a smooth one conjugate gradients do not see most of the spectrum.
///
/// # Errors
/// [`FemError`] if a cell has no volume.
pub fn jacobi_iterations(mesh: &TetMesh, held: impl Fn(Point) -> bool) -> Result<[usize; LOADS], FemError> {
    let assembler = assemble(mesh)?;
    let mut solver = LinearSolver::new(SolverOptions {
        kind: SolverKind::Cg,
        preconditioner: PreconditionerKind::Jacobi,
        tolerance: 1e-8,
        max_iterations: 100_000,
    });
    let fixed = held_dofs(mesh, held);
    let mut iterations = [0; LOADS];
    for (k, iterations) in iterations.iter_mut().enumerate() {
        let phase = k as f64;
        let waves = |i: usize| {
            let i = i as f64;
            ((12.9898 + 0.7 * phase) * i + phase).sin() + ((78.233 + 1.3 * phase) * i).cos()
        };
        let load: Vec<f64> = (0..3 * mesh.vertex_slots()).map(waves).collect();
        let mut x = vec![0.0; load.len()];
        *iterations = solver.solve(assembler.stiffness(), &fixed, &load, &mut x)?.iterations;
    }
    Ok(iterations)
}

/// Dofs of the held vertices, and of pieces without any.
fn held_dofs(mesh: &TetMesh, held: impl Fn(Point) -> bool) -> Vec<bool> {
    let mut fixed = vec![false; 3 * mesh.vertex_slots()];
    for v in mesh.vertex_ids().filter(|&v| held(mesh.rest_position(v))) {
        fixed[3 * v.index()..][..3].fill(true);
    }
    let (piece, count) = mesh.pieces();
    let mut is_held = vec![false; count];
    for (c, &k) in mesh.cell_ids().zip(&piece) {
        is_held[k] |= mesh.cell(c).iter().any(|v| fixed[3 * v.index()]);
    }
    for (c, k) in mesh.cell_ids().zip(piece).filter(|(_, k)| !is_held[*k]) {
        debug_assert!(!is_held[k]);
        for v in mesh.cell(c) {
            fixed[3 * v.index()..][..3].fill(true);
        }
    }
    fixed
}

/// Largest time step (s) of central differences, `2 / omega`, with `omega` the highest frequency (1/s) of the free body with
/// lumped mass: the square root of the largest eigenvalue of `M^-1 K`, by the power method. Young 1e5 Pa, Poisson 0.3,
/// 1000 kg/m³; infinite for a mesh without cells.
///
/// The method approaches the eigenvalue from below, so the step from above, by less than a thousandth where the highest
/// frequencies are not all alike.
///
/// # Errors
/// [`FemError`] if a cell has no volume.
pub fn stable_step(mesh: &TetMesh) -> Result<f64, FemError> {
    let assembler = assemble(mesh)?;
    let mass = assembler.lumped_mass();
    // with x = M^-1/2 y the matrix is symmetric, and the Rayleigh quotient never falls
    let root = |d: usize| {
        if mass[d / 3] > 0.0 {
            mass[d / 3].sqrt()
        } else {
            f64::INFINITY
        }
    };
    let mut y: Vec<f64> = (0..3 * mass.len()).map(|i| 1.0 + (12.9898 * i as f64).sin()).collect();
    let (mut x, mut kx) = (vec![0.0; y.len()], vec![0.0; y.len()]);
    let (least, most, change, in_a_row) = POWER;
    let (mut eigenvalue, mut settled) = (0.0, 0);
    for iteration in 0..most {
        let size = y.iter().map(|v| v * v).sum::<f64>().sqrt();
        if size == 0.0 {
            return Ok(f64::INFINITY);
        }
        for (d, (x, y)) in x.iter_mut().zip(&mut y).enumerate() {
            *y /= size;
            *x = *y / root(d);
        }
        assembler.stiffness().multiply(&x, &mut kx);
        let quotient: f64 = x.iter().zip(&kx).map(|(x, k)| x * k).sum();
        settled = if (quotient - eigenvalue).abs() <= change * quotient {
            settled + 1
        } else {
            0
        };
        eigenvalue = quotient;
        if iteration >= least && settled >= in_a_row {
            break;
        }
        for (d, (y, k)) in y.iter_mut().zip(&kx).enumerate() {
            *y = k / root(d);
        }
    }
    Ok(2.0 / eigenvalue.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use kerfem_mesh::generate;

    #[test]
    fn the_step_scales_with_the_cells() {
        let step = |n: usize| stable_step(&generate::box_tets([1.0; 3], [n; 3], [0.0; 3])).unwrap();
        let (coarse, fine) = (step(3), step(6));
        assert!((coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
        // a wave needs longer through a cell than the step, within a small factor
        let speed = (1e5 * 0.7 / (1.3 * 0.4) / 1000.0f64).sqrt();
        assert!(
            fine * speed * 6.0 > 0.2 && fine * speed * 6.0 < 1.0,
            "{}",
            fine * speed * 6.0
        );
    }

    #[test]
    fn one_bar_of_two_cells_is_what_its_matrix_says() {
        // all eigenvalues of a small matrix by brute force: inverse of nothing, powers of the matrix itself
        let mesh = generate::box_tets([1.0, 0.5, 0.7], [1; 3], [0.0; 3]);
        let assembler = assemble(&mesh).unwrap();
        let n = 3 * mesh.vertex_slots();
        let csr = assembler.stiffness().to_csr();
        let mut a = nalgebra::DMatrix::zeros(n, n);
        for (value, (i, j)) in csr.iter() {
            let scale = (assembler.lumped_mass()[i / 3] * assembler.lumped_mass()[j / 3]).sqrt();
            a[(i, j)] = value / scale;
        }
        let largest = a.symmetric_eigenvalues().max();
        let exact = 2.0 / largest.sqrt();
        assert!((stable_step(&mesh).unwrap() / exact - 1.0).abs() < 1e-4);
    }

    #[test]
    fn loose_pieces_are_held_and_nothing_is_no_problem() {
        let mesh = generate::box_tets([1.0; 3], [2; 3], [0.0; 3]);
        assert!(jacobi_iterations(&mesh, |p| p.x == 0.0).unwrap()[0] > 10);
        assert_eq!(jacobi_iterations(&mesh, |_| false).unwrap(), [0; LOADS]);
        let empty = TetMesh::new(Vec::new(), Vec::new()).unwrap();
        assert_eq!(stable_step(&empty).unwrap(), f64::INFINITY);
    }
}
