//! Which blocks of a square block matrix exist: rows in a growable arena.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::vectorised::vectorised;

/// Marks a segment whose row has moved away.
const HOLE: u32 = u32::MAX;

/// Rows per leaf of a parallel loop.
const GRAIN: usize = 128;

/// Gives every state of every pattern its own number.
static STAMPS: AtomicU64 = AtomicU64::new(1);

/// Where a row lies in the arena, in blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    start: u32,
    len: u32,
    capacity: u32,
}

/// A stretch of the arena given to one row; it ends where the next one starts.
#[derive(Clone, Copy, Debug)]
struct Segment {
    row: u32,
    start: u32,
}

/// The pattern of a square matrix of blocks, by rows.
///
/// A row that outgrows its place moves to the end of the arena, so a change costs what it touches. [`Self::compact`] closes
/// the holes when they exceed half of the arena: its cost, proportional to the matrix, is amortised over the moves.
#[derive(Clone, Debug)]
pub(crate) struct Pattern {
    rows: Vec<Row>,
    segment_of_row: Vec<u32>,
    segments: Vec<Segment>,
    cols: Vec<u32>,
    /// Blocks in use.
    live: usize,
    stamp: u64,
}

impl Pattern {
    /// The pattern with the given rows, each ascending, without holes.
    pub(crate) fn new(rows: usize, lens: impl Fn(usize) -> usize, fill: impl Fn(usize, &mut Vec<u32>)) -> Self {
        let total = (0..rows).map(&lens).sum();
        let mut pattern = Pattern {
            rows: Vec::with_capacity(rows),
            segment_of_row: Vec::with_capacity(rows),
            segments: Vec::with_capacity(rows),
            cols: Vec::with_capacity(total),
            live: 0,
            stamp: new_stamp(),
        };
        for i in 0..rows {
            let start = pattern.cols.len() as u32;
            fill(i, &mut pattern.cols);
            let len = pattern.cols.len() as u32 - start;
            pattern.push_row(
                i as u32,
                Row {
                    start,
                    len,
                    capacity: len,
                },
            );
        }
        pattern.live = pattern.cols.len();
        pattern
    }

    fn push_row(&mut self, row: u32, place: Row) {
        self.rows.push(place);
        self.segment_of_row.push(self.segments.len() as u32);
        self.segments.push(Segment {
            row,
            start: place.start,
        });
    }

    /// Number of rows.
    #[inline]
    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Length of the arena in blocks, holes included.
    #[inline]
    pub(crate) fn arena(&self) -> usize {
        self.cols.len()
    }

    /// Blocks in use.
    #[inline]
    pub(crate) fn live(&self) -> usize {
        self.live
    }

    /// Where row `i` lies in the arena.
    #[inline]
    pub(crate) fn range(&self, i: usize) -> std::ops::Range<usize> {
        let r = self.rows[i];
        r.start as usize..(r.start + r.len) as usize
    }

    /// Columns of row `i`, ascending.
    #[inline]
    pub(crate) fn cols(&self, i: usize) -> &[u32] {
        &self.cols[self.range(i)]
    }

    /// Place of the block `(i, j)` in the arena.
    #[inline]
    pub(crate) fn find(&self, i: usize, j: usize) -> Option<usize> {
        let range = self.range(i);
        let at = self.cols[range.clone()].binary_search(&(j as u32)).ok()?;
        Some(range.start + at)
    }

    /// The number of this state of the pattern: equal numbers, equal patterns and equal places.
    #[inline]
    pub(crate) fn stamp(&self) -> u64 {
        self.stamp
    }

    /// Gives the pattern a new number after changes.
    pub(crate) fn renew_stamp(&mut self) {
        self.stamp = new_stamp();
    }

    /// Takes over the number of a pattern that went through the same changes.
    pub(crate) fn adopt_stamp(&mut self, stamp: u64) {
        self.stamp = stamp;
    }

    /// Appends empty rows up to `rows`.
    pub(crate) fn grow_rows(&mut self, rows: usize) {
        let start = self.cols.len() as u32;
        for i in self.rows.len()..rows {
            self.push_row(
                i as u32,
                Row {
                    start,
                    len: 0,
                    capacity: 0,
                },
            );
        }
    }

    /// Replaces the columns of row `i` (ascending); whether the row had to move to the end of the arena.
    pub(crate) fn set_row(&mut self, i: usize, cols: &[u32]) -> bool {
        let row = self.rows[i];
        self.live = self.live + cols.len() - row.len as usize;
        self.rows[i].len = cols.len() as u32;
        let moves = cols.len() > row.capacity as usize;
        if moves {
            self.move_to_end(i, cols.len());
        }
        let range = self.range(i);
        self.cols[range].copy_from_slice(cols);
        moves
    }

