//! Measures of cells.

use crate::{Point, TetMesh};

/// Signed volume of a tetrahedron (m³).
#[inline]
pub fn tet_volume(p: &[Point; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0])) / 6.0
}

/// Volume of a mesh at rest (m³).
pub fn volume(mesh: &TetMesh) -> f64 {
    mesh.cell_ids().map(|c| tet_volume(&mesh.cell_rest_positions(c))).sum()
}

/// Radius ratio `3 r / R` of a tetrahedron (inscribed over circumscribed sphere): 1 for a regular one, 0 for a flat one,
/// negative for an inverted one.
pub fn radius_ratio(p: &[Point; 4]) -> f64 {
    let (a, b, c) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let six_v = a.cross(&b).dot(&c);
    let areas2 = a.cross(&b).norm() + b.cross(&c).norm() + c.cross(&a).norm() + (b - a).cross(&(c - a)).norm();
    let q = a.norm_squared() * b.cross(&c) + b.norm_squared() * c.cross(&a) + c.norm_squared() * a.cross(&b);
    // r = six_v / areas2, R = |q| / (2 six_v)
    let d = areas2 * q.norm();
    if d > 0.0 { 6.0 * six_v * six_v.abs() / d } else { 0.0 }
}
