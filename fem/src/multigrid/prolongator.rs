//! From coarse to fine: rigid motions of aggregates, smoothed.

use super::aggregates::Aggregates;
use super::block_rows::{BlockRows, Dense, Single, SquareRows, add_product, add_transposed_product, single};
use super::motions::{GramFactor, MOTIONS, Motions, orthonormalise};

/// Motions of the aggregates around a row that are smaller than this fraction of others cannot take over what is cut off.
const REDISTRIBUTABLE: f64 = 1e-5;

/// A prolongation: of each row blocks in columns of aggregates.
pub(crate) type Prolongation<const B: usize, const M: usize> = BlockRows<Single<B, M>>;

/// Prolongation before smoothing: in each aggregate an orthonormal basis of the motions that its rows can make.
#[derive(Debug)]
pub(crate) struct Tentative<const B: usize, const M: usize> {
    /// Of each row the block in the column of its aggregate.
    pub(crate) values: Vec<Dense<B, M>>,
    /// The motions as the coarse unknowns take part in them.
    pub(crate) coarse: Motions<M>,
    /// Which coarse unknowns exist.
    pub(crate) exist: Vec<[bool; M]>,
}

impl<const B: usize, const M: usize> Tentative<B, M> {
    /// Orthonormalises the motions aggregate by aggregate. Motions that an aggregate cannot make, or that depend on others
    /// there (as about the axis of vertices in a line), give unknowns that do not exist.
    pub(crate) fn of(aggregates: &Aggregates, motions: &Motions<B>) -> Self {
        let mut tentative = Tentative {
            values: vec![[[0.0; M]; B]; motions.values.len()],
            coarse: Motions {
                values: vec![[[0.0; MOTIONS]; M]; aggregates.len()],
                centers: vec![[0.0; 3]; aggregates.len()],
            },
            exist: vec![[false; M]; aggregates.len()],
        };
        let mut basis = Vec::new();
        for g in 0..aggregates.len() {
            let members = aggregates.members(g);
            let center = mean(members, &motions.centers);
            basis.clear();
            basis.extend(members.iter().map(|&i| motions.about(i as usize, &center)));
            let independent = orthonormalise(&mut basis);
            tentative.coarse.centers[g] = center;
            let coarse = &mut tentative.coarse.values[g];
            // the unknowns are the independent motions in their order
            for (k, m) in (0..MOTIONS).filter(|&m| independent[m]).take(M).enumerate() {
                tentative.exist[g][k] = true;
                for (&i, q) in members.iter().zip(&basis) {
                    for b in 0..B {
                        tentative.values[i as usize][b][k] = q[b][m];
                        for (sum, motion) in coarse[k].iter_mut().zip(&motions.values[i as usize][b]) {
                            *sum += q[b][m] * motion;
                        }
                    }
                }
            }
        }
        tentative
    }
}

fn mean(members: &[u32], centers: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &i in members {
        (0..3).for_each(|k| sum[k] += centers[i as usize][k]);
    }
    sum.map(|s| s / members.len() as f64)
}

/// The tentative prolongation after one step of damped block-Jacobi iteration, `(I - omega D^-1 A) T`, on the aggregates of
/// strong neighbors.
///
/// What would lie in the columns of other aggregates is given to these by the blocks of least norm that leave what becomes of
/// the rigid motions as it is, so that neither stretched cells nor weak bonds make the coarse matrices dense.
pub(crate) fn smoothed<const B: usize, const M: usize>(
    a: &impl SquareRows<B>,
    inverse_diagonal: &[Dense<B, B>],
    aggregates: &Aggregates,
    motions: &Motions<B>,
    tentative: &Tentative<B, M>,
    omega: f64,
) -> Prolongation<B, M> {
    let mut p = BlockRows::filled(a.rows(), [[0.0; M]; B], Vec::new, |i, cols, groups: &mut Vec<u32>| {
        groups.clear();
        groups.extend(aggregates.of_row(i));
        let neighbors = aggregates.strong_neighbors(i).iter();
        groups.extend(neighbors.filter_map(|&j| aggregates.of_row(j as usize)));
        groups.sort_unstable();
        groups.dedup();
        cols.extend_from_slice(groups);
    });
    p.in_parts(
        &mut vec![Vec::new(); super::block_rows::tasks()],
        #[inline(always)]
        |mut part, row: &mut Vec<Dense<B, M>>| {
            for i in part.rows() {
                let (groups, out) = part.row_mut(i);
                let Some(own) = aggregates.of_row(i) else { continue };
                row.clear();
                row.resize(groups.len(), [[0.0; M]; B]);
                apply_on_pattern(a, i, groups, aggregates, motions, tentative, row);
                for (to, &group) in row.iter_mut().zip(groups) {
                    let mut smoothed = [[0.0; M]; B];
                    if group == own {
                        smoothed = tentative.values[i];
                    }
                    let step = inverse_diagonal[i].map(|r| r.map(|x| -omega * x));
                    add_product(&mut smoothed, &step, to);
                    *to = smoothed;
                }
                out.iter_mut().zip(&*row).for_each(|(to, from)| *to = single(from));
            }
        },
    );
    p
}

/// `row := ` row `i` of `A T` in the columns `groups`.
#[inline(always)]
fn apply_on_pattern<const B: usize, const M: usize>(
    a: &impl SquareRows<B>,
    i: usize,
    groups: &[u32],
    aggregates: &Aggregates,
    motions: &Motions<B>,
    tentative: &Tentative<B, M>,
    row: &mut [Dense<B, M>],
) {
    let mut cut_off = [[0.0; MOTIONS]; B];
    let mut any = false;
    let (cols, blocks) = a.row(i);
    for (&j, block) in cols.iter().zip(blocks) {
        let j = j as usize;
        match aggregates.of_row(j).and_then(|g| groups.binary_search(&g).ok()) {
            Some(k) => add_product(&mut row[k], block, &tentative.values[j]),
            None => {
                add_product(&mut cut_off, block, &motions.about(j, &motions.centers[i]));
                any = true;
            }
        }
    }
    if any {
        redistribute(&cut_off, groups, &tentative.coarse, &motions.centers[i], row);
    }
}

/// Adds the blocks of least norm whose product with the motions of the groups, about `center`, is `cut_off`.
fn redistribute<const B: usize, const M: usize>(
    cut_off: &Dense<B, MOTIONS>,
    groups: &[u32],
    coarse: &Motions<M>,
    center: &[f64; 3],
    row: &mut [Dense<B, M>],
) {
    let mut gram = [[0.0; MOTIONS]; MOTIONS];
    for &g in groups {
        let motions = coarse.about(g as usize, center);
        add_transposed_product(&mut gram, &motions, &motions);
    }
    let factor = GramFactor::of(&gram, REDISTRIBUTABLE);
    let shares = cut_off.map(|motion| factor.solve(&motion));
    for (to, &g) in row.iter_mut().zip(groups) {
        let motions = coarse.about(g as usize, center);
        for b in 0..B {
            for m in 0..M {
                to[b][m] += (0..MOTIONS).map(|k| shares[b][k] * motions[m][k]).sum::<f64>();
            }
        }
    }
}
