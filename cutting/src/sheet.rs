//! The sheet: where a sweep crosses edges (METHODS S3, S4, S9).

use std::collections::{BTreeMap, BTreeSet};

use kerfem_mesh::{FacetLabel, FacetSide, VertexId};

use crate::snap;
use crate::split;
use crate::sweep::Piece;
use crate::workspace::Workspace;

/// How crossed edges are treated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    /// An end closer to the sweep than this fraction of its local size takes the cut; other edges are split.
    SnapWithin(f64),
    /// Edges are split, except at a vertex of the boundary closer than half this fraction, which takes the cut: the pieces of
    /// its edges would be too short, and such a vertex leaves no choice how they collapse.
    SplitBeyond(f64),
    /// The nearer end always takes the cut; nothing is split.
    SnapAlways,
}

/// Vertices that the cut goes through before anything is chosen: those on the sweep, and those of earlier cut faces that are
/// within the fraction `present` of their local size of it. So a repeated sweep finds the vertices that took it the first
/// time (F31).
pub(crate) fn take_present<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, present: f64) {
    for v in ws.region_vertices() {
        let distance = piece.nearest(&ws.position(v)).distance;
        let exact = distance <= ws.reach(v, 0.0);
        if exact || (distance <= ws.reach(v, present) && is_on_cut_face(ws, v)) {
            ws.take(v, exact);
        }
    }
}

fn is_on_cut_face<const N: usize>(ws: &Workspace<'_, N>, v: VertexId) -> bool {
    let unlabelled = |s: FacetSide| ws.mesh().facet_labels(s.cell)[s.local as usize] == FacetLabel::NONE;
    ws.mesh().boundary_facets_of_vertex(v).any(unlabelled)
}

type Hits = BTreeMap<[VertexId; 2], Vec<f64>>;

/// Edges that are split give new ones, which a sweep that turns back may cross again.
const ROUNDS: usize = 4;

/// Makes the cut go through vertices: chooses cut-vertices in ascending order of their distance to the sweep, moves them
/// onto it where that loses nothing, and splits the remaining crossed edges.
///
/// Corrects S3's order dependence (ascending distance, ties by id) and S5's dropped double hits (both are kept unless they
/// are closer than `d` to each other: then the sweep turns back inside a distance that is not resolved). What an earlier cut
/// left within the fraction `present` serves for crossings as well.
pub(crate) fn open<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, rule: Rule, present: f64) {
    for _ in 0..ROUNDS {
        let hits = crossed_edges(ws, piece, rule, present);
        if hits.is_empty() || ws.crumbles() {
            return;
        }
        let chosen = choose_cut_vertices(ws, piece, &hits, rule);
        for &v in &chosen {
            if move_onto(ws, piece, v, &hits) {
                ws.take(v, true);
            }
        }
        match rule {
            Rule::SnapWithin(snap) => split_crossed(ws, hits, &chosen, snap),
            Rule::SplitBeyond(_) => split_crossed(ws, hits, &chosen, 0.0),
            Rule::SnapAlways => {}
        }
    }
}

/// Crossed edges and where. An end that the cut goes through serves the crossings within `d` of it, and all if it does not
/// lie on the sweep itself (S3).
fn crossed_edges<const N: usize>(ws: &Workspace<'_, N>, piece: &Piece, rule: Rule, present: f64) -> Hits {
    let mut out = Hits::new();
    for e in ws.region_edges() {
        let taken = e.map(|v| ws.on.contains(&v));
        let inexact = |v: &VertexId| ws.on.contains(v) && !ws.exact.contains(v);
        if e.iter().any(inexact) || taken == [true; 2] || (rule == Rule::SnapAlways && taken != [false; 2]) {
            continue;
        }
        let p = e.map(|v| ws.position(v));
        let mut hits = piece.hits(p[0], p[1]);
        let length = (p[1] - p[0]).norm();
        hits.retain(|t| {
            let along = [t * length, (1.0 - t) * length];
            (0..2).all(|k| !taken[k] || along[k] > ws.reach(e[k], served(ws, rule, present, e[k])))
        });
        if !hits.is_empty() {
            out.insert(e, hits);
        }
    }
    out
}

