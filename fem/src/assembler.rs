//! Stiffness and mass of a mesh, kept current by what a change touches.

use std::borrow::Cow;
use std::sync::Mutex;

use kerfem_mesh::{CellId, FacetSide, MOST_NODES, MeshChange, Midpoints, SimplexMesh, VertexId, quadratic_shapes};
use rayon::prelude::*;

use crate::element::Element;
use crate::evaluate::Scratch;
use crate::parallel::for_each_slot;
use crate::patch::{Patch, patches_of_vertex};
use crate::pattern::Pattern;
use crate::quadratic::{self, Quadratic};
use crate::rows::{Slots, cells_of_row, corner_of, lumped_mass, mass_row, row_pattern, row_slots, stiffness_row};
use crate::{BlockMatrix, FemError, Locking, MassMatrix, Material};

/// What an update recomputed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Touched {
    /// Rows recomputed.
    pub rows: usize,
    /// Cells recomputed.
    pub cells: usize,
    /// Rows that outgrew their place and moved to the end of the arena.
    pub rows_moved: usize,
    /// Whether the arena was compacted: the only work proportional to the mesh, amortised over the moves.
    pub compacted: bool,
    /// The rows recomputed (vertex slots), ascending.
    pub row_ids: Vec<u32>,
}

/// K, M and their common pattern for one mesh of linear tetrahedra or planar triangles (`N = 3`).
///
/// A planar body has the same three dofs a vertex as any other; along z there is mass but no stiffness, and `u_z` does
/// nothing. Prescribe it as zero on every vertex when solving. That costs up to 2.25 times the memory and products of blocks
/// of two; see [`Material::in_plane`] for plane strain, plane stress and the thickness.
///
/// Every row is the sum over the cells of its vertex in ascending order, and then over the patches around it if locking is
/// cured (see [`Locking`]), so a row recomputed after a change has the bits of a fresh assembly.
#[derive(Debug)]
pub struct Assembler<const N: usize = 4> {
    /// By cell slot; of empty slots: what they last held.
    pub(crate) elements: Vec<Element<N>>,
    materials: Vec<Material>,
    locking: Locking,
    /// By vertex slot, and then material; all empty, or no slots at all, where nothing is cured.
    pub(crate) patches: Vec<Vec<Patch<N>>>,
    pub(crate) slots: Vec<Slots<N>>,
    /// Of order 2: its nodes; then `slots` is not used.
    pub(crate) quadratic: Option<Quadratic<N>>,
    pub(crate) stiffness: BlockMatrix,
    /// Consistent mass by block.
    pub(crate) mass: Vec<f64>,
    pub(crate) lumped: Vec<f64>,
    /// The pattern's number before the last update that changed it, and the rows which that update changed.
    stamp_before: u64,
    rows_changed: Vec<u32>,
    pub(crate) scratch: Mutex<Scratch<N>>,
}

impl<const N: usize> Clone for Assembler<N> {
    fn clone(&self) -> Self {
        Assembler {
            elements: self.elements.clone(),
            materials: self.materials.clone(),
            locking: self.locking,
            patches: self.patches.clone(),
            slots: self.slots.clone(),
            quadratic: self.quadratic.clone(),
            stiffness: self.stiffness.clone(),
            mass: self.mass.clone(),
            lumped: self.lumped.clone(),
            stamp_before: self.stamp_before,
            rows_changed: self.rows_changed.clone(),
            scratch: Mutex::default(),
        }
    }
}

impl<const N: usize> Assembler<N> {
    /// Assembles a mesh with no cure of locking; `material_of` is asked once per cell.
    ///
    /// # Errors
    /// As [`Self::with_cure`].
    pub fn new(mesh: &SimplexMesh<N>, material_of: impl Fn(CellId) -> Material) -> Result<Self, FemError> {
        Self::with_cure(mesh, Locking::None, material_of)
    }

    /// Assembles a mesh whose locking is cured, or not, as told; `material_of` is asked once per cell.
    ///
    /// # Errors
    /// [`FemError::InvertedCell`] if a rest volume is not positive, [`FemError::TooManyNeighbors`] beyond 65535 around a
    /// vertex, [`FemError::NotPlanar`] for a surface in space.
    pub fn with_cure(
        mesh: &SimplexMesh<N>,
        locking: Locking,
        material_of: impl Fn(CellId) -> Material,
    ) -> Result<Self, FemError> {
        Self::of_order(mesh, None, locking, material_of)
    }

