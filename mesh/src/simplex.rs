//! The mesh: rest positions, cells, and adjacency that is always up to date.

use std::collections::HashMap;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::stored::StoredMesh;
use crate::{CellId, FacetLabel, VertexId, predicates, quality};

/// A position in space, in metres. Planar meshes keep `z = 0`.
pub type Point = Vector3<f64>;

/// Tetrahedra: four corners, positively oriented (`(b-a) x (c-a) . (d-a) > 0`).
pub type TetMesh = SimplexMesh<4>;

/// Triangles: three corners. With `z = 0` everywhere a planar mesh ([`SimplexMesh::is_planar`]): counter-clockwise; else a
/// surface in space.
pub type TriMesh = SimplexMesh<3>;

/// Largest coordinate (m): its third power, and what predicates make of it, must be finite.
const FARTHEST: f64 = 1e90;

/// What is wrong with positions and cells that should become a mesh, with the place and the numbers.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not finite: ({x}, {y}, {z})")]
    NotFinite {
        /// Input index of the vertex.
        vertex: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// A coordinate is so large that volumes would overflow.
    #[error(
        "vertex {vertex} has a coordinate that is too large: ({x}, {y}, {z}); numbers from -1e90 to 1e90 are accepted"
    )]
    TooFar {
        /// Input index of the vertex.
        vertex: usize,
        /// First coordinate.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// A cell names a vertex that does not exist.
    #[error("cell {cell} names vertex {vertex}, but the mesh has {count} vertices (0 to {})", .count.saturating_sub(1))]
    NoSuchVertex {
        /// Input index of the cell.
        cell: usize,
        /// The index it names.
        vertex: usize,
        /// How many vertices there are.
        count: usize,
    },
    /// A cell names the same vertex twice.
    #[error("cell {cell} names vertex {vertex} twice; its corners must differ")]
    RepeatedCorner {
        /// Input index of the cell.
        cell: usize,
        /// The vertex.
        vertex: usize,
    },
    /// The corners of a cell lie in a plane (or, for a triangle, on a line).
    #[error("cell {cell} has no volume: its corners {corners:?} are degenerate")]
    ZeroVolume {
        /// Input index of the cell.
        cell: usize,
        /// Its corners.
        corners: Vec<usize>,
    },
    /// Some cells are oriented one way and some the other, so that one of them is inverted.
    #[error("cell {cell} is inverted: its volume is negative where that of the {others} others is positive")]
    Inverted {
        /// Input index of the cell.
        cell: usize,
        /// How many cells are oriented the other way.
        others: usize,
    },
    /// Two cells have the same corners.
    #[error("cells {first} and {second} have the same corners {corners:?}")]
    DuplicateCell {
        /// Input index of the first.
        first: usize,
        /// Input index of the second.
        second: usize,
        /// Their corners, sorted.
        corners: Vec<usize>,
    },
    /// More than two cells share a facet.
    #[error("facet {facet:?} is shared by more than two cells ({cells:?})")]
    NonManifoldFacet {
        /// Its vertices, sorted.
        facet: Vec<usize>,
        /// Three of the cells.
        cells: Vec<usize>,
    },
    /// Two cells lie on the same side of the facet they share, so they overlap.
    #[error("cells {first} and {second} lie on the same side of the facet {facet:?} they share: they overlap")]
    Overlap {
        /// Input index of the first.
        first: usize,
        /// Input index of the second.
        second: usize,
        /// Vertices of the facet, sorted.
        facet: Vec<usize>,
    },
    /// A vertex of a planar mesh does not lie in the plane z = 0.
    #[error("vertex {vertex} has z = {z}; a planar mesh lies in the plane z = 0")]
    OutOfPlane {
        /// Input index of the vertex.
        vertex: usize,
        /// Its third coordinate.
        z: f64,
    },
    /// More slots than ids can number.
    #[error("{what} has {count} entries; at most {} are supported", u32::MAX - 1)]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How many there are.
        count: usize,
    },
}

/// The sorted vertices of a facet, padded with `u32::MAX` where a facet has fewer than three.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FacetKey(pub [u32; 3]);

/// A facet seen from a cell: the one opposite corner `local`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FacetSide {
    /// The cell.
    pub cell: CellId,
    /// The corner (0 to N-1) that is not part of the facet.
    pub local: u8,
}

