//! What a cut marks and cannot open, because all that is there belongs to its border: vertices of the border are not doubled.
//! The corner of a cut inside a tetrahedron is a facet like that, as is a cut that passes between the vertices of a cell; and
//! an edge between two vertices of the border is a hinge, at which the lips would hang together. Such a facet and such an
//! edge get a vertex in the middle, which is doubled (METHODS N1, Y1, F7, F14).

use std::collections::{BTreeMap, BTreeSet};

use kerfem_mesh::{CellId, FacetKey, VertexId};

use crate::split;
use crate::workspace::{Workspace, facet_of};

/// Of `d`: the least radius of the inscribed circle of a facet that is opened; smaller ones stay closed, within `d` of the
/// border.
const OPENED: f64 = 0.1;

/// Of the local size: the least such radius where `d` is less.
const LEAST: f64 = 1e-3;

/// A split facet may make hinges of its edges.
const ROUNDS: usize = 4;

/// Splits the facets of the sheet that would stay closed and the edges that would be hinges; whether there are any.
pub(crate) fn split_locked<const N: usize>(ws: &mut Workspace<'_, N>, snap: f64) -> bool {
    if N != 4 {
        return false;
    }
    let mut any = false;
    for _ in 0..ROUNDS {
        let mut sides = Sides::of(ws);
        let hinges = sides.hinges(ws, snap);
        if !hinges.is_empty() {
            hinges.iter().for_each(|hinge| split_hinge(ws, *hinge));
            sides = Sides::of(ws);
        }
        let locked = sides.locked(ws, snap);
        locked.iter().for_each(|facet| split_facet(ws, *facet));
        if hinges.is_empty() && locked.is_empty() {
            break;
        }
        any = true;
    }
    any
}

/// Whether a facet of the sheet will open.
pub(crate) fn opens_something<const N: usize>(ws: &Workspace<'_, N>) -> bool {
    let sides = Sides::of(ws);
    sides.sheet.iter().any(|key| sides.opens(ws, &key.0.map(VertexId)))
}

/// Takes facets out of the sheet until it has no hinge, the smaller one at each, for a method that makes no vertices.
pub(crate) fn leave_hinges_closed<const N: usize>(ws: &mut Workspace<'_, N>) {
    if N != 4 {
        return;
    }
    let area = |ws: &Workspace<'_, N>, facet: &FacetKey| {
        let [a, b, c] = facet.0.map(|v| ws.position(VertexId(v)));
        (b - a).cross(&(c - a)).norm()
    };
    loop {
        // none of the facets that stay closed will be split
        let hinges = Sides::of(ws).hinges(ws, f64::INFINITY);
        if hinges.is_empty() {
            return;
        }
        for hinge in hinges {
            let smallest = (ws.sheet.iter())
                .filter(|f| hinge.iter().all(|v| f.0.contains(&v.0)))
                .min_by(|f, g| area(ws, f).total_cmp(&area(ws, g)).then(f.cmp(g)));
            if let Some(facet) = smallest.copied() {
                ws.exchange_sheet(&[facet], &[]);
            }
        }
    }
}

fn split_facet<const N: usize>(ws: &mut Workspace<'_, N>, [a, b, c]: [VertexId; 3]) {
    let v = split::split_triangle(ws, [a, b, c], [1.0 / 3.0; 3]);
    ws.take(v, true);
    ws.exchange_sheet(&[key([a, b, c])], &[key([a, b, v]), key([b, c, v]), key([a, c, v])]);
}

fn split_hinge<const N: usize>(ws: &mut Workspace<'_, N>, [a, b]: [VertexId; 2]) {
    let mut facets = BTreeSet::new();
    for c in ws.mesh().cells_of_edge(a, b) {
        let corners = ws.mesh().cell(c);
        let around = (0..N).filter(|&k| corners[k] != a && corners[k] != b);
        facets.extend(around.map(|k| facet_of(&corners, k)).filter(|f| ws.sheet.contains(f)));
    }
    for v in split::split_edge(ws, a, b, 0.5) {
        ws.take(v, true);
        for facet in &facets {
            let far = facet.0.map(VertexId).into_iter().find(|w| *w != a && *w != b);
            let new = far.map(|w| [key([a, w, v]), key([b, w, v])]);
            ws.exchange_sheet(&[*facet], new.as_ref().map_or(&[], |n| n));
        }
    }
}

