//! Which new vertices are copies of an old one.

use std::collections::BTreeMap;

use kerfem_mesh::{AddedVertex, MeshChange, VertexId, Weights};

/// Tells the copies of doubled vertices from other new vertices.
pub(super) struct Copies<'c> {
    moved: BTreeMap<VertexId, &'c Weights>,
}

impl<'c> Copies<'c> {
    pub(super) fn of<const N: usize>(change: &'c MeshChange<N>) -> Self {
        Copies {
            moved: change.vertices_moved.iter().map(|m| (m.id, &m.parents)).collect(),
        }
    }

    /// The vertex that `v` is a copy of: its only parent, or one that moved to the same place.
    pub(super) fn original(&self, v: &AddedVertex) -> Option<VertexId> {
        match v.parents.as_slice() {
            [(only, _)] if !self.moved.contains_key(only) => Some(*only),
            _ => {
                let mut candidates = v.parents.iter().map(|(p, _)| *p);
                candidates.find(|p| self.moved.get(p).is_some_and(|w| **w == v.parents))
            }
        }
    }
}
