//! Moving one vertex (Y7, Y9): to the mean of its neighbours or elsewhere near, where the worst of its cells gets better.

use kerfem_mesh::{CellId, Point, VertexId};

use super::hold::{Freedom, Hold, keeps_front, keeps_sheet, place_at, places};
use super::{FLAT, GAIN, Limits};
use crate::snap::keeps_boundary;
use crate::workspace::{Place, Workspace, facet_of};

/// How far towards each target a vertex is tried.
const FRACTIONS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
/// Moves of one vertex in a row.
const ROUNDS: usize = 4;

/// Moves a vertex as far as that lifts the worst of its cells; these, or `None` if it stays.
///
/// A vertex on the boundary keeps to its plane or its straight crease, one on the sheet goes on lying on the sweep, one on a
/// seam moves along it: no volume is lost, unlike in Y9.
pub(super) fn smooth<const N: usize>(
    ws: &mut Workspace<'_, N>,
    limits: &Limits<'_>,
    v: VertexId,
) -> Option<Vec<CellId>> {
    let (hold, freedom) = Hold::of_movable(ws, v)?;
    let star = ws.mesh().cells_of_vertex(v).to_vec();
    let mut moved = false;
    for _ in 0..ROUNDS {
        let before = ws.worst_quality(&star);
        let wanted = (before * (1.0 + GAIN)).max(FLAT);
        let mut better: Vec<(f64, Place)> = candidates(ws, limits, v, &star, &hold, freedom)
            .into_iter()
            .map(|place| (quality(ws, v, &star, &place, wanted), place))
            .filter(|(quality, _)| *quality > wanted)
            .collect();
        better.sort_by(|a, b| b.0.total_cmp(&a.0));
        let allowed = |place: &Place| keeps_surfaces(ws, limits, v, &star, &hold, place);
        let Some((_, place)) = better.into_iter().find(|(_, place)| allowed(place)) else {
            break;
        };
        ws.put_vertex(v, place.now, &place.parents);
        moved = true;
    }
    moved.then_some(star)
}

/// Whether boundary, sheet and front stay where they are if a vertex goes to a place.
pub(super) fn keeps_surfaces<const N: usize>(
    ws: &Workspace<'_, N>,
    limits: &Limits<'_>,
    v: VertexId,
    star: &[CellId],
    hold: &Hold,
    place: &Place,
) -> bool {
    let size = ws.mesh().local_size(v);
    let sheet = || {
        let old = places(ws, &hold.sheet, None);
        let new = places(ws, &hold.sheet, Some((v, place.now)));
        keeps_sheet(limits, &old, &new, size)
    };
    let front = || {
        let ends: Vec<Point> = hold.front().map(|w| ws.position(w)).collect();
        let from = |p: Point| ends.iter().map(|q| [p, *q]).collect::<Vec<_>>();
        keeps_front(limits, &from(ws.position(v)), &from(place.now), size)
    };
    keeps_boundary(ws, v, star, place.rest) && (hold.sheet.is_empty() || sheet() && front())
}

/// The worst cell with the vertex elsewhere; no more than that it is not good enough, if it is not.
fn quality<const N: usize>(ws: &Workspace<'_, N>, v: VertexId, star: &[CellId], place: &Place, wanted: f64) -> f64 {
    let mut worst = f64::INFINITY;
    for &c in star {
        worst = worst.min(ws.quality_with(&ws.mesh().cell(c), Some((v, place))));
        if worst <= wanted {
            break;
        }
    }
    worst
}

fn candidates<const N: usize>(
    ws: &Workspace<'_, N>,
    limits: &Limits<'_>,
    v: VertexId,
    star: &[CellId],
    hold: &Hold,
    freedom: Freedom,
) -> Vec<Place> {
    let here = ws.position(v);
    match freedom {
        Freedom::None => Vec::new(),
        Freedom::Seam | Freedom::Boundary => {
            let ways = hold.ways(ws, v, freedom);
            let steps = ways.iter().flat_map(|w| FRACTIONS[1..].iter().map(move |t| (*w, *t)));
            let mut out: Vec<Place> = steps.map(|(w, t)| Place::of(ws, vec![(v, 1.0 - t), (w, t)])).collect();
            if freedom == Freedom::Boundary {
                let share = 1.0 / ways.len().max(1) as f64;
                out.extend(FRACTIONS.iter().map(|t| {
                    let others = ways.iter().map(|w| (*w, t * share));
                    Place::of(ws, [(v, 1.0 - t)].into_iter().chain(others).collect())
                }));
            }
            out
        }
        Freedom::Inside | Freedom::Sheet => {
            let around = ws.mesh().vertex_neighbors(v);
            let mean = around.iter().map(|w| ws.position(*w)).sum::<Point>() / around.len().max(1) as f64;
            let mut targets = vec![mean];
            targets.extend(away_from_worst(ws, v, star));
            targets.extend(around.iter().map(|w| here + (ws.position(*w) - here) * 0.5));
            let steps = targets
                .iter()
                .flat_map(|target| FRACTIONS.iter().map(move |t| here + (target - here) * *t));
            steps.filter_map(|p| place_at(ws, limits, star, freedom, p)).collect()
        }
    }
}

/// Where the worst cell of a vertex would be about as high over its opposite facet as that is wide.
fn away_from_worst<const N: usize>(ws: &Workspace<'_, N>, v: VertexId, star: &[CellId]) -> Option<Point> {
    let worst = star.iter().min_by(|a, b| ws.quality(**a).total_cmp(&ws.quality(**b)))?;
    let local = ws.mesh().cell(*worst).iter().position(|w| *w == v)?;
    let p = facet_of(&ws.mesh().cell(*worst), local)
        .0
        .map(|w| ws.position(VertexId(w)));
    let middle = (p[0] + p[1] + p[2]) / 3.0;
    let across = (p[1] - p[0]).cross(&(p[2] - p[0]));
    let normal = if across.dot(&(ws.position(v) - middle)) > 0.0 {
        -across
    } else {
        across
    };
    let width = ((p[1] - p[0]).norm() + (p[2] - p[1]).norm() + (p[0] - p[2]).norm()) / 3.0;
    (normal.norm() > 0.0).then(|| middle - normal.normalize() * (0.8 * width))
}
