//! The record of an edit: plain data, and the only thing that passes between cutting and the rest.

use std::collections::HashMap;

use crate::{CellId, Point, VertexId};

/// An affine combination of vertices of the mesh before the change: parents and weights that add up to one, in ascending
/// order of parents, no zero weights.
pub type Weights = Vec<(VertexId, f64)>;

/// A cell that existed before the change and does not any more, with what is needed to evaluate fields in it.
#[derive(Clone, Debug, PartialEq)]
pub struct RemovedCell<const N: usize> {
    /// Its id.
    pub id: CellId,
    /// Its corners in the old mesh.
    pub corners: [VertexId; N],
    /// Their rest positions in the old mesh (m).
    pub rest_positions: [Point; N],
}

/// A cell that exists after the change and did not before.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedCell<const N: usize> {
    /// Its id.
    pub id: CellId,
    /// Its corners in the new mesh.
    pub corners: [VertexId; N],
    /// The cell of the old mesh whose material it inherits (always one of the removed cells).
    pub parent: CellId,
}

/// A vertex that exists after the change and did not before.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedVertex {
    /// Its id.
    pub id: VertexId,
    /// Where it lay in the old mesh: any nodal field is carried over by these.
    pub parents: Weights,
}

/// A vertex whose rest position changed.
#[derive(Clone, Debug, PartialEq)]
pub struct MovedVertex {
    /// Its id.
    pub id: VertexId,
    /// Rest position before (m).
    pub old_rest_position: Point,
    /// Where its new place lay in the old mesh.
    pub parents: Weights,
}

/// A vertex that existed before the change and does not any more.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemovedVertex {
    /// Its id.
    pub id: VertexId,
    /// The vertex it merged into, if any.
    pub merged_into: Option<VertexId>,
}

/// What one committed edit changed. Cells whose corners moved but did not change are not listed: they are the cells of
/// [`Self::vertices_moved`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshChange<const N: usize> {
    /// Cells that are gone, ascending.
    pub cells_removed: Vec<RemovedCell<N>>,
    /// Cells that are new, ascending.
    pub cells_added: Vec<AddedCell<N>>,
    /// Vertices that are new, ascending.
    pub vertices_added: Vec<AddedVertex>,
    /// Vertices that moved, ascending.
    pub vertices_moved: Vec<MovedVertex>,
    /// Vertices that are gone, ascending.
    pub vertices_removed: Vec<RemovedVertex>,
}

impl<const N: usize> MeshChange<N> {
    /// Whether nothing changed.
    pub fn is_empty(&self) -> bool {
        self.cells_removed.is_empty()
            && self.cells_added.is_empty()
            && self.vertices_added.is_empty()
            && self.vertices_moved.is_empty()
            && self.vertices_removed.is_empty()
    }

    /// This change followed by `later` as one change: weights refer to vertices that existed before the first, and what
    /// came and went again is left out.
    #[must_use]
    pub fn then(self, later: MeshChange<N>) -> MeshChange<N> {
        let mut origin: HashMap<VertexId, Weights> = HashMap::new();
        for v in &self.vertices_added {
            origin.insert(v.id, v.parents.clone());
        }
        for v in &self.vertices_moved {
            origin.insert(v.id, v.parents.clone());
        }
        let parent: HashMap<CellId, CellId> = self.cells_added.iter().map(|c| (c.id, c.parent)).collect();
        let added_before: HashMap<VertexId, usize> =
            self.vertices_added.iter().enumerate().map(|(i, v)| (v.id, i)).collect();
        let moved_before: HashMap<VertexId, usize> =
            self.vertices_moved.iter().enumerate().map(|(i, v)| (v.id, i)).collect();
        let old_places: HashMap<VertexId, Point> = self
            .vertices_moved
            .iter()
            .map(|v| (v.id, v.old_rest_position))
            .collect();

        let mut out = self;
        for v in later.vertices_added {
            out.vertices_added.push(AddedVertex {
                id: v.id,
                parents: resolve(&v.parents, &origin),
            });
        }
        for v in later.vertices_moved {
            let parents = resolve(&v.parents, &origin);
            if let Some(&i) = added_before.get(&v.id) {
                out.vertices_added[i].parents = parents;
            } else if let Some(&i) = moved_before.get(&v.id) {
                out.vertices_moved[i].parents = parents;
            } else {
                out.vertices_moved.push(MovedVertex {
                    id: v.id,
                    old_rest_position: v.old_rest_position,
                    parents,
                });
            }
        }
        for v in later.vertices_removed {
            if added_before.contains_key(&v.id) {
                out.vertices_added.retain(|a| a.id != v.id);
            } else {
                out.vertices_moved.retain(|m| m.id != v.id);
                out.vertices_removed.push(v);
            }
        }
        for c in later.cells_removed {
            if parent.contains_key(&c.id) {
                out.cells_added.retain(|a| a.id != c.id);
            } else {
                // corners of a cell that outlived the first change are old vertices; their old places may differ
                let mut c = c;
                for k in 0..N {
                    if let Some(place) = old_places.get(&c.corners[k]) {
                        c.rest_positions[k] = *place;
                    }
                }
                out.cells_removed.push(c);
            }
        }
        for mut c in later.cells_added {
            c.parent = parent.get(&c.parent).copied().unwrap_or(c.parent);
            out.cells_added.push(c);
        }
        out.sort();
        out
    }

    pub(crate) fn sort(&mut self) {
        self.cells_removed.sort_by_key(|c| c.id);
        self.cells_added.sort_by_key(|c| c.id);
        self.vertices_added.sort_by_key(|v| v.id);
        self.vertices_moved.sort_by_key(|v| v.id);
        self.vertices_removed.sort_by_key(|v| v.id);
    }
}

/// Weights over intermediate vertices as weights over old ones, where `origin` tells those that are new or moved.
pub(crate) fn resolve(weights: &Weights, origin: &HashMap<VertexId, Weights>) -> Weights {
    let mut out: Weights = Vec::with_capacity(weights.len());
    for &(v, w) in weights {
        match origin.get(&v) {
            Some(own) => out.extend(own.iter().map(|&(p, q)| (p, w * q))),
            None => out.push((v, w)),
        }
    }
    out.sort_by_key(|&(v, _)| v);
    let mut merged: Weights = Vec::with_capacity(out.len());
    for (v, w) in out {
        match merged.last_mut() {
            Some((last, sum)) if *last == v => *sum += w,
            _ => merged.push((v, w)),
        }
    }
    merged.retain(|&(_, w)| w != 0.0);
    merged
}