    /// Assembles a mesh for order 2: with `midpoints`, the mid-edge vertices of the mesh, as further nodes of its cells.
    ///
    /// # Errors
    /// As [`Self::with_cure`].
    pub fn quadratic(
        mesh: &SimplexMesh<N>,
        midpoints: Midpoints<N>,
        material_of: impl Fn(CellId) -> Material,
    ) -> Result<Self, FemError> {
        Self::of_order(mesh, Some(midpoints), Locking::None, material_of)
    }

    pub(crate) fn of_order(
        mesh: &SimplexMesh<N>,
        midpoints: Option<Midpoints<N>>,
        locking: Locking,
        material_of: impl Fn(CellId) -> Material,
    ) -> Result<Self, FemError> {
        let quadratic = midpoints.map(|midpoints| Quadratic {
            midpoints,
            slots: Vec::new(),
        });
        if N == 3 && !mesh.is_planar() {
            return Err(FemError::NotPlanar);
        }
        let mut elements = vec![Element::default(); mesh.cell_slots()];
        let mut materials = vec![Material::UNUSED; mesh.cell_slots()];
        for c in mesh.cell_ids() {
            materials[c.index()] = material_of(c);
            elements[c.index()] = element(mesh, c, &materials[c.index()], locking)?;
        }
        let cured = mesh.cell_ids().any(|c| locking.cures::<N>(&materials[c.index()]));
        let locking = if cured { locking } else { Locking::None };
        let patched = if cured { mesh.vertex_slots() as u32 } else { 0 };
        let patches: Vec<Vec<Patch<N>>> = (0..patched)
            .into_par_iter()
            .map(|v| patches_of_vertex(mesh, v, locking, |c| (&elements[c.index()], &materials[c.index()])))
            .collect();
        let rows: Vec<Vec<u32>> = (0..mesh.vertex_slots() as u32)
            .into_par_iter()
            .map(|v| {
                let patches_of = |w: u32| patches.get(w as usize).map_or(&[] as &[Patch<N>], Vec::as_slice);
                columns(mesh, quadratic.as_ref(), v, patches_of)
            })
            .collect::<Result<_, _>>()?;
        let pattern = Pattern::new(rows.len(), |i| rows[i].len(), |i, out| out.extend_from_slice(&rows[i]));
        let mut assembler = Assembler {
            slots: Vec::new(),
            quadratic,
            mass: vec![0.0; pattern.arena()],
            lumped: vec![0.0; mesh.vertex_slots()],
            stamp_before: pattern.stamp(),
            stiffness: BlockMatrix::zeros(pattern),
            elements,
            materials,
            locking,
            patches,
            rows_changed: Vec::new(),
            scratch: Mutex::default(),
        };
        assembler.fill(mesh);
        Ok(assembler)
    }

    fn fill(&mut self, mesh: &SimplexMesh<N>) {
        let pattern = &self.stiffness.pattern;
        if let Some(quadratic) = &mut self.quadratic {
            quadratic.place_all(mesh, pattern);
            let (elements, quadratic) = (&self.elements, &*quadratic);
            pattern.for_each_row(&mut self.stiffness.values, |i, _, row| {
                quadratic.stiffness_row(mesh, elements, i, row)
            });
            pattern.for_each_row(&mut self.mass, |i, _, row| quadratic.mass_row(mesh, elements, i, row));
            for_each_slot(&mut self.lumped, |i, m| *m = quadratic.lumped_mass(mesh, elements, i));
            return;
        }
        self.slots.resize(mesh.cell_slots(), [[0; N]; N]);
        for_each_slot(&mut self.slots, |c, slots| {
            let c = CellId(c as u32);
            if mesh.has_cell(c) {
                for a in 0..N {
                    slots[a] = row_slots(mesh, pattern, c, a);
                }
            }
        });
        let (elements, slots, patches) = (&self.elements, &self.slots, &self.patches);
        pattern.for_each_row(&mut self.stiffness.values, |i, cols, row| {
            stiffness_row(mesh, elements, slots, patches, i, cols, row)
        });
        pattern.for_each_row(&mut self.mass, |i, _, row| mass_row(mesh, elements, slots, i, row));
        for_each_slot(&mut self.lumped, |i, m| *m = lumped_mass(mesh, elements, i));
    }

