//! Exact signs of geometric determinants (Shewchuk's adaptive arithmetic, crate `robust`).
//!
//! Coordinates should stay between 1e-50 and 1e50 in magnitude: outside, products under- or overflow.

use robust::{Coord, Coord3D};

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

/// Positive if `a, b, c` turn counter-clockwise seen from above, by their first two coordinates; zero exactly if they lie on a
/// line. The sign is exact; the magnitude approximates twice the area.
#[inline]
pub fn orient2d(a: Point, b: Point, c: Point) -> f64 {
    let flat = |p: Point| Coord { x: p.x, y: p.y };
    robust::orient2d(flat(a), flat(b), flat(c))
}

/// Whether a point lies in a positively oriented cell, or on one of its facets. Exact.
pub fn contains<const N: usize>(cell: &[Point; N], p: Point) -> bool {
    (0..N).all(|k| {
        let mut with = *cell;
        with[k] = p;
        orientation(&with) >= 0.0
    })
}

/// Orientation of a cell: [`orient3d`] of a tetrahedron, [`orient2d`] of a planar triangle. Exact sign.
#[inline]
pub fn orientation<const N: usize>(p: &[Point; N]) -> f64 {
    if N == 4 {
        orient3d(p[0], p[1], p[2], p[3])
    } else {
        orient2d(p[0], p[1], p[2])
    }
}
