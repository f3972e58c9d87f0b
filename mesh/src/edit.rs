//! Transactions: the only way to change a mesh.

use std::collections::{HashMap, HashSet};

use crate::change::resolve;
use crate::{
    AddedCell, AddedVertex, CellId, FacetLabel, FacetSide, MeshChange, MovedVertex, Point, RemovedCell, RemovedVertex,
    SimplexMesh, VertexId, Weights,
};

/// One step back.
enum Undo {
    AddVertex,
    RemoveVertex(VertexId),
    MoveVertex(VertexId, Point, Option<Weights>),
    AddCell,
    RemoveCell(CellId),
}

/// A point in an edit that it can be rolled back to.
#[derive(Clone, Copy, Debug)]
pub struct Mark(usize);

/// An edit of a mesh. [`Edit::commit`] gives the [`MeshChange`]; dropping it without restores the mesh to the bit.
///
/// Operations keep adjacency up to date but do not judge geometry: the caller decides which cells are good enough.
pub struct Edit<'m, const N: usize> {
    mesh: &'m mut SimplexMesh<N>,
    log: Vec<Undo>,
    origin: HashMap<VertexId, Weights>,
    ancestor: HashMap<CellId, CellId>,
    old_places: HashMap<VertexId, Point>,
    merged: HashMap<VertexId, Option<VertexId>>,
    first_cell: usize,
    first_vertex: usize,
}

impl<'m, const N: usize> Edit<'m, N> {
    /// Begins an edit.
    pub fn new(mesh: &'m mut SimplexMesh<N>) -> Self {
        Edit {
            first_cell: mesh.cells.len(),
            first_vertex: mesh.rest_positions.len(),
            mesh,
            log: Vec::new(),
            origin: HashMap::new(),
            ancestor: HashMap::new(),
            old_places: HashMap::new(),
            merged: HashMap::new(),
        }
    }

    /// The mesh as it stands inside the edit.
    #[inline]
    pub fn mesh(&self) -> &SimplexMesh<N> {
        self.mesh
    }

    /// Where a vertex lies in the mesh before the edit: the weights any nodal field is carried over by.
    pub fn origin(&self, v: VertexId) -> Weights {
        self.origin.get(&v).cloned().unwrap_or_else(|| vec![(v, 1.0)])
    }

    /// The cell of the mesh before the edit that a cell descends from.
    pub fn ancestor(&self, c: CellId) -> CellId {
        self.ancestor.get(&c).copied().unwrap_or(c)
    }

    /// A new vertex at a rest position (m); `weights` place it between vertices of the mesh as it stands.
    pub fn add_vertex(&mut self, rest: Point, weights: &Weights) -> VertexId {
        let v = VertexId(self.mesh.rest_positions.len() as u32);
        self.origin.insert(v, resolve(weights, &self.origin));
        let size = weights
            .iter()
            .map(|&(p, _)| self.mesh.local_size(p))
            .fold(f64::INFINITY, f64::min);
        self.mesh.local_sizes.push(size);
        self.mesh.rest_positions.push(rest);
        self.mesh.vertex_alive.push(true);
        self.mesh.cells_of_vertex.push(Vec::new());
        self.mesh.live_vertices += 1;
        self.log.push(Undo::AddVertex);
        v
    }

    /// Moves a vertex to a rest position (m); `weights` place the new position between vertices of the mesh as it stands.
    pub fn move_vertex(&mut self, v: VertexId, rest: Point, weights: &Weights) {
        let place = &mut self.mesh.rest_positions[v.index()];
        self.log.push(Undo::MoveVertex(v, *place, self.origin.get(&v).cloned()));
        if v.index() < self.first_vertex {
            self.old_places.entry(v).or_insert(*place);
        }
        *place = rest;
        self.origin.insert(v, resolve(weights, &self.origin));
    }

