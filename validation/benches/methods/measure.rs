//! What is measured of a cut.

use std::collections::BTreeSet;
use std::time::Instant;

use kerfem_cutting::{CutOptions, CutOutcome, Sweep, cut};
use kerfem_mesh::{BoxTree, MeshChange, Point, TetMesh, VertexId, quality};
use kerfem_validation::ValidationError;

/// A longest edge over inradius above which Y6 calls a cell bad.
const BAD: f64 = 200.0;

/// The quality of a mesh in the measures of all papers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Quality {
    pub(crate) cells: usize,
    pub(crate) volume: f64,
    /// Smallest and mean `3 r / R` (S14: `r / R` is a third of the smallest).
    pub(crate) min_ratio: f64,
    pub(crate) mean_ratio: f64,
    /// Smallest, largest and mean longest edge over inradius, and the share above 200 (Y6, Y11).
    pub(crate) min_aspect: f64,
    pub(crate) max_aspect: f64,
    pub(crate) mean_aspect: f64,
    pub(crate) bad: f64,
    /// Largest cell over smallest, longest edge over shortest (S14).
    pub(crate) volumes: f64,
    pub(crate) edges: f64,
}

impl Quality {
    pub(crate) fn of(mesh: &TetMesh) -> Quality {
        let report = quality::report(mesh, mesh.rest_positions());
        let aspects: Vec<f64> = mesh
            .cell_ids()
            .map(|c| quality::edge_over_inradius(&mesh.cell_rest_positions(c)))
            .collect();
        let count = aspects.len().max(1) as f64;
        Quality {
            cells: report.cells,
            volume: quality::volume(mesh),
            min_ratio: report.min_radius_ratio,
            mean_ratio: report.mean_radius_ratio,
            min_aspect: aspects.iter().copied().fold(f64::INFINITY, f64::min),
            max_aspect: report.max_edge_over_inradius,
            mean_aspect: aspects.iter().sum::<f64>() / count,
            bad: aspects.iter().filter(|a| **a > BAD).count() as f64 / count,
            volumes: report.max_over_min_volume,
            edges: report.max_over_min_edge,
        }
    }
}

/// Cells that a cut shaped anew: how many there were, and the mean `3 r / R` and number of those in their place (G6).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reshaped {
    pub(crate) before: usize,
    pub(crate) created: usize,
    pub(crate) mean_ratio: f64,
}

impl Reshaped {
    /// Cells that only got other vertices at the same places do not count.
    pub(crate) fn of(mesh: &TetMesh, change: &MeshChange<4>) -> Reshaped {
        let key = |p: [Point; 4]| {
            let mut bits = p.map(|p| [p.x, p.y, p.z].map(f64::to_bits));
            bits.sort_unstable();
            bits
        };
        let old: BTreeSet<_> = change.cells_removed.iter().map(|c| key(c.rest_positions)).collect();
        let places = |c: &kerfem_mesh::AddedCell<4>| mesh.cell_rest_positions(c.id);
        let new: BTreeSet<_> = change.cells_added.iter().map(|c| key(places(c))).collect();
        let created: Vec<f64> = (change.cells_added.iter().map(places))
            .filter(|p| !old.contains(&key(*p)))
            .map(|p| quality::radius_ratio(&p))
            .collect();
        Reshaped {
            before: old.difference(&new).count(),
            created: created.len(),
            mean_ratio: created.iter().sum::<f64>() / created.len().max(1) as f64,
        }
    }
}

/// A mesh after cuts, and what they did.
pub(crate) struct Cut {
    pub(crate) mesh: TetMesh,
    pub(crate) outcome: CutOutcome,
    /// Median over the repeats (s).
    pub(crate) seconds: f64,
}

/// Makes a cut `repeats` times from the same mesh.
pub(crate) fn cut_timed(
    before: &TetMesh,
    sweep: &Sweep,
    options: &CutOptions,
    repeats: usize,
) -> Result<Cut, ValidationError> {
    let positions = before.rest_positions().to_vec();
    let tree = BoxTree::of_cells(before, &positions);
    let mut seconds = Vec::new();
    let (mut mesh, mut outcome) = (before.clone(), CutOutcome::default());
    for _ in 0..repeats {
        mesh = before.clone();
        let clock = Instant::now();
        outcome = cut(&mut mesh, &tree, &positions, sweep, options)?;
        seconds.push(clock.elapsed().as_secs_f64());
    }
    seconds.sort_by(f64::total_cmp);
    let seconds = seconds[seconds.len() / 2];
    Ok(Cut { mesh, outcome, seconds })
}

/// Cells of the mesh before that a cut removed or reshaped by moving a corner.
pub(crate) fn cells_touched(before: &TetMesh, change: &MeshChange<4>) -> usize {
    let around = change
        .vertices_moved
        .iter()
        .flat_map(|v| before.cells_of_vertex(v.id).iter().copied());
    let removed = change.cells_removed.iter().map(|c| c.id);
    around.chain(removed).collect::<BTreeSet<_>>().len()
}

/// Mean edge (m) of a mesh before any cut.
pub(crate) fn mean_size(mesh: &TetMesh) -> f64 {
    mesh.vertex_ids().map(|v: VertexId| mesh.local_size(v)).sum::<f64>() / mesh.num_vertices().max(1) as f64
}

/// A number in three digits, for tables.
pub(crate) fn show(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        a if (0.01..1000.0).contains(&a) => {
            let digits = (2 - a.log10().floor() as i32).clamp(0, 3) as usize;
            format!("{x:.digits$}")
        }
        a if (1000.0..1e5).contains(&a) => format!("{x:.0}"),
        _ => format!("{x:.1e}"),
    }
}