/// The fraction of the local size within which a vertex that the cut goes through serves a crossing.
fn served<const N: usize>(ws: &Workspace<'_, N>, rule: Rule, present: f64, v: VertexId) -> f64 {
    let own = match rule {
        Rule::SnapWithin(snap) => snap,
        Rule::SplitBeyond(_) | Rule::SnapAlways => 0.0,
    };
    if present > own && is_on_cut_face(ws, v) {
        present
    } else {
        own
    }
}

fn choose_cut_vertices<const N: usize>(
    ws: &mut Workspace<'_, N>,
    piece: &Piece,
    hits: &Hits,
    rule: Rule,
) -> Vec<VertexId> {
    let mut candidates = Vec::new();
    for (e, ts) in hits {
        for &t in ts {
            let v = if t < 0.5 { e[0] } else { e[1] };
            if ws.on.contains(&v) {
                continue;
            }
            let distance = piece.nearest(&ws.position(v)).distance;
            let near = match rule {
                Rule::SnapWithin(snap) => distance < ws.reach(v, snap),
                Rule::SplitBeyond(snap) => ws.mesh().is_boundary_vertex(v) && distance < ws.reach(v, snap / 2.0),
                Rule::SnapAlways => true,
            };
            if near {
                candidates.push((distance, v, *e));
            }
        }
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let (mut chosen, mut order) = (BTreeSet::new(), Vec::new());
    for (_, v, e) in candidates {
        if !e.iter().any(|u| chosen.contains(u)) {
            ws.take(v, false);
            chosen.insert(v);
            order.push(v);
        }
    }
    order
}

/// Interior vertices go to the nearest point of the sweep, boundary ones along a boundary edge to where the sweep crosses it.
fn move_onto<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, v: VertexId, hits: &Hits) -> bool {
    if !ws.mesh().is_boundary_vertex(v) {
        let target = piece.nearest(&ws.position(v)).point;
        return snap::move_interior(ws, v, target);
    }
    let mut ways: Vec<(f64, VertexId, f64)> = boundary_neighbors(ws, v)
        .into_iter()
        .filter_map(|w| {
            let t = if v < w {
                *hits.get(&[v, w])?.first()?
            } else {
                1.0 - *hits.get(&[w, v])?.last()?
            };
            Some((t * (ws.position(w) - ws.position(v)).norm(), w, t))
        })
        .collect();
    ways.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ways.into_iter()
        .any(|(_, w, t)| snap::move_on_boundary(ws, v, &[(v, 1.0 - t), (w, t)]))
}

fn boundary_neighbors<const N: usize>(ws: &Workspace<'_, N>, v: VertexId) -> Vec<VertexId> {
    let facets: Vec<FacetSide> = ws.mesh().boundary_facets_of_vertex(v).collect();
    let mut out: Vec<VertexId> = facets
        .into_iter()
        .flat_map(|side| ws.mesh().facet_corners(side))
        .filter(|&w| w != v)
        .collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// Splits the edges that no cut-vertex serves, longest first.
fn split_crossed<const N: usize>(ws: &mut Workspace<'_, N>, hits: Hits, chosen: &[VertexId], snap: f64) {
    let mut edges: Vec<(f64, [VertexId; 2], Vec<f64>)> = Vec::new();
    for (e, ts) in hits {
        if e.iter().any(|v| chosen.contains(v)) {
            continue;
        }
        let length = (ws.position(e[1]) - ws.position(e[0])).norm();
        let d = ws.reach(e[0], snap).min(ws.reach(e[1], snap));
        let ts = resolved(ts, d / length);
        if !ts.is_empty() {
            edges.push((length, e, ts));
        }
    }
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (_, [a, b], ts) in edges {
        let (mut from, mut done) = (vec![a], 0.0);
        for t in ts {
            let ahead = (t - done) / (1.0 - done);
            from = from
                .into_iter()
                .flat_map(|a| split::split_edge(ws, a, b, ahead))
                .collect();
            from.iter().for_each(|p| ws.take(*p, true));
            done = t;
        }
    }
}

/// Hits without the pairs that lie closer together than `apart`.
fn resolved(ts: Vec<f64>, apart: f64) -> Vec<f64> {
    let mut out: Vec<f64> = Vec::new();
    for t in ts {
        match out.last() {
            Some(last) if t - last < apart => {
                out.pop();
            }
            _ => out.push(t),
        }
    }
    out
}
