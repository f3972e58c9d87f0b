//! What a cut must keep: whole-mesh figures before and after, and the checks of `--verify` (DESIGN "What always holds").

use kerfem_cutting::Method;
use kerfem_mesh::{SimplexMesh, VertexId};
use nalgebra::Vector3;

use crate::momentum::{self, Correction};
use crate::report::{CutRecord, MeshFigures, QualityFigures};
use crate::{EngineError, Simulation};

/// Relative changes up to this are rounding.
const KEPT: f64 = 1e-12;

/// The sum of all loads (N), and that of their norms.
type TotalLoad = (Vector3<f64>, f64);

/// Figures of a body before a cut.
#[derive(Debug)]
pub(crate) struct Audit {
    figures: MeshFigures,
    elastic: f64,
    momentum: Vector3<f64>,
    momentum_scale: f64,
    load: Option<TotalLoad>,
    removes_cells: bool,
}

impl<const N: usize> Simulation<N> {
    /// Size and quality of the mesh as it is (work proportional to the mesh).
    pub fn mesh_figures(&self) -> MeshFigures {
        MeshFigures {
            vertices: self.mesh.num_vertices(),
            cells: self.mesh.num_cells(),
            volume_m3: self.thickness() * kerfem_mesh::quality::volume(&self.mesh),
            mass_kg: self.assembler.lumped_mass().iter().sum(),
            pieces: self.mesh.pieces().1,
            quality: QualityFigures::of(&self.mesh),
        }
    }

    /// Volume (m³) in which the deformed body lies twice because cut faces went through each other ([`kerfem_mesh::overlap`]);
    /// of a planar body its area times the thickness.
    pub fn overlap(&self) -> f64 {
        self.thickness() * kerfem_mesh::overlap(&self.mesh, &self.positions())
    }

    pub(crate) fn audit_before(&mut self, method: Method) -> Option<Audit> {
        (self.records_figures || self.verify.is_some()).then(|| Audit {
            figures: self.mesh_figures(),
            elastic: self.energies.elastic,
            momentum: momentum::linear(&self.mesh, &self.assembler, &self.inertia(), &self.state.v),
            momentum_scale: momentum::scale(&self.assembler, &self.state.v),
            load: self.total_load(),
            removes_cells: method == Method::Delete,
        })
    }

    /// The sum of all loads, where dividing facets cannot change it.
    fn total_load(&mut self) -> Option<TotalLoad> {
        if !self.loads.is_uniform() {
            return None;
        }
        let f = &mut self.buffers.scratch;
        self.loads.force(&self.mesh, &self.assembler, self.state.time, f).ok()?;
        let nodal = f.as_chunks::<3>().0.iter().map(|f| Vector3::from(*f));
        Some(nodal.fold((Vector3::zeros(), 0.0), |(sum, size), f| (sum + f, size + f.norm())))
    }

    /// Completes the record of a cut, and checks the invariants where that was asked for.
    pub(crate) fn audit_after(
        &mut self,
        before: Option<Audit>,
        correction: &Correction,
        record: &mut CutRecord,
    ) -> Result<(), EngineError> {
        let Some(before) = before else { return Ok(()) };
        let after = self.mesh_figures();
        let relative = |a: f64, b: f64| if a == b { 0.0 } else { (b - a) / a };
        let momentum = momentum::linear(&self.mesh, &self.assembler, &self.inertia(), &self.state.v);
        let lost = (momentum - before.momentum).norm();
        record.volume_change_relative = relative(before.figures.volume_m3, after.volume_m3);
        record.mass_change_relative = relative(before.figures.mass_kg, after.mass_kg);
        record.momentum_change_relative = if lost == 0.0 { 0.0 } else { lost / before.momentum_scale };
        (record.energy_before, record.energy_after) = (before.elastic, self.energies.elastic);
        (record.pieces_before, record.pieces_after) = (before.figures.pieces, after.pieces);
        (record.quality_before, record.quality_after) = (before.figures.quality, after.quality);
        if self.verify.is_some() {
            let load = self.total_load();
            let broken = self.first_broken(&before, correction, record, load);
            self.note_verification(broken);
        }
        Ok(())
    }

    fn first_broken(
        &self,
        before: &Audit,
        correction: &Correction,
        record: &CutRecord,
        load: Option<TotalLoad>,
    ) -> Option<String> {
        let kept = [
            ("rest volume", record.volume_change_relative, !before.removes_cells),
            ("mass", record.mass_change_relative, !before.removes_cells),
            (
                "linear momentum",
                record.momentum_change_relative,
                !before.removes_cells && correction.complete,
            ),
        ];
        for (what, change, applies) in kept {
            if applies && change.abs() > KEPT {
                return Some(format!(
                    "a cut changed the {what} by {change:e} of itself; up to {KEPT:e} is rounding"
                ));
            }
        }
        if let (Some((a, size)), Some((b, _)), false) = (before.load, load, before.removes_cells) {
            let change = (b - a).norm();
            if change > KEPT * size {
                return Some(format!(
                    "a cut changed the total load by {change:e} N, from {:e} N",
                    a.norm()
                ));
            }
        }
        None
    }

    /// A vertex that joins cells by a point only, other than those of the file.
    fn pinched_by_a_cut(&self) -> Option<String> {
        pinched_vertices(&self.mesh)
            .find(|v| self.pinched.binary_search(v).is_err())
            .map(|v| format!("the link of vertex {} is not connected", v.0))
    }

    /// Checks mesh, matrices and state as they are, and keeps the first thing that broke; `broken` came before.
    pub(crate) fn note_verification(&mut self, broken: Option<String>) {
        let Some(mut figures) = self.verify.take() else { return };
        let v = self.assembler.verify(&self.mesh);
        let worst = |a: f64, b: f64| if a > b { a } else { b };
        figures.stiffness_max_relative_difference = worst(
            v.stiffness_max_relative_difference,
            figures.stiffness_max_relative_difference,
        );
        figures.mass_max_relative_difference =
            worst(v.mass_max_relative_difference, figures.mass_max_relative_difference);
        let matrices = (v.stiffness_max_relative_difference != 0.0 || v.mass_max_relative_difference != 0.0)
            .then(|| "K or M after local updates differ from a fresh assembly".to_owned());
        let pattern = (!v.pattern_equal).then(|| "the pattern of K differs from a fresh assembly".to_owned());
        let finite = self.state.u.iter().chain(&self.state.v).all(|x| x.is_finite());
        let state = (!finite).then(|| "the state is not finite".to_owned());
        let first = broken
            .or_else(|| self.mesh.check(false).err())
            .or_else(|| self.pinched_by_a_cut())
            .or(matrices)
            .or(pattern)
            .or(state);
        if let (Some(what), true) = (first, figures.is_ok()) {
            figures.invariants = format!("t = {} s: {what}", self.state.time);
        }
        self.verify = Some(figures);
    }
}

/// Vertices whose cells are not all connected through facets at the vertex, ascending.
pub(crate) fn pinched_vertices<const N: usize>(mesh: &SimplexMesh<N>) -> impl Iterator<Item = VertexId> + '_ {
    mesh.vertex_ids().filter(|&v| mesh.link_components(v).1 > 1)
}