    /// Removes a vertex that no cell names any more; `merged_into` tells where a field's value went, if anywhere.
    pub fn remove_vertex(&mut self, v: VertexId, merged_into: Option<VertexId>) {
        debug_assert!(self.mesh.cells_of_vertex[v.index()].is_empty());
        self.mesh.vertex_alive[v.index()] = false;
        self.mesh.live_vertices -= 1;
        self.merged.insert(v, merged_into);
        self.log.push(Undo::RemoveVertex(v));
    }

    /// Removes a cell; its neighbours get a boundary facet there.
    pub fn remove_cell(&mut self, c: CellId) {
        debug_assert!(self.mesh.has_cell(c));
        self.detach(c);
        self.log.push(Undo::RemoveCell(c));
    }

    /// A new cell that inherits the material of `parent` (a cell of the mesh as it stands, or one that this edit removed).
    /// `labels[k]` belongs to the facet opposite corner `k`; neighbours are found by their shared vertices.
    pub fn add_cell(&mut self, corners: [VertexId; N], parent: CellId, labels: [FacetLabel; N]) -> CellId {
        let c = CellId(self.mesh.cells.len() as u32);
        let ancestor = self.ancestor(parent);
        self.ancestor.insert(c, ancestor);
        self.mesh.cells.push(corners);
        self.mesh.cell_alive.push(false);
        self.mesh.facet_labels.push(labels);
        self.mesh.neighbors.push([CellId::NONE; N]);
        self.attach(c);
        self.log.push(Undo::AddCell);
        c
    }

    fn detach(&mut self, c: CellId) {
        for k in 0..N {
            if let Some(back) = self.mesh.other_side(FacetSide {
                cell: c,
                local: k as u8,
            }) {
                self.mesh.neighbors[back.cell.index()][back.local as usize] = CellId::NONE;
            }
        }
        self.mesh.neighbors[c.index()] = [CellId::NONE; N];
        for v in self.mesh.cells[c.index()] {
            let list = &mut self.mesh.cells_of_vertex[v.index()];
            if let Ok(i) = list.binary_search(&c) {
                list.remove(i);
            }
        }
        self.mesh.cell_alive[c.index()] = false;
        self.mesh.live_cells -= 1;
    }

    fn attach(&mut self, c: CellId) {
        let corners = self.mesh.cells[c.index()];
        for k in 0..N {
            let side = FacetSide {
                cell: c,
                local: k as u8,
            };
            let key = self.mesh.facet_key(side);
            let lead = VertexId(key.0[0]);
            let found = self.mesh.cells_of_vertex[lead.index()].iter().copied().find_map(|n| {
                (0..N)
                    .map(|j| FacetSide {
                        cell: n,
                        local: j as u8,
                    })
                    .find(|&s| self.mesh.facet_key(s) == key)
            });
            if let Some(s) = found {
                debug_assert_eq!(
                    self.mesh.neighbors[s.cell.index()][s.local as usize],
                    CellId::NONE,
                    "facet used twice"
                );
                self.mesh.neighbors[c.index()][k] = s.cell;
                self.mesh.neighbors[s.cell.index()][s.local as usize] = c;
            }
        }
        for v in corners {
            let list = &mut self.mesh.cells_of_vertex[v.index()];
            if let Err(i) = list.binary_search(&c) {
                list.insert(i, c);
            }
        }
        self.mesh.cell_alive[c.index()] = true;
        self.mesh.live_cells += 1;
    }

    /// A point to roll back to.
    pub fn mark(&self) -> Mark {
        Mark(self.log.len())
    }

