//! `--export-system`: the matrices in Matrix Market files, all dofs before constraints, in the vertex order of `final.vtu`;
//! dof = `3 * vertex + axis`, of a planar mesh `2 * vertex + axis`.

use std::path::Path;

use kerfem_fem::{Locking, Tangent};
use kerfem_mesh::io::write_atomically;
use sprs::CsMat;

use super::frames::Numbering;
use crate::{EngineError, Simulation};

/// Writes `system/K.mtx` (linear stiffness at rest, without a cure of locking), `K_tangent.mtx` (operator of the last solve, or the tangent where
/// nothing was solved), `M.mtx`, `M_lumped.mtx` and `f.mtx` (external load).
pub(crate) fn export_system<const N: usize>(folder: &Path, simulation: &Simulation<N>) -> Result<(), EngineError> {
    let folder = folder.join("system");
    super::make_folder(&folder)?;
    let numbering = Numbering::of(&simulation.mesh);
    let assembler = &simulation.assembler;
    let tangent = match simulation.equilibrium.matrix() {
        Some(matrix) => matrix.to_csr(),
        None => {
            let mut matrix = assembler.new_matrix();
            let (mesh, model, u) = (&simulation.mesh, simulation.model, &simulation.state.u);
            assembler.tangent(mesh, model, Tangent::Exact, u, &mut matrix);
            matrix.to_csr()
        }
    };
    let stiffness = match assembler.locking() {
        Locking::None => assembler.stiffness().to_csr(),
        _ => assembler.stiffness_without_cure(&simulation.mesh)?.to_csr(),
    };
    write_matrix::<N>(&folder.join("K.mtx"), &stiffness, &numbering)?;
    write_matrix::<N>(&folder.join("K_tangent.mtx"), &tangent, &numbering)?;
    write_matrix::<N>(&folder.join("M.mtx"), &assembler.consistent_mass().to_csr(), &numbering)?;
    let axes = N - 1;
    let dofs = axes * numbering.vertices.len();
    let mass = |dof: usize| assembler.lumped_mass()[numbering.vertices[dof / axes].index()];
    let written = write_atomically(folder.join("M_lumped.mtx"), |out| {
        writeln!(
            out,
            "%%MatrixMarket matrix coordinate real general\n{dofs} {dofs} {dofs}"
        )?;
        (0..dofs).try_for_each(|d| writeln!(out, "{0} {0} {1:.16e}", d + 1, mass(d)))
    });
    written.map_err(EngineError::Write)?;
    let load = &simulation.buffers.load;
    let written = write_atomically(folder.join("f.mtx"), |out| {
        writeln!(out, "%%MatrixMarket matrix array real general\n{dofs} 1")?;
        let all = numbering.vertices.iter().flat_map(|v| &load[3 * v.index()..][..axes]);
        all.into_iter().try_for_each(|f| writeln!(out, "{f:.16e}"))
    });
    written.map_err(EngineError::Write)
}

fn write_matrix<const N: usize>(path: &Path, matrix: &CsMat<f64>, numbering: &Numbering) -> Result<(), EngineError> {
    let axes = N - 1;
    let dof = |slot_dof: usize| axes * numbering.index[slot_dof / 3] + slot_dof % 3;
    let dofs = axes * numbering.vertices.len();
    let written = |(i, j): (usize, usize)| i % 3 < axes && j % 3 < axes;
    let entries = || matrix.iter().filter(|(value, at)| **value != 0.0 && written(*at));
    let count = entries().count();
    let written = write_atomically(path, |out| {
        writeln!(
            out,
            "%%MatrixMarket matrix coordinate real general\n{dofs} {dofs} {count}"
        )?;
        entries().try_for_each(|(value, (i, j))| writeln!(out, "{} {} {value:.16e}", dof(i) + 1, dof(j) + 1))
    });
    written.map_err(EngineError::Write)
}
