//! Spherical caps of triangles.

use super::check_count;
use super::disk::Disk;
use crate::{MeshError, Point, TriMesh};

/// A spherical cap of `6 rings^2` triangles in space: the part of the sphere around `center` (m) with `radius` (m) that is
/// seen from the centre within `angle` (rad, more than 0, less than pi; pi/2 is a hemisphere) of the direction z. All
/// vertices lie on the sphere, `6 rings` of them on the rim, vertex 0 at the top; triangles run counter-clockwise seen from
/// outside. Zero rings, a radius that is not positive and an angle out of range give an empty mesh.
///
/// The area converges to `2 pi r^2 (1 - cos angle)` with the square of the number of rings, from below (hemisphere: 37% too
/// small at one, 12% at two, 1.5% at six, 0.06% at thirty). Up to a hemisphere the radius ratio `2 r / R` is 0.77 or more,
/// 0.89 or more in the mean; corner angles 33 to 90 degrees; longest over shortest edge at most 2.1 (seen up to thirty
/// rings). Near an angle of pi the triangles at the rim become narrow.
///
/// # Errors
/// [`MeshError`] if there are too many cells, a coordinate is not finite, or cells have no area because the cap is too small
/// for the rounding at its place.
pub fn cap_triangles(center: [f64; 3], radius: f64, angle: f64, rings: usize) -> Result<TriMesh, MeshError> {
    let possible = radius > 0.0 && angle > 0.0 && angle < std::f64::consts::PI;
    if rings == 0 || !possible {
        return TriMesh::new(Vec::new(), Vec::new());
    }
    check_count("the cap", Disk::num_triangles(rings))?;
    let disk = Disk::new(rings);
    let on_sphere = disk.vertices.iter().map(|v| {
        let (sin, cos) = (angle * (v.ring as f64 / rings as f64)).sin_cos();
        let [x, y] = v.direction;
        Point::from(center) + radius * Point::new(sin * x, sin * y, cos)
    });
    TriMesh::new(on_sphere.collect(), disk.triangles)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, PI};

    use super::*;
    use crate::quality;

    #[test]
    fn a_cap_is_one_piece_of_good_triangles_with_one_rim() {
        let center = Point::new(0.3, -1.0, 2.0);
        for rings in [1, 2, 6, 30] {
            let mesh = cap_triangles(center.into(), 0.1, FRAC_PI_2, rings).unwrap();
            assert_eq!(mesh.num_cells(), 6 * rings * rings);
            assert_eq!((mesh.pieces().1, mesh.is_planar()), (1, false));
            mesh.check(true).unwrap();
            let mut rim: Vec<_> = mesh.boundary_facets().map(|s| mesh.facet_corners(s)).collect();
            assert_eq!(rim.len(), 6 * rings);
            let start = rim[0][0];
            let mut at = start;
            while let Some(next) = rim.iter().position(|e| e[0] == at) {
                at = rim.swap_remove(next)[1];
                assert!((mesh.rest_position(at).z - 2.0).abs() < 1e-15);
            }
            assert!(rim.is_empty() && at == start, "the rim is one loop");
            for c in mesh.cell_ids() {
                let [p, q, r] = mesh.cell_rest_positions(c);
                assert!(
                    (q - p).cross(&(r - p)).dot(&(p + q + r - 3.0 * center)) > 0.0,
                    "cell {}",
                    c.0
                );
            }
            for p in mesh.rest_positions() {
                assert!(((p - center).norm() - 0.1).abs() < 1e-15);
            }
            let report = quality::report(&mesh, mesh.rest_positions());
            let name = format!("{rings}: {report:?}");
            assert!(
                report.min_radius_ratio > 0.77 && report.mean_radius_ratio > 0.89,
                "{name}"
            );
            assert!(
                report.min_dihedral_deg > 33.0 && report.max_dihedral_deg < 90.0,
                "{name}"
            );
            assert!(report.max_over_min_edge < 2.1, "{name}");
        }
    }

    #[test]
    fn the_area_of_a_cap_converges_with_order_two() {
        for angle in [0.1, FRAC_PI_3, FRAC_PI_2, 2.5] {
            let exact = 2.0 * PI * 9.0 * (1.0 - angle.cos());
            let error = |rings| exact - quality::volume(&cap_triangles([0.0; 3], 3.0, angle, rings).unwrap());
            let (coarse, fine) = (error(8), error(16));
            assert!(fine > 0.0 && fine / exact < 5e-3, "{angle}: {}", fine / exact);
            let rate = (coarse / fine).log2();
            assert!((rate - 2.0).abs() < 0.05, "{angle}: rate {rate}");
        }
    }

    #[test]
    fn impossible_caps_are_empty_or_errors() {
        for (radius, angle, rings) in [
            (0.0, 1.0, 2),
            (f64::NAN, 1.0, 2),
            (1.0, 0.0, 2),
            (1.0, f64::NAN, 2),
            (1.0, PI, 2),
            (1.0, 1.0, 0),
        ] {
            let mesh = cap_triangles([0.0; 3], radius, angle, rings).unwrap();
            assert_eq!(mesh.num_vertices(), 0, "{radius} {angle} {rings}");
        }
        assert!(matches!(
            cap_triangles([0.0; 3], 1.0, 1.0, usize::MAX),
            Err(MeshError::TooLarge { .. })
        ));
        assert!(matches!(
            cap_triangles([1.0; 3], 1e-20, 1.0, 2),
            Err(MeshError::ZeroVolume { .. })
        ));
        for (center, radius) in [(f64::NAN, 1.0), (0.0, f64::INFINITY)] {
            assert!(matches!(
                cap_triangles([center; 3], radius, 1.0, 2),
                Err(MeshError::NotFinite { .. })
            ));
        }
    }
}