    /// Undoes everything since the mark, to the bit.
    pub fn rollback_to(&mut self, mark: Mark) {
        while self.log.len() > mark.0 {
            let Some(undo) = self.log.pop() else { return };
            match undo {
                Undo::AddVertex => {
                    self.mesh.rest_positions.pop();
                    self.mesh.local_sizes.pop();
                    self.mesh.vertex_alive.pop();
                    self.mesh.cells_of_vertex.pop();
                    self.mesh.live_vertices -= 1;
                    self.origin.remove(&VertexId(self.mesh.rest_positions.len() as u32));
                }
                Undo::RemoveVertex(v) => {
                    self.mesh.vertex_alive[v.index()] = true;
                    self.mesh.live_vertices += 1;
                    self.merged.remove(&v);
                }
                Undo::MoveVertex(v, place, origin) => {
                    self.mesh.rest_positions[v.index()] = place;
                    match origin {
                        Some(w) => self.origin.insert(v, w),
                        None => self.origin.remove(&v),
                    };
                    if !self.origin.contains_key(&v) {
                        self.old_places.remove(&v);
                    }
                }
                Undo::AddCell => {
                    let c = CellId(self.mesh.cells.len() as u32 - 1);
                    self.detach(c);
                    self.mesh.cells.pop();
                    self.mesh.cell_alive.pop();
                    self.mesh.facet_labels.pop();
                    self.mesh.neighbors.pop();
                    self.ancestor.remove(&c);
                }
                Undo::RemoveCell(c) => self.attach(c),
            }
        }
    }

    /// Ends the edit and tells what it changed; what came and went inside it is left out.
    pub fn commit(mut self) -> MeshChange<N> {
        let mut change = MeshChange::default();
        let log = std::mem::take(&mut self.log);
        let mut gone = HashSet::new();
        for undo in &log {
            if let Undo::RemoveCell(c) = undo
                && c.index() < self.first_cell
                && gone.insert(*c)
            {
                let corners = self.mesh.cells[c.index()];
                let at = |v: VertexId| {
                    self.old_places
                        .get(&v)
                        .copied()
                        .unwrap_or(self.mesh.rest_positions[v.index()])
                };
                change.cells_removed.push(RemovedCell {
                    id: *c,
                    corners,
                    rest_positions: corners.map(at),
                });
            }
        }
        for c in (self.first_cell..self.mesh.cells.len()).map(|c| CellId(c as u32)) {
            if self.mesh.has_cell(c) {
                let corners = self.mesh.cells[c.index()];
                change.cells_added.push(AddedCell {
                    id: c,
                    corners,
                    parent: self.ancestor[&c],
                });
            }
        }
        for v in (self.first_vertex..self.mesh.rest_positions.len()).map(|v| VertexId(v as u32)) {
            if self.mesh.has_vertex(v) {
                change.vertices_added.push(AddedVertex {
                    id: v,
                    parents: self.origin[&v].clone(),
                });
            }
        }
        for (&id, &old) in &self.old_places {
            if self.mesh.has_vertex(id) && self.mesh.rest_positions[id.index()] != old {
                let parents = self.origin[&id].clone();
                change.vertices_moved.push(MovedVertex {
                    id,
                    old_rest_position: old,
                    parents,
                });
            }
        }
        for (&id, &merged_into) in &self.merged {
            if id.index() < self.first_vertex {
                change.vertices_removed.push(RemovedVertex { id, merged_into });
            }
        }
        change.sort();
        change
    }
}

