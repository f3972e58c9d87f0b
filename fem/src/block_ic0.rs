//! Incomplete Cholesky factorisation by blocks, without fill.

use crate::parts::Rows;
use crate::preconditioner::diagonal;
use crate::small::{self, Block, inverse_cholesky, masked, minus_times, minus_transposed_times, times_transposed};
use crate::{BlockMatrix, FemError};

/// First shift tried after a breakdown, as a fraction of the diagonal blocks; doubled until the factorisation exists.
const FIRST_SHIFT: f64 = 1e-3;

/// Shifts tried; the last exceeds the diagonal itself.
const SHIFTS: usize = 16;

/// No entry of the row at hand in this column.
const NONE: u32 = u32::MAX;

/// `L` with `L L^T` close to `A`, on the blocks of the lower triangle of `A`.
///
/// If a pivot block is not positive definite, the diagonal blocks are multiplied by `1 + shift` with growing shifts
/// (Manteuffel, Math. Comp. 34, 1980). The shift is remembered: the next factorisation starts from half of it.
#[derive(Debug, Default)]
pub(crate) struct BlockIc0 {
    stamp: u64,
    /// Blocks of row `i` left of the diagonal: `starts[i]..starts[i + 1]`.
    starts: Vec<u32>,
    cols: Vec<u32>,
    /// Their places in the arena of `A`.
    places: Vec<u32>,
    lower: Vec<Block>,
    /// Inverses of the diagonal blocks of `L` (lower triangular).
    pivots: Vec<Block>,
    shift: f64,
    /// Place of each column in the row at hand.
    marker: Vec<u32>,
}

impl BlockIc0 {
    /// Factors a matrix; the pattern is analysed only when it has changed.
    ///
    /// # Errors
    /// [`FemError::NotPositiveDefinite`] if even large shifts do not help.
    pub(crate) fn refresh(&mut self, a: &BlockMatrix, fixed: &[bool]) -> Result<(), FemError> {
        if self.stamp != a.pattern.stamp() {
            self.analyse(a);
        }
        let mut shift = if self.shift >= 2.0 * FIRST_SHIFT {
            self.shift / 2.0
        } else {
            0.0
        };
        for _ in 0..SHIFTS {
            if self.factor(a, fixed, shift) {
                self.shift = shift;
                return Ok(());
            }
            shift = (2.0 * shift).max(FIRST_SHIFT);
        }
        Err(FemError::NotPositiveDefinite {
            found_by: "an incomplete factorisation",
        })
    }

    /// The shift that the next factorisation starts from.
    pub(crate) fn shift(&self) -> f64 {
        self.shift
    }

    /// Starts the next factorisation from a shift that [`Self::shift`] gave.
    pub(crate) fn set_shift(&mut self, shift: f64) {
        self.shift = shift;
    }

    fn analyse(&mut self, a: &BlockMatrix) {
        self.stamp = a.pattern.stamp();
        self.starts.clear();
        self.cols.clear();
        self.places.clear();
        self.starts.push(0);
        for i in 0..a.rows() {
            for (k, &j) in a.pattern.range(i).zip(a.pattern.cols(i)) {
                if (j as usize) < i {
                    self.cols.push(j);
                    self.places.push(k as u32);
                }
            }
            self.starts.push(self.cols.len() as u32);
        }
        self.lower.resize(self.cols.len(), [0.0; 9]);
        self.pivots.resize(a.rows(), [0.0; 9]);
        self.marker.clear();
        self.marker.resize(a.rows(), NONE);
    }

    fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// Whether all pivots were positive definite.
    fn factor(&mut self, a: &BlockMatrix, fixed: &[bool], shift: f64) -> bool {
        for i in 0..a.rows() {
            let row = self.row(i);
            let own = &fixed[3 * i..3 * i + 3];
            for k in row.clone() {
                let j = self.cols[k] as usize;
                self.lower[k] = masked(&a.values[self.places[k] as usize], own, &fixed[3 * j..3 * j + 3]);
                self.marker[j] = k as u32;
            }
            for k in row.clone() {
                let j = self.cols[k] as usize;
                let mut sum = self.lower[k];
                for m in self.row(j) {
                    let at = self.marker[self.cols[m] as usize];
                    if at != NONE {
                        let p = times_transposed(&self.lower[at as usize], &self.lower[m]);
                        (0..9).for_each(|e| sum[e] -= p[e]);
                    }
                }
                // L_ij = S L_jj^-T
                self.lower[k] = times_transposed(&sum, &self.pivots[j]);
            }
            let mut pivot = diagonal(a, i, fixed);
            pivot.iter_mut().for_each(|d| *d *= 1.0 + shift);
            for k in row {
                let p = times_transposed(&self.lower[k], &self.lower[k]);
                (0..9).for_each(|e| pivot[e] -= p[e]);
                self.marker[self.cols[k] as usize] = NONE;
            }
            match inverse_cholesky(&pivot) {
                Some(inverse) => self.pivots[i] = inverse,
                None => return false,
            }
        }
        true
    }

    /// `z := (L L^T)^-1 r`, for `r` and `z` of some rows that no others are coupled to.
    pub(crate) fn apply(&self, rows: Rows<'_>, r: &[f64], z: &mut [f64]) {
        let (r, z) = (r.as_chunks::<3>().0, z.as_chunks_mut::<3>().0);
        match rows.places() {
            None => self.substitute(rows, r, z, |j| Some(j as usize)),
            Some(place) => self.substitute(rows, r, z, place),
        }
    }

