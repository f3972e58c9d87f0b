//! A blade: a line segment that moves, and the incision that it draws (METHODS N1, N13, N14, F4).
//!
//! The blade cuts as it moves: between two of its positions it sweeps a ruled surface, and the incision ends at the blade after
//! each of them. What it sweeps next goes on from where the incision really ends: from the vertices of its [`Tip`], wherever
//! the body has carried them since, and outside the body from where the blade was. So the pieces of a motion leave no
//! bridges between them, motions too short to be resolved add up until they are, and how finely a motion is sampled changes
//! the surface by no more than the distance that vertices snap over.
//!
//! The paper finds the places where the blade meets edges by events in time (N13, N14), with a matrix that is singular for a
//! pivoting blade. Here the swept surface is cut along, by exact predicates, so that pivoting, stopped, parallel and crossing
//! positions need no case of their own. A blade that moves along itself, as one that is stuck in does, sweeps next to no area:
//! it cuts nothing, and goes on from where it has come to.

use std::collections::{BTreeMap, BTreeSet};

use kerfem_mesh::nearest::{on_segment, on_triangle};
use kerfem_mesh::predicates::contains;
use kerfem_mesh::{Aabb, BoxTree, CellId, FacetLabel, FacetSide, Point, SimplexMesh, VertexId};
use serde::{Deserialize, Serialize};

use crate::region::TriangleBox;
use crate::{CutOptions, Method, Sweep};

/// Of the local size: how far the triangles of a swept surface may be from the ruled surface of the motion.
const SMOOTH: f64 = 0.01;

/// Most strips of triangles that one swept surface is divided into, along the blade and along its motion between two
/// vertices of the tip.
const FINEST: f64 = 32.0;

/// Of what a method resolves: shorter motions wait for what follows them. (Measured: strips half as wide cost half of the
/// quality and a third more cells.)
const WAIT: f64 = 2.0;

/// Cosine of the angle between the lips and a motion within which it leads back between them.
const BACK: f64 = 0.25;

/// Least fraction of the local size within which the end of the incision counts as being at the blade.
const CLOSE: f64 = 0.02;

/// Of the local size: what a blade that slides along itself may leave uncut, at least and at most. (The surface that it sweeps
/// nearly folds upon itself: cut exactly, it makes chips.)
const SLIDE: [f64; 2] = [0.1, 0.2];

/// Of what a method resolves, and of the depth of a blade in the body: how finely a motion is looked at that may be one of the
/// blade along itself.
const FINE: f64 = 0.25;

/// Most places along the way of a point of a blade that are looked at.
const ROWS: usize = 32;

/// How often the place where a line meets the surface is halved.
const HALVINGS: usize = 8;

/// Most places along a blade that are looked at.
const MOST_PLACES: f64 = 512.0;

/// Why a motion of a blade is not accepted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BladeError {
    /// Fewer than two samples.
    #[error("{count} samples are given; at least 2 are needed")]
    TooFew {
        /// How many there are.
        count: usize,
    },
    /// A time or coordinate that is not finite.
    #[error("sample {sample} (from zero) is not finite; finite numbers are needed")]
    NotFinite {
        /// Which sample, from zero.
        sample: usize,
    },
    /// Times do not ascend.
    #[error("sample {sample} (from zero) is at {time:?} s, not after the one before; ascending times are needed")]
    NotAscending {
        /// Which sample, from zero.
        sample: usize,
        /// Its time (s).
        time: f64,
    },
    /// Both ends are one point all the time.
    #[error("the blade has no length at any time; two different end points are needed")]
    NoLength,
}

/// A blade: the two end points of a line segment over time, linear between samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Blade {
    samples: Vec<(f64, [Point; 2])>,
}

impl Blade {
    /// A blade from its samples: times (s), ascending, and end points (m).
    ///
    /// # Errors
    /// [`BladeError`] for the first thing that is not accepted.
    pub fn new(samples: Vec<(f64, [Point; 2])>) -> Result<Blade, BladeError> {
        let finite = |(t, ends): &(f64, [Point; 2])| t.is_finite() && ends.iter().all(is_finite);
        if let Some(sample) = samples.iter().position(|s| !finite(s)) {
            return Err(BladeError::NotFinite { sample });
        }
        if samples.len() < 2 {
            return Err(BladeError::TooFew { count: samples.len() });
        }
        if let Some(k) = samples.windows(2).position(|w| w[1].0 <= w[0].0) {
            let (sample, time) = (k + 1, samples[k + 1].0);
            return Err(BladeError::NotAscending { sample, time });
        }
        if samples.iter().all(|(_, [a, b])| a == b) {
            return Err(BladeError::NoLength);
        }
        Ok(Blade { samples })
    }

    /// Time of the first sample (s).
    pub fn start(&self) -> f64 {
        self.samples[0].0
    }

    /// Time of the last sample (s).
    pub fn end(&self) -> f64 {
        self.samples[self.samples.len() - 1].0
    }

    /// The end points (m) at a time (s); those of the first sample before it, of the last one after it.
    pub fn at(&self, t: f64) -> [Point; 2] {
        let k = self.samples.partition_point(|(s, _)| *s <= t);
        let Some((from, a)) = k.checked_sub(1).map(|k| self.samples[k]) else {
            return self.samples[0].1;
        };
        let Some(&(to, b)) = self.samples.get(k) else { return a };
        let g = (t - from) / (to - from);
        [0, 1].map(|i| mix(a[i], b[i], g))
    }

