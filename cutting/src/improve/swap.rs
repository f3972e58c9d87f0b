//! Swaps: other cells between the same vertices (Y8).
//!
//! [`remove_edge`] takes an edge out and fills the ring around it anew: 3-2 and 4-4 swaps and their longer kin inside the
//! body, the 2-2 swap on a flat boundary, and the flip of an edge of the sheet. [`remove_facet`] is the 2-3 swap.

use kerfem_mesh::predicates::orientation;
use kerfem_mesh::{CellId, FacetKey, FacetLabel, FacetSide, VertexId};

use super::hold::{keeps_sheet, places};
use super::{FLAT, GAIN, Limits};
use crate::snap::{are_as_large, is_in_plane, volume_of};
use crate::workspace::{Workspace, facet_of};

/// Longest ring that is filled anew.
const RING: usize = 8;

/// Vertices around an edge, counter-clockwise seen from its second end; closed inside the body.
struct Ring {
    vertices: Vec<VertexId>,
    closed: bool,
}

/// Replaces the cells around the edge between `a` and `b` by cells without it, if all of them are better than the worst one
/// was; the new cells. Only of tetrahedra.
pub(super) fn remove_edge<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    [a, b]: [VertexId; 2],
) -> Option<Vec<CellId>> {
    let cells: Vec<CellId> = ws.mesh().cells_of_edge(a, b).collect();
    if N != 4 || !(2..=RING).contains(&cells.len()) || !ws.are_of_one_group(&cells) {
        return None;
    }
    let ring = ring_of(ws, a, b, &cells)?;
    let corner = |i: usize| ring.vertices[i];
    let on_sheet = |i: &usize| ws.sheet.contains(&key([a, b, corner(*i)]));
    let labels = match ring.closed {
        true => Vec::new(),
        false => labels_of_flip(ws, a, b, &ring, &cells)?,
    };
    // the filling must have the new edge of the sheet
    let diagonal = match (0..ring.vertices.len()).filter(on_sheet).collect::<Vec<_>>()[..] {
        [] => None,
        // between neighbours there is an edge already
        [i, j] if ring.closed && j > i + 1 && j - i < ring.vertices.len() - 1 => Some([i, j]),
        _ => return None,
    };
    let wanted = (ws.worst_quality(&cells) * (1.0 + GAIN)).max(FLAT);
    let filling = fill(ws, [a, b], &ring, diagonal, wanted)?;
    let old = diagonal.map(|d| d.map(|i| key([a, b, corner(i)])));
    let new = diagonal.map(|[i, j]| [a, b].map(|end| key([corner(i), corner(j), end])));
    if let (Some(old), Some(new)) = (old, new) {
        let (before, after) = (places(ws, &old, None), places(ws, &new, None));
        if limits.is_fixed || !keeps_sheet(limits, &before, &after, ws.mesh().local_size(a)) {
            return None;
        }
        ws.exchange_sheet(&old, &new);
    }
    let new: Vec<[VertexId; N]> = (filling.iter())
        .flat_map(|triangle| cells_over(triangle.map(corner), [a, b]))
        .collect();
    Some(ws.retile(&cells, &new, None, &labels))
}

/// Puts an edge in the place of the facet opposite corner `local` of a cell, if the three cells around it are better than the
/// worse of the two was; the new cells. Only of tetrahedra.
pub(super) fn remove_facet<const N: usize>(ws: &mut Workspace<'_, N>, side: FacetSide) -> Option<Vec<CellId>> {
    let other = ws.mesh().other_side(side)?;
    let cells = [side.cell, other.cell];
    if N != 4 || ws.sheet.contains(&ws.mesh().facet_key(side)) || !ws.are_of_one_group(&cells) {
        return None;
    }
    let apex = |s: FacetSide| ws.mesh().cell(s.cell)[s.local as usize];
    let (d, e) = (apex(side), apex(other));
    if has_edge(ws, d, e) {
        return None;
    }
    let wanted = (ws.worst_quality(&cells) * (1.0 + GAIN)).max(FLAT);
    // the normal of the facet points from d to e
    let f = ws.mesh().facet_corners(side);
    let new = [0, 1, 2].map(|k| {
        let four = [f[k], f[(k + 1) % 3], d, e];
        std::array::from_fn(|m| four[m])
    });
    let better = |corners: &[VertexId; N]| ws.quality_with(corners, None) > wanted;
    if !new.iter().all(better) {
        return None;
    }
    Some(ws.retile(&cells, &new, None, &[]))
}

fn key(mut corners: [VertexId; 3]) -> FacetKey {
    corners.sort_unstable();
    FacetKey(corners.map(|v| v.0))
}

fn has_edge<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId) -> bool {
    ws.mesh().cells_of_edge(a, b).next().is_some()
}

/// The two cells over and under a triangle of a filling.
fn cells_over<const N: usize>([i, j, k]: [VertexId; 3], [a, b]: [VertexId; 2]) -> [[VertexId; N]; 2] {
    [[i, j, k, b], [j, i, k, a]].map(|four| std::array::from_fn(|m| four[m]))
}