/// A mesh of simplices with `N` corners (`4`: tetrahedra, `3`: triangles).
///
/// Slots of vertices and cells are never renumbered; a removed one stays empty. Adjacency (cells of a vertex, neighbour
/// behind each facet) is kept up to date by every [`crate::Edit`]. Lists are in ascending order of ids, so that a mesh has
/// one representation whatever was done and undone to reach it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredMesh", into = "StoredMesh")]
pub struct SimplexMesh<const N: usize> {
    pub(crate) rest_positions: Vec<Point>,
    pub(crate) vertex_alive: Vec<bool>,
    pub(crate) cells: Vec<[VertexId; N]>,
    pub(crate) cell_alive: Vec<bool>,
    pub(crate) facet_labels: Vec<[FacetLabel; N]>,
    pub(crate) neighbors: Vec<[CellId; N]>,
    pub(crate) cells_of_vertex: Vec<Vec<CellId>>,
    pub(crate) live_cells: usize,
    pub(crate) live_vertices: usize,
    pub(crate) original_facets: Vec<[VertexId; 3]>,
    pub(crate) local_sizes: Vec<f64>,
    pub(crate) planar: bool,
}

impl<const N: usize> SimplexMesh<N> {
    /// A mesh from rest positions (m) and cells (indices from zero).
    ///
    /// Tetrahedra, or triangles in the plane `z = 0`, that are all negatively oriented are all turned (a file with the other
    /// convention); a mixture is an error. Vertices that no cell names are kept. Every boundary facet gets a [`FacetLabel`]: its index in
    /// [`Self::original_facets`].
    ///
    /// # Errors
    /// [`MeshError`] names the first vertex or cell at fault.
    pub fn new(rest_positions: Vec<Point>, cells: Vec<[usize; N]>) -> Result<Self, MeshError> {
        let count = rest_positions.len();
        for (what, n) in [("the vertex list", count), ("the cell list", cells.len())] {
            if n >= u32::MAX as usize {
                return Err(MeshError::TooLarge { what, count: n });
            }
        }
        let near = |p: &Point| p.iter().all(|c| c.abs() <= FARTHEST);
        if let Some((vertex, p)) = rest_positions.iter().enumerate().find(|(_, p)| !near(p)) {
            let [x, y, z] = [p.x, p.y, p.z];
            return Err(match p.iter().all(|c| c.is_finite()) {
                true => MeshError::TooFar { vertex, x, y, z },
                false => MeshError::NotFinite { vertex, x, y, z },
            });
        }
        for (cell, corners) in cells.iter().enumerate() {
            for (k, &vertex) in corners.iter().enumerate() {
                if vertex >= count {
                    return Err(MeshError::NoSuchVertex { cell, vertex, count });
                }
                if corners[..k].contains(&vertex) {
                    return Err(MeshError::RepeatedCorner { cell, vertex });
                }
            }
        }
        let mut cells: Vec<[VertexId; N]> = cells.iter().map(|c| c.map(|v| VertexId(v as u32))).collect();
        let planar = N == 3 && rest_positions.iter().all(|p| p.z == 0.0);
        orient(&rest_positions, &mut cells, planar)?;

        let mut mesh = SimplexMesh {
            vertex_alive: vec![true; count],
            cell_alive: vec![true; cells.len()],
            facet_labels: vec![[FacetLabel::NONE; N]; cells.len()],
            neighbors: vec![[CellId::NONE; N]; cells.len()],
            cells_of_vertex: vec![Vec::new(); count],
            live_cells: cells.len(),
            live_vertices: count,
            original_facets: Vec::new(),
            local_sizes: Vec::new(),
            rest_positions,
            cells,
            planar,
        };
        mesh.link()?;
        for c in 0..mesh.cells.len() {
            for k in 0..N {
                if mesh.neighbors[c][k] == CellId::NONE {
                    mesh.facet_labels[c][k] = FacetLabel(mesh.original_facets.len() as u32);
                    let side = FacetSide {
                        cell: CellId(c as u32),
                        local: k as u8,
                    };
                    mesh.original_facets.push(mesh.facet_corners(side));
                }
            }
        }
        mesh.local_sizes = mesh.vertex_ids().map(|v| mesh.mean_edge(v)).collect();
        Ok(mesh)
    }

