//! Short programs a user would write; each prints the one number that matters.
//!
//! | program | shows |
//! |---|---|
//! | `cut_mesh` | geometry only: a mesh cut by a curved surface, no mechanics |
//! | `organ` | a scene from a file: an organ cut by a curved blade while it deforms |
//! | `falling_beam` | a beam cut through, so that a piece falls |
//! | `real_time` | a loop that calls `step` and `cut` and writes no files |
//!
//! `cargo run --release -p kerfem-examples --example organ`
