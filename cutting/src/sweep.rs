//! The surface that a blade has covered; in the plane, the line.

use std::collections::{BTreeMap, HashMap};

use kerfem_mesh::nearest::{on_segment, on_triangle};
use kerfem_mesh::{Aabb, BoxTree, Point, SimplexMesh, predicates::orient3d};

use crate::CutError;
use crate::region::TriangleBox;

/// Sine of the angle between a line and a plane below which the place where they meet is ill-determined: the line counts
/// as lying in the plane.
const GRAZING: f64 = 1e-7;

/// Turn of a planar line (radians) above which the cut goes through the very corner; through smaller ones it goes between
/// the edges of the mesh that it crosses, as a surface does through its creases.
const SHARP: f64 = std::f64::consts::FRAC_PI_6;

/// Lengths of this fraction of the longest border segment, and angles this small, are rounding.
const SEAM: f64 = 1e-9;

/// A triangulated surface, open or closed, in any number of pieces.
///
/// Points that coincide are welded; repeated triangles and those of no area are left out. Pieces are connected through
/// shared edges.
///
/// For planar meshes a sweep is made of line segments ([`Sweep::from_segments`]), connected through shared points. Each
/// stands for a ribbon perpendicular to the plane, so that lines and surfaces cut by the same exact predicates.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    pieces: Vec<Piece>,
    planar: bool,
    /// Whether it goes on from the end of an incision.
    goes_on: bool,
}

/// A connected part of a sweep: what one pass of cutting uses.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    triangles: Vec<[Point; 3]>,
    tree: BoxTree,
    border: Vec<[Point; 2]>,
    border_tree: BoxTree,
    corners: Vec<Point>,
}

/// A point of a sweep seen from somewhere else.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) point: Point,
    pub(crate) distance: f64,
}

impl Sweep {
    /// A sweep from points (m, in the frame the cut is made in) and triangles (indices from zero), and warnings about what
    /// was left out.
    ///
    /// # Errors
    /// [`CutError::BadSweep`] for a coordinate that is not finite or an index out of range.
    pub fn new(points: Vec<Point>, triangles: Vec<[usize; 3]>) -> Result<(Sweep, Vec<String>), CutError> {
        Self::build(points, triangles, |_, triangles| triangles == 1)
    }

    /// Marks what goes on from the end of an incision: its faces meet those of the incision at angles, within `d`.
    pub(crate) fn going_on(self) -> Sweep {
        Sweep { goes_on: true, ..self }
    }

    /// Sides of the cube, in `d`, that a splinter is smaller than which must not come loose.
    pub(crate) fn splinter(&self) -> f64 {
        if self.goes_on { 2.0 } else { 1.0 }
    }

    /// [`Self::new`] with the edges that are to be border chosen by their points and how many triangles they belong to.
    fn build(
        points: Vec<Point>,
        triangles: Vec<[usize; 3]>,
        is_border: impl Fn([Point; 2], usize) -> bool,
    ) -> Result<(Sweep, Vec<String>), CutError> {
        let bad = |reason: String| CutError::BadSweep { reason };
        if let Some((i, p)) = points
            .iter()
            .enumerate()
            .find(|(_, p)| !p.iter().all(|c| c.is_finite()))
        {
            return Err(bad(format!("point {i} is not finite: ({}, {}, {})", p.x, p.y, p.z)));
        }
        if let Some((t, i)) = triangles
            .iter()
            .enumerate()
            .find_map(|(t, c)| c.iter().find(|&&i| i >= points.len()).map(|i| (t, i)))
        {
            return Err(bad(format!(
                "triangle {t} names point {i}, but there are {} points",
                points.len()
            )));
        }
        let mut first: HashMap<[u64; 3], usize> = HashMap::new();
        // adding zero turns -0 into +0, so that both weld
        let weld: Vec<usize> = points
            .iter()
            .enumerate()
            .map(|(i, p)| {
                *first
                    .entry([p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits))
                    .or_insert(i)
            })
            .collect();
        let mut kept: BTreeMap<[usize; 3], [usize; 3]> = BTreeMap::new();
        let (mut flat, mut repeated) = (0, 0);
        for t in &triangles {
            let t = t.map(|i| weld[i]);
            let mut key = t;
            key.sort_unstable();
            if has_no_area(t.map(|i| points[i])) {
                flat += 1;
            } else if kept.insert(key, t).is_some() {
                repeated += 1;
            }
        }
        let mut warnings = Vec::new();
        if flat > 0 {
            warnings.push(format!("{flat} triangles of the sweep have no area and were ignored"));
        }
        if repeated > 0 {
            warnings.push(format!("{repeated} repeated triangles of the sweep were ignored"));
        }
        let pieces = connected(kept.into_values().collect())
            .into_iter()
            .map(|triangles| Piece::new(&points, &triangles, &is_border))
            .collect();
        let sweep = Sweep {
            pieces,
            ..Sweep::default()
        };
        Ok((sweep, warnings))
    }

