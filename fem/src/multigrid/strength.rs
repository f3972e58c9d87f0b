//! Which rows of a matrix are strongly bound to each other.

use super::block_rows::SquareRows;

/// Rows are strongly bound if the norm of the block between them exceeds this fraction of the geometric mean of the norms of
/// their diagonal blocks. Larger values give smaller aggregates: fewer iterations, more work in each and at the set-up.
const THRESHOLD: f64 = 0.05;

/// For each row the other rows that it is strongly bound to; a symmetric relation.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StrongNeighbors {
    starts: Vec<usize>,
    rows: Vec<u32>,
    /// Squared strengths.
    weights: Vec<f32>,
}

impl StrongNeighbors {
    /// Of a matrix, in the Frobenius norm; a row that is not `active` has none.
    pub(crate) fn of<const B: usize>(a: &impl SquareRows<B>, active: impl Fn(usize) -> bool) -> Self {
        let sizes: Vec<f64> = (0..a.rows())
            .map(|i| {
                let (cols, blocks) = a.row(i);
                match cols.binary_search(&(i as u32)) {
                    Ok(k) if active(i) => squared_norm(&blocks[k]).sqrt(),
                    _ => f64::INFINITY,
                }
            })
            .collect();
        let mut starts = Vec::with_capacity(a.rows() + 1);
        starts.push(0);
        let (mut rows, mut weights) = (Vec::new(), Vec::new());
        for i in 0..a.rows() {
            let (cols, blocks) = a.row(i);
            for (&j, block) in cols.iter().zip(blocks).filter(|(j, _)| **j as usize != i) {
                let strength = squared_norm(block) / (sizes[i] * sizes[j as usize]);
                if strength > THRESHOLD * THRESHOLD {
                    rows.push(j);
                    weights.push(strength as f32);
                }
            }
            starts.push(rows.len());
        }
        StrongNeighbors { starts, rows, weights }
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Strong neighbors of a row, ascending.
    pub(crate) fn of_row(&self, i: usize) -> &[u32] {
        &self.rows[self.starts[i]..self.starts[i + 1]]
    }

    /// The neighbor among those that are `wanted` to which a row is bound most strongly.
    pub(crate) fn strongest(&self, i: usize, wanted: impl Fn(usize) -> bool) -> Option<usize> {
        let weights = &self.weights[self.starts[i]..self.starts[i + 1]];
        let wanted = self.of_row(i).iter().zip(weights).filter(|(j, _)| wanted(**j as usize));
        let most = wanted.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)))?;
        Some(*most.0 as usize)
    }
}

fn squared_norm<const B: usize>(block: &[[f64; B]; B]) -> f64 {
    block.as_flattened().iter().map(|x| x * x).sum()
}
