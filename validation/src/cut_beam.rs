//! The cuts behind the references `cut_plane` and `cut_curved`: a beam clamped at `x = 0`, partly cut near its middle.

use kerfem_cutting::{CutOptions, CutOutcome, Sweep, cut};
use kerfem_mesh::{BoxTree, TetMesh, generate, io};

use crate::{ValidationError, reference_file};

/// Names of the cuts.
pub const NAMES: [&str; 2] = ["cut_plane", "cut_curved"];

/// The beam before the cut: 4 x 1 x 1 m, 12 x 4 x 4 boxes of six tetrahedra.
pub fn beam() -> TetMesh {
    generate::box_tets([4.0, 1.0, 1.0], [12, 4, 4], [0.0; 3])
}

/// Cuts a mesh at rest by `references/NAME.obj`, with the default method; without quality maintenance, so that every vertex
/// keeps its number in a file.
///
/// # Errors
/// [`ValidationError`] if the sweep cannot be read or the cut is refused.
pub fn cut_by(mesh: &mut TetMesh, name: &str) -> Result<CutOutcome, ValidationError> {
    let data = io::read_sweep(reference_file(&format!("{name}.obj")))?;
    let (sweep, _) = Sweep::new(data.points, data.triangles)?;
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(mesh, &positions);
    let options = CutOptions {
        improve: false,
        ..CutOptions::default()
    };
    let outcome = cut(mesh, &tree, &positions, &sweep, &options)?;
    match outcome.report.refused.first() {
        Some(why) => Err(ValidationError::Refused {
            name: name.into(),
            why: why.to_string(),
        }),
        None => Ok(outcome),
    }
}
