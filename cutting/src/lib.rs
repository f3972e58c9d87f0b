//! Whatever changes connectivity: cutting meshes by swept surfaces.
//!
//! A [`Sweep`] is the surface that a blade has covered. [`cut`] edits a mesh in one transaction and returns the
//! [`kerfem_mesh::MeshChange`], where the new and moved vertices lie, and a [`CutReport`]. How it works, in order (one file each):
//!
//! 1. `region`: cells near the sweep, found through a box tree.
//! 2. `front`: where the border of the sweep pierces facets, a vertex is snapped or inserted (METHODS S6, S7, N1).
//! 3. `sheet`: where the sweep crosses edges, an end is snapped or the edge is split (S3, S4, S9).
//! 4. `separate`: facets whose two cells lie on different sides of the sweep are marked, and every vertex gets one copy for
//!    each group of its cells that the marks leave connected (S4, Y3, Y4, F14).
//! 5. `improve`: cells that came out badly are made better, between marking and doubling (G, Y, S10), if that is wanted.
//!
//! A moving [`Blade`] cuts progressively (`blade`): each of its motions is a sweep that begins where the incision ends, at its
//! [`Tip`].
//!
//! Sides are decided by counting, with exact predicates, how often a path between two points inside the cells crosses the
//! sweep. A closed path crosses a surface an even number of times unless it runs around its border, so the marked facets
//! have no holes, however coarse the mesh and however badly the earlier steps went; those only bring them closer to the
//! sweep.

mod blade;
mod cut;
mod delete;
mod front;
mod improve;
mod region;
mod separate;
mod sheet;
mod snap;
mod split;
mod sweep;
mod unlock;
mod workspace;

pub use blade::{Blade, BladeError, Tip};
pub use cut::{Borders, CutError, CutOptions, CutOutcome, CutReport, Method, Refusal, cut, cut_within, improve};
pub use sweep::Sweep;