    /// A sweep for planar meshes from points (m, `z = 0`) and line segments between them (indices from zero), and warnings
    /// about what was left out: segments of no length, and repeated ones.
    ///
    /// # Errors
    /// [`CutError::BadSweep`] for a coordinate that is not finite or not in the plane, or an index out of range.
    pub fn from_segments(points: Vec<Point>, segments: Vec<[usize; 2]>) -> Result<(Sweep, Vec<String>), CutError> {
        let bad = |reason: String| CutError::BadSweep { reason };
        let in_plane = |p: &Point| p.x.is_finite() && p.y.is_finite() && p.z == 0.0;
        if let Some((i, p)) = points.iter().enumerate().find(|(_, p)| !in_plane(p)) {
            let [x, y, z] = [p.x, p.y, p.z];
            return Err(bad(format!(
                "point {i} is ({x}, {y}, {z}); a planar sweep lies in z = 0"
            )));
        }
        if let Some(s) = segments.iter().position(|s| s.iter().any(|&i| i >= points.len())) {
            let count = points.len();
            return Err(bad(format!(
                "segment {s} names a point that does not exist; there are {count}"
            )));
        }
        // adding zero turns -0 into +0, so that both are one place
        let place = |i: usize| [points[i].x + 0.0, points[i].y + 0.0].map(f64::to_bits);
        let mut kept = BTreeMap::new();
        let (mut short, mut repeated) = (0, 0);
        for &[a, b] in &segments {
            let key = [place(a).min(place(b)), place(a).max(place(b))];
            if key[0] == key[1] {
                short += 1;
            } else if kept.insert(key, [a, b]).is_some() {
                repeated += 1;
            }
        }
        let mut directions: BTreeMap<[u64; 2], Vec<Point>> = BTreeMap::new();
        for &[a, b] in kept.values() {
            let along = (points[b] - points[a]).normalize();
            directions.entry(place(a)).or_default().push(along);
            directions.entry(place(b)).or_default().push(-along);
        }
        // a power of two, so that heights round nothing
        let size = points.iter().map(|p| p.amax()).fold(f64::MIN_POSITIVE, f64::max);
        let height = size.log2().ceil().exp2() * 4.0;
        let ends: Vec<usize> = kept.values().flatten().copied().collect();
        let below = ends.iter().map(|&i| points[i] - Point::z() * height);
        let above = ends.iter().map(|&i| points[i] + Point::z() * height);
        let ribbons = (0..kept.len()).flat_map(|k| {
            let [a, b] = [2 * k, 2 * k + 1];
            let [over_a, over_b] = [a, b].map(|i| i + ends.len());
            [[a, b, over_b], [a, over_b, over_a]]
        });
        // ends, branches and sharp corners: a vertex must come to lie there, the line does not pass straight on
        let is_border = |[p, q]: [Point; 2], _| {
            p.xy() == q.xy()
                && match directions[&[p.x + 0.0, p.y + 0.0].map(f64::to_bits)].as_slice() {
                    [one, other] => one.dot(other) > -SHARP.cos(),
                    _ => true,
                }
        };
        let (mut sweep, mut warnings) = Sweep::build(below.chain(above).collect(), ribbons.collect(), is_border)?;
        sweep.planar = true;
        for (count, what) in [
            (short, "segments of the sweep have no length"),
            (repeated, "repeated segments of the sweep"),
        ] {
            if count > 0 {
                let were = if what.ends_with("length") { "and were" } else { "were" };
                warnings.push(format!("{count} {what} {were} ignored"));
            }
        }
        Ok((sweep, warnings))
    }