    /// Brings everything up to date with a mesh that went through `change`: recomputes the cells added and those around
    /// moved vertices, and the rows of their vertices and of the vertices of removed cells, nothing else; where locking is
    /// cured also the patches of these vertices, and the rows of all their corners, before the change and after. A new cell
    /// inherits the material of its parent. Of order 2, `change` comes from [`Self::follow_midpoints`].
    ///
    /// # Errors
    /// [`FemError::InvertedCell`], [`FemError::UnknownParent`], [`FemError::TooManyNeighbors`]; then nothing has changed.
    pub fn update(&mut self, mesh: &SimplexMesh<N>, change: &MeshChange<N>) -> Result<Touched, FemError> {
        let cells = cells_touched(mesh, change);
        let corners = nodes_touched(mesh, self.midpoints(), change, &cells);
        let fresh = self.fresh_elements(mesh, change, &cells)?;
        let patches = self.fresh_patches(mesh, &corners, &fresh);
        let row_ids = self.rows_touched(&corners, &patches);
        let patches_of = |v: u32| match corners.binary_search(&v) {
            Ok(k) => patches.get(k).map_or(&[] as &[Patch<N>], Vec::as_slice),
            Err(_) => self.patches_of(v),
        };
        let rows: Vec<Vec<u32>> = row_ids
            .iter()
            .map(|&i| columns(mesh, self.quadratic.as_ref(), i, patches_of))
            .collect::<Result<_, _>>()?;

        self.resize(mesh);
        for (c, element, material) in fresh {
            self.elements[c.index()] = element;
            self.materials[c.index()] = material;
        }
        for (v, patches) in corners.iter().zip(patches) {
            self.patches[*v as usize] = patches;
        }
        let (rows_moved, compacted) = self.set_rows(mesh.vertex_slots(), &row_ids, &rows);
        for &i in &row_ids {
            self.recompute_row(mesh, i as usize);
        }
        Ok(Touched {
            rows: row_ids.len(),
            cells: cells.len(),
            rows_moved,
            compacted,
            row_ids,
        })
    }

    fn fresh_elements(
        &self,
        mesh: &SimplexMesh<N>,
        change: &MeshChange<N>,
        cells: &[CellId],
    ) -> Result<Vec<(CellId, Element<N>, Material)>, FemError> {
        cells
            .iter()
            .map(|&c| {
                let source = match change.cells_added.binary_search_by_key(&c, |a| a.id) {
                    Ok(k) => change.cells_added[k].parent,
                    Err(_) => c,
                };
                let material = *self.materials.get(source.index()).ok_or(FemError::UnknownParent {
                    cell: c.0,
                    parent: source.0,
                })?;
                let element = element(mesh, c, &material, self.locking)?;
                Ok((c, element, material))
            })
            .collect()
    }

    #[inline]
    fn patches_of(&self, v: u32) -> &[Patch<N>] {
        self.patches.get(v as usize).map_or(&[], Vec::as_slice)
    }

    /// The patches of vertices whose cells have changed; none where nothing is cured.
    fn fresh_patches(
        &self,
        mesh: &SimplexMesh<N>,
        corners: &[u32],
        fresh: &[(CellId, Element<N>, Material)],
    ) -> Vec<Vec<Patch<N>>> {
        if self.locking == Locking::None {
            return Vec::new();
        }
        let cell = |c: CellId| match fresh.binary_search_by_key(&c, |f| f.0) {
            Ok(k) => (&fresh[k].1, &fresh[k].2),
            Err(_) => (&self.elements[c.index()], &self.materials[c.index()]),
        };
        corners
            .iter()
            .map(|&v| patches_of_vertex(mesh, v, self.locking, cell))
            .collect()
    }

