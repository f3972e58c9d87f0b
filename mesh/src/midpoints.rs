//! Mid-edge vertices: what a field of order 2 needs besides the corners of its cells.

use std::collections::{BTreeMap, HashMap};

use crate::{
    AddedVertex, CellId, Deepest, Edit, FacetSide, MeshChange, MovedVertex, Point, SimplexMesh, VertexId, Weights,
};

/// Nodes of a quadratic tetrahedron: corners, then mid-edge vertices in the order of [`EDGES`]. A triangle has the corners 0 to
/// 2 and the first three edges, 6 in all; see [`Midpoints::NODES`].
pub const MOST_NODES: usize = 10;

/// Corners at the ends of the edges of a cell, as in VTK's quadratic cells; a triangle has the first three.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// A barycentric coordinate below this is none: a point on a facet takes nothing from the corner across.
const ZERO: f64 = 1e-12;

/// No vertex.
const NONE: VertexId = VertexId(u32::MAX);

/// One vertex in the middle of every edge of a mesh. They are vertices without cells of their own: whatever is kept by
/// vertex slot (displacements, velocities, conditions, masses) has its place for them, and what works on cells, such as
/// cutting, does not see them. Cells are straight-sided: a mid-edge vertex rests half-way between the ends.
///
/// An edit of the mesh knows nothing of them; [`Midpoints::follow`] brings them up to date after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Midpoints<const N: usize> {
    /// By cell slot: the vertices on the edges of the cell; of removed cells the last ones.
    of_cell: Vec<[VertexId; 6]>,
    /// By vertex slot: the cells around the edge of a mid-edge vertex, ascending; none of other vertices.
    cells: Vec<Vec<CellId>>,
    of_edge: HashMap<[VertexId; 2], VertexId>,
}

/// A cell of the mesh before a change.
struct OldCell<const N: usize> {
    id: CellId,
    corners: [VertexId; N],
    rest: [Point; N],
}

impl<const N: usize> Midpoints<N> {
    /// Edges of a cell.
    pub const EDGES: usize = N * (N - 1) / 2;
    /// Corners and mid-edge vertices of a cell.
    pub const NODES: usize = N + Self::EDGES;

    /// Adds the mid-edge vertices to a mesh, in the order of its cells.
    pub fn new(mesh: &mut SimplexMesh<N>) -> Self {
        let mut midpoints = Midpoints {
            of_cell: Vec::new(),
            cells: Vec::new(),
            of_edge: HashMap::new(),
        };
        let cells: Vec<CellId> = mesh.cell_ids().collect();
        let mut edit = Edit::new(mesh);
        for c in cells {
            midpoints.attach(&mut edit, c);
        }
        edit.commit();
        midpoints.resize(mesh);
        midpoints
    }

    /// The ends of the edge of each mid-edge vertex, to be stored.
    pub fn edges(&self) -> Vec<(VertexId, [VertexId; 2])> {
        let all: BTreeMap<VertexId, [VertexId; 2]> = self.of_edge.iter().map(|(ends, v)| (*v, *ends)).collect();
        all.into_iter().collect()
    }

    /// Takes back what [`Self::edges`] gave.
    ///
    /// # Errors
    /// What does not fit the mesh.
    pub fn restored(mesh: &SimplexMesh<N>, edges: &[(VertexId, [VertexId; 2])]) -> Result<Self, String> {
        let mut midpoints = Midpoints {
            of_cell: vec![[NONE; 6]; mesh.cell_slots()],
            cells: vec![Vec::new(); mesh.vertex_slots()],
            of_edge: edges.iter().map(|(v, ends)| (*ends, *v)).collect(),
        };
        for c in mesh.cell_ids() {
            for k in 0..Self::EDGES {
                let found = midpoints.of_edge.get(&ends(mesh, c, k)).copied();
                let v = found.filter(|v| mesh.has_vertex(*v) && mesh.cells_of_vertex(*v).is_empty());
                let v = v.ok_or_else(|| format!("an edge of cell {} has no vertex in its middle", c.0))?;
                midpoints.of_cell[c.index()][k] = v;
                midpoints.cells[v.index()].push(c);
            }
        }
        let used = midpoints.cells.iter().filter(|cells| !cells.is_empty()).count();
        match used == edges.len() && midpoints.of_edge.len() == edges.len() {
            true => Ok(midpoints),
            false => Err("a mid-edge vertex lies on no edge, or two on one".into()),
        }
    }

