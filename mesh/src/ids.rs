//! Typed indices. An id is the number of a slot: stable for the life of a mesh, never reused while it lives.

use serde::{Deserialize, Serialize};

/// A mesh corner: index of its slot in [`crate::SimplexMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct VertexId(pub u32);

/// A cell (tetrahedron or triangle): index of its slot in [`crate::SimplexMesh`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CellId(pub u32);

/// Which original boundary facet a facet descends from; [`FacetLabel::NONE`] for interior facets and cut faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FacetLabel(pub u32);

impl VertexId {
    /// The slot as an array index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl CellId {
    /// No cell: what lies behind a boundary facet.
    pub const NONE: CellId = CellId(u32::MAX);

    /// The slot as an array index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// `Some` for a cell, `None` for [`CellId::NONE`].
    #[inline]
    pub fn some(self) -> Option<CellId> {
        (self != CellId::NONE).then_some(self)
    }
}

impl FacetLabel {
    /// Not part of the original boundary.
    pub const NONE: FacetLabel = FacetLabel(u32::MAX);

    /// Index into the original boundary facets, if any.
    #[inline]
    pub fn some(self) -> Option<usize> {
        (self != FacetLabel::NONE).then_some(self.0 as usize)
    }
}