    /// Ends (s) of the straight motions within a span of time: the samples after `from` and before `to`, and `to`.
    pub fn stops(&self, from: f64, to: f64) -> Vec<f64> {
        let times = self.samples.iter().map(|(t, _)| *t);
        let mut stops: Vec<f64> = times.filter(|t| *t > from && *t < to).collect();
        stops.push(to);
        stops
    }

    /// How many samples it is given by.
    pub fn num_samples(&self) -> usize {
        self.samples.len()
    }

    /// The box around all positions (m).
    pub fn bounds(&self) -> Aabb {
        Aabb::around(self.samples.iter().flat_map(|(_, ends)| *ends))
    }
}

/// Where the incision of a blade ends: what its next motion goes on from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tip {
    /// The blade, where it had come to when it last cut (m, in the cutting frame).
    line: [Point; 2],
    /// Where the next motion begins outside the fronts (m): the blade, or what it left behind when the cut was too short to
    /// open anything there.
    behind: [Point; 2],
    /// Where it has been since then without opening anything (m): what is swept next is swept by this way.
    #[serde(default)]
    passed: Vec<[Point; 2]>,
    /// Where it is to come to by the cut that is being made (m); if it does not arrive, the cut was refused.
    #[serde(default)]
    tried: Option<[Point; 2]>,
    /// The ends of the incision at the blade, ascending along it: vertices joined by edges.
    fronts: Vec<Front>,
    /// Where the blade is while it moves back between the lips of its incision (m).
    back: Option<[Point; 2]>,
    /// How wide (m) the motions were since the last cut that were too narrow to cut.
    lost: f64,
    /// See [`Self::distance`].
    distance: f64,
}

/// Vertices of the end of an incision, ascending along the blade.
type Front = Vec<Mark>;

/// A vertex of a front.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Mark {
    vertex: VertexId,
    /// Where along the blade, 0 to 1.
    s: f64,
    /// Where it was when the blade got there (m).
    place: Point,
}

/// The start of a motion: points, and where along the blade they are.
type Start = Vec<(f64, Point)>;

impl Tip {
    /// Of a blade that has not cut yet.
    pub fn new(line: [Point; 2]) -> Tip {
        Tip {
            line,
            behind: line,
            passed: Vec::new(),
            tried: None,
            fronts: Vec::new(),
            back: None,
            lost: 0.0,
            distance: 0.0,
        }
    }

    /// The blade (m), where it had come to when it last cut.
    pub fn line(&self) -> [Point; 2] {
        self.line
    }

    /// Whether it can belong to a mesh of so many vertex slots.
    pub fn fits(&self, slots: usize) -> bool {
        let lines = [&self.line, &self.behind].into_iter().chain(&self.passed);
        let mut lines = lines.chain(&self.tried).chain(&self.back).flatten();
        let mut marks = self.fronts.iter().flatten();
        let fits = |m: &Mark| m.vertex.index() < slots && m.s.is_finite() && is_finite(&m.place);
        lines.all(is_finite) && marks.all(fits) && self.lost.is_finite()
    }