    /// The vertices on the edges of a cell, in the order of [`EDGES`]; of a triangle the first three.
    #[inline]
    pub fn of_cell(&self, c: CellId) -> &[VertexId] {
        &self.of_cell[c.index()][..Self::EDGES]
    }

    /// Corners and mid-edge vertices of a cell, [`Self::NODES`] of them.
    #[inline]
    pub fn nodes(&self, mesh: &SimplexMesh<N>, c: CellId) -> [VertexId; MOST_NODES] {
        let mut nodes = [NONE; MOST_NODES];
        nodes[..N].copy_from_slice(&mesh.cell(c));
        nodes[N..Self::NODES].copy_from_slice(self.of_cell(c));
        nodes
    }

    /// The cells around a vertex, or around the edge that it is the middle of, ascending.
    #[inline]
    pub fn cells_of<'a>(&'a self, mesh: &'a SimplexMesh<N>, v: VertexId) -> &'a [CellId] {
        match self.cells.get(v.index()) {
            Some(cells) if !cells.is_empty() => cells,
            _ => mesh.cells_of_vertex(v),
        }
    }

    /// The vertices of a facet: its corners, then those on its edges (0, 1), (1, 2), (2, 0); of a planar mesh the ends and the
    /// middle of an edge. With how many there are.
    pub fn facet_nodes(&self, mesh: &SimplexMesh<N>, side: FacetSide) -> ([VertexId; 6], usize) {
        let corners = mesh.facet_corners(side);
        let middle = |a: VertexId, b: VertexId| self.of_edge[&sorted([a, b])];
        let [a, b, c] = corners;
        match N {
            3 => ([a, b, middle(a, b), NONE, NONE, NONE], 3),
            _ => ([a, b, c, middle(a, b), middle(b, c), middle(c, a)], 6),
        }
    }

