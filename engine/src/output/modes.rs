//! Shapes of natural modes as `.vtu` files.

use std::path::Path;

use kerfem_mesh::io::{VtuArray, write_vtu};
use kerfem_mesh::{Midpoints, SimplexMesh};

use super::frames::Numbering;
use super::series::{FileList, Kind, Series};
use crate::EngineError;

/// The files of the modes of a scene; their list gives their numbers, from one, as times.
pub(crate) struct ModeFiles {
    series: Series,
}

impl ModeFiles {
    pub(crate) fn new(results: &Path, name: &str) -> Result<Self, EngineError> {
        let series = Series::new(Kind::MODES, results, name, FileList::new())?;
        Ok(ModeFiles { series })
    }

    /// Writes the list.
    pub(crate) fn finish(&self) -> Result<(), EngineError> {
        self.series.write_list()
    }

    /// Writes the next mode: a mesh at rest with displacements (m, flat, three a vertex slot).
    pub(crate) fn add<const N: usize>(
        &mut self,
        mesh: &SimplexMesh<N>,
        midpoints: Option<&Midpoints<N>>,
        u: &[f64],
    ) -> Result<(), EngineError> {
        let number = self.series.written().len() + 1;
        let numbering = Numbering::of(mesh);
        let mut grid = numbering.grid(mesh, numbering.cells(mesh, midpoints));
        let shape = VtuArray::reals("displacement", 3, numbering.rows(u, 3));
        grid.point_arrays.push(shape);
        let write = |path: &Path| write_vtu(path, &grid).map_err(EngineError::Write);
        self.series.add(number, number as f64, write)
    }
}
