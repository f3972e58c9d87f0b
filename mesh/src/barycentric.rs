//! Barycentric coordinates of points in cells.

use nalgebra::{Matrix4, Vector4};

use crate::Point;

/// Coordinates relative to the corners of one cell; of a triangle in the plane z = 0.
#[derive(Clone, Debug)]
pub struct Barycentric<const N: usize> {
    inverse: Matrix4<f64>,
}

impl<const N: usize> Barycentric<N> {
    /// For a cell with corners at `p`; none if it is flat.
    pub fn of(p: &[Point; N]) -> Option<Self> {
        // the fourth column of a triangle is the direction out of its plane
        let mut columns = [Vector4::new(0.0, 0.0, 0.0, 1.0); 4];
        for (column, p) in columns.iter_mut().zip(p) {
            *column = Vector4::new(1.0, p.x, p.y, p.z);
        }
        let inverse = Matrix4::from_columns(&columns).try_inverse()?;
        Some(Barycentric { inverse })
    }

    /// The coordinates of a point; they add up to one.
    pub fn at(&self, p: &Point) -> [f64; N] {
        let all = self.inverse * Vector4::new(1.0, p.x, p.y, p.z);
        std::array::from_fn(|k| all[k])
    }
}