    /// Vertices at which the incision ends at the blade, with their places along it (0 to 1).
    pub fn vertices(&self) -> impl Iterator<Item = (VertexId, f64)> + '_ {
        self.fronts.iter().flatten().map(|m| (m.vertex, m.s))
    }

    /// The largest distance (m) from the end of the incision, beside the blade, to it and, where an end of the blade is inside the body,
    /// from that to the end of the incision, in the cutting frame when it got there; zero where the incision does not end at
    /// the blade.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// What the blade sweeps from here to `line` (m), as a surface to cut along. Nothing, unless it is `due`, if it only moves
    /// by less than the method resolves or back between the lips of its incision: then this tip stays what to go on from; and
    /// nothing if it slides along itself: then it has come to `line`. `positions` (m, by vertex slot) are those of the cutting
    /// frame as they are now, `tree` holds the boxes of the cells.
    ///
    /// A blade that comes forward again cuts from the end of its incision on; one that leaves its incision by another way, or
    /// the body, begins anew from where it was.
    pub fn sweep_to<const N: usize>(
        &mut self,
        mesh: &SimplexMesh<N>,
        tree: &BoxTree,
        positions: &[Point],
        line: [Point; 2],
        options: &CutOptions,
        due: bool,
    ) -> Sweep {
        if let Some(refused) = self.tried.take() {
            self.pass(refused, SMOOTH * size_around(mesh, tree, &refused));
        }
        if self.vertices().any(|(v, _)| !mesh.has_vertex(v)) {
            // improving cells has taken some away
            let passed = self.passed.clone();
            self.arrive(mesh, tree, positions, self.line, options);
            self.passed = passed;
        }
        let mut start = self.start(positions);
        let mut way = self.way_to(line);
        let mut size = size_near(mesh, tree, &ruled(&start, &way, f64::INFINITY));
        if size.is_infinite() {
            // through the air
            *self = Tip::new(line);
            return Sweep::default();
        }
        let resolved = WAIT * resolution_of(options) * size;
        let is_short = self.moved(positions, line) < resolved;
        if is_short && !due {
            return Sweep::default();
        }
        let back = self.back.take();
        let anew = if !is_short && self.heads_back(mesh, positions, line) {
            if !is_stuck(mesh, tree, positions, &line, resolved) {
                self.back = Some(line);
                return Sweep::default();
            }
            // out of the incision on its other side
            Some(back.unwrap_or_else(|| self.carried(positions)))
        } else {
            back.filter(|back| !self.is_passed(positions, *back, line, resolved))
        };
        if let Some(from) = anew {
            *self = Tip::new(from);
            start = self.start(positions);
            way = self.way_to(line);
            size = size_near(mesh, tree, &ruled(&start, &way, f64::INFINITY));
        }
        let most = resolution_of(options).clamp(SLIDE[0], SLIDE[1]) * size;
        if !due
            && let Some(width) = self.slides(mesh, tree, positions, line, most)
            && self.lost + width <= most
        {
            let lost = self.lost + width;
            self.arrive(mesh, tree, positions, line, options);
            (self.behind, self.lost) = (line, lost);
            self.passed.clear();
            return Sweep::default();
        }
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for t in ruled(&start, &way, SMOOTH * size) {
            triangles.push([0, 1, 2].map(|k| points.len() + k));
            points.extend(t);
        }
        for lip in self.fronts.iter().flat_map(|f| lip_behind(mesh, f)) {
            triangles.push([0, 1, 2].map(|k| points.len() + k));
            points.extend(lip.map(|v| positions[v.index()]));
        }
        self.tried = Some(line);
        // all points come from finite ones, so there is nothing to refuse
        Sweep::new(points, triangles).map_or_else(|_| Sweep::default(), |(sweep, _)| sweep.going_on())
    }

    /// Where the blade comes by on its way to `line` (m), and that.
    fn way_to(&self, line: [Point; 2]) -> Vec<[Point; 2]> {
        self.passed.iter().copied().chain([line]).collect()
    }

    /// Takes note that the blade has been at `line` (m) and opened nothing on its way; places within `least` (m) of a straight
    /// way are left out.
    fn pass(&mut self, line: [Point; 2], least: f64) {
        if let Some(last) = self.passed.last() {
            let before = self.passed.len().checked_sub(2).map_or(self.behind, |k| self.passed[k]);
            let off = |k: usize| (on_segment(&last[k], &[before[k], line[k]]).0 - last[k]).norm();
            if (0..2).all(|k| off(k) <= least) {
                self.passed.pop();
            }
        }
        self.passed.push(line);
    }

    /// How far (m) what the blade sweeps on its way to `line` inside the body lies from where it has come to, if it only slides
    /// along itself, as [`slides`] says of every part of the way.
    fn slides<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        tree: &BoxTree,
        positions: &[Point],
        line: [Point; 2],
        reach: f64,
    ) -> Option<f64> {
        let (mut start, mut width) = (self.start(positions), 0.0);
        for line in self.way_to(line) {
            width += slides(mesh, tree, positions, &start, line, reach, !self.fronts.is_empty())?;
            start = vec![(0.0, line[0]), (1.0, line[1])];
        }
        Some(width)
    }

    /// Whether the way from the end of the incision to `line` leads back between the lips: within 75 degrees on average.
    fn heads_back<const N: usize>(&self, mesh: &SimplexMesh<N>, positions: &[Point], line: [Point; 2]) -> bool {
        let at = |v: VertexId| positions[v.index()];
        let (mut sum, mut count) = (0.0, 0.0);
        for front in &self.fronts {
            let lips = lip_behind(mesh, front);
            for m in front {
                let p = at(m.vertex);
                let around = lips.iter().filter(|f| f.contains(&m.vertex));
                let behind: Point = around.flat_map(|f| f.map(at)).map(|q| q - p).sum();
                let way = mix(line[0], line[1], m.s) - p;
                let size = behind.norm() * way.norm();
                if size > 0.0 {
                    sum += behind.dot(&way) / size;
                    count += 1.0;
                }
            }
        }
        count > 0.0 && sum > BACK * count
    }

    /// Whether the blade passes the end of its incision on the way from one line to another, within `reach` (m).
    fn is_passed(&self, positions: &[Point], from: [Point; 2], to: [Point; 2], reach: f64) -> bool {
        let way = ruled(&vec![(0.0, from[0]), (1.0, from[1])], &[to], f64::INFINITY);
        let off = |m: &Mark| {
            let p = positions[m.vertex.index()];
            way.iter()
                .map(|t| (on_triangle(&p, t) - p).norm())
                .fold(f64::INFINITY, f64::min)
        };
        let marks = self.fronts.iter().map(Vec::len).sum::<usize>();
        2 * self.fronts.iter().flatten().filter(|m| off(m) <= reach).count() > marks
    }

    /// The blade (m) where it last cut, as the body has carried the end of the incision since.
    fn carried(&self, positions: &[Point]) -> [Point; 2] {
        let mut marks = self.fronts.iter().flatten();
        let by = |m: &Mark| positions[m.vertex.index()] - m.place;
        let first = marks.next().map_or(Point::zeros(), by);
        let last = marks.next_back().map_or(first, by);
        [self.line[0] + first, self.line[1] + last]
    }

    /// How far (m) the blade has moved against the body since it last cut, at most.
    fn moved(&self, positions: &[Point], line: [Point; 2]) -> f64 {
        let last = self.passed.last().unwrap_or(&self.behind);
        let of_ends = [0, 1].map(|k| (line[k] - last[k]).norm());
        let of_fronts = self.fronts.iter().flatten().map(|m| {
            let carried = positions[m.vertex.index()] - m.place;
            (mix(line[0], line[1], m.s) - mix(self.line[0], self.line[1], m.s) - carried).norm()
        });
        of_fronts.chain(of_ends).fold(0.0, f64::max)
    }

    /// The line that the next motion begins with: the end of the incision as the body has carried it, and outside the body
    /// where the blade was, carried along with the nearest end of it.
    fn start(&self, positions: &[Point]) -> Start {
        let mut start: Start = Vec::new();
        for mark in self.fronts.iter().flatten() {
            // along a front that turns back the blade waits
            let least = start.last().map_or(0.0, |(s, _)| *s);
            start.push((mark.s.max(least), positions[mark.vertex.index()]));
        }
        let mut marks = self.fronts.iter().flatten();
        let Some((first, last)) = marks.next().map(|first| (first, marks.next_back().unwrap_or(first))) else {
            return vec![(0.0, self.behind[0]), (1.0, self.behind[1])];
        };
        let outside = |end: f64, mark: &Mark| {
            let carried = positions[mark.vertex.index()] - mark.place;
            [mark.s, end].map(|s| (s, mix(self.behind[0], self.behind[1], s) + carried))
        };
        // where nothing was left behind the front goes on straight to the end of the blade
        let jog = self.behind != self.line;
        if first.s > 0.0 {
            let [near, end] = outside(0.0, first);
            start.splice(..0, std::iter::once(end).chain(jog.then_some(near)));
        }
        if last.s < 1.0 {
            let [near, end] = outside(1.0, last);
            start.extend(jog.then_some(near).into_iter().chain([end]));
        }
        start
    }

    /// Takes note that the blade has cut, or found nothing to cut, on its way to `line` (m).
    pub fn arrive<const N: usize>(
        &mut self,
        mesh: &SimplexMesh<N>,
        tree: &BoxTree,
        positions: &[Point],
        line: [Point; 2],
        options: &CutOptions,
    ) {
        let at = |v: VertexId| positions[v.index()];
        let reach = |v: VertexId| reach_of(options) * mesh.local_size(v);
        let size = size_around(mesh, tree, &line);
        let cells = cells_near(tree, &line, reach_of(options) * size);
        let near = |v: VertexId| {
            let (foot, s) = on_segment(&at(v), &line);
            (s, (foot - at(v)).norm())
        };
        let mut joined = Graph::new();
        let ends = ends_of_incisions(mesh, &cells).into_iter();
        for [a, b] in ends.filter(|e| e.iter().all(|v| near(*v).1 <= reach(*v))) {
            joined.entry(a).or_default().push(b);
            joined.entry(b).or_default().push(a);
        }
        let mark = |vertex: VertexId| Mark {
            vertex,
            s: near(vertex).0,
            place: at(vertex),
        };
        // an edge that is farther from the blade costs more
        let away = |v: VertexId, w: VertexId| {
            let off = [v, w].map(|u| near(u).1 / (resolution_of(options) * mesh.local_size(u)));
            1.0 + off[0] * off[0] + off[1] * off[1]
        };
        let cost = |v: VertexId, w: VertexId| (at(v) - at(w)).norm() * away(v, w);
        // and stands for less of the blade
        let stands = |w: &[Mark]| (w[1].s - w[0].s).abs() / away(w[0].vertex, w[1].vertex);
        let mut fronts: Vec<Front> = Vec::new();
        for part in connected(&joined) {
            // inside the body it ends where the blade does
            let at_end = |end: usize| {
                let close = |v: &VertexId| {
                    (at(*v) - line[end]).norm() <= 1.25 * resolution_of(options).min(0.5) * mesh.local_size(*v)
                };
                let inside = part.iter().filter(|v| close(v) && !is_on_original_boundary(mesh, **v));
                inside.copied().min_by(|a, b| {
                    let [p, q] = [a, b].map(|v| (at(*v) - line[end]).norm());
                    p.total_cmp(&q).then(a.cmp(b))
                })
            };
            let ends = [0, 1].map(at_end);
            let along = |v: VertexId| (near(v).0 * (line[1] - line[0]).norm(), near(v).1);
            // where it comes out of the body, or where what is looked at ends
            let is_end = |v: &VertexId| joined[v].len() == 1 || is_on_original_boundary(mesh, *v);
            let outermost = [1.0, -1.0].map(|sign| outermost(&part, is_end, sign, along));
            let path = path_between([0, 1].map(|k| ends[k].unwrap_or(outermost[k])), &joined, cost);
            let mut front: Front = path.into_iter().map(mark).collect();
            for (k, end) in [(0, 0), (front.len() - 1, 1)] {
                if ends[end].is_some() {
                    front[k].s = end as f64;
                }
            }
            if front.len() > 1 {
                fronts.push(front);
            }
        }
        self.line = line;
        (self.back, self.tried, self.lost) = (None, None, 0.0);
        let is_at = |m: &Mark| near(m.vertex).1 <= resolution_of(options) * mesh.local_size(m.vertex);
        self.fronts = apart(fronts, |f| f.windows(2).map(stands).sum(), is_at);
        // without snapping whatever is swept is opened
        let exact = options.method == Method::Subdivide;
        let far = 0.75 * resolution_of(options).min(0.5) * size;
        if exact || !is_stuck(mesh, tree, positions, &line, far) {
            self.behind = line;
            self.passed.clear();
        } else if self.fronts.is_empty() {
            self.pass(line, SMOOTH * size);
        } else {
            self.passed.clear();
        }
        self.distance = self.distance_now(mesh, tree, positions);
    }

    fn distance_now<const N: usize>(&self, mesh: &SimplexMesh<N>, tree: &BoxTree, positions: &[Point]) -> f64 {
        let [from, to] = self.line;
        let axis = (to - from) / (to - from).norm_squared().max(f64::MIN_POSITIVE);
        let beside = |w: &[Mark]| {
            let p = [w[0].place, w[1].place];
            let s = p.map(|p| axis.dot(&(p - from)));
            let at = |end: f64| ((end - s[0]) / (s[1] - s[0])).clamp(0.0, 1.0);
            let within = |k: usize| (0.0..=1.0).contains(&s[k]);
            // where the edge passes an end of the blade
            let passes = [0.0, 1.0].map(|end| ((s[0] < end) != (s[1] < end)).then(|| mix(p[0], p[1], at(end))));
            let ends = [0, 1].map(|k| within(k).then_some(p[k]));
            let off = |p: Point| (on_segment(&p, &self.line).0 - p).norm();
            passes.into_iter().chain(ends).flatten().map(off).fold(0.0, f64::max)
        };
        let of_front = self.fronts.iter().flat_map(|f| f.windows(2)).map(beside);
        let edges = self.fronts.iter().flat_map(|f| f.windows(2));
        let to_front = |p: &Point| {
            let off = |w: &[Mark]| (on_segment(p, &[w[0].place, w[1].place]).0 - p).norm();
            edges.clone().map(off).fold(f64::INFINITY, f64::min)
        };
        let of_ends = (self.line.iter())
            .filter(|p| !self.fronts.is_empty() && is_inside(mesh, tree, positions, p))
            .map(to_front);
        of_front.chain(of_ends).fold(0.0, f64::max)
    }
}