    /// Refuses a mesh of the other kind.
    pub(crate) fn fits<const N: usize>(&self, mesh: &SimplexMesh<N>) -> Result<(), CutError> {
        match (N, self.planar) {
            (3, _) if !mesh.is_planar() => Err(CutError::WrongKind(
                "a surface in space cannot be cut; accepted: tetrahedra, and triangles in the plane z = 0",
            )),
            (3, false) if !self.is_empty() => Err(CutError::WrongKind(
                "triangles in the plane cannot be cut by a surface; accepted: a sweep of line segments",
            )),
            (4, true) if !self.is_empty() => Err(CutError::WrongKind(
                "tetrahedra cannot be cut by line segments; accepted: a sweep of triangles",
            )),
            _ => Ok(()),
        }
    }

    /// Whether nothing is left to cut with.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The box around the sweep (m); around nothing for an empty one.
    pub fn bounds(&self) -> Aabb {
        let corners = self.pieces.iter().flat_map(|p| p.triangles.iter().flatten());
        // the height of ribbons means nothing
        let flat = |p: &Point| if self.planar { Point::new(p.x, p.y, 0.0) } else { *p };
        Aabb::around(corners.map(flat))
    }

    /// How many pieces it is made of.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// Distance from a point to the sweep (m); infinite for an empty sweep.
    pub fn distance(&self, p: &Point) -> f64 {
        self.pieces
            .iter()
            .map(|s| s.nearest(p).distance)
            .fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }
}

fn has_no_area(p: [Point; 3]) -> bool {
    let (a, b) = (p[1] - p[0], p[2] - p[0]);
    a.cross(&b).norm() <= 1e-14 * a.norm_squared().max(b.norm_squared())
}

fn edges(t: [usize; 3]) -> [[usize; 2]; 3] {
    [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)])
}

fn connected(triangles: Vec<[usize; 3]>) -> Vec<Vec<[usize; 3]>> {
    let mut of_edge: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (i, t) in triangles.iter().enumerate() {
        for e in edges(*t) {
            of_edge.entry(e).or_default().push(i);
        }
    }
    let mut seen = vec![false; triangles.len()];
    let mut pieces = Vec::new();
    for start in 0..triangles.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let (mut piece, mut stack) = (Vec::new(), vec![start]);
        while let Some(i) = stack.pop() {
            piece.push(triangles[i]);
            for e in edges(triangles[i]) {
                for &j in &of_edge[&e] {
                    if !std::mem::replace(&mut seen[j], true) {
                        stack.push(j);
                    }
                }
            }
        }
        pieces.push(piece);
    }
    pieces
}

/// Ends of border segments, other than those where two of them pass on without a sharp turn. A seam, where the border runs
/// back along itself, ends nothing.
fn corners(border: &[[Point; 2]]) -> Vec<Point> {
    let longest = border.iter().map(|[a, b]| (b - a).norm()).fold(0.0, f64::max);
    let mut directions: HashMap<[u64; 3], (Point, Vec<Point>)> = HashMap::new();
    for &[a, b] in border {
        let length = (b - a).norm();
        let along = if length > SEAM * longest {
            (b - a) / length
        } else {
            Point::zeros()
        };
        for (end, away) in [(a, along), (b, -along)] {
            let key = [end.x + 0.0, end.y + 0.0, end.z + 0.0].map(f64::to_bits);
            directions.entry(key).or_insert_with(|| (end, Vec::new())).1.push(away);
        }
    }
    let sharp = |away: &[Point]| match away {
        [one, other] => {
            one.dot(other) > -SHARP.cos()
                && one.dot(other) < 1.0 - SEAM
                && [one, other].iter().all(|d| **d != Point::zeros())
        }
        _ => true,
    };
    let ends = directions.into_values().filter(|(_, away)| sharp(away));
    let mut out: Vec<Point> = ends.map(|(end, _)| end).collect();
    out.sort_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)).then(p.z.total_cmp(&q.z)));
    out
}