    fn move_to_end(&mut self, i: usize, len: usize) {
        let capacity = len + len / 4 + 1;
        let start = self.cols.len() as u32;
        self.segments[self.segment_of_row[i] as usize].row = HOLE;
        self.segment_of_row[i] = self.segments.len() as u32;
        self.segments.push(Segment { row: i as u32, start });
        self.rows[i] = Row {
            start,
            len: len as u32,
            capacity: capacity as u32,
        };
        self.cols.resize(start as usize + capacity, 0);
    }

    /// Whether holes take up more than half of the arena.
    pub(crate) fn wants_compaction(&self) -> bool {
        self.arena() > 2 * self.live + 64
    }

    /// Closes all holes and puts the rows in order; the place where each row started before.
    pub(crate) fn compact(&mut self) -> Vec<u32> {
        let old: Vec<u32> = self.rows.iter().map(|r| r.start).collect();
        let fresh = Pattern::new(
            self.rows(),
            |i| self.rows[i].len as usize,
            |i, out| out.extend(self.cols(i)),
        );
        *self = fresh;
        old
    }

    /// Moves values that lay as before [`Self::compact`] to where they lie now.
    pub(crate) fn follow_compaction<V: Copy>(&self, old_starts: &[u32], values: &mut Vec<V>) {
        let mut moved = Vec::with_capacity(self.arena());
        for (row, &start) in self.rows.iter().zip(old_starts) {
            moved.extend_from_slice(&values[start as usize..(start + row.len) as usize]);
        }
        *values = moved;
    }

    /// Calls `f(row, columns, values)` for every row, in parallel; `values` has one entry per block of the arena.
    pub(crate) fn for_each_row<V: Send>(&self, values: &mut [V], f: impl Fn(usize, &[u32], &mut [V]) + Sync) {
        debug_assert_eq!(values.len(), self.arena());
        let grain = if rayon::current_num_threads() == 1 {
            usize::MAX
        } else {
            GRAIN
        };
        self.split_rows(&self.segments, 0, values, grain, &f);
    }

    fn split_rows<V: Send>(
        &self,
        segments: &[Segment],
        base: usize,
        values: &mut [V],
        grain: usize,
        f: &(impl Fn(usize, &[u32], &mut [V]) + Sync),
    ) {
        if segments.len() <= grain {
            vectorised(
                #[inline(always)]
                || {
                    for s in segments.iter().filter(|s| s.row != HOLE) {
                        let range = self.range(s.row as usize);
                        let cols = &self.cols[range.clone()];
                        f(s.row as usize, cols, &mut values[range.start - base..range.end - base]);
                    }
                },
            );
        } else {
            let (left, right) = segments.split_at(segments.len() / 2);
            let middle = right[0].start as usize;
            let (low, high) = values.split_at_mut(middle - base);
            rayon::join(
                || self.split_rows(left, base, low, grain, f),
                || self.split_rows(right, middle, high, grain, f),
            );
        }
    }
}

fn new_stamp() -> u64 {
    STAMPS.fetch_add(1, Ordering::Relaxed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tridiagonal(n: usize) -> Pattern {
        let row = move |i: usize| -> Vec<u32> { (i.saturating_sub(1)..(i + 2).min(n)).map(|j| j as u32).collect() };
        Pattern::new(n, |i| row(i).len(), |i, out| out.extend(row(i)))
    }

    #[test]
    fn rows_grow_shrink_and_survive_compaction() {
        let mut p = tridiagonal(300);
        assert_eq!(p.live(), 898);
        assert!(!p.set_row(7, &[7]));
        assert!(p.set_row(7, &[1, 5, 6, 7, 200]));
        p.grow_rows(301);
        assert!(p.set_row(300, &[2, 300]));
        assert_eq!(p.cols(7), [1, 5, 6, 7, 200]);
        assert_eq!(p.find(7, 200), Some(p.range(7).start + 4));
        assert_eq!(p.find(7, 8), None);
        let mut values: Vec<f64> = vec![-1.0; p.arena()];
        p.for_each_row(&mut values, |i, cols, row| {
            for (v, c) in row.iter_mut().zip(cols) {
                *v = (1000 * i) as f64 + f64::from(*c);
            }
        });
        let check = |p: &Pattern, values: &[f64]| {
            for i in 0..p.rows() {
                for (k, c) in p.range(i).zip(p.cols(i)) {
                    assert_eq!(values[k], (1000 * i) as f64 + f64::from(*c));
                }
            }
        };
        check(&p, &values);
        let old = p.compact();
        p.follow_compaction(&old, &mut values);
        assert_eq!(p.arena(), p.live());
        check(&p, &values);
    }

    #[test]
    fn holes_stay_below_half() {
        let mut p = tridiagonal(50);
        for round in 0..200u32 {
            let cols: Vec<u32> = (0..40 + round % 9).collect();
            p.set_row((round % 50) as usize, &cols);
            p.set_row(((round + 25) % 50) as usize, &[]);
            if p.wants_compaction() {
                p.compact();
            }
            assert!(p.arena() <= 2 * p.live() + 64);
        }
    }
}