/// Whether a part of a blade is in the material, farther than `reach` (m) from any incision.
fn is_stuck<const N: usize>(
    mesh: &SimplexMesh<N>,
    tree: &BoxTree,
    positions: &[Point],
    line: &[Point; 2],
    reach: f64,
) -> bool {
    if reach == 0.0 {
        return false;
    }
    let lips = cut_faces(mesh, &cells_near(tree, line, reach), positions);
    let places = places_along(line, 0.5 * reach);
    (0..=places).any(|k| {
        let p = mix(line[0], line[1], k as f64 / places as f64);
        let off = |t: &[Point; 3]| (on_triangle(&p, t) - p).norm();
        is_inside(mesh, tree, positions, &p) && lips.iter().all(|t| off(t) > reach)
    })
}

/// Into how many parts a line is divided to look at places about so far (m) apart.
fn places_along([a, b]: &[Point; 2], apart: f64) -> usize {
    ((b - a).norm() / apart).ceil().clamp(1.0, MOST_PLACES) as usize
}

/// How far (m) what a motion sweeps inside the body lies from its end, if the blade only slides along itself: that is within
/// `reach` (m), and what goes in does so about where the blade itself meets the surface of the body, for its depth, so that no
/// bridge is left between what it cuts next and the surface. What goes out of an incision (`has_cut`) might leave one too.
fn slides<const N: usize>(
    mesh: &SimplexMesh<N>,
    tree: &BoxTree,
    positions: &[Point],
    start: &Start,
    line: [Point; 2],
    reach: f64,
    has_cut: bool,
) -> Option<f64> {
    let inside = |p: &Point| is_inside(mesh, tree, positions, p);
    let apart = (FINE * reach).max(f64::MIN_POSITIVE);
    let (mut entries, mut depth) = (Vec::new(), 0.0_f64);
    for line in [line, [start[0].1, start[start.len() - 1].1]] {
        let places = places_along(&line, apart);
        let within = (0..=places).filter(|&k| inside(&mix(line[0], line[1], k as f64 / places as f64)));
        depth = depth.max(within.count() as f64 / places as f64 * (line[1] - line[0]).norm());
        entries.extend(crossings(line, places, inside));
    }
    if depth < WAIT * reach {
        // what is as shallow may have been looked at too roughly
        return None;
    }
    let near = reach.min(FINE * depth);
    let mut width = 0.0_f64;
    for pair in start.windows(2) {
        let [(s, p), (t, q)] = [pair[0], pair[1]];
        let places = places_along(&[p, q], apart);
        for k in 0..=places {
            let g = k as f64 / places as f64;
            let way = [mix(p, q, g), mix(line[0], line[1], s + g * (t - s))];
            let rows = places_along(&way, apart).min(ROWS);
            for row in 0..=rows {
                let p = mix(way[0], way[1], row as f64 / rows as f64);
                let off = (on_segment(&p, &line).0 - p).norm();
                if off > width && inside(&p) {
                    width = off;
                }
            }
            let passes = crossings(way, rows, inside);
            let is_entry = |p: &Point| entries.iter().any(|e| (e - p).norm() <= near);
            let leaves = has_cut && !passes.is_empty() && !inside(&way[1]);
            if width > reach || leaves || !passes.iter().all(is_entry) {
                return None;
            }
        }
    }
    Some(width)
}

