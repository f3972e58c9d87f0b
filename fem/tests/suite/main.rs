//! Tests of the whole crate: elasticity of a body, updates after edits, linear solves, multigrid, and figures (ignored).

mod elasticity;
mod figures;
mod helpers;
mod multigrid;
mod planar;
mod solve;
mod update;
