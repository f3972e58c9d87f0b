//! Groups of rows that become one row of the next coarser level.

use super::strength::StrongNeighbors;

/// No aggregate.
const NONE: u32 = u32::MAX;

/// A partition of some of the rows of a matrix into aggregates. Each is connected through strong neighbors.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Aggregates {
    strong: StrongNeighbors,
    of_row: Vec<u32>,
    /// Rows of aggregate `g`: `members[starts[g]..starts[g + 1]]`, ascending.
    starts: Vec<usize>,
    members: Vec<u32>,
    kept: usize,
}

impl Aggregates {
    /// Aggregates by the greedy passes of Vanek, Mandel and Brezina (Computing 56, 1996): whole strong neighborhoods first,
    /// then each row left over joins the aggregate it is bound to most strongly, then what is still left over forms
    /// aggregates of its own. Rows are visited in ascending order. A row without strong neighbors is in no aggregate: it is
    /// left to the smoother.
    ///
    /// Aggregates of an earlier matrix are kept if each of their rows has the strong neighbors that it had. The others, so
    /// all that a cut runs through, are dissolved and their rows aggregated anew.
    pub(crate) fn of(strong: StrongNeighbors, before: Option<&Aggregates>) -> Self {
        let n = strong.len();
        let (mut of_row, kept) = match before {
            Some(before) => before.unchanged(&strong),
            None => (vec![NONE; n], 0),
        };
        let mut count = kept as u32;
        let free = |of_row: &[u32], j: usize| of_row[j] == NONE;
        for i in 0..n {
            let neighbors = strong.of_row(i);
            let whole = !neighbors.is_empty() && neighbors.iter().all(|&j| free(&of_row, j as usize));
            if whole && free(&of_row, i) {
                of_row[i] = count;
                neighbors.iter().for_each(|&j| of_row[j as usize] = count);
                count += 1;
            }
        }
        let joins: Vec<(usize, u32)> = (0..n)
            .filter(|&i| free(&of_row, i))
            .filter_map(|i| Some((i, of_row[strong.strongest(i, |j| !free(&of_row, j))?])))
            .collect();
        joins.into_iter().for_each(|(i, g)| of_row[i] = g);
        for i in (0..n).filter(|&i| !strong.of_row(i).is_empty()) {
            if !free(&of_row, i) {
                continue;
            }
            let neighbors = strong.of_row(i);
            if neighbors.iter().any(|&j| free(&of_row, j as usize)) {
                of_row[i] = count;
                for &j in neighbors {
                    if free(&of_row, j as usize) {
                        of_row[j as usize] = count;
                    }
                }
                count += 1;
            } else if let Some(j) = strong.strongest(i, |_| true) {
                of_row[i] = of_row[j];
            }
        }
        Self::numbered(strong, of_row, count as usize, kept)
    }

    /// The aggregates whose rows have the strong neighbors they had, numbered from zero, and how many.
    fn unchanged(&self, strong: &StrongNeighbors) -> (Vec<u32>, usize) {
        let mut of_row = vec![NONE; strong.len()];
        let mut count = 0;
        let same = |i: usize| i < strong.len() && self.strong.of_row(i) == strong.of_row(i);
        for g in 0..self.len() {
            if self.members(g).iter().all(|&i| same(i as usize)) {
                self.members(g).iter().for_each(|&i| of_row[i as usize] = count);
                count += 1;
            }
        }
        (of_row, count as usize)
    }

    fn numbered(strong: StrongNeighbors, of_row: Vec<u32>, count: usize, kept: usize) -> Self {
        let mut starts = vec![0; count + 1];
        for &g in of_row.iter().filter(|&&g| g != NONE) {
            starts[g as usize + 1] += 1;
        }
        for g in 0..count {
            starts[g + 1] += starts[g];
        }
        let mut next = starts.clone();
        let mut members = vec![0; starts[count]];
        for (i, &g) in of_row.iter().enumerate().filter(|(_, g)| **g != NONE) {
            members[next[g as usize]] = i as u32;
            next[g as usize] += 1;
        }
        Aggregates {
            strong,
            of_row,
            starts,
            members,
            kept,
        }
    }

    /// Number of aggregates.
    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// How many of them were taken over from an earlier matrix.
    pub(crate) fn kept(&self) -> usize {
        self.kept
    }

    /// The aggregate of a row.
    #[inline]
    pub(crate) fn of_row(&self, i: usize) -> Option<u32> {
        Some(self.of_row[i]).filter(|&g| g != NONE)
    }

    /// Rows of an aggregate, ascending.
    #[inline]
    pub(crate) fn members(&self, g: usize) -> &[u32] {
        &self.members[self.starts[g]..self.starts[g + 1]]
    }

    /// Strong neighbors of a row, ascending.
    pub(crate) fn strong_neighbors(&self, i: usize) -> &[u32] {
        self.strong.of_row(i)
    }
}