/// Where a line comes out of the body or goes into it, as seen from places along it.
fn crossings(line: [Point; 2], places: usize, inside: impl Fn(&Point) -> bool) -> Vec<Point> {
    let at = |k: usize| mix(line[0], line[1], k as f64 / places as f64);
    let is_in: Vec<bool> = (0..=places).map(|k| inside(&at(k))).collect();
    let changes = (1..=places).filter(|&k| is_in[k - 1] != is_in[k]);
    let halved = |k: usize| {
        let (mut a, mut b) = (at(k - 1), at(k));
        for _ in 0..HALVINGS {
            let middle = (a + b) / 2.0;
            if inside(&middle) == is_in[k] {
                b = middle;
            } else {
                a = middle;
            }
        }
        b
    };
    changes.map(halved).collect()
}

/// How far (of the local size) the end of an incision may lie from the blade that made it: what the method resolves.
fn resolution_of(options: &CutOptions) -> f64 {
    match options.method {
        // cells are gone: there is no end to go on from
        Method::Delete => 0.0,
        Method::Snap => 1.0,
        Method::Subdivide => CLOSE,
        _ => options.snap.max(CLOSE),
    }
}

/// How far (of the local size) single vertices of the end of an incision are looked for: where the edge of the cut jumps from
/// one vertex to the next they may lie farther from the blade than a cut resolves.
fn reach_of(options: &CutOptions) -> f64 {
    match options.method {
        Method::Snap => 1.5,
        _ => 3.0 * resolution_of(options),
    }
}

