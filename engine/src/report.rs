//! What a run reports (`report.json`).

use kerfem_mesh::{SimplexMesh, quality};
use serde::{Deserialize, Serialize};

/// Quality of the cells at rest; see [`kerfem_mesh::quality`] for the measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QualityFigures {
    /// Smallest radius ratio `3 r / R`, of triangles `2 r / R`.
    pub min_radius_ratio: f64,
    /// Mean radius ratio.
    pub mean_radius_ratio: f64,
    /// Smallest dihedral angle, of triangles angle at a corner (degrees).
    pub min_dihedral_deg: f64,
    /// Largest dihedral angle, of triangles angle at a corner (degrees).
    pub max_dihedral_deg: f64,
    /// Largest ratio of longest edge to inradius.
    pub max_edge_over_inradius: f64,
    /// Largest over smallest cell, by volume or area.
    pub max_over_min_volume: f64,
    /// Longest over shortest edge.
    pub max_over_min_edge: f64,
}

impl QualityFigures {
    /// Measures a mesh at rest.
    pub fn of<const N: usize>(mesh: &SimplexMesh<N>) -> Self {
        let q = quality::report(mesh, mesh.rest_positions());
        QualityFigures {
            min_radius_ratio: q.min_radius_ratio,
            mean_radius_ratio: q.mean_radius_ratio,
            min_dihedral_deg: q.min_dihedral_deg,
            max_dihedral_deg: q.max_dihedral_deg,
            max_edge_over_inradius: q.max_edge_over_inradius,
            max_over_min_volume: q.max_over_min_volume,
            max_over_min_edge: q.max_over_min_edge,
        }
    }
}

/// Size and quality of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshFigures {
    /// Vertices, unreferenced ones included.
    pub vertices: usize,
    /// Cells.
    pub cells: usize,
    /// Volume at rest; of triangles their area times the thickness.
    pub volume_m3: f64,
    /// Mass.
    pub mass_kg: f64,
    /// Pieces, connected through facets.
    pub pieces: usize,
    /// Quality at rest.
    pub quality: QualityFigures,
}

/// Linear and nonlinear solves of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SolverFigures {
    /// Iterations of the linear solver, of each solve the most that a piece of the body took; of "central-difference" the steps made.
    pub iterations_total: usize,
    /// Most iterations in one step.
    pub iterations_max: usize,
    /// Newton steps.
    pub newton_steps_total: usize,
    /// Largest relative residual at the end of a step.
    pub residual_max: f64,
    /// Steps that missed the tolerance.
    pub unconverged_steps: usize,
}

/// Seconds by the clock, by task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// From reading the scene to the last file.
    pub total: f64,
    /// Matrices, forces and energies.
    pub assemble: f64,
    /// Linear solver.
    pub solve: f64,
    /// Finding what is cut, changing the mesh and its search tree.
    pub cut: f64,
    /// State, conditions and matrices after a cut.
    pub update: f64,
    /// Files.
    pub write: f64,
}

/// Seconds of one cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CutSeconds {
    /// Finding cells.
    pub find: f64,
    /// Changing the mesh.
    pub remesh: f64,
    /// Improving cells.
    pub improve: f64,
    /// State, conditions and matrices.
    pub update: f64,
}

/// One cut.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CutRecord {
    /// When it was made (s).
    pub at: f64,
    /// Method.
    pub method: String,
    /// Time it took.
    pub seconds: CutSeconds,
    /// Cells that are gone.
    pub cells_removed: usize,
    /// Cells that are new.
    pub cells_added: usize,
    /// Vertices that are new.
    pub vertices_added: usize,
    /// Vertices that are gone.
    pub vertices_removed: usize,
    /// Vertices whose rest position changed.
    pub vertices_moved: usize,
    /// Block rows of the matrices that were recomputed.
    pub rows_updated: usize,
    /// Cells whose matrices were recomputed.
    pub cells_updated: usize,
    /// Nodes of the search tree that were looked at.
    pub tree_nodes: usize,
    /// Operations made to improve cells.
    pub operations: usize,
    /// Bad cells left for later steps because the operations allowed were used up.
    pub unfinished: usize,
    /// Area of one lip at rest; in the plane its length times the thickness.
    pub area_m2: f64,
    /// Largest distance of the new faces to the sweep, in the cutting frame.
    pub max_distance_to_sweep_m: f64,
    /// Of a blade: the largest distance from the end of its incision to it; see [`kerfem_cutting::Tip::distance`].
    pub tip_distance_m: Option<f64>,
    /// Change of the rest volume, relative.
    pub volume_change_relative: f64,
    /// Change of the mass, relative.
    pub mass_change_relative: f64,
    /// Change of the linear momentum, relative to the sum of `m |v|`.
    pub momentum_change_relative: f64,
    /// Norm of the velocity correction in the lumped mass (sqrt(J)).
    pub velocity_correction: f64,
    /// Elastic energy before.
    #[serde(rename = "energy_before_J")]
    pub energy_before: f64,
    /// Elastic energy after.
    #[serde(rename = "energy_after_J")]
    pub energy_after: f64,
    /// Pieces before.
    pub pieces_before: usize,
    /// Pieces after.
    pub pieces_after: usize,
    /// Quality before.
    pub quality_before: QualityFigures,
    /// Quality after.
    pub quality_after: QualityFigures,
    /// Why the cut was not made, if it was not.
    pub refused: Vec<String>,
}

/// The checks of `--verify`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VerifyFigures {
    /// K after local updates against a fresh assembly.
    pub stiffness_max_relative_difference: f64,
    /// Mass after local updates against a fresh assembly.
    pub mass_max_relative_difference: f64,
    /// "ok", or the first invariant that broke.
    pub invariants: String,
}

impl Default for VerifyFigures {
    fn default() -> Self {
        VerifyFigures {
            stiffness_max_relative_difference: 0.0,
            mass_max_relative_difference: 0.0,
            invariants: "ok".into(),
        }
    }
}

impl VerifyFigures {
    /// Whether nothing broke.
    pub fn is_ok(&self) -> bool {
        self.invariants == "ok"
    }
}

/// Something that "auto" chose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The choice.
    pub chosen: String,
    /// Why.
    pub why: String,
}

impl CutRecord {
    /// Whether the mesh is not what it was.
    pub fn changes_something(&self) -> bool {
        [
            self.cells_removed,
            self.cells_added,
            self.vertices_added,
            self.vertices_removed,
            self.vertices_moved,
        ] != [0; 5]
    }
}
