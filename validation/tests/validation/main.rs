//! kerfem against references: `references` scikit-fem on the same mesh, `cut_cantilevers` scikit-fem on the mesh that a cut
//! produced, `beams` closed forms and rates of convergence, `rotations` rigid and bent bodies, `clamps` conditions crossed
//! by a cut, `conditioning` what a cut costs solvers, `fragments` pieces cut free and bodies that vanish, `openings` cracks that open. `helpers` is what they share.

mod beams;
mod clamps;
mod conditioning;
mod cut_cantilevers;
mod fragments;
mod helpers;
mod openings;
mod references;
mod rotations;