    /// Rows that differ, ascending: of vertices whose cells have changed, and of the corners of their patches, old and new.
    fn rows_touched(&self, corners: &[u32], fresh: &[Vec<Patch<N>>]) -> Vec<u32> {
        let old = corners.iter().flat_map(|&v| self.patches_of(v));
        let of_patches = old.chain(fresh.iter().flatten()).flat_map(|p| &p.vertices);
        let mut rows: Vec<u32> = corners.iter().chain(of_patches).copied().collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    fn resize(&mut self, mesh: &SimplexMesh<N>) {
        self.elements.resize(mesh.cell_slots(), Element::default());
        self.materials.resize(mesh.cell_slots(), Material::UNUSED);
        match &mut self.quadratic {
            Some(quadratic) => quadratic.slots.resize(mesh.cell_slots(), Default::default()),
            None => self.slots.resize(mesh.cell_slots(), [[0; N]; N]),
        }
        self.lumped.resize(mesh.vertex_slots(), 0.0);
        if self.locking != Locking::None {
            self.patches.resize_with(mesh.vertex_slots(), Vec::new);
        }
    }

    /// Puts new columns into rows; how many moved, and whether the arena was compacted.
    fn set_rows(&mut self, slots: usize, row_ids: &[u32], rows: &[Vec<u32>]) -> (usize, bool) {
        let pattern = &mut self.stiffness.pattern;
        let grown = slots > pattern.rows();
        let old_slots = pattern.rows();
        let changed: Vec<u32> = row_ids
            .iter()
            .zip(rows)
            .filter(|&(&i, cols)| i as usize >= old_slots || pattern.cols(i as usize) != cols.as_slice())
            .map(|(&i, _)| i)
            .collect();
        if !grown && changed.is_empty() {
            return (0, false);
        }
        self.stamp_before = pattern.stamp();
        pattern.renew_stamp();
        let stamp = pattern.stamp();
        pattern.grow_rows(slots);
        let mut moved = 0;
        for (&i, cols) in row_ids.iter().zip(rows) {
            if changed.binary_search(&i).is_ok() {
                moved += usize::from(pattern.set_row(i as usize, cols));
            }
        }
        self.rows_changed = changed;
        let compacted = settle(pattern, stamp, &mut [&mut self.mass], &mut self.stiffness.values);
        (moved, compacted)
    }

    fn recompute_row(&mut self, mesh: &SimplexMesh<N>, i: usize) {
        let pattern = &self.stiffness.pattern;
        if let Some(quadratic) = &mut self.quadratic {
            quadratic.place_row(mesh, pattern, i);
            let range = pattern.range(i);
            quadratic.stiffness_row(mesh, &self.elements, i, &mut self.stiffness.values[range.clone()]);
            quadratic.mass_row(mesh, &self.elements, i, &mut self.mass[range]);
            self.lumped[i] = quadratic.lumped_mass(mesh, &self.elements, i);
            return;
        }
        for &c in cells_of_row(mesh, i) {
            let a = corner_of(mesh, c, i);
            self.slots[c.index()][a] = row_slots(mesh, pattern, c, a);
        }
        let range = pattern.range(i);
        stiffness_row(
            mesh,
            &self.elements,
            &self.slots,
            &self.patches,
            i,
            pattern.cols(i),
            &mut self.stiffness.values[range.clone()],
        );
        mass_row(mesh, &self.elements, &self.slots, i, &mut self.mass[range]);
        self.lumped[i] = lumped_mass(mesh, &self.elements, i);
    }

    /// Brings the mid-edge vertices up to date with a mesh that went through `change`, and returns the change as it is for
    /// order 2, see [`Midpoints::follow`]. Of order 1 it stays as it is.
    #[must_use]
    pub fn follow_midpoints<'c>(
        &mut self,
        mesh: &mut SimplexMesh<N>,
        change: &'c MeshChange<N>,
    ) -> Cow<'c, MeshChange<N>> {
        match &mut self.quadratic {
            Some(quadratic) => Cow::Owned(quadratic.midpoints.follow(mesh, change.clone())),
            None => Cow::Borrowed(change),
        }
    }

    /// The mid-edge vertices; none of order 1.
    #[inline]
    pub fn midpoints(&self) -> Option<&Midpoints<N>> {
        self.quadratic.as_ref().map(|q| &q.midpoints)
    }

    /// The nodes of a cell: its corners, of order 2 then the vertices on its edges.
    pub fn nodes(&self, mesh: &SimplexMesh<N>, c: CellId) -> impl Iterator<Item = VertexId> + use<N> {
        let (nodes, count) = match &self.quadratic {
            Some(quadratic) => (quadratic.midpoints.nodes(mesh, c), Midpoints::<N>::NODES),
            None => {
                let mut nodes = [VertexId(0); MOST_NODES];
                nodes[..N].copy_from_slice(&mesh.cell(c));
                (nodes, N)
            }
        };
        nodes.into_iter().take(count)
    }

    /// The cells that have a vertex as a node, ascending.
    pub fn cells_of_node<'a>(&'a self, mesh: &'a SimplexMesh<N>, v: VertexId) -> &'a [CellId] {
        match &self.quadratic {
            Some(quadratic) => quadratic.midpoints.cells_of(mesh, v),
            None => mesh.cells_of_vertex(v),
        }
    }

    /// Shape functions of the nodes of a cell at barycentric coordinates.
    pub fn shapes(&self, w: &[f64; N]) -> [f64; MOST_NODES] {
        match &self.quadratic {
            Some(_) => quadratic_shapes(w),
            None => std::array::from_fn(|k| w.get(k).copied().unwrap_or(0.0)),
        }
    }

    /// The value of a nodal field, 3 entries a vertex slot, at barycentric coordinates of a cell.
    ///
    /// # Panics
    /// If the field is too short.
    pub fn interpolate(&self, mesh: &SimplexMesh<N>, c: CellId, w: &[f64; N], field: &[f64]) -> [f64; 3] {
        let mut value = [0.0; 3];
        for (v, shape) in self.nodes(mesh, c).zip(self.shapes(w)) {
            for axis in 0..3 {
                value[axis] += shape * field[3 * v.index() + axis];
            }
        }
        value
    }

    /// The nodes of a facet and the mean of the shape function of each over it.
    pub fn facet_means(&self, mesh: &SimplexMesh<N>, side: FacetSide) -> Vec<(VertexId, f64)> {
        match &self.quadratic {
            Some(quadratic) => {
                let (corner, middle) = if N == 3 {
                    (1.0 / 6.0, 2.0 / 3.0)
                } else {
                    (0.0, 1.0 / 3.0)
                };
                let (nodes, count) = quadratic.midpoints.facet_nodes(mesh, side);
                let mean = |k: usize| if k < N - 1 { corner } else { middle };
                (0..count).map(|k| (nodes[k], mean(k))).collect()
            }
            None => {
                let corners = mesh.facet_corners(side).into_iter().take(N - 1);
                corners.map(|v| (v, 1.0 / (N - 1) as f64)).collect()
            }
        }
    }

    /// The mass matrix of any cell in parts of its mass, by nodes: consistent or lumped.
    pub fn mass_shares(&self, lumped: bool) -> [[f64; MOST_NODES]; MOST_NODES] {
        let nodes = if self.quadratic.is_some() {
            Midpoints::<N>::NODES
        } else {
            N
        };
        let lumped_shares = quadratic::lumped_shares::<N>();
        let share = |a: usize, b: usize| match (self.quadratic.is_some(), lumped) {
            _ if a >= nodes || b >= nodes || (lumped && a != b) => 0.0,
            (true, true) => lumped_shares[a],
            (true, false) => quadratic::mass_share::<N>(a, b),
            (false, true) => 1.0 / N as f64,
            (false, false) => f64::from(1 + u8::from(a == b)) / (N * (N + 1)) as f64,
        };
        std::array::from_fn(|a| std::array::from_fn(|b| share(a, b)))
    }

    /// The linear stiffness at rest (N/m), always current.
    #[inline]
    pub fn stiffness(&self) -> &BlockMatrix {
        &self.stiffness
    }

    /// The linear stiffness at rest (N/m) of the same body with no cure of locking, assembled anew.
    ///
    /// # Errors
    /// As [`Self::new`]; there are none if the mesh is the one assembled.
    pub fn stiffness_without_cure(&self, mesh: &SimplexMesh<N>) -> Result<BlockMatrix, FemError> {
        Ok(Self::new(mesh, |c| *self.material(c))?.stiffness)
    }

    /// How locking is cured; [`Locking::None`] also if no material of the body needs it.
    #[inline]
    pub fn locking(&self) -> Locking {
        self.locking
    }

    /// The consistent mass (kg), always current.
    #[inline]
    pub fn consistent_mass(&self) -> MassMatrix<'_> {
        MassMatrix {
            pattern: &self.stiffness.pattern,
            values: &self.mass,
        }
    }

    /// Lumped mass by vertex slot (kg): each cell gives equal parts of `density * volume` to its corners; of order 2 to its
    /// nodes in proportion to the diagonal of its consistent mass.
    #[inline]
    pub fn lumped_mass(&self) -> &[f64] {
        &self.lumped
    }

    /// Material of a cell; of an empty slot: what it last held.
    ///
    /// # Panics
    /// If there is no such slot.
    #[inline]
    pub fn material(&self, c: CellId) -> &Material {
        &self.materials[c.index()]
    }

    /// Largest eigenvalue (1/s²) of the rest stiffness of a cell against its own share of the lumped mass. The square of no
    /// angular frequency of the body, by lumped mass and wherever it is held, exceeds the largest of these: Irons and Treharne,
    /// "A bound theorem in eigenvalues and its practical applications" (1971). In practice the bound is a few tens of per cent
    /// high; with a cure of locking, which only takes stiffness away, by as much as that takes.
    ///
    /// # Panics
    /// If there is no such slot.
    pub fn largest_eigenvalue(&self, c: CellId) -> f64 {
        let (element, lame) = (&self.elements[c.index()], self.materials[c.index()].lame::<N>());
        match self.quadratic {
            Some(_) => quadratic::largest_eigenvalue(element),
            None => element.largest_eigenvalue(&lame),
        }
    }

    /// A matrix of zeros with the current pattern.
    pub fn new_matrix(&self) -> BlockMatrix {
        BlockMatrix::zeros(self.stiffness.pattern.clone())
    }

    /// Brings a matrix from [`Self::new_matrix`] to the current pattern. If it had the pattern before the last update, only
    /// the rows which that changed are touched; their values become zero. An older one is made anew.
    pub fn follow(&self, out: &mut BlockMatrix) {
        let own = &self.stiffness.pattern;
        if out.pattern.stamp() == own.stamp() {
            return;
        }
        if out.pattern.stamp() != self.stamp_before {
            *out = self.new_matrix();
            return;
        }
        out.pattern.grow_rows(own.rows());
        for &i in &self.rows_changed {
            out.pattern.set_row(i as usize, own.cols(i as usize));
        }
        settle(&mut out.pattern, own.stamp(), &mut [], &mut out.values);
        for &i in &self.rows_changed {
            out.values[own.range(i as usize)].fill([0.0; 9]);
        }
    }
}