impl Piece {
    fn new(points: &[Point], triangles: &[[usize; 3]], is_border: impl Fn([Point; 2], usize) -> bool) -> Piece {
        let mut uses: BTreeMap<[usize; 2], usize> = BTreeMap::new();
        for e in triangles.iter().flat_map(|t| edges(*t)) {
            *uses.entry(e).or_default() += 1;
        }
        let border: Vec<[Point; 2]> = uses
            .into_iter()
            .map(|(e, n)| (e.map(|i| points[i]), n))
            .filter(|(e, n)| is_border(*e, *n))
            .map(|(e, _)| e)
            .collect();
        let corners = corners(&border);
        let triangles: Vec<[Point; 3]> = triangles.iter().map(|t| t.map(|i| points[i])).collect();
        let numbered = |k: usize, b: Aabb| (k as u32, b);
        Piece {
            tree: BoxTree::build(triangles.iter().enumerate().map(|(k, t)| numbered(k, Aabb::around(*t)))),
            border_tree: BoxTree::build(border.iter().enumerate().map(|(k, e)| numbered(k, Aabb::around(*e)))),
            triangles,
            border,
            corners,
        }
    }

    pub(crate) fn triangles(&self) -> &[[Point; 3]] {
        &self.triangles
    }

    /// Where the border turns sharply, ends or branches, in the order of coordinates.
    pub(crate) fn corners(&self) -> &[Point] {
        &self.corners
    }

    /// Whether a triangle may meet the box (its own box and its plane are tried).
    pub(crate) fn reaches(&self, b: &Aabb) -> bool {
        let mut any = false;
        self.tree
            .query(b, |k| any |= TriangleBox::new(&self.triangles[k as usize]).overlaps(b));
        any
    }

    /// The point of the surface nearest to `p`.
    pub(crate) fn nearest(&self, p: &Point) -> Nearest {
        let at = |k: u32| on_triangle(p, &self.triangles[k as usize]);
        nearest(p, &self.tree, at)
    }

    /// The point of the border nearest to `p`, if the surface has a border.
    pub(crate) fn nearest_on_border(&self, p: &Point) -> Option<Nearest> {
        let at = |k: u32| on_segment(p, &self.border[k as usize]).0;
        (!self.border.is_empty()).then(|| nearest(p, &self.border_tree, at))
    }

    /// Parameters `t` in (0, 1), ascending, where the segment `p + t (q - p)` properly crosses the surface. Ends on a
    /// triangle's plane do not count, nor does a segment that lies in it; hits on an edge shared by triangles count once.
    pub(crate) fn hits(&self, p: Point, q: Point) -> Vec<f64> {
        let mut out = Vec::new();
        self.tree.query(&Aabb::around([p, q]), |k| {
            let [a, b, c] = self.triangles[k as usize];
            let (sp, sq) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
            let flattest = GRAZING * (b - a).cross(&(c - a)).norm() * (q - p).norm();
            if ((sp > 0.0 && sq < 0.0) || (sp < 0.0 && sq > 0.0)) && (sp - sq).abs() > flattest {
                let s = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
                if s.iter().all(|&x| x >= 0.0) || s.iter().all(|&x| x <= 0.0) {
                    out.push(sp / (sp - sq));
                }
            }
        });
        out.retain(|t| *t > 0.0 && *t < 1.0);
        out.sort_by(f64::total_cmp);
        out.dedup_by(|b, a| *b - *a < 1e-9);
        out
    }

    /// Whether the path from `p` over `via` to `q` crosses the surface an odd number of times, with points on a triangle's
    /// plane taken to lie on its positive side. `None` if a leg meets the edge of a triangle: choose other points.
    pub(crate) fn separates(&self, p: Point, via: Point, q: Point) -> Option<bool> {
        Some(self.crosses_oddly(p, via)? != self.crosses_oddly(via, q)?)
    }

