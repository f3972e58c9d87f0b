//! Stress intensity factor of a crack in opening mode, by the opening of its lips.
//!
//! Behind the front of a crack in plane strain the lips are `8 K_I / E' sqrt(r / 2 pi)` apart at the distance `r`, with
//! `E' = E / (1 - nu²)` (in plane stress `E' = E`). What each opening says of `K_I` differs from the limit by a term in `r`, so
//! that a straight line through several is extrapolated to `r = 0` (Chan, Tuba and Wilson 1970). Cells at the front do not
//! know the root of `r`: distances begin some cells behind it.

use std::f64::consts::PI;

use kerfem_fem::{Assembler, Material, Plane};
use kerfem_mesh::{Point, SimplexMesh, quality};
use nalgebra::Vector3;

use crate::StressIntensitySpec;
use crate::fit;
use crate::jump::jump;
use crate::probes::locate;

/// Distances behind the front, in mean edges of the cell at the front, where none are given.
const RADII: [f64; 2] = [2.0, 5.0];
/// Openings that the line goes through.
const OPENINGS: usize = 7;
/// Directions around the normal that are looked along for the crack.
const DIRECTIONS: usize = 48;

/// `K_I` (Pa sqrt(m)) at the rest position of a front; none where no crack ends there.
pub(crate) fn stress_intensity<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    u: &[f64],
    spec: &StressIntensitySpec,
) -> Option<f64> {
    let front = Point::from(spec.front.in_space());
    let normal = Vector3::from(spec.normal.in_space()).normalize();
    let (cell, _) = locate(mesh, &front, mesh.cell_ids())?;
    let [inner, outer] = spec.radii.unwrap_or_else(|| {
        let edges: Vec<f64> = quality::edge_lengths(&mesh.cell_rest_positions(cell)).collect();
        RADII.map(|k| k * edges.iter().sum::<f64>() / edges.len() as f64)
    });
    let opening = |place: Point| Some(jump(mesh, assembler, u, &place, &normal)?.dot(&normal));
    let behind = behind::<N>(&normal, |direction| opening(front + outer * direction))?;
    let modulus = modulus::<N>(assembler.material(cell));
    let samples = (0..OPENINGS).map(|k| {
        let r = inner + (outer - inner) * k as f64 / (OPENINGS - 1) as f64;
        Some((r, modulus / 8.0 * opening(front + r * behind)? * (2.0 * PI / r).sqrt()))
    });
    Some(fit::line(&samples.collect::<Option<Vec<_>>>()?).0)
}

/// `E'` (Pa).
fn modulus<const N: usize>(material: &Material) -> f64 {
    match material.plane() {
        Plane::Stress if N == 3 => material.young(),
        _ => material.young() / (1.0 - material.poisson().powi(2)),
    }
}

/// The direction from a front into its crack: the mean of those along which the lips are apart, by how far they are.
fn behind<const N: usize>(
    normal: &Vector3<f64>,
    opening: impl Fn(Vector3<f64>) -> Option<f64>,
) -> Option<Vector3<f64>> {
    let directions: Vec<Vector3<f64>> = match N {
        3 => {
            let along = normal.cross(&Vector3::z());
            vec![along, -along]
        }
        _ => {
            let first = normal.cross(&Vector3::ith(normal.iamin(), 1.0)).normalize();
            let second = normal.cross(&first);
            let angle = |k: usize| 2.0 * PI * k as f64 / DIRECTIONS as f64;
            (0..DIRECTIONS)
                .map(|k| angle(k).cos() * first + angle(k).sin() * second)
                .collect()
        }
    };
    let apart = directions.iter().map(|d| (d, opening(*d).unwrap_or(0.0).max(0.0)));
    apart.map(|(d, w)| w * d).sum::<Vector3<f64>>().try_normalize(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_crack_is_found_behind_its_front() {
        let normal = Vector3::new(0.0, 1.0, 0.0);
        // open where x < 0
        let found = behind::<4>(&normal, |d| (d.x < 0.0).then(|| (-d.x).sqrt())).unwrap();
        assert!((found + Vector3::x()).norm() < 1e-6, "{found}");
        let found = behind::<3>(&normal, |d| (d.x < 0.0).then_some(1.0)).unwrap();
        assert!((found + Vector3::x()).norm() < 1e-6, "{found}");
        assert_eq!(behind::<4>(&normal, |_| None), None);
    }
}
