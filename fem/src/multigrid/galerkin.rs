//! Coarse matrices `P^T A P`.

use super::block_rows::{BlockRows, Dense, Part, SquareRows, add_product, add_transposed_product, double, tasks};
use super::prolongator::Prolongation;

/// A column that the row at hand does not have.
const NONE: u32 = u32::MAX;

/// For each column of a matrix the rows that have it, ascending, and the places of the blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns {
    starts: Vec<usize>,
    entries: Vec<(u32, u32)>,
}

impl Columns {
    /// Of a matrix with so many columns.
    pub(crate) fn of<V: Copy + Send + Sync>(p: &BlockRows<V>, columns: usize) -> Self {
        let mut starts = vec![0; columns + 1];
        for i in 0..p.rows() {
            p.cols(i).iter().for_each(|&c| starts[c as usize + 1] += 1);
        }
        for c in 0..columns {
            starts[c + 1] += starts[c];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0); starts[columns]];
        let mut place = 0;
        for i in 0..p.rows() {
            for &c in p.cols(i) {
                entries[next[c as usize]] = (i as u32, place);
                next[c as usize] += 1;
                place += 1;
            }
        }
        Columns { starts, entries }
    }

    /// Row and place of the blocks of a column.
    #[inline]
    pub(crate) fn column(&self, c: usize) -> &[(u32, u32)] {
        &self.entries[self.starts[c]..self.starts[c + 1]]
    }

    /// Number of columns.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }
}

/// The product `P^T A P`, refilled when the values of `A` change.
#[derive(Debug)]
pub(crate) struct Galerkin<const B: usize, const M: usize> {
    coarse: BlockRows<Dense<M, M>>,
    scratch: Vec<Scratch<B, M>>,
    mirror: Vec<usize>,
}

/// Memory of a task.
#[derive(Clone, Debug)]
struct Scratch<const B: usize, const M: usize> {
    /// One row of `A P`: its columns in the order met, and for each column of the matrix its place among them.
    cols: Vec<u32>,
    blocks: Vec<Dense<B, M>>,
    places: Vec<u32>,
    /// Place of each column in the coarse row at hand.
    targets: Vec<u32>,
}

impl<const B: usize, const M: usize> Galerkin<B, M> {
    /// Finds the pattern.
    pub(crate) fn of_pattern(a: &impl SquareRows<B>, p: &Prolongation<B, M>, columns: &Columns) -> Self {
        let n = columns.len();
        // rows and columns met last by which coarse row
        let marks = || (vec![NONE; a.rows()], vec![NONE; n]);
        let coarse = BlockRows::filled(n, [[0.0; M]; M], marks, |c, out, (rows, cols)| {
            let first = out.len();
            for &(i, _) in columns.column(c) {
                for &j in a.row(i as usize).0 {
                    if std::mem::replace(&mut rows[j as usize], c as u32) == c as u32 {
                        continue;
                    }
                    for &d in p.cols(j as usize) {
                        if std::mem::replace(&mut cols[d as usize], c as u32) != c as u32 {
                            out.push(d);
                        }
                    }
                }
            }
            out[first..].sort_unstable();
        });
        let scratch = Scratch {
            cols: Vec::new(),
            blocks: Vec::new(),
            places: vec![NONE; n],
            targets: vec![NONE; n],
        };
        Galerkin {
            coarse,
            scratch: vec![scratch; tasks()],
            mirror: Vec::new(),
        }
    }

    /// The coarse matrix.
    pub(crate) fn coarse(&self) -> &BlockRows<Dense<M, M>> {
        &self.coarse
    }

    /// Forms the product. Every entry is a sum over fine rows in ascending order, so its bits do not depend on the tasks.
    pub(crate) fn refresh(&mut self, a: &impl SquareRows<B>, p: &Prolongation<B, M>) {
        self.coarse.in_parts(
            &mut self.scratch,
            #[inline(always)]
            |mut part, scratch| {
                for c in part.rows() {
                    part.row_mut(c).1.fill([[0.0; M]; M]);
                }
                for i in 0..p.rows() {
                    add_row(a, p, i, &mut part, scratch);
                }
            },
        );
        self.coarse.mirror(&mut self.mirror);
    }
}

/// Adds what fine row `i` contributes to the coarse rows of a part, on and right of the diagonal.
#[inline(always)]
fn add_row<const B: usize, const M: usize>(
    a: &impl SquareRows<B>,
    p: &Prolongation<B, M>,
    i: usize,
    part: &mut Part<'_, Dense<M, M>>,
    scratch: &mut Scratch<B, M>,
) {
    let rows = part.rows();
    let (groups, weights) = p.row(i);
    let mine = |g: u32| rows.contains(&(g as usize));
    let Some(&least) = groups.iter().find(|&&g| mine(g)) else {
        return;
    };
    scratch.fill(a, p, i, least);
    for (&c, weight) in groups.iter().zip(weights).filter(|(c, _)| mine(**c)) {
        let weight = double(weight);
        let (cols, row) = part.row_mut(c as usize);
        let first = cols.partition_point(|&d| d < c);
        for (k, &d) in cols.iter().enumerate().skip(first) {
            scratch.targets[d as usize] = k as u32;
        }
        for (&d, block) in scratch.cols.iter().zip(&scratch.blocks).filter(|(d, _)| **d >= c) {
            add_transposed_product(&mut row[scratch.targets[d as usize] as usize], &weight, block);
        }
    }
}

impl<const B: usize, const M: usize> Scratch<B, M> {
    /// Row `i` of `A P` from column `least` on.
    #[inline(always)]
    fn fill(&mut self, a: &impl SquareRows<B>, p: &Prolongation<B, M>, i: usize, least: u32) {
        self.cols.drain(..).for_each(|c| self.places[c as usize] = NONE);
        self.blocks.clear();
        let (cols, blocks) = a.row(i);
        for (&j, block) in cols.iter().zip(blocks) {
            let (groups, weights) = p.row(j as usize);
            for (&g, weight) in groups.iter().zip(weights).filter(|(g, _)| **g >= least) {
                let place = &mut self.places[g as usize];
                if *place == NONE {
                    *place = self.cols.len() as u32;
                    self.cols.push(g);
                    self.blocks.push([[0.0; M]; B]);
                }
                add_product(&mut self.blocks[*place as usize], block, &double(weight));
            }
        }
    }
}