    #[inline]
    fn substitute(&self, rows: Rows<'_>, r: &[[f64; 3]], z: &mut [[f64; 3]], place: impl Fn(u32) -> Option<usize>) {
        for (k, i) in rows.iter().enumerate() {
            let row = self.row(i);
            let mut y = r[k];
            for (&j, block) in self.cols[row.clone()].iter().zip(&self.lower[row]) {
                if let Some(place) = place(j) {
                    y = minus_times(y, block, &z[place]);
                }
            }
            z[k] = small::times(&self.pivots[i], &y);
        }
        for (k, i) in rows.iter().enumerate().rev() {
            let row = self.row(i);
            let y = small::transposed_times(&self.pivots[i], &z[k]);
            z[k] = y;
            for (&j, block) in self.cols[row.clone()].iter().zip(&self.lower[row]) {
                if let Some(place) = place(j) {
                    z[place] = minus_transposed_times(z[place], block, &y);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::generate;

    use super::*;
    use crate::parts::Parts;
    use crate::{Assembler, LinearSolver, Material, PreconditionerKind, SolverKind, SolverOptions};

    /// A stiffness with all dofs free and its diagonal blocks multiplied by `factor`.
    fn matrix(factor: f64) -> BlockMatrix {
        let mesh = generate::box_tets([2.0, 1.0, 1.0], [4, 3, 3], [0.0; 3]);
        let assembler = Assembler::new(&mesh, |_| Material::new(1.0, 0.3, 1.0).unwrap()).unwrap();
        let mut a = assembler.stiffness().clone();
        a.pattern.for_each_row(&mut a.values, |i, cols, row| {
            let k = cols.binary_search(&(i as u32)).unwrap();
            row[k].iter_mut().for_each(|d| *d *= factor);
        });
        a
    }

    /// `z . A z` against `z . r` for `z = (L L^T)^-1 r`: one if the factor were exact.
    fn quality(factor: &BlockIc0, a: &BlockMatrix) -> f64 {
        let r: Vec<f64> = (0..3 * a.rows()).map(|d| ((7 * d) % 11) as f64 - 5.0).collect();
        let (mut z, mut az) = (vec![0.0; r.len()], vec![0.0; r.len()]);
        factor.apply(Parts::default().all(a), &r, &mut z);
        a.multiply(&z, &mut az);
        crate::vector::dot(&z, &az) / crate::vector::dot(&z, &r)
    }

    #[test]
    fn breakdown_is_cured_by_a_shift_that_fades_when_it_is_not_needed() {
        let free = vec![false; 3 * matrix(1.0).rows()];
        let mut factor = BlockIc0::default();
        factor.refresh(&matrix(2.0), &free).unwrap();
        assert_eq!(factor.shift, 0.0);
        assert!((quality(&factor, &matrix(2.0)) - 1.0).abs() < 0.2);

        // indefinite
        factor.refresh(&matrix(0.6), &free).unwrap();
        let needed = factor.shift;
        assert!(needed > 0.1, "{needed}");
        for _ in 0..10 {
            factor.refresh(&matrix(2.0), &free).unwrap();
        }
        assert_eq!(factor.shift, 0.0);
        assert!(factor.refresh(&matrix(-1.0), &free).is_err());
    }

    #[test]
    fn a_solver_that_recalls_what_another_has_learnt_goes_on_with_the_same_bits() {
        let options = SolverOptions {
            kind: SolverKind::Cg,
            preconditioner: PreconditionerKind::BlockIc0,
            tolerance: 1e-6,
            max_iterations: 1000,
        };
        let (hard, easy) = (matrix(0.6), matrix(2.0));
        let free = vec![false; 3 * easy.rows()];
        let b: Vec<f64> = (0..free.len()).map(|d| ((5 * d) % 13) as f64 - 6.0).collect();
        let solution = |solver: &mut LinearSolver| {
            let mut x = vec![0.0; b.len()];
            solver.solve(&easy, &free, &b, &mut x).unwrap();
            x
        };
        let mut learnt = LinearSolver::new(options);
        // indefinite: no solution, but a shift
        assert!(learnt.solve(&hard, &free, &b, &mut vec![0.0; b.len()]).is_err());
        assert!(learnt.memory() > 0.1, "{}", learnt.memory());
        let (mut recalls, mut fresh) = (LinearSolver::new(options), LinearSolver::new(options));
        recalls.recall(learnt.memory());
        let expected = solution(&mut learnt);
        assert_eq!(solution(&mut recalls), expected);
        assert_ne!(solution(&mut fresh), expected);
        recalls.recall(f64::NAN);
        assert_eq!(recalls.memory(), learnt.memory());
    }

    #[test]
    fn fixed_dofs_are_passed_through() {
        let a = matrix(1.5);
        let fixed: Vec<bool> = (0..3 * a.rows()).map(|d| d % 4 == 0).collect();
        let mut factor = BlockIc0::default();
        factor.refresh(&a, &fixed).unwrap();
        let r: Vec<f64> = (0..fixed.len()).map(|d| d as f64).collect();
        let mut z = vec![0.0; r.len()];
        factor.apply(Parts::default().all(&a), &r, &mut z);
        assert!((0..z.len()).step_by(4).all(|d| z[d] == r[d]));
    }
}
