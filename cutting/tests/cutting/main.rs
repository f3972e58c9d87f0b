//! Cutting from outside: `robust` awkward sweeps with a known answer, `every_method` those that every method must survive,
//! `random` seeded sweeps with every invariant checked after each, `blade` progressive cuts, `fuzz` anything at all, `planar`
//! triangles cut by line segments, `codes` all ways a plane or disc can meet one tetrahedron. What they share: `bodies`,
//! `sweeps` drawn at random, `invariants`, `numbers`, and the rest in `common`.

mod blade;
mod bodies;
mod codes;
mod common;
mod every_method;
mod fuzz;
mod improve;
mod invariants;
mod numbers;
mod planar;
mod random;
mod robust;
mod sweeps;
