//! Points whose displacement is followed over time and through cuts.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use kerfem_fem::Assembler;
use kerfem_mesh::{CellId, Deepest, MeshChange, Point, SimplexMesh};

use crate::{EngineError, Scene};

/// A point outside its cell by at most this much (in barycentric coordinates) still counts as inside.
const OUTSIDE: f64 = 1e-9;

#[derive(Clone, Debug)]
struct Probe<const N: usize> {
    name: String,
    rest: Point,
    /// The cell it lies in, unless that was removed and nothing took its place.
    cell: Option<CellId>,
    weights: [f64; N],
}

/// The probes of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Probes<const N: usize> {
    probes: Vec<Probe<N>>,
}

impl<const N: usize> Probes<N> {
    pub(crate) fn new(scene: &Scene, mesh: &SimplexMesh<N>) -> Result<Self, EngineError> {
        let mut probes = Vec::with_capacity(scene.probe.len());
        for (i, spec) in scene.probe.iter().enumerate() {
            let rest = Point::from(spec.point.in_space());
            let Some((cell, weights)) = locate(mesh, &rest, mesh.cell_ids()) else {
                let message = format!("({}, {}, {}) does not lie in the mesh", rest.x, rest.y, rest.z);
                return Err(scene.source.error("probe", i, "point", message));
            };
            probes.push(Probe {
                name: spec.name.clone(),
                rest,
                cell: Some(cell),
                weights,
            });
        }
        Ok(Probes { probes })
    }

    /// The cells that the probes lie in, to be stored.
    pub(crate) fn cells(&self) -> Vec<Option<CellId>> {
        self.probes.iter().map(|p| p.cell).collect()
    }

    /// The probes of a scene in stored cells.
    ///
    /// # Errors
    /// What does not fit scene and mesh.
    pub(crate) fn restored(scene: &Scene, mesh: &SimplexMesh<N>, cells: &[Option<CellId>]) -> Result<Self, String> {
        let misplaced = || "a probe does not lie in its cell".to_owned();
        if cells.len() != scene.probe.len() {
            return Err(misplaced());
        }
        let probes = scene.probe.iter().zip(cells).map(|(spec, cell)| {
            let rest = Point::from(spec.point.in_space());
            let weights = match cell.filter(|c| mesh.has_cell(*c)) {
                Some(c) => locate(mesh, &rest, [c]).ok_or_else(misplaced)?.1,
                None if cell.is_some() => return Err(misplaced()),
                None => [0.0; N],
            };
            Ok(Probe {
                name: spec.name.clone(),
                rest,
                cell: *cell,
                weights,
            })
        });
        Ok(Probes {
            probes: probes.collect::<Result<_, _>>()?,
        })
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.probes.iter().map(|p| p.name.as_str())
    }

    /// Name, rest position and cell of each probe.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&str, &Point, Option<CellId>)> {
        self.probes.iter().map(|p| (p.name.as_str(), &p.rest, p.cell))
    }

    /// Three displacements (m) a probe; NaN where its cell was removed.
    pub(crate) fn values<'a>(
        &'a self,
        mesh: &'a SimplexMesh<N>,
        assembler: &'a Assembler<N>,
        u: &'a [f64],
    ) -> impl Iterator<Item = f64> + 'a {
        self.probes.iter().flat_map(move |p| {
            p.cell
                .map_or([f64::NAN; 3], |c| assembler.interpolate(mesh, c, &p.weights, u))
        })
    }

    /// Follows a change: a probe stays with the descendants of its cell; where moved vertices left it outside of them, it
    /// goes to the touched cell that holds it.
    pub(crate) fn follow(&mut self, mesh: &SimplexMesh<N>, change: &MeshChange<N>) {
        for probe in &mut self.probes {
            let Some(own) = probe.cell else { continue };
            let heirs = change.cells_added.iter().filter(|c| c.parent == own).map(|c| c.id);
            let near = heirs.chain(mesh.has_cell(own).then_some(own));
            let found = locate(mesh, &probe.rest, near).or_else(|| {
                let moved = change
                    .vertices_moved
                    .iter()
                    .flat_map(|v| mesh.cells_of_vertex(v.id).iter().copied());
                let touched: BTreeSet<CellId> = change.cells_added.iter().map(|c| c.id).chain(moved).collect();
                locate(mesh, &probe.rest, touched)
            });
            match found {
                Some((cell, weights)) => (probe.cell, probe.weights) = (Some(cell), weights),
                None => probe.cell = None,
            }
        }
    }
}

/// The cell among `cells` that holds a rest position best, and the barycentric coordinates there.
pub(crate) fn locate<const N: usize>(
    mesh: &SimplexMesh<N>,
    rest: &Point,
    cells: impl IntoIterator<Item = CellId>,
) -> Option<(CellId, [f64; N])> {
    // of cells that hold it equally well the first
    let cells = cells.into_iter().map(|c| (Reverse(c), mesh.cell_rest_positions(c)));
    let deepest = Deepest::of(rest, cells).filter(|d| d.depth >= -OUTSIDE)?;
    Some((deepest.key.0, deepest.coordinates))
}
