//! The consistent mass matrix: one number per block of the stiffness pattern.

use kerfem_mesh::VertexId;
use sprs::CsMat;

use crate::BlockMatrix;
use crate::block_matrix::to_csr;
use crate::pattern::Pattern;

/// Consistent mass (kg), the same for the three axes: of linear simplices `density * volume / (N (N + 1)) * (1 + delta_ab)` for
/// corners `a`, `b` of a cell of `N` corners; of order 2 that of the quadratic shape functions. A view into an [`crate::Assembler`].
#[derive(Clone, Copy, Debug)]
pub struct MassMatrix<'a> {
    pub(crate) pattern: &'a Pattern,
    pub(crate) values: &'a [f64],
}

impl MassMatrix<'_> {
    /// `y := M x`, both of length `3 * vertex slots`.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        let n = 3 * self.pattern.rows();
        assert_eq!((x.len(), y.len()), (n, n), "lengths of x and y");
        for (i, y) in y.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            *y = [0.0; 3];
            for (m, &c) in self.values[self.pattern.range(i)].iter().zip(self.pattern.cols(i)) {
                for axis in 0..3 {
                    y[axis] += m * x[3 * c as usize + axis];
                }
            }
        }
    }

    /// What a vertex weighs in a uniform acceleration (kg): the sum of its row. Of order 2 it may be negative.
    ///
    /// # Panics
    /// If there is no such slot.
    pub fn row_sum(&self, v: VertexId) -> f64 {
        self.values[self.pattern.range(v.index())].iter().sum()
    }

    /// `out += factor * M`; `out` has the pattern of the assembler this comes from.
    ///
    /// # Panics
    /// If `out` has another pattern.
    pub fn add_to(&self, factor: f64, out: &mut BlockMatrix) {
        assert_eq!(self.pattern.stamp(), out.pattern.stamp(), "`out` has another pattern");
        out.pattern.for_each_row(&mut out.values, |i, _, row| {
            for (block, m) in row.iter_mut().zip(&self.values[self.pattern.range(i)]) {
                for axis in 0..3 {
                    block[4 * axis] += factor * m;
                }
            }
        });
    }

    /// The matrix in compressed rows, `3 n x 3 n` for `n` vertex slots.
    pub fn to_csr(&self) -> CsMat<f64> {
        to_csr(self.pattern, |k, _, _| self.values[k], false)
    }
}