    /// Finds the cells of each vertex and the neighbour behind each facet, where there are none yet.
    pub(crate) fn link(&mut self) -> Result<(), MeshError> {
        let mut open: HashMap<FacetKey, (FacetSide, Option<FacetSide>)> = HashMap::with_capacity(2 * self.live_cells);
        for c in (0..self.cells.len()).filter(|&c| self.cell_alive[c]) {
            for v in self.cells[c] {
                self.cells_of_vertex[v.index()].push(CellId(c as u32));
            }
            for k in 0..N {
                let side = FacetSide {
                    cell: CellId(c as u32),
                    local: k as u8,
                };
                let key = self.facet_key(side);
                let plain = |k: FacetKey| k.0[..N - 1].iter().map(|&v| v as usize).collect::<Vec<_>>();
                match open.get_mut(&key) {
                    None => {
                        open.insert(key, (side, None));
                    }
                    Some((first, second @ None)) => {
                        let a = self.cells[first.cell.index()];
                        let mut sa = a;
                        let mut sb = self.cells[c];
                        sa.sort();
                        sb.sort();
                        if sa == sb {
                            let corners = sa.iter().map(|v| v.index()).collect();
                            return Err(MeshError::DuplicateCell {
                                first: first.cell.index(),
                                second: c,
                                corners,
                            });
                        }
                        if N == 4 || self.planar {
                            let f = self.facet_corners(*first).map(|v| self.rest_positions[v.index()]);
                            let side = |v: VertexId| {
                                let p = self.rest_positions[v.index()];
                                match N {
                                    4 => predicates::orient3d(f[0], f[1], f[2], p),
                                    _ => predicates::orient2d(f[0], f[1], p),
                                }
                            };
                            if (side(self.cells[c][k]) > 0.0) == (side(a[first.local as usize]) > 0.0) {
                                let (first, facet) = (first.cell.index(), plain(key));
                                return Err(MeshError::Overlap {
                                    first,
                                    second: c,
                                    facet,
                                });
                            }
                        }
                        self.neighbors[c][k] = first.cell;
                        self.neighbors[first.cell.index()][first.local as usize] = CellId(c as u32);
                        *second = Some(side);
                    }
                    Some((first, Some(second))) => {
                        let cells = vec![first.cell.index(), second.cell.index(), c];
                        return Err(MeshError::NonManifoldFacet {
                            facet: plain(key),
                            cells,
                        });
                    }
                }
            }
        }
        Ok(())
    }

    /// Whether this is a mesh of triangles in the plane `z = 0`.
    #[inline]
    pub fn is_planar(&self) -> bool {
        self.planar
    }

    /// Number of cells that exist.
    #[inline]
    pub fn num_cells(&self) -> usize {
        self.live_cells
    }

    /// Number of vertices that exist, unreferenced ones included.
    #[inline]
    pub fn num_vertices(&self) -> usize {
        self.live_vertices
    }

    /// Length of arrays indexed by [`CellId`]: cells that exist and empty slots.
    #[inline]
    pub fn cell_slots(&self) -> usize {
        self.cells.len()
    }

    /// Length of arrays indexed by [`VertexId`]: vertices that exist and empty slots.
    #[inline]
    pub fn vertex_slots(&self) -> usize {
        self.rest_positions.len()
    }

    /// Whether the slot holds a cell.
    #[inline]
    pub fn has_cell(&self, c: CellId) -> bool {
        self.cell_alive.get(c.index()).copied().unwrap_or(false)
    }

    /// Whether the slot holds a vertex.
    #[inline]
    pub fn has_vertex(&self, v: VertexId) -> bool {
        self.vertex_alive.get(v.index()).copied().unwrap_or(false)
    }

