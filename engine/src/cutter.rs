//! Cuts the mesh and keeps the search tree true: the only place of the engine that calls the cutting crate.

use kerfem_cutting::{Borders, CutOptions, CutOutcome, Sweep, Tip};
use kerfem_mesh::{Aabb, BoxTree, CellId, Point, SimplexMesh};

use crate::{EngineError, Frame};

/// A tree over the cells of a mesh, and the positions it was made for.
#[derive(Debug, Default)]
pub(crate) struct Cutter {
    tree: Option<BoxTree>,
    positions: Vec<Point>,
    /// The frame of the positions, while they are those of the mesh as it is.
    frame: Option<Frame>,
}

impl Cutter {
    /// Brings positions and tree to a frame. At rest this costs nothing once done; the deformed frame is new each time
    /// (work proportional to the mesh, as for a step).
    pub(crate) fn prepare<const N: usize>(&mut self, mesh: &SimplexMesh<N>, u: &[f64], frame: Frame) {
        if frame == Frame::Rest && self.frame == Some(Frame::Rest) {
            return;
        }
        self.positions.clear();
        self.positions.extend_from_slice(mesh.rest_positions());
        if frame == Frame::Deformed {
            for (p, u) in self.positions.iter_mut().zip(u.as_chunks::<3>().0) {
                *p += Point::from(*u);
            }
        }
        let positions = &self.positions;
        let cell_box = |i: u32| cell_box(mesh, positions, CellId(i));
        match &mut self.tree {
            Some(tree) => tree.refit(cell_box),
            None => self.tree = Some(BoxTree::of_cells(mesh, positions)),
        }
        self.frame = Some(frame);
    }

    /// Cuts the mesh in the frame of the last [`Self::prepare`] and updates the tree where the mesh changed.
    ///
    /// # Errors
    /// [`EngineError::Cut`] for input that cannot be cut with; the mesh is then as it was.
    pub(crate) fn cut<const N: usize>(
        &mut self,
        mesh: &mut SimplexMesh<N>,
        sweep: &Sweep,
        options: &CutOptions,
        borders: Borders<'_>,
    ) -> Result<CutOutcome<N>, EngineError> {
        self.reach(mesh);
        let Some(tree) = &mut self.tree else {
            return Ok(CutOutcome::default());
        };
        let mut outcome = kerfem_cutting::cut_within(mesh, tree, &self.positions, sweep, options, borders)?;
        outcome.report.tree_nodes += self.follow(mesh, &outcome);
        Ok(outcome)
    }

    /// Improves cells in the frame of the last [`Self::prepare`] and updates the tree where the mesh changed.
    ///
    /// # Errors
    /// [`EngineError::Cut`] for options out of range.
    pub(crate) fn improve<const N: usize>(
        &mut self,
        mesh: &mut SimplexMesh<N>,
        cells: &[CellId],
        options: &CutOptions,
        borders: Borders<'_>,
    ) -> Result<CutOutcome<N>, EngineError> {
        self.reach(mesh);
        let mut outcome = kerfem_cutting::improve(mesh, &self.positions, cells, options, borders)?;
        outcome.report.tree_nodes += self.follow(mesh, &outcome);
        Ok(outcome)
    }

    /// Has a position for each vertex slot: those that came without a cut are mid-edge vertices, which no cell has as corners.
    fn reach<const N: usize>(&mut self, mesh: &SimplexMesh<N>) {
        let known = self.positions.len();
        self.positions
            .extend_from_slice(&mesh.rest_positions()[known.min(mesh.vertex_slots())..]);
    }

    /// Carries positions and tree through a change; the tree nodes that were touched.
    fn follow<const N: usize>(&mut self, mesh: &SimplexMesh<N>, outcome: &CutOutcome<N>) -> usize {
        let Some(tree) = &mut self.tree else { return 0 };
        let change = &outcome.change;
        self.positions.resize(mesh.vertex_slots(), Point::zeros());
        for (v, position) in &outcome.positions {
            self.positions[v.index()] = *position;
        }
        let positions = &self.positions;
        let cell_box = |i: u32| cell_box(mesh, positions, CellId(i));
        let mut nodes = 0;
        for c in &change.cells_added {
            nodes += tree.insert(c.id.0, Some(c.parent.0), cell_box).0;
        }
        for c in &change.cells_removed {
            nodes += tree.remove(c.id.0, cell_box).0;
        }
        for c in change.vertices_moved.iter().flat_map(|v| mesh.cells_of_vertex(v.id)) {
            nodes += tree.update(c.0, cell_box).0;
        }
        nodes
    }

    /// What a blade sweeps on its way to `line`, in the frame of the last [`Self::prepare`].
    pub(crate) fn sweep_of<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        tip: &mut Tip,
        line: [Point; 2],
        options: &CutOptions,
        due: bool,
    ) -> Sweep {
        let positions = &self.positions;
        let swept = self
            .tree
            .as_ref()
            .map(|tree| tip.sweep_to(mesh, tree, positions, line, options, due));
        swept.unwrap_or_default()
    }

    /// Lets a tip take note of the cut that it has made on its way to `line`.
    pub(crate) fn arrive<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        tip: &mut Tip,
        line: [Point; 2],
        options: &CutOptions,
    ) {
        if let Some(tree) = &self.tree {
            tip.arrive(mesh, tree, &self.positions, line, options);
        }
    }
}

fn cell_box<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point], c: CellId) -> Aabb {
    Aabb::around(mesh.cell(c).map(|v| positions[v.index()]))
}
