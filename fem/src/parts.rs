//! Parts of a system that nothing couples: a body that is cut in two is two systems.

use crate::BlockMatrix;

/// A part that has fewer rows than all divided by this is taken together with the other small ones.
const SMALLEST: usize = 8;

/// Stands for the place of a row that is not looked at.
const NOWHERE: u32 = u32::MAX;

/// Block rows of a system, ascending, that are solved for; vectors have three entries for each of these only.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    rows: &'a [u32],
    /// By row of the whole system: which of the rows it is, of those that it is coupled to. None if these are all rows.
    places: Option<&'a [u32]>,
}

impl<'a> Rows<'a> {
    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The number of the `k`-th in the whole system.
    #[inline]
    pub(crate) fn row(&self, k: usize) -> usize {
        self.rows[k] as usize
    }

    /// Where the entries of each row of the whole system are; none if these are all rows, each in its own place.
    #[inline]
    pub(crate) fn places(&self) -> Option<impl Fn(u32) -> Option<usize> + Copy + 'a> {
        self.places.map(|places| {
            #[inline]
            move |row: u32| {
                let place = places[row as usize];
                (place != NOWHERE).then_some(place as usize)
            }
        })
    }

    /// Their numbers in the whole system.
    pub(crate) fn iter(&self) -> impl DoubleEndedIterator<Item = usize> + ExactSizeIterator + use<'a> {
        self.rows.iter().map(|&i| i as usize)
    }
}

/// The uncoupled parts of a matrix on its free dofs, as far as each is large.
///
/// Conjugate gradients on two parts at once must meet the eigenvalues of both with one sequence of steps; on each by itself they
/// need fewer.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// Of the pattern they were found for.
    stamp: u64,
    fixed: Vec<bool>,
    /// Rows with a free dof, by part.
    parts: Vec<Vec<u32>>,
    /// By row: which of its part it is.
    places: Vec<u32>,
    /// All rows, each its own place.
    all: Vec<u32>,
}

impl Parts {
    /// Every row, those without a free dof too.
    pub(crate) fn all(&mut self, a: &BlockMatrix) -> Rows<'_> {
        self.all.truncate(a.rows());
        self.all.extend(self.all.len() as u32..a.rows() as u32);
        Rows {
            rows: &self.all,
            places: None,
        }
    }

    /// How many parts there are, found anew if the pattern or the fixed dofs are others than before.
    pub(crate) fn find(&mut self, a: &BlockMatrix, fixed: &[bool]) -> usize {
        if self.stamp != a.pattern.stamp() || self.fixed != fixed {
            self.stamp = a.pattern.stamp();
            self.fixed.clear();
            self.fixed.extend_from_slice(fixed);
            self.parts = grouped(uncoupled(a, fixed));
            self.places.clear();
            self.places.resize(a.rows(), NOWHERE);
            for part in &self.parts {
                for (place, &row) in part.iter().enumerate() {
                    self.places[row as usize] = place as u32;
                }
            }
        }
        self.parts.len()
    }

    /// One of the parts last found.
    pub(crate) fn part(&self, k: usize) -> Rows<'_> {
        Rows {
            rows: &self.parts[k],
            places: Some(&self.places),
        }
    }
}

/// Large parts as they are, and the small ones as one; rows ascend in each.
fn grouped(parts: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
    let rows: usize = parts.iter().map(Vec::len).sum();
    let (mut groups, small): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| SMALLEST * part.len() >= rows);
    if !small.is_empty() {
        groups.push(small.concat());
    }
    groups.iter_mut().for_each(|group| group.sort_unstable());
    groups
}

/// Rows with a free dof, by the part that they belong to.
fn uncoupled(a: &BlockMatrix, fixed: &[bool]) -> Vec<Vec<u32>> {
    let is_free = |i: usize| fixed[3 * i..3 * i + 3] != [true; 3];
    let mut is_new: Vec<bool> = (0..a.rows()).map(is_free).collect();
    let mut parts = Vec::new();
    for start in 0..a.rows() {
        if !std::mem::take(&mut is_new[start]) {
            continue;
        }
        let mut part = vec![start as u32];
        let mut reached = 0;
        while let Some(&i) = part.get(reached) {
            for &j in a.pattern.cols(i as usize) {
                if std::mem::take(&mut is_new[j as usize]) {
                    part.push(j);
                }
            }
            reached += 1;
        }
        parts.push(part);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::Pattern;

    /// A matrix of chains of rows, one after another.
    fn chains(lengths: &[usize]) -> BlockMatrix {
        let mut rows: Vec<Vec<u32>> = Vec::new();
        for &length in lengths {
            let first = rows.len();
            for i in first..first + length {
                let row = i.saturating_sub(1).max(first)..(i + 2).min(first + length);
                rows.push(row.map(|j| j as u32).collect());
            }
        }
        BlockMatrix::zeros(Pattern::new(
            rows.len(),
            |i| rows[i].len(),
            |i, out| out.extend(&rows[i]),
        ))
    }

    fn found(parts: &mut Parts, a: &BlockMatrix, fixed: &[bool]) -> Vec<Vec<usize>> {
        (0..parts.find(a, fixed))
            .map(|k| parts.part(k).iter().collect())
            .collect()
    }

    #[test]
    fn chains_are_parts_and_fixed_rows_divide_them() {
        let (a, mut parts) = (chains(&[3, 4]), Parts::default());
        let mut fixed = vec![false; 21];
        assert_eq!(found(&mut parts, &a, &fixed), [vec![0, 1, 2], vec![3, 4, 5, 6]]);
        fixed[15..18].fill(true);
        assert_eq!(found(&mut parts, &a, &fixed), [vec![0, 1, 2], vec![3, 4], vec![6]]);
        let second = parts.part(1);
        assert_eq!((second.len(), second.row(1)), (2, 4));
        assert_eq!([3, 4, 5].map(second.places().unwrap()), [Some(0), Some(1), None]);
        // one dof of three still couples
        fixed[16] = false;
        assert_eq!(found(&mut parts, &a, &fixed).len(), 2);
        assert!(found(&mut parts, &a, &[true; 21]).is_empty());
        assert_eq!(parts.all(&a).iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn small_parts_are_taken_together() {
        let parts = found(&mut Parts::default(), &chains(&[1, 20, 2, 20, 1]), &[false; 3 * 44]);
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [20, 20, 4]);
        assert_eq!(parts[2], [0, 21, 22, 43]);
    }

    #[test]
    fn parts_are_found_anew_for_another_pattern_or_other_supports() {
        let mut parts = Parts::default();
        let (one, two) = (chains(&[6]), chains(&[3, 3]));
        let mut count = |a: &BlockMatrix, fixed: &[bool]| parts.find(a, fixed);
        assert_eq!(count(&one, &[false; 18]), 1);
        assert_eq!(count(&two, &[false; 18]), 2);
        assert_eq!(count(&one, &[false; 18]), 1);
        let mut middle = [false; 18];
        middle[6..9].fill(true);
        assert_eq!(count(&one, &middle), 2);
    }
}