    /// Boundary facets that a vertex lies on, be it a corner or the middle of an edge of theirs.
    pub fn boundary_facets_of<'a>(
        &'a self,
        mesh: &'a SimplexMesh<N>,
        v: VertexId,
    ) -> impl Iterator<Item = FacetSide> + 'a {
        let sides = self.cells_of(mesh, v).iter().flat_map(move |&cell| {
            let nodes = self.nodes(mesh, cell);
            let sides = (0..N as u8).map(move |local| FacetSide { cell, local });
            sides.filter(move |s| (0..Self::NODES).any(|k| nodes[k] == v && !touches::<N>(k, s.local as usize)))
        });
        sides.filter(|s| mesh.other_side(*s).is_none())
    }

    /// Follows an edit of the mesh: adds, moves and removes mid-edge vertices, and returns the change as it is for a field of
    /// order 2, with these in it and with weights over corners and mid-edge vertices, the values of the quadratic shape
    /// functions. A field that is quadratic over each old cell is carried over exactly where a new cell lies in one old cell.
    #[must_use]
    pub fn follow(&mut self, mesh: &mut SimplexMesh<N>, change: MeshChange<N>) -> MeshChange<N> {
        let old = OldCells::of(mesh, &change);
        for c in &change.cells_removed {
            for v in &self.of_cell[c.id.index()][..Self::EDGES] {
                self.cells[v.index()].retain(|other| *other != c.id);
            }
        }
        let first = mesh.vertex_slots();
        let mut edit = Edit::new(mesh);
        for c in &change.cells_added {
            self.attach(&mut edit, c.id);
        }
        for c in &change.cells_removed {
            for (k, [i, j]) in EDGES.into_iter().enumerate().take(Self::EDGES) {
                let v = self.of_cell[c.id.index()][k];
                if self.cells[v.index()].is_empty() && edit.mesh().has_vertex(v) {
                    let edge = sorted([c.corners[i], c.corners[j]]);
                    self.of_edge.remove(&edge);
                    edit.remove_vertex(v, None);
                }
            }
        }
        let mut moved: BTreeMap<VertexId, [VertexId; 2]> = BTreeMap::new();
        for m in &change.vertices_moved {
            for c in edit.mesh().cells_of_vertex(m.id) {
                for k in 0..Self::EDGES {
                    let (v, edge) = (self.of_cell[c.index()][k], ends(edit.mesh(), *c, k));
                    if edge.contains(&m.id) && v.index() < first {
                        moved.insert(v, edge);
                    }
                }
            }
        }
        for (v, [a, b]) in &moved {
            let middle = (edit.mesh().rest_position(*a) + edit.mesh().rest_position(*b)) / 2.0;
            edit.move_vertex(*v, middle, &vec![(*a, 0.5), (*b, 0.5)]);
        }
        let own = edit.commit();
        self.resize(mesh);
        self.record(mesh, change, own, &old)
    }

    /// The change of an edit together with that of the mid-edge vertices, with quadratic weights.
    fn record(
        &self,
        mesh: &SimplexMesh<N>,
        mut change: MeshChange<N>,
        own: MeshChange<N>,
        old: &OldCells<N>,
    ) -> MeshChange<N> {
        let parents: HashMap<CellId, CellId> = change.cells_added.iter().map(|c| (c.id, c.parent)).collect();
        let origins: HashMap<VertexId, Weights> = (change.vertices_added.iter().map(|v| (v.id, v.parents.clone())))
            .chain(change.vertices_moved.iter().map(|v| (v.id, v.parents.clone())))
            .collect();
        let edge_of: HashMap<VertexId, [VertexId; 2]> = (own.vertices_added.iter().map(|v| v.id))
            .chain(own.vertices_moved.iter().map(|v| v.id))
            .filter_map(|v| Some((v, self.ends_of(mesh, v)?)))
            .collect();
        let quadratic = |v: VertexId| {
            let linear = match edge_of.get(&v) {
                Some(ends) => crate::change::resolve(&ends.map(|e| (e, 0.5)).to_vec(), &origins),
                None => origins[&v].clone(),
            };
            let ancestors = (self.cells_of(mesh, v).iter()).map(|c| parents.get(c).copied().unwrap_or(*c));
            self.weights(old, &linear, &mesh.rest_position(v), ancestors.collect())
        };
        for v in &mut change.vertices_added {
            v.parents = quadratic(v.id);
        }
        for v in &mut change.vertices_moved {
            v.parents = quadratic(v.id);
        }
        let added = own.vertices_added.iter().map(|v| AddedVertex {
            id: v.id,
            parents: quadratic(v.id),
        });
        let added: Vec<AddedVertex> = added.collect();
        let moved = own.vertices_moved.into_iter().map(|m| MovedVertex {
            parents: quadratic(m.id),
            ..m
        });
        change.vertices_moved.extend(moved);
        change.vertices_added.extend(added);
        change.vertices_removed.extend(own.vertices_removed);
        change.sort();
        change
    }

    /// Where a place of the mesh, given by linear weights and its rest position, lay in the old quadratic field.
    fn weights(&self, old: &OldCells<N>, linear: &Weights, place: &Point, ancestors: Vec<CellId>) -> Weights {
        let corners: Vec<VertexId> = linear.iter().map(|(v, _)| *v).collect();
        let near = || ancestors.iter().filter_map(|c| old.cells.get(c));
        let holds = |c: &&OldCell<N>| corners.iter().all(|v| c.corners.contains(v));
        // the same field from whichever of the cells that have all the parents as corners
        if let Some(cell) = near().find(holds).or_else(|| old.cells.values().find(holds)) {
            let weight = |v: &VertexId| linear.iter().find(|(p, _)| p == v).map_or(0.0, |(_, w)| *w);
            return self.shape_weights(cell, &cell.corners.each_ref().map(weight));
        }
        let at_rest = |c: &OldCell<N>| (c.id, c.rest);
        let own = Deepest::of(place, near().map(at_rest)).filter(|d| d.depth > -ZERO.sqrt());
        match own.or_else(|| Deepest::of(place, old.cells.values().map(at_rest))) {
            Some(found) => self.shape_weights(&old.cells[&found.key], &found.coordinates),
            None => linear.clone(),
        }
    }

    /// The quadratic shape functions of an old cell at barycentric coordinates, by vertex.
    fn shape_weights(&self, cell: &OldCell<N>, w: &[f64; N]) -> Weights {
        let mut w = w.map(|w| if w.abs() < ZERO { 0.0 } else { w });
        let sum: f64 = w.iter().sum();
        w.iter_mut().for_each(|w| *w /= sum);
        let values = quadratic_shapes(&w);
        let mids = &self.of_cell[cell.id.index()];
        let nodes = cell.corners.iter().chain(mids);
        let mut out: Weights = nodes.copied().zip(values).filter(|(_, value)| *value != 0.0).collect();
        out.sort_unstable_by_key(|(v, _)| *v);
        out
    }

    /// The ends of the edge that a vertex is the middle of; none of other vertices.
    pub fn ends_of(&self, mesh: &SimplexMesh<N>, v: VertexId) -> Option<[VertexId; 2]> {
        let c = *self.cells.get(v.index())?.first()?;
        let k = self.of_cell(c).iter().position(|w| *w == v)?;
        Some(ends(mesh, c, k))
    }

    /// Finds or makes the vertices on the edges of a cell.
    fn attach(&mut self, edit: &mut Edit<'_, N>, c: CellId) {
        if self.of_cell.len() <= c.index() {
            self.of_cell.resize(c.index() + 1, [NONE; 6]);
        }
        for k in 0..Self::EDGES {
            let [a, b] = ends(edit.mesh(), c, k);
            let v = *self.of_edge.entry([a, b]).or_insert_with(|| {
                let middle = (edit.mesh().rest_position(a) + edit.mesh().rest_position(b)) / 2.0;
                edit.add_vertex(middle, &vec![(a, 0.5), (b, 0.5)])
            });
            if self.cells.len() <= v.index() {
                self.cells.resize(v.index() + 1, Vec::new());
            }
            self.of_cell[c.index()][k] = v;
            let around = &mut self.cells[v.index()];
            if let Err(at) = around.binary_search(&c) {
                around.insert(at, c);
            }
        }
    }

    fn resize(&mut self, mesh: &SimplexMesh<N>) {
        self.of_cell.resize(mesh.cell_slots(), [NONE; 6]);
        self.cells.resize(mesh.vertex_slots(), Vec::new());
    }
}

