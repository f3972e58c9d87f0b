//! What holds a vertex in its place: the boundary of the body, and the sheet, the facets that a cut is about to open.

use kerfem_mesh::{CellId, FacetKey, FacetSide, Point, VertexId};

use super::Limits;
use crate::snap::parents_within;
use crate::workspace::{Place, TINY, Workspace, facet_of};

/// Cosine of the angle between the normals of two boundary facets beyond which they are the two lips of a cut that ends at
/// the vertex (or of a body without thickness).
const OPPOSITE: f64 = -0.999;

/// How a vertex may move (Y5, extended by vertices inside the sheet and by those that must stay).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// Anywhere.
    Inside,
    /// On the sheet.
    Sheet,
    /// Within a flat part of the boundary or along a straight crease.
    Boundary,
    /// Along the seam it lies on: the contour, the line in which sheet and boundary meet, or the front, in which the sheet
    /// ends inside the body.
    Seam,
    /// Nowhere: it lies on the front of an open cut, or where seams meet.
    None,
}

/// Facets that hold a vertex.
pub(super) struct Hold {
    pub(super) boundary: Vec<FacetSide>,
    pub(super) sheet: Vec<FacetKey>,
    /// Other ends of the edges along which the sheet ends or meets the boundary.
    pub(super) seam: Vec<(VertexId, Seam)>,
}

/// What an edge is to the sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Seam {
    /// It meets the boundary there.
    Contour,
    /// It ends there inside the body.
    Front,
    /// Several leaves of it meet there.
    Branch,
}

impl Hold {
    pub(super) fn of<const N: usize>(ws: &Workspace<'_, N>, v: VertexId) -> Hold {
        let boundary: Vec<FacetSide> = ws.mesh().boundary_facets_of_vertex(v).collect();
        let mut sheet = Vec::new();
        if !ws.sheet.is_empty() {
            for &c in ws.mesh().cells_of_vertex(v) {
                let corners = ws.mesh().cell(c);
                for k in (0..N).filter(|&k| corners[k] != v) {
                    let key = facet_of(&corners, k);
                    if ws.sheet.contains(&key) && !sheet.contains(&key) {
                        sheet.push(key);
                    }
                }
            }
            sheet.sort_unstable();
        }
        let mut ends: Vec<u32> = sheet.iter().flat_map(|f| others(f, v)).collect();
        ends.sort_unstable();
        let mut seam = Vec::new();
        for same in ends.chunk_by(|a, b| a == b) {
            let on_boundary = boundary.iter().any(|s| ws.mesh().facet_key(*s).0.contains(&same[0]));
            let what = match (on_boundary, same.len()) {
                (false, 2) => continue,
                (true, 1) => Seam::Contour,
                (false, 1) => Seam::Front,
                _ => Seam::Branch,
            };
            seam.push((VertexId(same[0]), what));
        }
        Hold { boundary, sheet, seam }
    }

    /// What holds a vertex, and how it may move: `None` if it must stay, also for the sake of materials and conditions.
    pub(super) fn of_movable<const N: usize>(ws: &Workspace<'_, N>, v: VertexId) -> Option<(Hold, Freedom)> {
        let hold = Hold::of(ws, v);
        let freedom = hold.freedom(ws);
        (freedom != Freedom::None && !ws.is_held(v) && ws.may_move(v)).then_some((hold, freedom))
    }

