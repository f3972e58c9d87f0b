//! What the steps of a cut share: the edit, positions in the cutting frame, and the cells near the sweep.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use crate::Borders;
use kerfem_mesh::{CellId, Edit, FacetKey, FacetLabel, Mark, Point, SimplexMesh, VertexId, Weights, quality};

/// Fraction of the local size within which two places are one.
pub(crate) const TINY: f64 = 1e-9;

/// A mesh inside a cut.
pub(crate) struct Workspace<'a, const N: usize> {
    pub(crate) edit: Edit<'a, N>,
    /// Cells near the current piece of the sweep, and what became of them.
    pub(crate) region: BTreeSet<CellId>,
    /// Vertices that the cut goes through.
    pub(crate) on: BTreeSet<VertexId>,
    /// Those of them that lie on the sweep; the others are within `d` of it and could not be moved there.
    pub(crate) exact: BTreeSet<VertexId>,
    /// The sheet: facets that the cut is about to open.
    pub(crate) sheet: HashSet<FacetKey>,
    /// So many cells may the region come to have.
    pub(crate) most_cells: usize,
    /// Cells that reach beyond the one they inherit from.
    grown: BTreeSet<CellId>,
    positions: &'a [Point],
    borders: Borders<'a>,
    changed: HashMap<VertexId, Point>,
    descendants: HashMap<CellId, Vec<CellId>>,
    journal: Vec<Step>,
}

/// What to put back to undo a step.
enum Step {
    Changed(VertexId, Option<Point>),
    Descendants(CellId, Option<Vec<CellId>>),
    /// Put into the region, or taken out.
    Region(CellId, bool),
    Grown(CellId),
    /// Put into the sheet, or taken out.
    Sheet(FacetKey, bool),
}

/// A state to return to.
#[derive(Clone, Copy)]
pub(crate) struct Savepoint {
    mark: Mark,
    steps: usize,
}

impl<'a, const N: usize> Workspace<'a, N> {
    /// Begins a cut; `positions` in the cutting frame, one for each vertex slot.
    pub(crate) fn new(mesh: &'a mut SimplexMesh<N>, positions: &'a [Point], borders: Borders<'a>) -> Self {
        Workspace {
            edit: Edit::new(mesh),
            region: BTreeSet::new(),
            on: BTreeSet::new(),
            exact: BTreeSet::new(),
            sheet: HashSet::new(),
            most_cells: usize::MAX,
            grown: BTreeSet::new(),
            positions,
            borders,
            changed: HashMap::new(),
            descendants: HashMap::new(),
            journal: Vec::new(),
        }
    }

    /// Whether the region has more cells than it may have.
    pub(crate) fn crumbles(&self) -> bool {
        self.region.len() > self.most_cells
    }

    pub(crate) fn mesh(&self) -> &SimplexMesh<N> {
        self.edit.mesh()
    }

    /// Position in the cutting frame.
    pub(crate) fn position(&self, v: VertexId) -> Point {
        self.changed
            .get(&v)
            .copied()
            .unwrap_or_else(|| self.positions[v.index()])
    }

    pub(crate) fn cell_positions(&self, c: CellId) -> [Point; N] {
        self.mesh().cell(c).map(|v| self.position(v))
    }

    /// Cutting-frame positions of vertices that are new or moved, ascending.
    pub(crate) fn changed_positions(&self) -> Vec<(VertexId, Point)> {
        let mut out: Vec<_> = self
            .changed
            .iter()
            .map(|(&v, &p)| (v, p))
            .filter(|(v, _)| self.mesh().has_vertex(*v))
            .collect();
        out.sort_by_key(|(v, _)| *v);
        out
    }

    pub(crate) fn sorted_corners(&self, c: CellId) -> [VertexId; N] {
        let mut corners = self.mesh().cell(c);
        corners.sort_unstable();
        corners
    }

    /// How far the cut may be from a vertex that takes it: the fraction `snap` of [`SimplexMesh::local_size`], the mean edge
    /// before any cut, so that cutting the same place again finds the same vertices near.
    pub(crate) fn reach(&self, v: VertexId, snap: f64) -> f64 {
        snap.max(TINY) * self.mesh().local_size(v)
    }

    /// Lets the cut go through a vertex.
    pub(crate) fn take(&mut self, v: VertexId, exact: bool) {
        self.on.insert(v);
        if exact {
            self.exact.insert(v);
        }
    }

    /// Cells that now stand where a cell of the mesh before the cut was.
    pub(crate) fn current(&self, c: CellId) -> Vec<CellId> {
        match self.descendants.get(&c) {
            None => vec![c],
            Some(children) => children.iter().flat_map(|&d| self.current(d)).collect(),
        }
    }

