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

/// A cell in which a point lies deepest.
#[derive(Clone, Debug)]
pub struct Deepest<K, const N: usize> {
    /// The least of the coordinates: below zero the point lies outside.
    pub depth: f64,
    /// Which cell.
    pub key: K,
    /// Coordinates of the point in it.
    pub coordinates: [f64; N],
}

impl<K: PartialOrd, const N: usize> Deepest<K, N> {
    /// Among cells with corners at the places given, flat ones left out; of several that are as deep that with the greatest key.
    pub fn of(point: &Point, cells: impl IntoIterator<Item = (K, [Point; N])>) -> Option<Self> {
        let mut deepest: Option<Self> = None;
        for (key, corners) in cells {
            let Some(coordinates) = Barycentric::of(&corners).map(|b| b.at(point)) else {
                continue;
            };
            let depth = coordinates.into_iter().fold(f64::INFINITY, f64::min);
            if deepest.as_ref().is_none_or(|d| (depth, &key) > (d.depth, &d.key)) {
                deepest = Some(Deepest {
                    depth,
                    key,
                    coordinates,
                });
            }
        }
        deepest
    }
}