fn is_finite(p: &Point) -> bool {
    p.iter().all(|x| x.is_finite())
}

/// `a + g (b - a)`, exact at both ends.
fn mix(a: Point, b: Point, g: f64) -> Point {
    if g == 1.0 { b } else { a + (b - a) * g }
}

/// Triangles of the surface that straight lines from a start over one line after another sweep, within `finest` (m) of it.
fn ruled(start: &Start, way: &[[Point; 2]], finest: f64) -> Vec<[Point; 3]> {
    // the places on the way of what starts at a point
    let through = |p: Point, s: f64| {
        let over = way.iter().map(move |line| mix(line[0], line[1], s));
        std::iter::once(p).chain(over).collect::<Vec<Point>>()
    };
    let mut columns: Vec<Vec<Point>> = Vec::new();
    let mut rows = vec![1.0_f64; way.len()];
    for (i, &(s, p)) in start.iter().enumerate() {
        let column = through(p, s);
        if let Some(&(before, o)) = i.checked_sub(1).map(|k| &start[k]) {
            let beside = through(o, before);
            let mut most = 1.0_f64;
            for (k, rows) in rows.iter_mut().enumerate() {
                let corners = [beside[k], column[k], column[k + 1], beside[k + 1]];
                let strips = (out_of_plane(corners) / finest).sqrt().ceil();
                let strips = if strips > 1.0 { strips.min(FINEST) } else { 1.0 };
                *rows = rows.max(strips);
                most = most.max(strips);
            }
            for k in 1..most as usize {
                let g = k as f64 / most;
                columns.push(through(mix(o, p, g), before + g * (s - before)));
            }
        }
        columns.push(column);
    }
    let mut out = Vec::new();
    for pair in columns.windows(2) {
        for (part, &rows) in rows.iter().enumerate() {
            for k in 0..rows as usize {
                let ends = [k as f64 / rows, (k + 1) as f64 / rows];
                let [[a, d], [b, c]] = [0, 1].map(|i| ends.map(|g| mix(pair[i][part], pair[i][part + 1], g)));
                out.extend(if (c - a).norm_squared() <= (d - b).norm_squared() {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                });
            }
        }
    }
    out
}

/// How far (m) the two halves of a quadrilateral are from the bilinear surface through its corners at most.
fn out_of_plane([a, b, c, d]: [Point; 4]) -> f64 {
    let normal = (c - a).cross(&(d - b));
    let size = normal.norm();
    if size == 0.0 {
        0.0
    } else {
        (b - a).dot(&normal).abs() / (2.0 * size)
    }
}

/// Least local size (m) at the cells near a surface; infinite where there are none.
fn size_near<const N: usize>(mesh: &SimplexMesh<N>, tree: &BoxTree, surface: &[[Point; 3]]) -> f64 {
    let mut cells = BTreeSet::new();
    for t in surface {
        let reaches = TriangleBox::new(t);
        tree.visit(
            |b| reaches.overlaps(b),
            |c| {
                cells.insert(c);
            },
        );
    }
    let sizes = cells
        .iter()
        .flat_map(|&c| mesh.cell(CellId(c)))
        .map(|v| mesh.local_size(v));
    sizes.fold(f64::INFINITY, f64::min)
}

