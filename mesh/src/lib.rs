//! Positions and indices, and nothing else: simplex meshes with live adjacency, transactional edits and the record of
//! what an edit changed.
//!
//! A newcomer's path: [`SimplexMesh`] (tetrahedra: [`TetMesh`]) holds rest positions and cells. [`Edit`] is the only way
//! to change connectivity; committing it returns a [`MeshChange`], dropping it restores the mesh to the bit. [`BoxTree`]
//! finds cells by place and follows edits. [`quality`] measures cells, [`generate`] makes meshes, [`io`] reads and writes
//! files.
//!
//! ```
//! use kerfem_mesh::{generate, quality};
//! let mesh = generate::box_tets([1.0, 1.0, 1.0], [2, 2, 2], [0.0, 0.0, 0.0]);
//! assert_eq!(mesh.num_cells(), 48);
//! assert!((quality::volume(&mesh) - 1.0).abs() < 1e-14);
//! ```

mod barycentric;
mod box_tree;
mod change;
mod edit;
pub mod generate;
mod ids;
pub mod io;
mod midpoints;
pub mod nearest;
mod overlap;
mod planar;
pub mod predicates;
pub mod quality;
mod simplex;
mod stored;

pub use barycentric::{Barycentric, Deepest};
pub use box_tree::{Aabb, BoxTree, TouchedNodes};
pub use change::{AddedCell, AddedVertex, MeshChange, MovedVertex, RemovedCell, RemovedVertex, Weights};
pub use edit::{Edit, Mark};
pub use ids::{CellId, FacetLabel, VertexId};
pub use midpoints::{EDGES, MOST_NODES, Midpoints, quadratic_shapes};
pub use overlap::overlap;
pub use simplex::{FacetKey, FacetSide, MeshError, Point, SimplexMesh, TetMesh, TriMesh};
