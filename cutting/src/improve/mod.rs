//! Quality maintenance: cells near a cut that came out badly are made better, one operation at a time.
//!
//! Operations, one file each: `collapse` (G3, G4, Y5), `swap` (Y8), `smooth` (Y7, Y9), `insert`. Each is accepted only if the
//! worst cell it touches gets better, so the sorted qualities of the cells rise with each and the process ends; none changes
//! the topology, moves the front of a cut, a border between materials or conditions, or the volume. `hold` tells what a vertex
//! must keep to, `link` when an edge may vanish. First of all bad cells that the sheet folds around change sides (`flip`).
//!
//! Before a cut opens, its lips are one sheet of facets inside the body. That is when they are improved: a vertex of the sheet
//! moves on the sweep, and what one part loses the other gains. Afterwards the lips are boundary and stay in their planes.

mod collapse;
mod flip;
mod hold;
mod insert;
mod link;
mod relax;
mod smooth;
mod swap;

pub(crate) use relax::relax;

use std::collections::{BTreeMap, BTreeSet};

use kerfem_mesh::{CellId, FacetSide, VertexId, quality};

use crate::sweep::Piece;
use crate::workspace::Workspace;

/// A cell must become better by this fraction.
const GAIN: f64 = 0.02;
/// Radius ratios from here on are positive beyond doubt.
const FLAT: f64 = 1e-9;
/// Cells looked at for each that is bad at the beginning, and operations at most: work is bounded even where nothing helps, such as
/// at the border of a fixed sheet of tiny facets.
const LOOKS: usize = 4;
const OPERATIONS: usize = 2;

/// What an operation must keep to, beyond what the mesh tells.
pub(crate) struct Limits<'a> {
    /// The part of the sweep that the sheet lies on.
    pub(crate) piece: Option<&'a Piece>,
    /// Whether the facets of the sheet stay what they are; their vertices may move.
    pub(crate) is_fixed: bool,
    /// How far from it a facet of the sheet may lie, as a fraction of the local size.
    pub(crate) sheet: f64,
    /// The quality from which a cell is good enough.
    pub(crate) floor: f64,
}

/// Which cells are worked on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Bad {
    /// Those of a smaller radius ratio (G2).
    Below(f64),
    /// Those bad by their longest edge over their inradius and by their longest edge over their shortest (Y5): small
    /// compared with their neighbours, whatever their size.
    Uneven {
        /// Longest edge over inradius.
        aspect: f64,
        /// Longest edge over shortest.
        edges: f64,
    },
}

/// Which operations are tried, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Work {
    /// Collapse of the shortest edge.
    Collapse,
    /// Everything.
    All,
}

/// What became of the bad cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Done {
    /// Operations made.
    pub(crate) operations: usize,
    /// Cells that were still to be looked at when the budget was used up, ascending.
    pub(crate) left: Vec<CellId>,
}

/// Works on the bad cells among `cells`, the worst first, and on those that come to be bad meanwhile, until nothing helps any
/// more or `budget` operations are made.
pub(crate) fn run<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    (bad, work): (Bad, Work),
    cells: impl IntoIterator<Item = CellId>,
    budget: usize,
) -> Done {
    let mut queue = Queue::default();
    for c in cells {
        queue.look_at(ws, bad, c);
    }
    for (_, _, c) in &queue.waiting {
        flip::flip(ws, limits, *c);
    }
    let (mut looks, most) = (LOOKS * queue.waiting.len(), OPERATIONS * queue.waiting.len());
    let mut done = Done::default();
    while let Some(c) = queue.next(ws) {
        if done.operations == budget {
            done.left = queue.rest(ws, c);
            break;
        }
        if looks == 0 || done.operations == most {
            break;
        }
        looks -= 1;
        if let Some(touched) = better(ws, limits, work, c) {
            done.operations += 1;
            for c in touched {
                queue.look_at(ws, bad, c);
            }
        }
    }
    done
}

/// Bad cells by their quality. A cell is looked at again whenever it has been touched.
#[derive(Default)]
struct Queue {
    /// Quality (its bits: qualities are positive), sorted corners, cell.
    waiting: BTreeSet<(u64, Vec<VertexId>, CellId)>,
    keys: BTreeMap<CellId, (u64, Vec<VertexId>)>,
}

impl Queue {
    fn look_at<const N: usize>(&mut self, ws: &Workspace<'_, N>, bad: Bad, c: CellId) {
        if let Some((q, corners)) = self.keys.remove(&c) {
            self.waiting.remove(&(q, corners, c));
        }
        if !ws.mesh().has_cell(c) || !bad.is(ws, c) {
            return;
        }
        let mut corners = ws.mesh().cell(c);
        let q = ws.quality_with(&corners, None).max(0.0).to_bits();
        corners.sort_unstable();
        self.keys.insert(c, (q, corners.to_vec()));
        self.waiting.insert((q, corners.to_vec(), c));
    }

    fn next<const N: usize>(&mut self, ws: &Workspace<'_, N>) -> Option<CellId> {
        while let Some((_, _, c)) = self.waiting.pop_first() {
            self.keys.remove(&c);
            if ws.mesh().has_cell(c) {
                return Some(c);
            }
        }
        None
    }

