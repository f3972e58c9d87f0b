//! Meshes of simple bodies and surfaces.

mod ball;
mod boxes;
mod cap;
mod cylinder;
mod disk;

pub use ball::ball_tets;
pub use boxes::{box_tets, rect_triangles, try_box_tets};
pub use cap::cap_triangles;
pub use cylinder::cylinder_tets;

use crate::quality::tet_volume;
use crate::{MeshError, Point};

fn check_count(what: &'static str, count: usize) -> Result<(), MeshError> {
    if count < u32::MAX as usize {
        Ok(())
    } else {
        Err(MeshError::TooLarge { what, count })
    }
}

/// The tetrahedron with two corners swapped if that makes its volume positive.
fn oriented(points: &[Point], mut tet: [usize; 4]) -> [usize; 4] {
    if tet_volume(&tet.map(|v| points[v])) < 0.0 {
        tet.swap(2, 3);
    }
    tet
}
