//! What the steps of a cut share: the edit, positions in the cutting frame, and the cells near the sweep.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::Borders;
use kerfem_mesh::{CellId, Edit, FacetLabel, Mark, Point, SimplexMesh, VertexId, Weights, quality};

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
    positions: &'a [Point],
    borders: Borders<'a>,
    changed: HashMap<VertexId, Point>,
    descendants: HashMap<CellId, Vec<CellId>>,
}

impl<'a, const N: usize> Workspace<'a, N> {
    /// Begins a cut; `positions` in the cutting frame, one for each vertex slot.
    pub(crate) fn new(mesh: &'a mut SimplexMesh<N>, positions: &'a [Point], borders: Borders<'a>) -> Self {
        Workspace {
            edit: Edit::new(mesh),
            region: BTreeSet::new(),
            on: BTreeSet::new(),
            exact: BTreeSet::new(),
            positions,
            borders,
            changed: HashMap::new(),
            descendants: HashMap::new(),
        }
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
        self.descendants.insert(c, Vec::new());
    }

    /// Second half of a replacement: cells that inherit from `c` and are near the sweep if it was.
    pub(crate) fn put_in(&mut self, c: CellId, children: &[([VertexId; N], [FacetLabel; N])]) {
        let ids: Vec<CellId> = children
            .iter()
            .map(|(corners, labels)| self.edit.add_cell(*corners, c, *labels))
            .collect();
        if self.region.remove(&c) {
            self.region.extend(ids.iter().copied());
        }
        self.descendants.insert(c, ids);
    }

    /// A new vertex at an affine combination of present ones (weights add up to one, the first takes the rest).
    pub(crate) fn add_vertex(&mut self, parents: &[(VertexId, f64)]) -> VertexId {
        let rest = combine(parents, |v| self.mesh().rest_position(v));
        let position = combine(parents, |v| self.position(v));
        let v = self.edit.add_vertex(rest, &weights(parents));
        self.changed.insert(v, position);
        v
    }

    /// Moves a vertex to a combination of present ones, without looking whether its cells stay good.
    pub(crate) fn put_vertex(&mut self, v: VertexId, position: Point, parents: &[(VertexId, f64)]) {
        let rest = combine(parents, |w| self.mesh().rest_position(w));
        self.edit.move_vertex(v, rest, &weights(parents));
        self.changed.insert(v, position);
    }

    /// State to return to when a move of `v` turns out badly.
    pub(crate) fn savepoint_of(&self, v: VertexId) -> (Mark, Option<Point>) {
        (self.edit.mark(), self.changed.get(&v).copied())
    }

    /// Undoes a move.
    pub(crate) fn restore_vertex(&mut self, v: VertexId, (mark, position): (Mark, Option<Point>)) {
        self.edit.rollback_to(mark);
        match position {
            Some(p) => self.changed.insert(v, p),
            None => self.changed.remove(&v),
        };
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

    /// Cells around new and moved vertices: they may have outgrown the boxes of before the cut.
    pub(crate) fn cells_of_changed(&self) -> BTreeSet<CellId> {
        let live = self.changed.keys().filter(|v| self.mesh().has_vertex(**v));
        live.flat_map(|&v| self.mesh().cells_of_vertex(v).iter().copied())
            .collect()
    }

    /// Worst radius ratio of some cells, at rest and in the cutting frame.
    pub(crate) fn worst_quality(&self, cells: &[CellId]) -> f64 {
        let of = |c: &CellId| {
            let rest = quality::radius_ratio(&self.mesh().cell_rest_positions(*c));
            rest.min(quality::radius_ratio(&self.cell_positions(*c)))
        };
        cells.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// State to return to when a piece of the sweep turns out to change nothing.
    pub(crate) fn savepoint(&self) -> Savepoint {
        Savepoint {
            mark: self.edit.mark(),
            changed: self.changed.clone(),
            descendants: self.descendants.clone(),
        }
    }

    /// Undoes everything since the savepoint.
    pub(crate) fn restore(&mut self, save: Savepoint) {
        self.edit.rollback_to(save.mark);
        self.changed = save.changed;
        self.descendants = save.descendants;
    }
}

/// See [`Workspace::savepoint`].
pub(crate) struct Savepoint {
    mark: Mark,
    changed: HashMap<VertexId, Point>,
    descendants: HashMap<CellId, Vec<CellId>>,
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