    fn rest<const N: usize>(self, ws: &Workspace<'_, N>, first: CellId) -> Vec<CellId> {
        let mut all: Vec<CellId> = self.keys.into_keys().filter(|c| ws.mesh().has_cell(*c)).collect();
        all.push(first);
        all.sort_unstable();
        all
    }
}

impl Bad {
    fn is<const N: usize>(&self, ws: &Workspace<'_, N>, c: CellId) -> bool {
        match *self {
            Bad::Below(wanted) => ws.quality(c) < wanted,
            Bad::Uneven { aspect, edges } => {
                let p = ws.mesh().cell_rest_positions(c);
                let lengths = quality::edge_lengths(&p);
                let (short, long) = lengths.fold((f64::INFINITY, 0.0_f64), |(s, l), e| (s.min(e), l.max(e)));
                quality::edge_over_inradius(&p) > aspect && long > edges * short
            }
        }
    }
}

/// One operation that makes the worst cell around better; the cells it touched.
fn better<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    work: Work,
    c: CellId,
) -> Option<Vec<CellId>> {
    let edges = edges_by_length(ws, c);
    let shortest = collapse_either(ws, limits, edges[0], None);
    if shortest.is_some() || work == Work::Collapse {
        return shortest;
    }
    simple(ws, limits, c, &edges)
        .or_else(|| edges[..SHORT].iter().find_map(|e| compound(ws, limits, c, *e)))
        .or_else(|| edges.iter().rev().find_map(|e| insert::insert(ws, *e)))
}

/// Edges of a cell, the shortest first, each with its smaller vertex first.
fn edges_by_length<const N: usize>(ws: &Workspace<'_, N>, c: CellId) -> Vec<[VertexId; 2]> {
    let corners = ws.mesh().cell(c);
    let length = |[a, b]: [VertexId; 2]| (ws.mesh().rest_position(b) - ws.mesh().rest_position(a)).norm();
    let mut edges: Vec<(f64, [VertexId; 2])> = (quality::edges::<N>().iter())
        .map(|[i, j]| [corners[*i].min(corners[*j]), corners[*i].max(corners[*j])])
        .map(|e| (length(e), e))
        .collect();
    edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    edges.into_iter().map(|(_, e)| e).collect()
}

/// Collapse of an edge, the younger of its ends first.
fn collapse_either<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    [a, b]: [VertexId; 2],
    wanted: Option<f64>,
) -> Option<Vec<CellId>> {
    collapse::collapse(ws, limits, [b, a], wanted).or_else(|| collapse::collapse(ws, limits, [a, b], wanted))
}

/// A swap, a move or a collapse of another edge.
fn simple<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    c: CellId,
    edges: &[[VertexId; 2]],
) -> Option<Vec<CellId>> {
    let corners = ws.mesh().cell(c);
    let mut locals: [u8; N] = std::array::from_fn(|k| k as u8);
    locals.sort_unstable_by_key(|&k| corners[k as usize]);
    let vertices = locals.map(|k| corners[k as usize]);
    let mut sides = locals.iter().map(|&local| FacetSide { cell: c, local });
    sides
        .find_map(|side| swap::remove_facet(ws, side))
        .or_else(|| edges.iter().rev().find_map(|e| swap::remove_edge(ws, limits, *e)))
        .or_else(|| vertices.iter().find_map(|v| smooth::smooth(ws, limits, *v)))
        .or_else(|| edges[1..].iter().find_map(|e| collapse_either(ws, limits, *e, None)))
}

/// Edges of a cell, the shortest, whose collapse is tried at the price of repairs.
const SHORT: usize = 3;
/// Operations that may repair what a collapse made worse.
const REPAIRS: usize = 6;
/// Of the quality of the bad cell: what a collapse may leave behind to be repaired.
const REPAIRABLE: f64 = 0.1;

/// A collapse that makes a cell worse than the bad one, and operations that make it better again; all or nothing.
fn compound<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    c: CellId,
    edge: [VertexId; 2],
) -> Option<Vec<CellId>> {
    let own = ws.quality(c);
    let wanted = own * (1.0 + GAIN);
    [edge, [edge[1], edge[0]]].into_iter().find_map(|edge| {
        let save = ws.savepoint();
        let made = collapse::collapse(ws, limits, edge, Some(REPAIRABLE * own))?;
        let mut touched: BTreeSet<CellId> = made.into_iter().collect();
        for _ in 0..=REPAIRS {
            touched.retain(|c| ws.mesh().has_cell(*c));
            let worst = touched
                .iter()
                .min_by(|a, b| ws.quality(**a).total_cmp(&ws.quality(**b)));
            let Some(worst) = worst.copied().filter(|c| ws.quality(*c) <= wanted) else {
                return Some(touched.iter().copied().collect());
            };
            let edges = edges_by_length(ws, worst);
            match simple(ws, limits, worst, &edges) {
                Some(more) => touched.extend(more),
                None => break,
            }
        }
        ws.restore(save);
        None
    })
}
