//! Tests of the whole crate: elasticity of a body, updates after edits, the cure of locking, linear solves, multigrid, and figures (ignored).

mod elasticity;
mod figures;
mod helpers;
mod locking;
mod multigrid;
mod planar;
mod quadratic;
mod solve;
mod update;