    /// Other ends of the edges in which the sheet ends inside the body.
    pub(super) fn front(&self) -> impl Iterator<Item = VertexId> + '_ {
        let front = self.seam.iter().filter(|(_, what)| *what == Seam::Front);
        front.map(|(end, _)| *end)
    }

    /// Other ends of the edges along which a vertex `v` that keeps to the boundary or to a seam may slide, ascending.
    pub(super) fn ways<const N: usize>(&self, ws: &Workspace<'_, N>, v: VertexId, freedom: Freedom) -> Vec<VertexId> {
        let mut ends: Vec<VertexId> = match freedom {
            Freedom::Seam => self.seam.iter().map(|(w, _)| *w).collect(),
            Freedom::Boundary => self.boundary.iter().flat_map(|s| ws.mesh().facet_corners(*s)).collect(),
            Freedom::Inside | Freedom::Sheet | Freedom::None => Vec::new(),
        };
        ends.retain(|w| *w != v);
        ends.sort_unstable();
        ends.dedup();
        ends
    }

    pub(super) fn freedom<const N: usize>(&self, ws: &Workspace<'_, N>) -> Freedom {
        let normals = || self.boundary.iter().map(|s| ws.mesh().facet_normal(*s).normalize());
        let is_tip = || {
            let all: Vec<Point> = normals().collect();
            (0..all.len()).any(|i| all[..i].iter().any(|n| n.dot(&all[i]) < OPPOSITE))
        };
        match (self.boundary.is_empty(), self.sheet.is_empty()) {
            (true, true) => Freedom::Inside,
            (true, false) if self.seam.is_empty() => Freedom::Sheet,
            (true, false) if matches!(self.seam[..], [(_, Seam::Front), (_, Seam::Front)]) => Freedom::Seam,
            (true, false) => Freedom::None,
            (false, _) if is_tip() => Freedom::None,
            (false, true) => Freedom::Boundary,
            (false, false) if matches!(self.seam[..], [(_, Seam::Contour), (_, Seam::Contour)]) => Freedom::Seam,
            (false, false) => Freedom::None,
        }
    }
}

/// A place near `target` (cutting frame) for a vertex with the cells `star` that is free inside the body or on the sheet: there
/// the nearest point of the sweep. `None` if no cell of the star holds it.
pub(super) fn place_at<const N: usize>(
    ws: &Workspace<'_, N>,
    limits: &Limits<'_>,
    star: &[CellId],
    freedom: Freedom,
    target: Point,
) -> Option<Place> {
    let now = match (freedom, limits.piece) {
        (Freedom::Sheet, Some(piece)) => piece.nearest(&target).point,
        _ => target,
    };
    Some(Place::of(ws, parents_within(ws, star, now)?))
}

/// The corners of a facet other than `v`.
pub(super) fn others(facet: &FacetKey, v: VertexId) -> impl Iterator<Item = u32> + '_ {
    facet.0.iter().copied().filter(move |&w| w != v.0)
}

/// Whether sheet facets, given by the places of their corners in the cutting frame, stay as close to the sweep as is wanted
/// or as the old ones were.
pub(super) fn keeps_sheet(limits: &Limits<'_>, old: &[[Point; 3]], new: &[[Point; 3]], local_size: f64) -> bool {
    let Some(piece) = limits.piece else {
        return new.is_empty();
    };
    let farthest = |facets: &[[Point; 3]]| {
        let samples = facets.iter().flat_map(|[a, b, c]| {
            let middle = (a + b + c) / 3.0;
            [*a, *b, *c, middle, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0]
        });
        samples.map(|p| piece.nearest(&p).distance).fold(0.0, f64::max)
    };
    stays_near(limits, farthest(old), farthest(new), local_size)
}

/// Whether edges of the front stay as close to the border of the sweep as is wanted or as the old ones were.
pub(super) fn keeps_front(limits: &Limits<'_>, old: &[[Point; 2]], new: &[[Point; 2]], local_size: f64) -> bool {
    let Some(piece) = limits.piece else {
        return new.is_empty();
    };
    let off = |p: Point| piece.nearest_on_border(&p).map_or(f64::INFINITY, |near| near.distance);
    let farthest = |edges: &[[Point; 2]]| {
        let samples = edges.iter().flat_map(|[a, b]| [*a, (a + b) / 2.0, *b]);
        samples.map(off).fold(0.0, f64::max)
    };
    stays_near(limits, farthest(old), farthest(new), local_size)
}

fn stays_near(limits: &Limits<'_>, old: f64, new: f64, local_size: f64) -> bool {
    new <= limits.sheet.max(TINY) * local_size || (limits.sheet > 0.0 && new <= old)
}

/// Where the corners of facets lie in the cutting frame, with one vertex elsewhere.
pub(super) fn places<const N: usize>(
    ws: &Workspace<'_, N>,
    facets: &[FacetKey],
    moved: Option<(VertexId, Point)>,
) -> Vec<[Point; 3]> {
    let at = |v: u32| match moved {
        Some((w, place)) if w.0 == v => place,
        _ => ws.position(VertexId(v)),
    };
    facets.iter().map(|f| f.0.map(at)).collect()
}