    fn crosses_oddly(&self, p: Point, q: Point) -> Option<bool> {
        let (mut odd, mut degenerate) = (false, false);
        self.tree.query(&Aabb::around([p, q]), |k| {
            let [a, b, c] = self.triangles[k as usize];
            if (orient3d(a, b, c, p) >= 0.0) == (orient3d(a, b, c, q) >= 0.0) {
                return;
            }
            let s = [orient3d(p, q, a, b), orient3d(p, q, b, c), orient3d(p, q, c, a)];
            if s.iter().any(|&x| x > 0.0) && s.iter().any(|&x| x < 0.0) {
                return;
            }
            if s.contains(&0.0) {
                degenerate = true;
            } else {
                odd = !odd;
            }
        });
        (!degenerate).then_some(odd)
    }

    /// Points where the border pierces the triangle `abc`, as barycentric weights. A border segment that lies in the plane
    /// of the triangle, or so nearly that the point would be ill-determined, does not pierce it.
    pub(crate) fn border_piercings(&self, [a, b, c]: [Point; 3]) -> Vec<[f64; 3]> {
        let mut out = Vec::new();
        self.border_tree.query(&Aabb::around([a, b, c]), |k| {
            let [p, q] = self.border[k as usize];
            let (sp, sq) = (orient3d(a, b, c, p), orient3d(a, b, c, q));
            let flattest = GRAZING * (b - a).cross(&(c - a)).norm() * (q - p).norm();
            if (sp >= 0.0) == (sq >= 0.0) || (sp - sq).abs() <= flattest {
                return;
            }
            let s = [orient3d(p, q, b, c), orient3d(p, q, c, a), orient3d(p, q, a, b)];
            let sum = s[0] + s[1] + s[2];
            if (s.iter().all(|&x| x >= 0.0) || s.iter().all(|&x| x <= 0.0)) && sum != 0.0 {
                out.push(s.map(|x| x / sum));
            }
        });
        out
    }
}

fn nearest(p: &Point, tree: &BoxTree, at: impl Fn(u32) -> Point) -> Nearest {
    match tree.nearest(p, |k| (at(k) - p).norm_squared()) {
        Some((k, d)) => Nearest {
            point: at(k),
            distance: d.sqrt(),
        },
        None => Nearest {
            point: *p,
            distance: f64::INFINITY,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Sweep {
        let p = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 1.0)];
        Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0
    }

    #[test]
    fn diagonal_of_a_square_is_hit_once() {
        let sweep = square();
        let hits = sweep.pieces()[0].hits(Point::new(0.5, 0.5, -1.0), Point::new(0.5, 0.5, 3.0));
        assert_eq!(hits, vec![0.25]);
    }

    #[test]
    fn border_pierces_a_facet_where_it_should() {
        let sweep = square();
        let facet = [
            Point::new(0.3, -1.0, -1.0),
            Point::new(0.3, 1.0, -1.0),
            Point::new(0.3, 0.0, 1.0),
        ];
        let w = sweep.pieces()[0].border_piercings(facet);
        assert_eq!(w.len(), 1);
        let at = facet[0] * w[0][0] + facet[1] * w[0][1] + facet[2] * w[0][2];
        assert!((at - Point::new(0.3, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn pieces_are_connected_through_edges_and_bad_triangles_are_reported() {
        let p = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![
            p(0.0, 0.0),
            p(1.0, 0.0),
            p(1.0, 1.0),
            p(0.0, 1.0),
            p(1.0, 0.0),
            p(2.0, 0.0),
            p(3.0, 1.0),
        ];
        let (sweep, warnings) =
            Sweep::new(points, vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [0, 4, 2], [0, 1, 0]]).unwrap();
        assert_eq!(sweep.pieces().len(), 2);
        assert_eq!(warnings.len(), 2);
        assert!(Sweep::new(vec![p(f64::NAN, 0.0)], vec![]).is_err());
    }
}