    /// Edges of the cells near the sweep, each with its smaller vertex first, ascending.
    pub(crate) fn region_edges(&self) -> Vec<[VertexId; 2]> {
        let mut out = BTreeSet::new();
        for &c in &self.region {
            let v = self.mesh().cell(c);
            for [i, j] in quality::edges::<N>() {
                out.insert([v[*i].min(v[*j]), v[*i].max(v[*j])]);
            }
        }
        out.into_iter().collect()
    }

    /// Vertices of the cells near the sweep, ascending.
    pub(crate) fn region_vertices(&self) -> Vec<VertexId> {
        self.region
            .iter()
            .flat_map(|&c| self.mesh().cell(c))
            .collect::<BTreeSet<_>>()
            .into_iter()
            .collect()
    }

    /// Replaces a cell by others that fill the same space.
    pub(crate) fn replace(&mut self, c: CellId, children: &[([VertexId; N], [FacetLabel; N])]) {
        self.take_out(c);
        self.put_in(c, children);
    }

    /// First half of a replacement; without the second the cell is gone.
    pub(crate) fn take_out(&mut self, c: CellId) {
        self.edit.remove_cell(c);
        self.set_descendants(c, Vec::new());
    }

    /// Second half of a replacement: cells that inherit from `c` and are near the sweep if it was.
    pub(crate) fn put_in(&mut self, c: CellId, children: &[([VertexId; N], [FacetLabel; N])]) {
        let ids: Vec<CellId> = children
            .iter()
            .map(|(corners, labels)| self.edit.add_cell(*corners, c, *labels))
            .collect();
        if self.leave_region(c) {
            ids.iter().for_each(|id| self.enter_region(*id));
        }
        self.set_descendants(c, ids);
    }

    fn set_descendants(&mut self, c: CellId, ids: Vec<CellId>) {
        let old = self.descendants.insert(c, ids);
        self.journal.push(Step::Descendants(c, old));
    }

    fn set_position(&mut self, v: VertexId, position: Point) {
        let old = self.changed.insert(v, position);
        self.journal.push(Step::Changed(v, old));
    }

    /// Counts a cell among those near the sweep.
    pub(crate) fn enter_region(&mut self, c: CellId) {
        if self.region.insert(c) {
            self.journal.push(Step::Region(c, true));
        }
    }

    /// Counts a cell no longer among those near the sweep; whether it was.
    pub(crate) fn leave_region(&mut self, c: CellId) -> bool {
        let was = self.region.remove(&c);
        if was {
            self.journal.push(Step::Region(c, false));
        }
        was
    }

    /// Exchanges facets of the sheet for others.
    pub(crate) fn exchange_sheet(&mut self, old: &[FacetKey], new: &[FacetKey]) {
        for facet in old {
            if self.sheet.remove(facet) {
                self.journal.push(Step::Sheet(*facet, false));
            }
        }
        for facet in new {
            if self.sheet.insert(*facet) {
                self.journal.push(Step::Sheet(*facet, true));
            }
        }
    }

    /// Replaces cells by others that fill the same space together. Boundary facets keep their labels; where a vertex was
    /// `renamed`, those of its facets go to the other one, and new boundary facets have theirs in `labels`. Each new cell
    /// inherits from the old one that holds its centre.
    pub(crate) fn retile(
        &mut self,
        old: &[CellId],
        new: &[[VertexId; N]],
        renamed: Option<(VertexId, VertexId)>,
        labels: &[(FacetKey, FacetLabel)],
    ) -> Vec<CellId> {
        let name = |v: VertexId| renamed.filter(|(from, _)| *from == v).map_or(v, |(_, to)| to);
        let mut labels: HashMap<FacetKey, FacetLabel> = labels.iter().copied().collect();
        for &cell in old {
            for (k, &label) in self.mesh().facet_labels(cell).iter().enumerate() {
                if label != FacetLabel::NONE {
                    let corners = self.mesh().cell(cell).map(name);
                    labels.insert(facet_of(&corners, k), label);
                }
            }
        }
        let mut children: Vec<Vec<_>> = vec![Vec::new(); old.len()];
        for corners in new {
            let own = std::array::from_fn(|k| {
                let label = labels.get(&facet_of(corners, k));
                label.copied().unwrap_or(FacetLabel::NONE)
            });
            let center = corners.map(|v| self.mesh().rest_position(v)).iter().sum::<Point>() / N as f64;
            let depth = |c: CellId| {
                let weights = barycentric(&self.mesh().cell_rest_positions(c), center);
                weights.iter().copied().fold(f64::INFINITY, f64::min)
            };
            let parent = (0..old.len()).max_by(|&i, &j| depth(old[i]).total_cmp(&depth(old[j])).then(j.cmp(&i)));
            children[parent.unwrap_or(0)].push((*corners, own));
        }
        for &cell in old {
            self.take_out(cell);
        }
        let mut made = Vec::new();
        for (&cell, children) in old.iter().zip(&children) {
            self.put_in(cell, children);
            made.extend(self.descendants[&cell].iter().copied());
        }
        for &c in &made {
            self.grown.insert(c);
            self.journal.push(Step::Grown(c));
        }
        made
    }

