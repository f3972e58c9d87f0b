//! Anything with a reference: kerfem against scikit-fem, closed forms and stated invariants.
//!
//! [`Reference`] is a solution that scikit-fem found (`validation/references`, made by `make_references.py`);
//! [`cut_beam`] makes the cuts behind the references named `cut_*`; [`norms`] measures differences, [`conditioning`] what a mesh
//! asks of solvers and time steps. The comparisons themselves are the tests of this crate, and `check_results.py` for files that the command writes.
//!
//! ```
//! use kerfem_validation::Reference;
//! let reference = Reference::read("cantilever_gravity")?;
//! assert_eq!(reference.displacement.len(), 3 * reference.mesh.vertex_slots());
//! # Ok::<(), kerfem_validation::ValidationError>(())
//! ```

pub mod conditioning;
pub mod cut_beam;
mod error;
pub mod norms;
mod reference;

pub use error::ValidationError;
pub use reference::{DENSITY, POISSON, Reference, YOUNG, reference_file};
