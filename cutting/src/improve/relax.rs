//! Relaxation (S10): what snapping has pressed together spreads over the neighbourhood.
//!
//! Vertices within [`RINGS`] edges of those that were moved onto the sweep are points joined by springs, whose rest length is
//! the local size of the mesh, and by a Lennard-Jones force that keeps them apart. The damped motion is stepped explicitly. As
//! everywhere in `improve` a vertex keeps to its surface, and it moves only if its worst cell does not get worse and its cells
//! get better on the whole.
//!
//! The paper gives no constants. With these Jacobi-CG needs the fewest iterations on a cube of 8 x 8 x 8 boxes cut near a layer
//! of vertices (F1): 109, 109, 104, 102 against 109, 110, 109, 106 without relaxation at eps .2, .1, .05, .01 (uncut 87).
//! That is little, as the paper says; the stable explicit step gets 6% shorter and three times as many cells are touched, so
//! relaxation is made only when it is asked for.

use std::collections::BTreeSet;

use kerfem_mesh::{CellId, Point, VertexId};

use super::hold::{Freedom, Hold, place_at};
use super::smooth::keeps_surfaces;
use super::{FLAT, Limits};
use crate::workspace::{Place, Workspace};

/// How far relaxation reaches, in edges.
const RINGS: usize = 2;
/// Steps of the motion.
const STEPS: usize = 4;
/// Share of the mean force, in local sizes, that a vertex moves by in a step.
const SPEED: f64 = 1.0;
/// Weight of the Lennard-Jones force against that of the springs.
const REPULSION: f64 = 0.1;
/// Distance at which the Lennard-Jones force vanishes, in local sizes.
const APART: f64 = 0.6;

/// Relaxes the neighbourhood of `moved` vertices; how many moves were made.
pub(crate) fn relax<const N: usize>(ws: &mut Workspace<'_, N>, limits: &Limits<'_>, moved: &[VertexId]) -> usize {
    let mut near: BTreeSet<VertexId> = moved.iter().copied().collect();
    for _ in 0..RINGS {
        let next: Vec<VertexId> = near.iter().flat_map(|v| ws.mesh().vertex_neighbors(*v)).collect();
        near.extend(next);
    }
    let mut moves = 0;
    for _ in 0..STEPS {
        let before = moves;
        for &v in &near {
            moves += usize::from(step(ws, limits, v));
        }
        if moves == before {
            break;
        }
    }
    moves
}

fn step<const N: usize>(ws: &mut Workspace<'_, N>, limits: &Limits<'_>, v: VertexId) -> bool {
    let Some((hold, freedom)) = Hold::of_movable(ws, v) else {
        return false;
    };
    let star = ws.mesh().cells_of_vertex(v).to_vec();
    let Some(place) = pushed(ws, limits, v, &star, &hold, freedom) else {
        return false;
    };
    let now = judge(ws, &star, None);
    let then = judge(ws, &star, Some((v, &place)));
    let better = then.0 >= now.0.min(limits.floor).max(FLAT) && then.1 > now.1;
    if better && keeps_surfaces(ws, limits, v, &star, &hold, &place) {
        ws.put_vertex(v, place.now, &place.parents);
        return true;
    }
    false
}

/// The worst quality of some cells, and their mean.
fn judge<const N: usize>(ws: &Workspace<'_, N>, star: &[CellId], moved: Option<(VertexId, &Place)>) -> (f64, f64) {
    let all = star.iter().map(|c| ws.quality_with(&ws.mesh().cell(*c), moved));
    let (worst, sum) = all.fold((f64::INFINITY, 0.0), |(w, s), q| (f64::min(w, q), s + q));
    (worst, sum / star.len() as f64)
}

/// Where the forces push a vertex.
fn pushed<const N: usize>(
    ws: &Workspace<'_, N>,
    limits: &Limits<'_>,
    v: VertexId,
    star: &[CellId],
    hold: &Hold,
    freedom: Freedom,
) -> Option<Place> {
    let (here, size) = (ws.position(v), ws.mesh().local_size(v));
    let around = ws.mesh().vertex_neighbors(v);
    let force = around.iter().map(|w| {
        let e = (ws.position(*w) - here) / size;
        let r = e.norm().max(0.1 * APART);
        let (near, six) = (APART / r, (APART / r).powi(6));
        // attraction is positive
        let lennard_jones = near * six * (1.0 - six);
        e / r * ((r - 1.0) + REPULSION * lennard_jones.max(-10.0))
    });
    let shift = force.sum::<Point>() * (SPEED * size / around.len().max(1) as f64);
    match freedom {
        Freedom::None => None,
        Freedom::Inside | Freedom::Sheet => place_at(ws, limits, star, freedom, here + shift),
        // along the edge of its surface that the force points along most
        Freedom::Boundary | Freedom::Seam => {
            let along = |w: VertexId| {
                let e = ws.position(w) - here;
                (shift.dot(&e) / e.norm(), w)
            };
            let all = hold.ways(ws, v, freedom).into_iter().map(along);
            let (length, w) = all.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
            let t = (length / (ws.position(w) - here).norm()).min(0.5);
            if t <= 0.0 {
                return None;
            }
            Some(Place::of(ws, vec![(v, 1.0 - t), (w, t)]))
        }
    }
}