    /// A new vertex at an affine combination of present ones (weights add up to one, the first takes the rest).
    pub(crate) fn add_vertex(&mut self, parents: &[(VertexId, f64)]) -> VertexId {
        let rest = combine(parents, |v| self.mesh().rest_position(v));
        let position = combine(parents, |v| self.position(v));
        let v = self.edit.add_vertex(rest, &weights(parents));
        self.set_position(v, position);
        v
    }

    /// Moves a vertex to a combination of present ones, without looking whether its cells stay good.
    pub(crate) fn put_vertex(&mut self, v: VertexId, position: Point, parents: &[(VertexId, f64)]) {
        let rest = combine(parents, |w| self.mesh().rest_position(w));
        self.edit.move_vertex(v, rest, &weights(parents));
        self.set_position(v, position);
    }

    /// Vertices of the mesh before the cut that lie elsewhere now, ascending.
    pub(crate) fn moved_vertices(&self) -> Vec<VertexId> {
        let old = self.changed.keys().copied();
        let mut moved: Vec<VertexId> = old
            .filter(|v| v.index() < self.positions.len() && self.mesh().has_vertex(*v))
            .collect();
        moved.sort_unstable();
        moved
    }

    /// Whether a vertex may move without shifting a border between materials, or between different conditions on one plane
    /// of the boundary.
    pub(crate) fn may_move(&self, v: VertexId) -> bool {
        let group = |c: &CellId| (self.borders.cell_group)(self.edit.ancestor(*c));
        let mut groups = self.mesh().cells_of_vertex(v).iter().map(group);
        let first = groups.next();
        if groups.any(|g| Some(g) != first) {
            return false;
        }
        let facets: Vec<(u64, Point)> = self
            .mesh()
            .boundary_facets_of_vertex(v)
            .map(|side| {
                let label = self.mesh().facet_labels(side.cell)[side.local as usize];
                let original = label.some().map(|k| self.mesh().original_facets()[k]);
                let p = self.mesh().facet_corners(side).map(|u| self.mesh().rest_position(u));
                let normal = quality::facet_normal::<N>(&p).normalize();
                (
                    original.map_or(0, |corners| (self.borders.facet_group)(label, corners)),
                    normal,
                )
            })
            .collect();
        let differ = |a: &(u64, Point), b: &(u64, Point)| a.0 != b.0 && a.1.dot(&b.1) > 1.0 - 1e-9;
        !facets
            .iter()
            .enumerate()
            .any(|(i, a)| facets[..i].iter().any(|b| differ(a, b)))
    }

    /// Whether a vertex of the mesh before the cut has conditions of its own.
    pub(crate) fn is_held(&self, v: VertexId) -> bool {
        v.index() < self.positions.len() && (self.borders.vertex_group)(v) != 0
    }

    /// Whether cells are of one material.
    pub(crate) fn are_of_one_group(&self, cells: &[CellId]) -> bool {
        let group = |c: &CellId| (self.borders.cell_group)(self.edit.ancestor(*c));
        cells.windows(2).all(|w| group(&w[0]) == group(&w[1]))
    }

    /// Cells around new and moved vertices, and those put together anew: they may have outgrown the boxes of before the cut.
    pub(crate) fn cells_of_changed(&self) -> BTreeSet<CellId> {
        let live = self.changed.keys().filter(|v| self.mesh().has_vertex(**v));
        let around = live.flat_map(|&v| self.mesh().cells_of_vertex(v).iter().copied());
        let grown = self.grown.iter().copied().filter(|c| self.mesh().has_cell(*c));
        around.chain(grown).collect()
    }

    /// Radius ratio of a cell that there might be, at rest or in the cutting frame, whichever is worse; with one vertex
    /// taken to lie elsewhere, if that is given.
    pub(crate) fn quality_with(&self, corners: &[VertexId; N], moved: Option<(VertexId, &Place)>) -> f64 {
        let place = |v: VertexId| match moved {
            Some((w, place)) if w == v => (place.rest, place.now),
            _ => (self.mesh().rest_position(v), self.position(v)),
        };
        // in an order of their own, so that rounding does not depend on which cell an operation was seen from
        let places = in_even_order(*corners).map(place);
        let rest = quality::radius_ratio(&places.map(|p| p.0));
        if places.iter().all(|(rest, now)| rest == now) {
            return rest;
        }
        rest.min(quality::radius_ratio(&places.map(|p| p.1)))
    }