/// After changes to a pattern: compacts it if holes prevail, sizes the values, gives it its number.
fn settle(pattern: &mut Pattern, stamp: u64, scalars: &mut [&mut Vec<f64>], blocks: &mut Vec<[f64; 9]>) -> bool {
    scalars.iter_mut().for_each(|s| s.resize(pattern.arena(), 0.0));
    blocks.resize(pattern.arena(), [0.0; 9]);
    let compacts = pattern.wants_compaction();
    if compacts {
        let old = pattern.compact();
        scalars.iter_mut().for_each(|s| pattern.follow_compaction(&old, s));
        pattern.follow_compaction(&old, blocks);
    }
    pattern.adopt_stamp(stamp);
    compacts
}

/// Cells whose shape is new: those added and those around moved vertices, ascending.
fn cells_touched<const N: usize>(mesh: &SimplexMesh<N>, change: &MeshChange<N>) -> Vec<CellId> {
    let added = change.cells_added.iter().map(|c| c.id);
    let around = change
        .vertices_moved
        .iter()
        .flat_map(|v| mesh.cells_of_vertex(v.id).iter().copied());
    let mut cells: Vec<CellId> = added.chain(around).collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

/// The element of a cell, with what a cure leaves it of its stiffness.
fn element<const N: usize>(
    mesh: &SimplexMesh<N>,
    c: CellId,
    material: &Material,
    locking: Locking,
) -> Result<Element<N>, FemError> {
    Ok(Element {
        lame: locking.law_of_cells::<N>(material),
        ..Element::new(c.0, &mesh.cell_rest_positions(c), material)?
    })
}

/// Columns of a row, ascending.
fn columns<'p, const N: usize>(
    mesh: &SimplexMesh<N>,
    quadratic: Option<&Quadratic<N>>,
    i: u32,
    patches_of: impl Fn(u32) -> &'p [Patch<N>],
) -> Result<Vec<u32>, FemError> {
    match quadratic {
        Some(quadratic) => quadratic.row_pattern(mesh, i),
        None => row_pattern(mesh, i, patches_of),
    }
}

/// Nodes whose cells have changed: those of touched and removed cells, ascending.
fn nodes_touched<const N: usize>(
    mesh: &SimplexMesh<N>,
    midpoints: Option<&Midpoints<N>>,
    change: &MeshChange<N>,
    cells: &[CellId],
) -> Vec<u32> {
    let on_edges = |c: CellId| midpoints.map_or(&[] as &[VertexId], |m| m.of_cell(c)).iter().copied();
    let removed = change
        .cells_removed
        .iter()
        .flat_map(|c| c.corners.into_iter().chain(on_edges(c.id)));
    let touched = cells.iter().flat_map(|&c| mesh.cell(c).into_iter().chain(on_edges(c)));
    let mut nodes: Vec<u32> = removed.chain(touched).map(|v| v.0).collect();
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
