//! One instant of solid mechanics on tetrahedra or planar triangles, linear or quadratic: stiffness and mass, forces, loads and linear solvers. There is no
//! clock here, and nothing that changes connectivity.
//!
//! A newcomer's path: a [`Material`] says what the body is made of, an [`Assembler`] holds K and M of a mesh and follows
//! its changes row by row, [`load`] fills right-hand sides, a [`LinearSolver`] solves for displacements. For large rotations
//! use [`Model::Corotated`]: [`Assembler::internal_force`] is the exact gradient of [`Assembler::energy`], and
//! [`Assembler::tangent`] its derivative. Nearly incompressible materials need [`Assembler::with_cure`]. All vectors are flat,
//! dof = `3 * vertex + axis`, in SI units.
//!
//! ```
//! use kerfem_fem::{Assembler, LinearSolver, Material, SolverOptions, load};
//! use kerfem_mesh::generate;
//!
//! let mesh = generate::box_tets([1.0, 0.1, 0.1], [20, 2, 2], [0.0; 3]);
//! let rubber = Material::new(1e7, 0.3, 1000.0)?;
//! let assembler = Assembler::new(&mesh, |_| rubber)?;
//!
//! let dofs = 3 * mesh.vertex_slots();
//! let clamped: Vec<bool> = (0..dofs).map(|d| mesh.rest_positions()[d / 3].x == 0.0).collect();
//! let (mut f, mut u) = (vec![0.0; dofs], vec![0.0; dofs]);
//! load::add_gravity(&mesh, &assembler, [0.0, 0.0, -9.81], &mut f);
//!
//! let mut solver = LinearSolver::new(SolverOptions::default());
//! let info = solver.solve(assembler.stiffness(), &clamped, &f, &mut u)?;
//! assert!(info.converged);
//! let sag = u.iter().skip(2).step_by(3).fold(0.0, |m: f64, z| m.min(*z));
//! assert!(sag < -0.05 && sag > -0.2);
//! # Ok::<(), kerfem_fem::FemError>(())
//! ```

mod assembler;
mod block_ic0;
mod block_matrix;
mod cg;
mod cholesky;
mod corotated;
mod eigen;
mod element;
mod error;
mod evaluate;
pub mod load;
mod locking;
mod mass;
mod material;
mod modes;
mod multigrid;
mod parallel;
mod parts;
mod patch;
mod pattern;
mod preconditioner;
mod quadratic;
mod rotation;
mod rows;
mod small;
mod solver;
mod vector;
mod vectorised;
mod verify;

pub use assembler::{Assembler, Touched};
pub use block_matrix::BlockMatrix;
pub use error::FemError;
pub use evaluate::{Model, Scales, Tangent};
pub use locking::{Locking, NEARLY_INCOMPRESSIBLE};
pub use mass::MassMatrix;
pub use material::{Material, Plane};
pub use modes::{Mode, natural_modes};
pub use multigrid::MultigridWork;
pub use solver::{LinearSolver, PreconditionerKind, SolveInfo, SolverKind, SolverOptions};
pub use verify::Verification;
