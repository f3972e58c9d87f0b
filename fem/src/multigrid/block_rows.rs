//! Sparse matrices of small dense blocks, in compressed rows.

use rayon::prelude::*;

use crate::BlockMatrix;
use crate::vectorised::vectorised;

/// A dense block, by rows.
pub(crate) type Dense<const R: usize, const C: usize> = [[f64; C]; R];

/// A dense block kept in single precision: half the memory to stream through.
pub(crate) type Single<const R: usize, const C: usize> = [[f32; C]; R];

/// Entries per task of a parallel loop.
const GRAIN: usize = 64;

/// Tasks of a parallel loop over rows.
const TASKS: usize = 64;

/// A square matrix of `B x B` blocks, read by rows.
pub(crate) trait SquareRows<const B: usize>: Sync {
    /// Number of block rows.
    fn rows(&self) -> usize;
    /// Columns (ascending) and blocks of a row.
    fn row(&self, i: usize) -> (&[u32], &[Dense<B, B>]);
}

impl SquareRows<3> for BlockMatrix {
    #[inline]
    fn rows(&self) -> usize {
        self.rows()
    }

    #[inline]
    fn row(&self, i: usize) -> (&[u32], &[Dense<3, 3>]) {
        let (cols, blocks) = self.row(i);
        (cols, blocks.as_flattened().as_chunks().0.as_chunks().0)
    }
}

/// A matrix of blocks.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BlockRows<V> {
    /// Blocks of row `i`: `starts[i]..starts[i + 1]`.
    starts: Vec<usize>,
    cols: Vec<u32>,
    blocks: Vec<V>,
}

impl<V: Copy + Send + Sync> BlockRows<V> {
    /// A matrix of equal blocks; `list` appends the columns of a row, ascending, and may use memory that starts as `scratch`
    /// makes it.
    pub(crate) fn filled<S>(
        rows: usize,
        value: V,
        scratch: impl Fn() -> S + Sync,
        list: impl Fn(usize, &mut Vec<u32>, &mut S) + Sync,
    ) -> Self {
        let part_len = rows.div_ceil(tasks()).max(1);
        let parts: Vec<(Vec<usize>, Vec<u32>)> = (0..rows.div_ceil(part_len))
            .into_par_iter()
            .map(|part| {
                let (mut ends, mut cols, mut scratch) = (Vec::new(), Vec::new(), scratch());
                for i in part * part_len..rows.min((part + 1) * part_len) {
                    list(i, &mut cols, &mut scratch);
                    ends.push(cols.len());
                }
                (ends, cols)
            })
            .collect();
        let mut starts = Vec::with_capacity(rows + 1);
        starts.push(0);
        let mut cols = Vec::with_capacity(parts.iter().map(|p| p.1.len()).sum());
        for (ends, part) in parts {
            starts.extend(ends.iter().map(|end| cols.len() + end));
            cols.extend_from_slice(&part);
        }
        let blocks = vec![value; cols.len()];
        BlockRows { starts, cols, blocks }
    }

    /// Number of block rows.
    #[inline]
    pub(crate) fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Columns of a row, ascending.
    #[inline]
    pub(crate) fn cols(&self, i: usize) -> &[u32] {
        &self.cols[self.starts[i]..self.starts[i + 1]]
    }

    /// Columns and blocks of a row.
    #[inline]
    pub(crate) fn row(&self, i: usize) -> (&[u32], &[V]) {
        let range = self.starts[i]..self.starts[i + 1];
        (&self.cols[range.clone()], &self.blocks[range])
    }

    /// All blocks, row after row.
    #[inline]
    pub(crate) fn blocks(&self) -> &[V] {
        &self.blocks
    }

    /// Calls `f(row, columns, blocks)` for every row, in parallel.
    pub(crate) fn for_each_row(&mut self, f: impl Fn(usize, &[u32], &mut [V]) + Sync) {
        self.in_parts(
            &mut vec![(); tasks()],
            #[inline(always)]
            |mut part, ()| {
                for i in part.rows() {
                    let (cols, blocks) = part.row_mut(i);
                    f(i, cols, blocks);
                }
            },
        );
    }

    /// Calls `f(part, scratch)` for as many runs of rows as there is scratch memory for, in parallel and with the vector
    /// instructions there are.
    pub(crate) fn in_parts<S: Send>(&mut self, scratch: &mut [S], f: impl Fn(Part<'_, V>, &mut S) + Sync) {
        let whole = Part {
            first: 0,
            starts: &self.starts,
            cols: &self.cols,
            blocks: &mut self.blocks,
        };
        whole.split(scratch, &f);
    }
}

/// Tasks that a loop over rows is split into.
pub(crate) fn tasks() -> usize {
    match rayon::current_num_threads() {
        1 => 1,
        _ => TASKS,
    }
}

impl<const B: usize> BlockRows<Dense<B, B>> {
    /// Fills what is left of the diagonal so that the matrix is symmetric, if its pattern is. `next` is memory for a number
    /// per row.
    pub(crate) fn mirror(&mut self, next: &mut Vec<usize>) {
        next.clear();
        next.extend_from_slice(&self.starts);
        for i in 0..self.rows() {
            for k in self.starts[i]..self.starts[i + 1] {
                let j = self.cols[k] as usize;
                if j > i {
                    // what is left of the diagonal of a row is met in ascending order
                    debug_assert_eq!(self.cols[next[j]] as usize, i, "symmetric pattern");
                    self.blocks[next[j]] = transposed(&self.blocks[k]);
                    next[j] += 1;
                }
            }
        }
    }
}

impl<const B: usize> SquareRows<B> for BlockRows<Dense<B, B>> {
    #[inline]
    fn rows(&self) -> usize {
        self.rows()
    }