    /// Radius ratio of a cell, at rest or in the cutting frame, whichever is worse.
    pub(crate) fn quality(&self, c: CellId) -> f64 {
        self.quality_with(&self.mesh().cell(c), None)
    }

    /// Worst radius ratio of some cells, at rest and in the cutting frame.
    pub(crate) fn worst_quality(&self, cells: &[CellId]) -> f64 {
        cells.iter().map(|c| self.quality(*c)).fold(f64::INFINITY, f64::min)
    }

    /// A state to return to.
    pub(crate) fn savepoint(&self) -> Savepoint {
        Savepoint {
            mark: self.edit.mark(),
            steps: self.journal.len(),
        }
    }

    /// Undoes everything since the savepoint.
    pub(crate) fn restore(&mut self, save: Savepoint) {
        self.edit.rollback_to(save.mark);
        for step in self.journal.drain(save.steps..).rev() {
            match step {
                Step::Changed(v, Some(p)) => drop(self.changed.insert(v, p)),
                Step::Changed(v, None) => drop(self.changed.remove(&v)),
                Step::Descendants(c, Some(ids)) => drop(self.descendants.insert(c, ids)),
                Step::Descendants(c, None) => drop(self.descendants.remove(&c)),
                Step::Region(c, true) => drop(self.region.remove(&c)),
                Step::Region(c, false) => drop(self.region.insert(c)),
                Step::Grown(c) => drop(self.grown.remove(&c)),
                Step::Sheet(facet, true) => drop(self.sheet.remove(&facet)),
                Step::Sheet(facet, false) => drop(self.sheet.insert(facet)),
            }
        }
    }
}

/// Where a vertex might lie.
pub(crate) struct Place {
    pub(crate) rest: Point,
    /// In the cutting frame.
    pub(crate) now: Point,
    /// The same place as a combination of vertices.
    pub(crate) parents: Vec<(VertexId, f64)>,
}

impl Place {
    /// Where the weights say, in both frames.
    pub(crate) fn of<const N: usize>(ws: &Workspace<'_, N>, parents: Vec<(VertexId, f64)>) -> Place {
        Place {
            rest: combine(&parents, |v| ws.mesh().rest_position(v)),
            now: combine(&parents, |v| ws.position(v)),
            parents,
        }
    }
}

/// Corners sorted, but for the last two where the orientation would change.
fn in_even_order<const N: usize>(mut corners: [VertexId; N]) -> [VertexId; N] {
    let mut is_odd = false;
    for i in 1..N {
        let mut j = i;
        while j > 0 && corners[j] < corners[j - 1] {
            corners.swap(j, j - 1);
            is_odd = !is_odd;
            j -= 1;
        }
    }
    if is_odd {
        corners.swap(N - 2, N - 1);
    }
    corners
}

/// The facet opposite corner `k` of a cell.
pub(crate) fn facet_of<const N: usize>(corners: &[VertexId; N], k: usize) -> FacetKey {
    let mut key = [u32::MAX; 3];
    let others = corners.iter().enumerate().filter(|(i, _)| *i != k);
    for (own, (_, v)) in key.iter_mut().zip(others) {
        *own = v.0;
    }
    key.sort_unstable();
    FacetKey(key)
}

/// Barycentric coordinates of `x` in a cell of some volume.
pub(crate) fn barycentric<const N: usize>(p: &[Point; N], x: Point) -> [f64; N] {
    let all = quality::cell_volume(p);
    std::array::from_fn(|k| {
        let mut q = *p;
        q[k] = x;
        quality::cell_volume(&q) / all
    })
}

/// `first + sum of w_k (p_k - first)`: exact in a coordinate that all parents share, so that points made on a
/// coordinate plane stay on it.
pub(crate) fn combine(parents: &[(VertexId, f64)], at: impl Fn(VertexId) -> Point) -> Point {
    let first = at(parents[0].0);
    parents[1..].iter().fold(first, |p, &(v, w)| p + (at(v) - first) * w)
}

fn weights(parents: &[(VertexId, f64)]) -> Weights {
    let mut out: BTreeMap<VertexId, f64> = BTreeMap::new();
    let tail: f64 = parents[1..].iter().map(|&(_, w)| w).sum();
    *out.entry(parents[0].0).or_default() += 1.0 - tail;
    for &(v, w) in &parents[1..] {
        *out.entry(v).or_default() += w;
    }
    out.into_iter().collect()
}