/// The cells of the old mesh that a change removed or whose corners it moved.
struct OldCells<const N: usize> {
    cells: BTreeMap<CellId, OldCell<N>>,
}

impl<const N: usize> OldCells<N> {
    fn of(mesh: &SimplexMesh<N>, change: &MeshChange<N>) -> Self {
        let moved: HashMap<VertexId, Point> = (change.vertices_moved.iter())
            .map(|m| (m.id, m.old_rest_position))
            .collect();
        let place = |v: VertexId| moved.get(&v).copied().unwrap_or(mesh.rest_position(v));
        let new: std::collections::HashSet<CellId> = change.cells_added.iter().map(|c| c.id).collect();
        let around = (change.vertices_moved.iter())
            .flat_map(|m| mesh.cells_of_vertex(m.id).iter().copied())
            .filter(|c| !new.contains(c));
        let kept = around.map(|id| OldCell {
            id,
            corners: mesh.cell(id),
            rest: mesh.cell(id).map(place),
        });
        let removed = change.cells_removed.iter().map(|c| OldCell {
            id: c.id,
            corners: c.corners,
            rest: c.rest_positions,
        });
        OldCells {
            cells: removed.chain(kept).map(|c| (c.id, c)).collect(),
        }
    }
}

/// The quadratic shape functions at barycentric coordinates: `(2 w_i - 1) w_i` of the corners, `4 w_i w_j` of the edges.
#[inline]
pub fn quadratic_shapes<const N: usize>(w: &[f64; N]) -> [f64; MOST_NODES] {
    let mut values = [0.0; MOST_NODES];
    for i in 0..N {
        values[i] = (2.0 * w[i] - 1.0) * w[i];
    }
    for (k, [i, j]) in EDGES.into_iter().enumerate().take(Midpoints::<N>::EDGES) {
        values[N + k] = 4.0 * w[i] * w[j];
    }
    values
}

/// Whether node `k` of a cell belongs to what lies across from the facet opposite corner `corner`: that corner and its edges.
fn touches<const N: usize>(k: usize, corner: usize) -> bool {
    match k.checked_sub(N) {
        None => k == corner,
        Some(edge) => EDGES[edge].contains(&corner),
    }
}

/// Ends of edge `k` of a cell, ascending.
fn ends<const N: usize>(mesh: &SimplexMesh<N>, c: CellId, k: usize) -> [VertexId; 2] {
    let corners = mesh.cell(c);
    sorted(EDGES[k].map(|i| corners[i]))
}

fn sorted([a, b]: [VertexId; 2]) -> [VertexId; 2] {
    if a < b { [a, b] } else { [b, a] }
}