    #[inline]
    fn row(&self, i: usize) -> (&[u32], &[Dense<B, B>]) {
        self.row(i)
    }
}

/// A run of rows of a matrix.
pub(crate) struct Part<'a, V> {
    first: usize,
    /// Starts of the rows and end of the last one, in the whole matrix.
    starts: &'a [usize],
    cols: &'a [u32],
    blocks: &'a mut [V],
}

impl<V: Send> Part<'_, V> {
    /// Numbers of the rows.
    #[inline]
    pub(crate) fn rows(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.starts.len() - 1
    }

    /// Columns and blocks of a row.
    #[inline]
    pub(crate) fn row_mut(&mut self, i: usize) -> (&[u32], &mut [V]) {
        let k = i - self.first;
        let range = self.starts[k] - self.starts[0]..self.starts[k + 1] - self.starts[0];
        (&self.cols[range.clone()], &mut self.blocks[range])
    }

    fn split<S: Send>(self, scratch: &mut [S], f: &(impl Fn(Part<'_, V>, &mut S) + Sync)) {
        let half = self.rows().len() / 2;
        if half == 0 || scratch.len() < 2 {
            let mut whole = Some(self);
            vectorised(
                #[inline(always)]
                || {
                    if let (Some(part), Some(scratch)) = (whole.take(), scratch.first_mut()) {
                        f(part, scratch);
                    }
                },
            );
            return;
        }
        let at = self.starts[half] - self.starts[0];
        let (low_cols, high_cols) = self.cols.split_at(at);
        let (low_blocks, high_blocks) = self.blocks.split_at_mut(at);
        let low = Part {
            first: self.first,
            starts: &self.starts[..=half],
            cols: low_cols,
            blocks: low_blocks,
        };
        let high = Part {
            first: self.first + half,
            starts: &self.starts[half..],
            cols: high_cols,
            blocks: high_blocks,
        };
        let (low_scratch, high_scratch) = scratch.split_at_mut(scratch.len() / 2);
        rayon::join(|| low.split(low_scratch, f), || high.split(high_scratch, f));
    }
}

/// Calls `f(row, entry)` for every entry, in parallel and with the vector instructions there are.
pub(crate) fn for_each_entry<V: Send>(entries: &mut [V], f: impl Fn(usize, &mut V) + Sync) {
    let task = |first: usize, entries: &mut [V]| {
        vectorised(
            #[inline(always)]
            || {
                for (k, entry) in entries.iter_mut().enumerate() {
                    f(first + k, entry);
                }
            },
        );
    };
    if rayon::current_num_threads() == 1 {
        task(0, entries);
    } else {
        entries
            .par_chunks_mut(GRAIN)
            .enumerate()
            .for_each(|(c, entries)| task(c * GRAIN, entries));
    }
}

/// The block in double precision.
#[inline(always)]
pub(crate) fn double<const R: usize, const C: usize>(a: &Single<R, C>) -> Dense<R, C> {
    a.map(|row| row.map(f64::from))
}

/// The block in single precision.
#[inline(always)]
pub(crate) fn single<const R: usize, const C: usize>(a: &Dense<R, C>) -> Single<R, C> {
    a.map(|row| row.map(|x| x as f32))
}

/// `A^T`.
#[inline(always)]
pub(crate) fn transposed<const R: usize, const C: usize>(a: &Dense<R, C>) -> Dense<C, R> {
    std::array::from_fn(|c| std::array::from_fn(|r| a[r][c]))
}

/// `out += A B`.
#[inline(always)]
pub(crate) fn add_product<const R: usize, const K: usize, const C: usize>(
    out: &mut Dense<R, C>,
    a: &Dense<R, K>,
    b: &Dense<K, C>,
) {
    for r in 0..R {
        for k in 0..K {
            for c in 0..C {
                out[r][c] += a[r][k] * b[k][c];
            }
        }
    }
}

/// `out += A^T B`.
#[inline(always)]
pub(crate) fn add_transposed_product<const R: usize, const K: usize, const C: usize>(
    out: &mut Dense<R, C>,
    a: &Dense<K, R>,
    b: &Dense<K, C>,
) {
    for k in 0..K {
        for r in 0..R {
            for c in 0..C {
                out[r][c] += a[k][r] * b[k][c];
            }
        }
    }
}

/// `A x`.
#[inline(always)]
pub(crate) fn times<const R: usize, const C: usize>(a: &Dense<R, C>, x: &[f64; C]) -> [f64; R] {
    let mut y = [0.0; R];
    add_times(&mut y, a, x);
    y
}

/// `y += A x`.
#[inline(always)]
pub(crate) fn add_times<const R: usize, const C: usize>(y: &mut [f64; R], a: &Dense<R, C>, x: &[f64; C]) {
    for r in 0..R {
        let mut sum = 0.0;
        for c in 0..C {
            sum += a[r][c] * x[c];
        }
        y[r] += sum;
    }
}

/// `y += A^T x`.
#[inline(always)]
pub(crate) fn add_transposed_times<const R: usize, const C: usize>(y: &mut [f64; C], a: &Dense<R, C>, x: &[f64; R]) {
    for r in 0..R {
        for c in 0..C {
            y[c] += a[r][c] * x[r];
        }
    }
}