    /// Ids of the cells that exist, ascending.
    pub fn cell_ids(&self) -> impl Iterator<Item = CellId> + '_ {
        (0..self.cells.len())
            .filter(|&c| self.cell_alive[c])
            .map(|c| CellId(c as u32))
    }

    /// Ids of the vertices that exist, ascending.
    pub fn vertex_ids(&self) -> impl Iterator<Item = VertexId> + '_ {
        (0..self.rest_positions.len())
            .filter(|&v| self.vertex_alive[v])
            .map(|v| VertexId(v as u32))
    }

    /// Corners of a cell. Of an empty slot: those it last had.
    #[inline]
    pub fn cell(&self, c: CellId) -> [VertexId; N] {
        self.cells[c.index()]
    }

    /// Rest position of a vertex (m).
    #[inline]
    pub fn rest_position(&self, v: VertexId) -> Point {
        self.rest_positions[v.index()]
    }

    /// Rest positions of all slots (m), indexed by [`VertexId`].
    #[inline]
    pub fn rest_positions(&self) -> &[Point] {
        &self.rest_positions
    }

    /// Rest positions of a cell's corners.
    #[inline]
    pub fn cell_rest_positions(&self, c: CellId) -> [Point; N] {
        self.cells[c.index()].map(|v| self.rest_positions[v.index()])
    }

    /// Cells that contain a vertex, ascending.
    #[inline]
    pub fn cells_of_vertex(&self, v: VertexId) -> &[CellId] {
        &self.cells_of_vertex[v.index()]
    }

    /// Cells behind the facets of `c`: entry `k` lies opposite corner `k`, [`CellId::NONE`] on the boundary.
    #[inline]
    pub fn neighbors(&self, c: CellId) -> [CellId; N] {
        self.neighbors[c.index()]
    }

    /// Labels of the facets of `c`: entry `k` belongs to the facet opposite corner `k`.
    #[inline]
    pub fn facet_labels(&self, c: CellId) -> [FacetLabel; N] {
        self.facet_labels[c.index()]
    }

    /// The boundary facets the mesh was made with, by [`FacetLabel`] (triangle meshes: third entry repeats the second).
    #[inline]
    pub fn original_facets(&self) -> &[[VertexId; 3]] {
        &self.original_facets
    }

    /// Vertices of a facet, ordered so that its normal points out of the cell (tetrahedra); an edge of a triangle mesh
    /// runs counter-clockwise around its triangle, and its second vertex is repeated.
    #[inline]
    pub fn facet_corners(&self, side: FacetSide) -> [VertexId; 3] {
        let c = &self.cells[side.cell.index()];
        let k = side.local as usize;
        if N == 4 {
            const FACETS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
            FACETS[k].map(|i| c[i])
        } else {
            let (a, b) = (c[(k + 1) % N], c[(k + 2) % N]);
            [a, b, b]
        }
    }

    /// Outward normal of a facet at rest, as long as the facet is large: its area (m²) for a tetrahedron, its length (m) for a
    /// planar triangle.
    #[inline]
    pub fn facet_normal(&self, side: FacetSide) -> Point {
        quality::facet_normal::<N>(&self.facet_corners(side).map(|v| self.rest_positions[v.index()])) / 2.0
    }

    /// Sorted vertices of a facet: the same seen from both cells.
    #[inline]
    pub fn facet_key(&self, side: FacetSide) -> FacetKey {
        let c = &self.cells[side.cell.index()];
        let mut key = [u32::MAX; 3];
        let mut n = 0;
        for (i, v) in c.iter().enumerate() {
            if i != side.local as usize {
                key[n] = v.0;
                n += 1;
            }
        }
        key.sort_unstable();
        FacetKey(key)
    }

    /// The same facet seen from the cell behind it, if there is one.
    pub fn other_side(&self, side: FacetSide) -> Option<FacetSide> {
        let cell = self.neighbors[side.cell.index()][side.local as usize].some()?;
        let back = (0..N).find(|&k| {
            self.neighbors[cell.index()][k] == side.cell && {
                self.facet_key(FacetSide { cell, local: k as u8 }) == self.facet_key(side)
            }
        })?;
        Some(FacetSide {
            cell,
            local: back as u8,
        })
    }

    /// Facets with a cell on one side only, in ascending order of cell and corner.
    pub fn boundary_facets(&self) -> impl Iterator<Item = FacetSide> + '_ {
        self.cell_ids().flat_map(move |cell| {
            (0..N)
                .filter(move |&k| self.neighbors[cell.index()][k] == CellId::NONE)
                .map(move |k| FacetSide { cell, local: k as u8 })
        })
    }

    /// Boundary facets at one vertex.
    pub fn boundary_facets_of_vertex(&self, v: VertexId) -> impl Iterator<Item = FacetSide> + '_ {
        self.cells_of_vertex[v.index()].iter().flat_map(move |&cell| {
            (0..N)
                .filter(move |&k| self.neighbors[cell.index()][k] == CellId::NONE && self.cells[cell.index()][k] != v)
                .map(move |k| FacetSide { cell, local: k as u8 })
        })
    }

    /// Whether a boundary facet contains the vertex.
    pub fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.boundary_facets_of_vertex(v).next().is_some()
    }

    /// Cells that contain both ends of an edge, ascending.
    pub fn cells_of_edge(&self, a: VertexId, b: VertexId) -> impl Iterator<Item = CellId> + '_ {
        self.cells_of_vertex[a.index()]
            .iter()
            .copied()
            .filter(move |c| self.cells[c.index()].contains(&b))
    }

    /// [`Self::cells_of_edge`] by fans: each is connected through facets that contain the edge. In space there is one fan
    /// around a sound edge; several hang together by the edge only, as by a hinge.
    pub fn fans_of_edge(&self, a: VertexId, b: VertexId) -> Vec<Vec<CellId>> {
        let cells: Vec<CellId> = self.cells_of_edge(a, b).collect();
        let (fan, count) = self.pieces_among(&cells, |side| {
            let opposite = self.cells[side.cell.index()][side.local as usize];
            opposite != a && opposite != b
        });
        let mut fans = vec![Vec::new(); count];
        for (c, f) in cells.into_iter().zip(fan) {
            fans[f].push(c);
        }
        fans
    }

    /// Mean rest length (m) of the edges that met at a vertex when the mesh was made; a vertex that came later has the
    /// least of its parents. Lengths that should not shrink as cuts refine the mesh are measured by it.
    #[inline]
    pub fn local_size(&self, v: VertexId) -> f64 {
        self.local_sizes[v.index()]
    }

    fn mean_edge(&self, v: VertexId) -> f64 {
        let around = self.vertex_neighbors(v);
        let p = self.rest_position(v);
        around.iter().map(|&w| (self.rest_position(w) - p).norm()).sum::<f64>() / around.len().max(1) as f64
    }

    /// Vertices joined to `v` by an edge, ascending.
    pub fn vertex_neighbors(&self, v: VertexId) -> Vec<VertexId> {
        let mut out: Vec<VertexId> = self.cells_of_vertex[v.index()]
            .iter()
            .flat_map(|c| self.cells[c.index()])
            .filter(|&w| w != v)
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// Connected pieces of `cells` through shared facets that `open` lets pass: for each cell of the (sorted) list the
    /// number of its piece, and how many pieces there are. Pieces are numbered by their smallest cell.
    pub fn pieces_among(&self, cells: &[CellId], open: impl Fn(FacetSide) -> bool) -> (Vec<usize>, usize) {
        debug_assert!(cells.is_sorted());
        let mut piece = vec![usize::MAX; cells.len()];
        let mut count = 0;
        let mut stack = Vec::new();
        for start in 0..cells.len() {
            if piece[start] != usize::MAX {
                continue;
            }
            piece[start] = count;
            stack.push(start);
            while let Some(i) = stack.pop() {
                for k in 0..N {
                    let n = self.neighbors[cells[i].index()][k];
                    if n == CellId::NONE
                        || !open(FacetSide {
                            cell: cells[i],
                            local: k as u8,
                        })
                    {
                        continue;
                    }
                    if let Ok(j) = cells.binary_search(&n)
                        && piece[j] == usize::MAX
                    {
                        piece[j] = count;
                        stack.push(j);
                    }
                }
            }
            count += 1;
        }
        (piece, count)
    }

    /// Connected pieces of the mesh through facets: the number of each live cell's piece (in the order of
    /// [`Self::cell_ids`]) and how many there are.
    pub fn pieces(&self) -> (Vec<usize>, usize) {
        let cells: Vec<CellId> = self.cell_ids().collect();
        self.pieces_among(&cells, |_| true)
    }

    /// Everything that must always hold, as one message naming the first thing that does not (DESIGN invariant 5).
    ///
    /// Checks orientation (exactly), mutual adjacency, facets shared by at most two cells, sorted vertex lists, counts and,
    /// with `links`, that the link of every vertex and of every edge is connected.
    ///
    /// # Errors
    /// The first violation, in words.
    pub fn check(&self, links: bool) -> Result<(), String> {
        let mut facets: HashMap<FacetKey, u32> = HashMap::with_capacity(2 * self.live_cells);
        for c in self.cell_ids() {
            self.check_cell(c)?;
            for k in 0..N {
                let n = facets
                    .entry(self.facet_key(FacetSide {
                        cell: c,
                        local: k as u8,
                    }))
                    .or_default();
                *n += 1;
                if *n > 2 {
                    return Err(format!(
                        "facet of cell {} opposite corner {k} is shared by more than two cells",
                        c.0
                    ));
                }
            }
        }
        for c in self.cell_ids() {
            for k in 0..N {
                let n = facets[&self.facet_key(FacetSide {
                    cell: c,
                    local: k as u8,
                })];
                if (n == 2) != (self.neighbors[c.index()][k] != CellId::NONE) {
                    return Err(format!("cell {} has a wrong neighbour opposite corner {k}", c.0));
                }
            }
        }
        if self.cell_ids().count() != self.live_cells || self.vertex_ids().count() != self.live_vertices {
            return Err("the counts of live cells or vertices are wrong".into());
        }
        for v in 0..self.rest_positions.len() {
            self.check_vertex(VertexId(v as u32), links)?;
        }
        Ok(())
    }

    /// [`Self::check`] for one cell: corners alive, orientation, labels only on the boundary, mutual neighbours.
    ///
    /// # Errors
    /// The first violation, in words.
    pub fn check_cell(&self, c: CellId) -> Result<(), String> {
        let corners = self.cells[c.index()];
        for v in corners {
            if !self.has_vertex(v) {
                return Err(format!("cell {} names vertex {}, which does not exist", c.0, v.0));
            }
            if self.cells_of_vertex[v.index()].binary_search(&c).is_err() {
                return Err(format!("cell {} is missing from the list of its vertex {}", c.0, v.0));
            }
        }
        if N == 4 || self.planar {
            let p = corners.map(|v| self.rest_positions[v.index()]);
            if predicates::orientation(&p) <= 0.0 {
                return Err(format!(
                    "cell {} is inverted or degenerate at rest: corners {:?}",
                    c.0,
                    corners.map(|v| v.0)
                ));
            }
        }
        for k in 0..N {
            let side = FacetSide {
                cell: c,
                local: k as u8,
            };
            if let Some(n) = self.neighbors[c.index()][k].some() {
                if !self.has_cell(n) || self.other_side(side).is_none() {
                    return Err(format!("cells {} and {} are not mutual neighbours", c.0, n.0));
                }
                if self.facet_labels[c.index()][k] != FacetLabel::NONE {
                    return Err(format!(
                        "the interior facet of cell {} opposite corner {k} carries a boundary label",
                        c.0
                    ));
                }
            }
        }
        Ok(())
    }

    /// [`Self::check`] for one vertex: its list is sorted and true and, with `links`, its link is connected, and those of
    /// the edges to vertices of larger numbers.
    ///
    /// # Errors
    /// The first violation, in words.
    pub fn check_vertex(&self, v: VertexId, links: bool) -> Result<(), String> {
        let cells = &self.cells_of_vertex[v.index()];
        if !cells.is_sorted()
            || cells
                .iter()
                .any(|&c| !self.has_cell(c) || !self.cells[c.index()].contains(&v))
        {
            return Err(format!("the list of cells of vertex {} is wrong", v.0));
        }
        if !self.has_vertex(v) && !cells.is_empty() {
            return Err(format!("vertex {} does not exist but has cells", v.0));
        }
        if links && self.link_components(v).1 > 1 {
            return Err(format!("the link of vertex {} is not connected", v.0));
        }
        if links && N == 4 {
            let hinge = |w: &VertexId| *w > v && self.fans_of_edge(v, *w).len() > 1;
            if let Some(w) = self.vertex_neighbors(v).into_iter().find(hinge) {
                return Err(format!(
                    "the link of the edge between vertices {} and {} is not connected",
                    v.0, w.0
                ));
            }
        }
        Ok(())
    }

    /// Groups of the cells of `v` (in the order of [`Self::cells_of_vertex`]) that are connected through facets containing
    /// `v`, and how many groups there are. One group: the link of the vertex is connected.
    pub fn link_components(&self, v: VertexId) -> (Vec<usize>, usize) {
        self.pieces_among(&self.cells_of_vertex[v.index()], |side| {
            self.cells[side.cell.index()][side.local as usize] != v
        })
    }
}

fn orient<const N: usize>(positions: &[Point], cells: &mut [[VertexId; N]], planar: bool) -> Result<(), MeshError> {
    let mut negative = Vec::new();
    for (cell, c) in cells.iter().enumerate() {
        let p = c.map(|v| positions[v.index()]);
        let s = match N == 4 || planar {
            true => predicates::orientation(&p),
            false => (p[1] - p[0]).cross(&(p[2] - p[0])).norm(),
        };
        if s == 0.0 {
            return Err(MeshError::ZeroVolume {
                cell,
                corners: c.iter().map(|v| v.index()).collect(),
            });
        }
        if s < 0.0 {
            negative.push(cell);
        }
    }
    if negative.len() == cells.len() {
        for c in cells.iter_mut() {
            c.swap(N - 2, N - 1);
        }
    } else if let Some(&cell) = negative.first() {
        return Err(MeshError::Inverted {
            cell,
            others: cells.len() - negative.len(),
        });
    }
    Ok(())
}