fn ring_of<const N: usize>(ws: &Workspace<'_, N>, a: VertexId, b: VertexId, cells: &[CellId]) -> Option<Ring> {
    let mut pairs: Vec<[VertexId; 2]> = Vec::with_capacity(cells.len());
    for &c in cells {
        let corners = ws.mesh().cell(c);
        let mut rest = corners.into_iter().filter(|v| *v != a && *v != b);
        let (x, y) = (rest.next()?, rest.next()?);
        let four = [a, b, x, y].map(|v| ws.mesh().rest_position(v));
        pairs.push(if orientation(&four) > 0.0 { [x, y] } else { [y, x] });
    }
    let is_end = |v: &VertexId| !pairs.iter().any(|p| p[1] == *v);
    let first = pairs.iter().map(|p| p[0]).find(is_end);
    let smallest = pairs.iter().map(|p| p[0]).min()?;
    let mut vertices = vec![first.unwrap_or(smallest)];
    for _ in 0..pairs.len() {
        let last = vertices[vertices.len() - 1];
        vertices.push(pairs.iter().find(|p| p[0] == last)?[1]);
    }
    let closed = vertices[0] == vertices[pairs.len()];
    if closed {
        vertices.pop();
    }
    let mut different = vertices.clone();
    different.sort_unstable();
    different.dedup();
    (different.len() == vertices.len() && vertices.len() >= 3 && closed == first.is_none())
        .then_some(Ring { vertices, closed })
}

/// The labels of the two boundary facets that take the place of those at an edge, if these lie in one plane, have one label,
/// and there is no edge between their far corners yet.
fn labels_of_flip<const N: usize>(
    ws: &Workspace<'_, N>,
    a: VertexId,
    b: VertexId,
    ring: &Ring,
    cells: &[CellId],
) -> Option<Vec<(FacetKey, FacetLabel)>> {
    let (first, last) = (ring.vertices[0], *ring.vertices.last()?);
    let label = |far: VertexId| {
        let sides = cells.iter().flat_map(|c| (0..N).map(move |k| (*c, k)));
        let mut of_facet = sides.filter(|(c, k)| facet_of(&ws.mesh().cell(*c), *k) == key([a, b, far]));
        of_facet.next().map(|(c, k)| ws.mesh().facet_labels(c)[k])
    };
    let label = label(first).filter(|l| Some(*l) == label(last))?;
    let [p, q, r, s] = [a, b, first, last].map(|v| ws.mesh().rest_position(v));
    let flat = is_in_plane::<N>(&[p, q, r], s, volume_of(ws, cells))
        && are_as_large::<N>(&[[p, q, r], [p, q, s]], &[[r, s, p], [r, s, q]]);
    let new = [a, b].map(|end| (key([first, last, end]), label));
    (flat && !has_edge(ws, first, last)).then(|| new.to_vec())
}

/// Triangles between the vertices of a ring, by their numbers, whose worst cell is the best there is (by dynamic programming
/// over parts of the ring; Klincsek 1980) and better than `wanted`.
fn fill<const N: usize>(
    ws: &Workspace<'_, N>,
    ends: [VertexId; 2],
    ring: &Ring,
    diagonal: Option<[usize; 2]>,
    wanted: f64,
) -> Option<Vec<[usize; 3]>> {
    let v = &ring.vertices;
    let n = v.len();
    if n == 3 && ring.closed && v[..2].iter().all(|w| has_edge(ws, *w, v[2])) {
        let around = ws.mesh().cells_of_edge(v[0], v[1]);
        if around.into_iter().any(|c| ws.mesh().cell(c).contains(&v[2])) {
            return None;
        }
    }
    let crosses = |i: usize, j: usize| {
        diagonal.is_some_and(|[p, q]| {
            let inside = |k: usize| k > p && k < q;
            let outside = |k: usize| k < p || k > q;
            inside(i) && outside(j) || inside(j) && outside(i)
        })
    };
    let is_side = |i: usize, j: usize| j == i + 1 || (i == 0 && j == n - 1);
    // the best worst cell of the part from i to j, and the third corner of the triangle at its edge
    let mut best = vec![vec![(f64::INFINITY, 0); n]; n];
    for width in 2..n {
        for i in 0..n - width {
            let j = i + width;
            best[i][j].0 = f64::NEG_INFINITY;
            if crosses(i, j) || (!is_side(i, j) && has_edge(ws, v[i], v[j])) {
                continue;
            }
            for k in i + 1..j {
                let below = best[i][k].0.min(best[k][j].0);
                if below <= best[i][j].0.max(wanted) {
                    continue;
                }
                let cells = cells_over::<N>([v[i], v[k], v[j]], ends);
                let own = cells.iter().map(|c| ws.quality_with(c, None)).fold(below, f64::min);
                if own > best[i][j].0 {
                    best[i][j] = (own, k);
                }
            }
        }
    }
    if best[0][n - 1].0 <= wanted {
        return None;
    }
    let (mut triangles, mut parts) = (Vec::new(), vec![(0, n - 1)]);
    while let Some((i, j)) = parts.pop() {
        if j > i + 1 {
            let k = best[i][j].1;
            triangles.push([i, k, j]);
            parts.extend([(i, k), (k, j)]);
        }
    }
    let has = |[p, q]: [usize; 2]| triangles.iter().any(|t| t.contains(&p) && t.contains(&q));
    diagonal.is_none_or(has).then_some(triangles)
}