fn key(mut corners: [VertexId; 3]) -> FacetKey {
    corners.sort_unstable();
    FacetKey(corners.map(|v| v.0))
}

/// For each vertex of the sheet the groups of its cells that stay connected at it when the sheet opens.
struct Sides {
    groups: BTreeMap<VertexId, BTreeMap<CellId, usize>>,
    sheet: BTreeSet<FacetKey>,
}

impl Sides {
    fn of<const N: usize>(ws: &Workspace<'_, N>) -> Sides {
        let sheet: BTreeSet<FacetKey> = ws.sheet.iter().copied().collect();
        let vertices: BTreeSet<VertexId> = sheet.iter().flat_map(|key| key.0.map(VertexId)).collect();
        let groups_of = |v: VertexId| {
            let cells = ws.mesh().cells_of_vertex(v);
            let (group, _) = ws.mesh().pieces_among(cells, |side| {
                ws.mesh().cell(side.cell)[side.local as usize] != v && !sheet.contains(&ws.mesh().facet_key(side))
            });
            cells.iter().copied().zip(group).collect()
        };
        let groups = vertices.into_iter().map(|v| (v, groups_of(v))).collect();
        Sides { groups, sheet }
    }

    /// Facets none of whose vertices is doubled between its two cells, if they are large enough to be opened.
    fn locked<const N: usize>(&self, ws: &Workspace<'_, N>, snap: f64) -> Vec<[VertexId; 3]> {
        let facets = self.sheet.iter().map(|key| key.0.map(VertexId));
        facets.filter(|f| !self.opens(ws, f) && is_large(ws, f, snap)).collect()
    }

    fn opens<const N: usize>(&self, ws: &Workspace<'_, N>, facet: &[VertexId; 3]) -> bool {
        let cells = split::cells_with(ws, *facet);
        facet.iter().any(|v| {
            let mut groups = cells.iter().map(|c| self.groups[v][c]);
            let first = groups.next();
            groups.any(|g| Some(g) != first)
        })
    }

    /// Edges around which the facets that open leave several fans of cells, two of which neither end is doubled between.
    fn hinges<const N: usize>(&self, ws: &Workspace<'_, N>, snap: f64) -> Vec<[VertexId; 2]> {
        let stays = |f: &&FacetKey| {
            let facet = f.0.map(VertexId);
            !self.opens(ws, &facet) && !is_large(ws, &facet, snap)
        };
        let closed: BTreeSet<FacetKey> = self.sheet.iter().filter(stays).copied().collect();
        let opened = || self.sheet.difference(&closed).map(|f| f.0.map(VertexId));
        let edges: BTreeSet<[VertexId; 2]> = opened().flat_map(|[a, b, c]| [[a, b], [a, c], [b, c]]).collect();
        let is_hinge = |&[a, b]: &[VertexId; 2]| {
            let cells: Vec<CellId> = ws.mesh().cells_of_edge(a, b).collect();
            let (fan, count) = ws.mesh().pieces_among(&cells, |side| {
                let opposite = ws.mesh().cell(side.cell)[side.local as usize];
                let facet = ws.mesh().facet_key(side);
                opposite != a && opposite != b && (closed.contains(&facet) || !self.sheet.contains(&facet))
            });
            let mut ends: Vec<Option<[usize; 2]>> = vec![None; count];
            for (c, f) in cells.iter().zip(fan) {
                ends[f] = Some([a, b].map(|v| self.groups[&v][c]));
            }
            let different: BTreeSet<_> = ends.iter().collect();
            different.len() < count
        };
        edges.into_iter().filter(is_hinge).collect()
    }
}

fn is_large<const N: usize>(ws: &Workspace<'_, N>, facet: &[VertexId; 3], snap: f64) -> bool {
    let p = facet.map(|v| ws.position(v));
    let around: f64 = (0..3).map(|k| (p[(k + 1) % 3] - p[k]).norm()).sum();
    let radius = (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / around;
    let least = |v: &VertexId| ws.reach(*v, (OPENED * snap).max(LEAST));
    facet.iter().all(|v| radius > least(v))
}