impl<const N: usize> Drop for Edit<'_, N> {
    fn drop(&mut self) {
        self.rollback_to(Mark(0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;

    fn split_edge(edit: &mut Edit<'_, 4>, a: VertexId, b: VertexId, t: f64) -> VertexId {
        let m = edit.mesh();
        let rest = m.rest_position(a) * (1.0 - t) + m.rest_position(b) * t;
        let ring: Vec<CellId> = m.cells_of_edge(a, b).collect();
        let p = edit.add_vertex(rest, &vec![(a, 1.0 - t), (b, t)]);
        for c in ring {
            let corners = edit.mesh().cell(c);
            edit.remove_cell(c);
            for gone in [a, b] {
                edit.add_cell(corners.map(|v| if v == gone { p } else { v }), c, [FacetLabel::NONE; 4]);
            }
        }
        p
    }

    #[test]
    fn dropped_edit_restores_every_bit() {
        let mut mesh = generate::box_tets([1.0, 1.0, 1.0], [2, 2, 2], [0.0; 3]);
        let before = mesh.clone();
        {
            let mut edit = Edit::new(&mut mesh);
            let p = split_edge(&mut edit, VertexId(0), VertexId(13), 0.3);
            edit.move_vertex(
                p,
                Point::new(0.2, 0.2, 0.2),
                &vec![(VertexId(0), 0.6), (VertexId(13), 0.4)],
            );
            split_edge(&mut edit, p, VertexId(13), 0.5);
            assert_ne!(*edit.mesh(), before);
        }
        assert_eq!(mesh, before);
    }

    #[test]
    fn commit_resolves_weights_to_old_vertices_and_nets_out() {
        let mut mesh = generate::box_tets([1.0, 1.0, 1.0], [1, 1, 1], [0.0; 3]);
        let mut edit = Edit::new(&mut mesh);
        let p = split_edge(&mut edit, VertexId(0), VertexId(7), 0.5);
        let q = split_edge(&mut edit, p, VertexId(7), 0.5);
        let change = edit.commit();
        assert_eq!(change.cells_removed.len(), 6);
        assert_eq!(change.cells_added.len(), 18);
        assert_eq!(change.vertices_added[1].id, q);
        assert_eq!(
            change.vertices_added[1].parents,
            vec![(VertexId(0), 0.25), (VertexId(7), 0.75)]
        );
        mesh.check(true).unwrap();
    }

    #[test]
    fn composing_a_move_with_a_removal_keeps_the_old_places() {
        let mut mesh = generate::box_tets([1.0, 1.0, 1.0], [1, 1, 1], [0.0; 3]);
        let (moved, also) = (VertexId(1), VertexId(2));
        let mut edit = Edit::new(&mut mesh);
        edit.move_vertex(
            moved,
            Point::new(0.9, 0.0, 0.0),
            &vec![(VertexId(0), 0.1), (moved, 0.9)],
        );
        edit.move_vertex(also, Point::new(0.0, 0.8, 0.0), &vec![(VertexId(0), 0.2), (also, 0.8)]);
        let first = edit.commit();
        let mut edit = Edit::new(&mut mesh);
        for c in edit.mesh().cells_of_vertex(moved).to_vec() {
            edit.remove_cell(c);
        }
        edit.remove_vertex(moved, None);
        for c in edit.mesh().cells_of_vertex(also).to_vec() {
            edit.remove_cell(c);
        }
        let both = first.then(edit.commit());
        assert_eq!(both.vertices_moved.len(), 1);
        let places = |v: VertexId| {
            let at = both
                .cells_removed
                .iter()
                .find_map(|c| Some(c.rest_positions[c.corners.iter().position(|w| *w == v)?]));
            at.unwrap()
        };
        assert_eq!(places(moved), Point::new(1.0, 0.0, 0.0));
        assert_eq!(places(also), Point::new(0.0, 1.0, 0.0));
    }

    #[test]
    fn composed_changes_equal_one_edit() {
        let start = generate::box_tets([1.0, 1.0, 1.0], [1, 1, 1], [0.0; 3]);
        let mut two = start.clone();
        let mut edit = Edit::new(&mut two);
        let p = split_edge(&mut edit, VertexId(0), VertexId(7), 0.5);
        let first = edit.commit();
        let mut edit = Edit::new(&mut two);
        split_edge(&mut edit, p, VertexId(7), 0.5);
        let both = first.then(edit.commit());
        let mut one = start;
        let mut edit = Edit::new(&mut one);
        split_edge(&mut edit, VertexId(0), VertexId(7), 0.5);
        split_edge(&mut edit, p, VertexId(7), 0.5);
        assert_eq!(edit.commit(), both);
        assert_eq!(one, two);
    }
}
