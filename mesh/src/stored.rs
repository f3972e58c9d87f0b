//! A mesh as plain data, to be stored and taken back to the bit.

use serde::{Deserialize, Serialize};

use crate::{CellId, FacetLabel, Point, SimplexMesh, VertexId};

/// What a mesh with `N` corners a cell consists of besides its adjacency, which follows from it. Lists are by slot, those of
/// cells with `N` entries each.
#[derive(Serialize, Deserialize)]
pub(crate) struct StoredMesh {
    rest_positions: Vec<Point>,
    vertex_alive: Vec<bool>,
    cells: Vec<VertexId>,
    cell_alive: Vec<bool>,
    facet_labels: Vec<FacetLabel>,
    original_facets: Vec<[VertexId; 3]>,
    local_sizes: Vec<f64>,
    planar: bool,
}

impl<const N: usize> From<SimplexMesh<N>> for StoredMesh {
    fn from(mesh: SimplexMesh<N>) -> Self {
        StoredMesh {
            cells: mesh.cells.into_flattened(),
            facet_labels: mesh.facet_labels.into_flattened(),
            rest_positions: mesh.rest_positions,
            vertex_alive: mesh.vertex_alive,
            cell_alive: mesh.cell_alive,
            original_facets: mesh.original_facets,
            local_sizes: mesh.local_sizes,
            planar: mesh.planar,
        }
    }
}

/// What is wrong with a stored mesh.
#[derive(Debug, thiserror::Error)]
#[error("the stored mesh is not one: {0}")]
pub(crate) struct StoredMeshError(String);

impl<const N: usize> TryFrom<StoredMesh> for SimplexMesh<N> {
    type Error = StoredMeshError;

    fn try_from(stored: StoredMesh) -> Result<Self, StoredMeshError> {
        stored.check::<N>()?;
        let (vertices, cells) = (stored.rest_positions.len(), stored.cell_alive.len());
        let count = |alive: &[bool]| alive.iter().filter(|a| **a).count();
        let mut mesh = SimplexMesh {
            neighbors: vec![[CellId::NONE; N]; cells],
            cells_of_vertex: vec![Vec::new(); vertices],
            live_cells: count(&stored.cell_alive),
            live_vertices: count(&stored.vertex_alive),
            cells: stored.cells.as_chunks::<N>().0.to_vec(),
            facet_labels: stored.facet_labels.as_chunks::<N>().0.to_vec(),
            rest_positions: stored.rest_positions,
            vertex_alive: stored.vertex_alive,
            cell_alive: stored.cell_alive,
            original_facets: stored.original_facets,
            local_sizes: stored.local_sizes,
            planar: stored.planar,
        };
        mesh.link().map_err(|e| StoredMeshError(e.to_string()))?;
        mesh.check(false).map_err(StoredMeshError)?;
        Ok(mesh)
    }
}

impl StoredMesh {
    /// Lengths, indices and coordinates; the rest is for the mesh to check.
    fn check<const N: usize>(&self) -> Result<(), StoredMeshError> {
        let (vertices, cells) = (self.rest_positions.len(), self.cell_alive.len());
        let exists = |v: &VertexId| v.index() < vertices;
        let labelled = |l: &FacetLabel| l.some().is_none_or(|k| k < self.original_facets.len());
        let checks = [
            (
                "lists of different lengths",
                self.vertex_alive.len() == vertices
                    && self.local_sizes.len() == vertices
                    && self.cells.len() == N * cells
                    && self.facet_labels.len() == N * cells,
            ),
            (
                "too many vertices or cells",
                vertices < u32::MAX as usize && cells < u32::MAX as usize,
            ),
            (
                "a corner that does not exist",
                self.cells.iter().all(exists) && self.original_facets.iter().flatten().all(exists),
            ),
            (
                "a facet label that does not exist",
                self.facet_labels.iter().all(labelled),
            ),
            (
                "a coordinate that is not finite",
                self.rest_positions.iter().flatten().all(|x| x.is_finite()),
            ),
            (
                "a planar mesh of tetrahedra, or one that leaves its plane",
                !self.planar || (N == 3 && self.rest_positions.iter().all(|p| p.z == 0.0)),
            ),
        ];
        match checks.iter().find(|(_, holds)| !holds) {
            Some((what, _)) => Err(StoredMeshError((*what).into())),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Edit, TetMesh, TriMesh, generate};

    /// Two cells, one of which an edit has divided, and a vertex that is gone.
    fn edited() -> TetMesh {
        let mut mesh = generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
        let mut edit = Edit::new(&mut mesh);
        let gone = edit.add_vertex(Point::repeat(0.3), &vec![(VertexId(0), 0.7), (VertexId(7), 0.3)]);
        let parent = CellId(0);
        let (corners, labels) = (edit.mesh().cell(parent), edit.mesh().facet_labels(parent));
        edit.remove_cell(parent);
        edit.add_cell(corners, parent, labels);
        edit.remove_vertex(gone, None);
        edit.commit();
        mesh
    }

    #[test]
    fn a_mesh_comes_back_to_the_bit() {
        let mesh = edited();
        assert!(mesh.cell_slots() > mesh.num_cells() && mesh.vertex_slots() > mesh.num_vertices());
        assert_eq!(TetMesh::try_from(StoredMesh::from(mesh.clone())).unwrap(), mesh);
        let plate = generate::rect_triangles([2.0, 1.0], [3, 2], [0.0; 2]).unwrap();
        assert_eq!(TriMesh::try_from(StoredMesh::from(plate.clone())).unwrap(), plate);
    }

    #[test]
    fn what_is_no_mesh_is_refused() {
        let refused = |damage: &dyn Fn(&mut StoredMesh)| {
            let mut stored = StoredMesh::from(edited());
            damage(&mut stored);
            TetMesh::try_from(stored).unwrap_err().to_string()
        };
        assert!(refused(&|s| s.cells[5] = VertexId(99)).contains("a corner that does not exist"));
        assert!(refused(&|s| s.local_sizes.truncate(3)).contains("different lengths"));
        assert!(refused(&|s| s.facet_labels[0] = FacetLabel(1000)).contains("label"));
        assert!(refused(&|s| s.rest_positions[2].y = f64::NAN).contains("not finite"));
        assert!(refused(&|s| s.planar = true).contains("planar"));
        assert!(refused(&|s| s.vertex_alive[0] = false).contains("does not exist"));
        assert!(refused(&|s| s.cells.swap(8, 9)).contains("stored mesh is not one"));
        assert!(refused(&|s| s.rest_positions.swap(0, 7)).contains("stored mesh is not one"));
        assert!(TriMesh::try_from(StoredMesh::from(edited())).is_err());
    }
}
