//! The points of segments and triangles that are nearest to a place.

use crate::Point;

/// Nearest point on a segment and its parameter.
pub fn on_segment(p: &Point, [a, b]: &[Point; 2]) -> (Point, f64) {
    let d = b - a;
    let n = d.norm_squared();
    let t = if n > 0.0 {
        ((p - a).dot(&d) / n).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (a + d * t, t)
}

/// The point of a triangle nearest to `p`; the triangle has an area.
pub fn on_triangle(p: &Point, [a, b, c]: &[Point; 3]) -> Point {
    let n = (b - a).cross(&(c - a));
    let inside = |u: &Point, v: &Point| (v - u).cross(&(p - u)).dot(&n) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return p - n * ((p - a).dot(&n) / n.norm_squared());
    }
    [[*a, *b], [*b, *c], [*c, *a]]
        .iter()
        .map(|e| on_segment(p, e).0)
        .min_by(|x, y| (x - p).norm_squared().total_cmp(&(y - p).norm_squared()))
        .unwrap_or(*a)
}
