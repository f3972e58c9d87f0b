//! Parts of a system that nothing couples: a body that is cut in two is two systems.

use crate::BlockMatrix;

/// A part that has fewer rows than all divided by this is taken together with the other small ones.
const SMALLEST: usize = 8;

/// The uncoupled parts of a matrix on its free dofs, as far as each is large.
///
/// Conjugate gradients on two parts at once must meet the eigenvalues of both with one sequence of steps; on each by itself they
/// need fewer.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// Of the pattern they were found for.
    stamp: u64,
    fixed: Vec<bool>,
    masks: Vec<Vec<bool>>,
}

impl Parts {
    /// For each part the dofs that are fixed or belong to others: `fixed` itself if there is one part only.
    pub(crate) fn find(&mut self, a: &BlockMatrix, fixed: &[bool]) -> &[Vec<bool>] {
        if self.stamp != a.pattern.stamp() || self.fixed != fixed {
            self.stamp = a.pattern.stamp();
            self.fixed.clear();
            self.fixed.extend_from_slice(fixed);
            self.masks = masks(a, fixed);
        }
        &self.masks
    }
}

fn masks(a: &BlockMatrix, fixed: &[bool]) -> Vec<Vec<bool>> {
    let parts = uncoupled(a, fixed);
    let rows: usize = parts.iter().map(Vec::len).sum();
    let (large, small): (Vec<_>, Vec<_>) = parts.into_iter().partition(|part| SMALLEST * part.len() >= rows);
    let rest = small.concat();
    let groups = large.iter().chain((!rest.is_empty()).then_some(&rest));
    let mask = |rows: &Vec<u32>| {
        let mut mask = vec![true; fixed.len()];
        for dofs in rows.iter().map(|&i| 3 * i as usize..3 * i as usize + 3) {
            mask[dofs.clone()].copy_from_slice(&fixed[dofs]);
        }
        mask
    };
    groups.map(mask).collect()
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

    /// The free rows of each part.
    fn free_rows(a: &BlockMatrix, fixed: &[bool]) -> Vec<Vec<usize>> {
        let free = |mask: &Vec<bool>| (0..a.rows()).filter(|i| !mask[3 * i]).collect();
        Parts::default().find(a, fixed).iter().map(free).collect()
    }

    #[test]
    fn chains_are_parts_and_fixed_rows_divide_them() {
        let a = chains(&[3, 4]);
        let mut fixed = vec![false; 21];
        assert_eq!(free_rows(&a, &fixed), [vec![0, 1, 2], vec![3, 4, 5, 6]]);
        fixed[15..18].fill(true);
        assert_eq!(free_rows(&a, &fixed), [vec![0, 1, 2], vec![3, 4], vec![6]]);
        // one dof of three still couples
        fixed[16] = false;
        assert_eq!(free_rows(&a, &fixed).len(), 2);
        assert!(free_rows(&a, &[true; 21]).is_empty());
    }

    #[test]
    fn small_parts_are_taken_together() {
        let a = chains(&[1, 20, 2, 20, 1]);
        let found = free_rows(&a, &[false; 3 * 44]);
        assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [20, 20, 4]);
        assert_eq!(found[2], [0, 21, 22, 43]);
    }

    #[test]
    fn parts_are_found_anew_for_another_pattern_or_other_supports() {
        let mut parts = Parts::default();
        let (one, two) = (chains(&[6]), chains(&[3, 3]));
        let mut count = |a: &BlockMatrix, fixed: &[bool]| parts.find(a, fixed).len();
        assert_eq!(count(&one, &[false; 18]), 1);
        assert_eq!(count(&two, &[false; 18]), 2);
        assert_eq!(count(&one, &[false; 18]), 1);
        let mut middle = [false; 18];
        middle[6..9].fill(true);
        assert_eq!(count(&one, &middle), 2);
    }
}