/// Largest local size (m) at the cells that a line meets.
fn size_around<const N: usize>(mesh: &SimplexMesh<N>, tree: &BoxTree, line: &[Point; 2]) -> f64 {
    let cells = cells_near(tree, line, 0.0);
    let sizes = cells.iter().flat_map(|&c| mesh.cell(c)).map(|v| mesh.local_size(v));
    sizes.fold(0.0, f64::max)
}

fn cells_near(tree: &BoxTree, line: &[Point; 2], reach: f64) -> BTreeSet<CellId> {
    let mut cells = BTreeSet::new();
    tree.visit(
        |b| meets(line, &b.grown(reach)),
        |c| {
            cells.insert(CellId(c));
        },
    );
    cells
}

/// Whether a segment meets a box.
fn meets([a, b]: &[Point; 2], aabb: &Aabb) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let along = b[k] - a[k];
        if along == 0.0 {
            if a[k] < aabb.min[k] || a[k] > aabb.max[k] {
                return false;
            }
            continue;
        }
        let (s, t) = ((aabb.min[k] - a[k]) / along, (aabb.max[k] - a[k]) / along);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    from <= to
}

/// Whether a point lies in a cell, or on one.
fn is_inside<const N: usize>(mesh: &SimplexMesh<N>, tree: &BoxTree, positions: &[Point], p: &Point) -> bool {
    let mut inside = false;
    tree.query(&Aabb::around([*p]), |c| {
        let corners = mesh.cell(CellId(c)).map(|v| positions[v.index()]);
        inside |= contains(&corners, *p);
    });
    inside
}

fn is_on_original_boundary<const N: usize>(mesh: &SimplexMesh<N>, v: VertexId) -> bool {
    mesh.boundary_facets_of_vertex(v)
        .any(|s| mesh.facet_labels(s.cell)[s.local as usize] != FacetLabel::NONE)
}

/// Corners of the cut faces of some cells.
fn lips<'a, const N: usize>(
    mesh: &'a SimplexMesh<N>,
    cells: &'a BTreeSet<CellId>,
) -> impl Iterator<Item = [VertexId; 3]> + 'a {
    let sides = cells
        .iter()
        .flat_map(|&cell| (0..N as u8).map(move |local| FacetSide { cell, local }));
    let is_lip = |s: &FacetSide| {
        let open = mesh.neighbors(s.cell)[s.local as usize].some().is_none();
        open && mesh.facet_labels(s.cell)[s.local as usize] == FacetLabel::NONE
    };
    sides.filter(is_lip).map(|s| mesh.facet_corners(s))
}

/// [`lips`] by their positions (m).
fn cut_faces<const N: usize>(mesh: &SimplexMesh<N>, cells: &BTreeSet<CellId>, positions: &[Point]) -> Vec<[Point; 3]> {
    lips(mesh, cells).map(|f| f.map(|v| positions[v.index()])).collect()
}

/// The cut faces on one side of the incision that touch a front. With them the surface to cut along does not end at the
/// front but goes on between the lips, so that no path from one side to the other slips past its border there.
fn lip_behind<const N: usize>(mesh: &SimplexMesh<N>, front: &Front) -> BTreeSet<[VertexId; 3]> {
    let mut out = BTreeSet::new();
    let sorted = |mut f: [VertexId; 3]| {
        f.sort_unstable();
        f
    };
    for (i, mark) in front.iter().enumerate() {
        let v = mark.vertex;
        let sides = mesh.boundary_facets_of_vertex(v);
        let lips = sides.filter(|s| mesh.facet_labels(s.cell)[s.local as usize] == FacetLabel::NONE);
        let mut fan: Vec<[VertexId; 3]> = lips.map(|s| mesh.facet_corners(s)).collect();
        let ahead = front.get(i + 1).map(|m| m.vertex);
        let before = i.checked_sub(1).map(|k| front[k].vertex);
        let follows = |f: &[VertexId; 3], a: VertexId, b: VertexId| (0..3).any(|k| f[k] == a && f[(k + 1) % 3] == b);
        // round the vertex from the face along the edge of the front that goes on, or else comes from before
        let first = fan.iter().position(|f| match (ahead, before) {
            (Some(w), _) => follows(f, v, w),
            (None, Some(u)) => follows(f, u, v),
            (None, None) => false,
        });
        let mut edge = ahead.or(before);
        let mut next = first;
        while let Some(k) = next {
            let facet = fan.swap_remove(k);
            out.insert(sorted(facet));
            edge = facet.into_iter().find(|w| *w != v && Some(*w) != edge);
            let past = edge == before || edge == ahead;
            next = (!past)
                .then(|| fan.iter().position(|f| edge.is_some_and(|w| f.contains(&w))))
                .flatten();
        }
    }
    out
}

