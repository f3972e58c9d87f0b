//! One level: its smoother, and its way to the next coarser one.

use super::aggregates::Aggregates;
use super::block_rows::{BlockRows, Dense, SquareRows, add_times, add_transposed_times, double, for_each_entry, tasks};
use super::galerkin::{Columns, Galerkin};
use super::motions::Motions;
use super::prolongator::{Prolongation, Tentative, smoothed};
use super::spectrum::largest_eigenvalue;
use super::strength::StrongNeighbors;
use super::sweeps::Sweeps;

/// Damping of the step that smooths the prolongation, times the largest eigenvalue (Vanek, Mandel and Brezina).
const DAMPING: f64 = 4.0 / 3.0;

/// The unknowns of a level.
#[derive(Debug)]
pub(crate) struct Unknowns<const B: usize> {
    /// Which of each row exist.
    pub(crate) exist: Vec<[bool; B]>,
    /// The rigid motions as they take part in them.
    pub(crate) motions: Motions<B>,
}

/// A level with `B` unknowns a row above one with `M`.
#[derive(Debug)]
pub(crate) struct Level<const B: usize, const M: usize> {
    exist: Vec<[bool; B]>,
    sweeps: Sweeps<B>,
    /// None if nothing binds the rows: the sweeps do all that is to do.
    coarser: Option<Coarser<B, M>>,
}

/// The way to the next coarser level and back.
#[derive(Debug)]
struct Coarser<const B: usize, const M: usize> {
    p: Prolongation<B, M>,
    columns: Columns,
    galerkin: Galerkin<B, M>,
}

impl<const B: usize, const M: usize> Level<B, M> {
    /// Sets up a level and the matrix of the next; also the unknowns of that and the aggregates that they belong to. `None`
    /// if a diagonal block is not positive definite.
    #[allow(clippy::type_complexity)]
    pub(crate) fn of(
        a: &impl SquareRows<B>,
        unknowns: Unknowns<B>,
        before: Option<&Aggregates>,
    ) -> Option<(Self, Option<Unknowns<M>>, Aggregates)> {
        let Unknowns { exist, motions } = unknowns;
        let mut sweeps = Sweeps::of_pattern(a);
        sweeps.refresh(a, |i| exist[i])?;
        let aggregates = Aggregates::of(StrongNeighbors::of(a, |i| exist[i] != [false; B]), before);
        let mut level = Level {
            exist,
            sweeps,
            coarser: None,
        };
        if aggregates.len() == 0 {
            return Some((level, None, aggregates));
        }
        let tentative = Tentative::of(&aggregates, &motions);
        let omega = DAMPING / largest_eigenvalue(&level.sweeps);
        let p = smoothed(
            a,
            level.sweeps.inverse_diagonal(),
            &aggregates,
            &motions,
            &tentative,
            omega,
        );
        let columns = Columns::of(&p, aggregates.len());
        let mut galerkin = Galerkin::of_pattern(a, &p, &columns);
        galerkin.refresh(a, &p);
        level.coarser = Some(Coarser { p, columns, galerkin });
        let unknowns = Unknowns {
            exist: tentative.exist,
            motions: tentative.coarse,
        };
        Some((level, Some(unknowns), aggregates))
    }

    /// Takes over the values of a matrix with the same pattern; the prolongation stays. `None` if a diagonal block is not
    /// positive definite.
    #[must_use]
    pub(crate) fn refresh(&mut self, a: &impl SquareRows<B>) -> Option<()> {
        self.sweeps.refresh(a, |i| self.exist[i])?;
        if let Some(coarser) = &mut self.coarser {
            coarser.galerkin.refresh(a, &coarser.p);
        }
        Some(())
    }

    /// The matrix of the next level, if there is one.
    pub(crate) fn coarse_matrix(&self) -> Option<&BlockRows<Dense<M, M>>> {
        self.coarser.as_ref().map(|c| c.galerkin.coarse())
    }

    /// First half of a cycle: `x :=` one sweep from zero for `A x = b`, `r` the residual, `coarse_b` its restriction. Without a
    /// coarser level only the sweep.
    pub(crate) fn descend(
        &self,
        b: &[[f64; B]],
        x: &mut [[f64; B]],
        r: &mut [[f64; B]],
        coarse_b: Option<&mut [[f64; M]]>,
    ) {
        self.sweeps.up_from_zero(b, x);
        if let (Some(coarser), Some(coarse_b)) = (&self.coarser, coarse_b) {
            self.sweeps.residual_after_up(x, r);
            coarser.restrict(r, coarse_b);
        }
    }

    /// Second half: adds the prolongation of `coarse_x` to `x` and sweeps back.
    pub(crate) fn ascend(&self, coarse_x: Option<&[[f64; M]]>, b: &[[f64; B]], x: &mut [[f64; B]]) {
        if let (Some(coarser), Some(coarse_x)) = (&self.coarser, coarse_x) {
            coarser.add_prolongation(coarse_x, x);
        }
        self.sweeps.down(b, x);
    }
}

impl<const B: usize, const M: usize> Coarser<B, M> {
    /// `b := P^T r`. One thread adds up the same terms in the same order while it reads row by row.
    fn restrict(&self, r: &[[f64; B]], b: &mut [[f64; M]]) {
        if tasks() == 1 {
            b.fill([0.0; M]);
            for (i, r) in r.iter().enumerate() {
                let (groups, weights) = self.p.row(i);
                for (&g, weight) in groups.iter().zip(weights) {
                    add_transposed_times(&mut b[g as usize], &double(weight), r);
                }
            }
            return;
        }
        let weights = self.p.blocks();
        for_each_entry(
            b,
            #[inline(always)]
            |g, b| {
                *b = [0.0; M];
                for &(i, k) in self.columns.column(g) {
                    add_transposed_times(b, &double(&weights[k as usize]), &r[i as usize]);
                }
            },
        );
    }

    /// `x += P e`.
    fn add_prolongation(&self, e: &[[f64; M]], x: &mut [[f64; B]]) {
        for_each_entry(
            x,
            #[inline(always)]
            |i, x| {
                let (groups, weights) = self.p.row(i);
                for (&g, weight) in groups.iter().zip(weights) {
                    add_times(x, &double(weight), &e[g as usize]);
                }
            },
        );
    }
}
