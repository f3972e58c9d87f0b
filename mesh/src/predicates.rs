//! Exact signs of geometric determinants (Shewchuk's adaptive arithmetic, crate `robust`).
//!
//! Coordinates should stay between 1e-50 and 1e50 in magnitude: outside, products under- or overflow.

use robust::Coord3D;

use crate::Point;

fn coord(p: Point) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Positive if `d` lies on the side of the plane `abc` from which `a, b, c` turn counter-clockwise, that is, if the
/// tetrahedron `abcd` is positively oriented; zero exactly if the four are coplanar. The sign is exact; the magnitude
/// approximates six times the volume.
#[inline]
pub fn orient3d(a: Point, b: Point, c: Point, d: Point) -> f64 {
    // robust's convention has the opposite sign
    -robust::orient3d(coord(a), coord(b), coord(c), coord(d))
}