/// Edges of some cells at which an incision ends: cut faces meet there, and at rest the material goes all the way round.
fn ends_of_incisions<const N: usize>(mesh: &SimplexMesh<N>, cells: &BTreeSet<CellId>) -> BTreeSet<[VertexId; 2]> {
    if N != 4 {
        return BTreeSet::new();
    }
    let of_facet = |[a, b, c]: [VertexId; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut edges: BTreeSet<[VertexId; 2]> = lips(mesh, cells).flat_map(of_facet).collect();
    edges.retain(|e| (angle_around(mesh, *e) - std::f64::consts::TAU).abs() < 1e-6);
    edges
}

/// Sum of the angles at rest (radians) of the tetrahedra around an edge.
fn angle_around<const N: usize>(mesh: &SimplexMesh<N>, [a, b]: [VertexId; 2]) -> f64 {
    let from = mesh.rest_position(a);
    let axis = (mesh.rest_position(b) - from).normalize();
    let angle = |c: CellId| {
        let mut arms = (mesh.cell(c).into_iter())
            .filter(|v| *v != a && *v != b)
            .map(|v| mesh.rest_position(v) - from)
            .map(|p| p - axis * axis.dot(&p));
        match (arms.next(), arms.next()) {
            (Some(p), Some(q)) => p.cross(&q).norm().atan2(p.dot(&q)),
            _ => 0.0,
        }
    };
    mesh.cells_of_edge(a, b).map(angle).sum()
}

type Graph = BTreeMap<VertexId, Vec<VertexId>>;

fn connected(joined: &Graph) -> Vec<Vec<VertexId>> {
    let mut seen = BTreeSet::new();
    let mut parts = Vec::new();
    for &v in joined.keys() {
        if !seen.insert(v) {
            continue;
        }
        let (mut part, mut stack) = (vec![v], vec![v]);
        while let Some(v) = stack.pop() {
            for &w in joined[&v].iter().filter(|w| seen.insert(**w)) {
                part.push(w);
                stack.push(w);
            }
        }
        parts.push(part);
    }
    parts
}

/// The end of a front that is farthest along the blade (first if `sign` is 1, last if -1), less how far it is from it; of those
/// the nearest. `place` says where along the blade a vertex is (m), and how far from it (m). Where the incision is so narrow that
/// its other border is as near as this one, the end of that lies farther off.
fn outermost(
    part: &[VertexId],
    is_end: impl Fn(&VertexId) -> bool,
    sign: f64,
    place: impl Fn(VertexId) -> (f64, f64),
) -> VertexId {
    let order = |a: &VertexId, b: &VertexId| {
        let ((s, p), (t, q)) = (place(*a), place(*b));
        (sign * s + p)
            .total_cmp(&(sign * t + q))
            .then(p.total_cmp(&q))
            .then(a.cmp(b))
    };
    let ends = part.iter().copied().filter(is_end).min_by(order);
    ends.or_else(|| part.iter().copied().min_by(order)).unwrap_or(part[0])
}

/// The way through a connected graph that costs least.
fn path_between(
    [first, last]: [VertexId; 2],
    joined: &Graph,
    cost: impl Fn(VertexId, VertexId) -> f64,
) -> Vec<VertexId> {
    let mut way: BTreeMap<VertexId, (f64, VertexId)> = BTreeMap::from([(first, (0.0, first))]);
    let mut open = BTreeSet::from([first]);
    while let Some(v) = open.pop_first() {
        let here = way[&v].0;
        for &w in &joined[&v] {
            let there = here + cost(v, w);
            if way.get(&w).is_none_or(|(known, _)| there < *known) {
                way.insert(w, (there, v));
                open.insert(w);
            }
        }
    }
    let mut path = vec![last];
    let mut v = last;
    while v != first {
        v = way[&v].1;
        path.push(v);
    }
    path.reverse();
    path
}

/// The fronts that stand for most of the blade, and of others what is at the blade where none of these is; ascending along it.
fn apart(fronts: Vec<Front>, stand: impl Fn(&Front) -> f64, is_at: impl Fn(&Mark) -> bool) -> Vec<Front> {
    let ends = |f: &Front| (f[0].s, f[f.len() - 1].s);
    let mut fronts: Vec<(f64, Front)> = fronts.into_iter().map(|f| (stand(&f), f)).collect();
    fronts.sort_by(|(s, a), (t, b)| t.total_cmp(s).then(a[0].vertex.cmp(&b[0].vertex)));
    let mut kept: Vec<Front> = Vec::new();
    for (_, front) in fronts {
        let (from, to) = ends(&front);
        if kept.iter().all(|k| ends(k).1 <= from || to <= ends(k).0) {
            kept.push(front);
            continue;
        }
        let is_free = |m: &Mark| is_at(m) && kept.iter().all(|k| m.s < ends(k).0 || m.s > ends(k).1);
        // with the vertices beside it, that nothing stays closed between the two
        let is_wanted = |k: &usize| {
            let around = k.saturating_sub(1)..(k + 2).min(front.len());
            is_at(&front[*k]) && front[around].iter().any(is_free)
        };
        let wanted: Vec<usize> = (0..front.len()).filter(is_wanted).collect();
        let runs = wanted.chunk_by(|i, k| i + 1 == *k);
        let runs: Vec<Front> = runs.map(|run| run.iter().map(|k| front[*k]).collect()).collect();
        kept.extend(runs);
    }
    kept.sort_by(|a, b| ends(a).0.total_cmp(&ends(b).0));
    kept
}
