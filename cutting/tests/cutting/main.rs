//! Cutting from outside: `robust` awkward sweeps with a known answer, `random` seeded sweeps with every invariant checked
//! after each, `planar` triangles cut by
//! line segments, `codes` all ways a plane or disc can meet one tetrahedron, `common` what they share.

mod codes;
mod common;
mod improve;
mod planar;
mod random;
mod robust;
