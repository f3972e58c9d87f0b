//! kerfem against references: `references` scikit-fem on the same mesh, `cut_cantilevers` scikit-fem on the mesh that a cut
//! produced, `beams` closed forms and rates of convergence, `rotations` rigid and bent bodies, `clamps` conditions crossed
//! by a cut, `conditioning` what a cut costs solvers, `fragments` pieces cut free and bodies that vanish, `openings` cracks
//! that open,
//! `random_cuts` everything that a cut must keep. `helpers` is what they share.

#[path = "../../../cutting/tests/cutting/bodies.rs"]
#[allow(dead_code)]
mod bodies;
#[path = "../../../cutting/tests/cutting/common.rs"]
#[allow(dead_code, unused_imports)]
mod common;
#[path = "../../../cutting/tests/cutting/invariants.rs"]
#[allow(dead_code)]
mod invariants;
#[path = "../../../cutting/tests/cutting/numbers.rs"]
mod numbers;
#[path = "../../../cutting/tests/cutting/sweeps.rs"]
#[allow(dead_code)]
mod sweeps;

mod beams;
mod cases;
mod clamps;
mod conditioning;
mod cut_cantilevers;
mod fragments;
mod helpers;
mod openings;
mod random_cuts;
mod references;
mod rotations;
