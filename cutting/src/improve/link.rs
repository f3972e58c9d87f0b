//! When the ends of an edge may become one vertex without a change of topology (G4).
//!
//! The link condition `Lk(a) n Lk(b) = Lk(ab)` (Dey, Edelsbrunner, Guha and Nekhayev 1999), of the cells together with a cone
//! over each of: the boundary, the sheet, and the seams of the sheet. The cones are what forbids to close a hole, to tear a
//! ligament of one cell, to pull a vertex off its surface, or to join two parts of the front.

use kerfem_mesh::{FacetKey, VertexId};

use super::hold::{Hold, others};
use crate::workspace::Workspace;

/// Apexes of the cones.
const BOUNDARY: u32 = u32::MAX;
const SHEET: u32 = u32::MAX - 1;
const SEAM: u32 = u32::MAX - 2;
/// Pads simplices of less than three vertices.
const NOTHING: u32 = u32::MAX - 3;

/// Up to three vertices, ascending, padded.
type Simplex = [u32; 3];

/// Whether the edge between `a` and `b` may vanish.
pub(super) fn condition<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId, hold: [&Hold; 2]) -> bool {
    let links = [link(ws, a, hold[0]), link(ws, b, hold[1])];
    let of_edge = link_of_edge(ws, a, b, hold[0]);
    let both = links[0].iter().filter(|s| links[1].binary_search(s).is_ok());
    both.eq(of_edge.iter()) && !brings_sheet_to_boundary(ws, hold, &of_edge)
}

/// Whether a vertex, edge or facet of the sheet would come to be one with one of the boundary where sheet and boundary do not
/// meet now.
fn brings_sheet_to_boundary<const N: usize>(ws: &Workspace<'_, N>, hold: [&Hold; 2], link_of_edge: &[Simplex]) -> bool {
    // whether the join of an end with a simplex (nothing, a vertex, an edge) belongs to sheet and boundary
    let belongs = |k: usize, simplex: &[u32]| {
        let has = |facet: &FacetKey| simplex.iter().all(|v| facet.0.contains(v));
        let boundary = hold[k].boundary.iter().any(|s| has(&ws.mesh().facet_key(*s)));
        [hold[k].sheet.iter().any(has), boundary]
    };
    let meets = |simplex: &[u32]| {
        let [[sheet_a, boundary_a], [sheet_b, boundary_b]] = [0, 1].map(|k| belongs(k, simplex));
        let meet_now = sheet_a && boundary_a || sheet_b && boundary_b;
        (sheet_a || sheet_b) && (boundary_a || boundary_b) && !meet_now
    };
    let real = |s: &&Simplex| s.iter().all(|v| *v <= NOTHING);
    meets(&[])
        || link_of_edge.iter().filter(real).any(|s| {
            let vertices: Vec<u32> = s.iter().copied().filter(|v| *v != NOTHING).collect();
            meets(&vertices)
        })
}

fn link<const N: usize>(ws: &Workspace<'_, N>, v: VertexId, hold: &Hold) -> Vec<Simplex> {
    let mut out = Vec::new();
    for &c in ws.mesh().cells_of_vertex(v) {
        let corners = ws.mesh().cell(c);
        push(&mut out, corners.iter().filter(|w| **w != v).map(|w| w.0));
    }
    for side in &hold.boundary {
        let key = ws.mesh().facet_key(*side);
        push(&mut out, others(&key, v).chain([BOUNDARY]));
    }
    for facet in &hold.sheet {
        push(&mut out, others(facet, v).chain([SHEET]));
    }
    for (end, _) in &hold.seam {
        push(&mut out, [end.0, SEAM].into_iter());
    }
    sorted(out)
}

fn link_of_edge<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId, hold: &Hold) -> Vec<Simplex> {
    let mut out = Vec::new();
    for c in ws.mesh().cells_of_edge(a, b) {
        let corners = ws.mesh().cell(c);
        push(&mut out, corners.iter().filter(|w| **w != a && **w != b).map(|w| w.0));
    }
    for side in &hold.boundary {
        let key = ws.mesh().facet_key(*side);
        if key.0.contains(&b.0) {
            push(&mut out, others(&key, a).filter(|w| *w != b.0).chain([BOUNDARY]));
        }
    }
    for facet in hold.sheet.iter().filter(|f| f.0.contains(&b.0)) {
        push(&mut out, others(facet, a).filter(|w| *w != b.0).chain([SHEET]));
    }
    if hold.seam.iter().any(|(end, _)| *end == b) {
        push(&mut out, [SEAM].into_iter());
    }
    sorted(out)
}

/// Adds a simplex of one to three vertices and all its faces.
fn push(out: &mut Vec<Simplex>, vertices: impl Iterator<Item = u32>) {
    let all: Vec<u32> = vertices.collect();
    for chosen in 1..1usize << all.len() {
        let mut simplex = [NOTHING; 3];
        let some = (0..all.len()).filter(|i| chosen >> i & 1 == 1).map(|i| all[i]);
        for (own, v) in simplex.iter_mut().zip(some) {
            *own = v;
        }
        simplex.sort_unstable();
        out.push(simplex);
    }
}

fn sorted(mut simplices: Vec<Simplex>) -> Vec<Simplex> {
    simplices.sort_unstable();
    simplices.dedup();
    simplices
}
