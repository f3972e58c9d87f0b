//! A square sparse matrix of 3x3 blocks.

use rayon::prelude::*;
use sprs::CsMat;

use crate::parts::Rows;
use crate::pattern::Pattern;
use crate::small::times;

/// Rows per task of a parallel product.
const CHUNK: usize = 128;

/// A square sparse matrix of 3x3 blocks, one block row per vertex slot. Blocks are row-major.
///
/// Rows live in a growable arena, so that a cut moves only the rows it touches; see [`crate::Assembler::update`].
#[derive(Clone, Debug)]
pub struct BlockMatrix {
    pub(crate) pattern: Pattern,
    pub(crate) values: Vec<[f64; 9]>,
}

impl BlockMatrix {
    pub(crate) fn zeros(pattern: Pattern) -> Self {
        let values = vec![[0.0; 9]; pattern.arena()];
        BlockMatrix { pattern, values }
    }

    /// Number of block rows; the matrix is `3 rows x 3 rows`.
    #[inline]
    pub fn rows(&self) -> usize {
        self.pattern.rows()
    }

    /// Number of stored blocks.
    #[inline]
    pub fn blocks(&self) -> usize {
        self.pattern.live()
    }

    /// Columns (ascending) and blocks (row-major) of a block row.
    #[inline]
    pub fn row(&self, i: usize) -> (&[u32], &[[f64; 9]]) {
        let range = self.pattern.range(i);
        (self.pattern.cols(i), &self.values[range])
    }

    /// `y := A x`, both of length `3 rows`. In parallel over rows, the same bits at any thread count.
    ///
    /// # Panics
    /// If a length is wrong.
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        assert_eq!(
            (x.len(), y.len()),
            (3 * self.rows(), 3 * self.rows()),
            "lengths of x and y"
        );
        let x = x.as_chunks::<3>().0;
        fill_rows(y, |i| self.row_times(i, x, |c| Some(c as usize)));
    }

    /// `y := A x` on the free dofs of some rows, for `x` and `y` of these rows; `x` is zero at `fixed` dofs, and `y` will be.
    pub(crate) fn multiply_rows(&self, rows: Rows<'_>, fixed: &[bool], x: &[f64], y: &mut [f64]) {
        let (x, fixed) = (x.as_chunks::<3>().0, fixed.as_chunks::<3>().0);
        let free = |i: usize, y: [f64; 3]| std::array::from_fn(|axis| if fixed[i][axis] { 0.0 } else { y[axis] });
        match rows.places() {
            None => fill_rows(y, |i| match fixed[i] {
                [true, true, true] => [0.0; 3],
                _ => free(i, self.row_times(i, x, |c| Some(c as usize))),
            }),
            Some(place) => fill_rows(y, |k| free(rows.row(k), self.row_times(rows.row(k), x, place))),
        }
    }

    /// A block row times `x`, whose entries of a column are at its place; they are zero where it has none.
    #[inline]
    fn row_times(&self, i: usize, x: &[[f64; 3]], place: impl Fn(u32) -> Option<usize>) -> [f64; 3] {
        let (cols, blocks) = self.row(i);
        let mut y = [0.0; 3];
        for (&c, block) in cols.iter().zip(blocks) {
            if let Some(place) = place(c) {
                let p = times(block, &x[place]);
                y = [y[0] + p[0], y[1] + p[1], y[2] + p[2]];
            }
        }
        y
    }

    /// Multiplies every entry by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.pattern.for_each_row(&mut self.values, |_, _, row| {
            row.as_flattened_mut().iter_mut().for_each(|a| *a *= factor);
        });
    }

    /// `self += factor * other`; both have the same pattern.
    ///
    /// # Panics
    /// If `other` has another pattern.
    pub fn add(&mut self, factor: f64, other: &BlockMatrix) {
        assert_eq!(
            self.pattern.stamp(),
            other.pattern.stamp(),
            "`other` has another pattern"
        );
        self.pattern.for_each_row(&mut self.values, |i, _, row| {
            let (_, blocks) = other.row(i);
            for (to, from) in row.as_flattened_mut().iter_mut().zip(blocks.as_flattened()) {
                *to += factor * from;
            }
        });
    }

    /// Adds `factor * per_vertex[i]` to the three diagonal entries of every row `i` that has blocks (a lumped mass).
    ///
    /// # Panics
    /// If `per_vertex` has fewer entries than there are rows.
    pub fn add_diagonal(&mut self, factor: f64, per_vertex: &[f64]) {
        self.pattern.for_each_row(&mut self.values, |i, cols, row| {
            if let Ok(k) = cols.binary_search(&(i as u32)) {
                for axis in 0..3 {
                    row[k][4 * axis] += factor * per_vertex[i];
                }
            }
        });
    }

    /// The matrix in compressed rows, `3 rows x 3 rows`, explicit zeros inside blocks included.
    pub fn to_csr(&self) -> CsMat<f64> {
        to_csr(&self.pattern, |k, r, c| self.values[k][3 * r + c], true)
    }
}

/// Sets each block row of `y`, in parallel.
fn fill_rows(y: &mut [f64], row: impl Fn(usize) -> [f64; 3] + Sync) {
    let rows = |first: usize, y: &mut [f64]| {
        for (k, out) in y.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            *out = row(first + k);
        }
    };
    if rayon::current_num_threads() == 1 {
        rows(0, y);
    } else {
        y.par_chunks_mut(3 * CHUNK)
            .enumerate()
            .for_each(|(c, y)| rows(c * CHUNK, y));
    }
}

/// Compressed rows of a matrix whose block at place `k` of the arena has the entry `entry(k, row, column)`; without `full`
/// only the diagonals of the blocks.
pub(crate) fn to_csr(pattern: &Pattern, entry: impl Fn(usize, usize, usize) -> f64, full: bool) -> CsMat<f64> {
    let n = 3 * pattern.rows();
    let (mut indptr, mut indices, mut data) = (vec![0], Vec::new(), Vec::new());
    for i in 0..pattern.rows() {
        for r in 0..3 {
            for (k, &col) in pattern.range(i).zip(pattern.cols(i)) {
                for c in (0..3).filter(|&c| full || c == r) {
                    indices.push(3 * col as usize + c);
                    data.push(entry(k, r, c));
                }
            }
            indptr.push(indices.len());
        }
    }
    CsMat::new((n, n), indptr, indices, data)
}
