//! Dead loads: work-equivalent nodal forces of gravity, tractions and pressures on the rest shape.

use kerfem_mesh::{FacetSide, Point, TetMesh};

use crate::Assembler;

/// `f += m_v g` for every vertex `v`: gravity `g` (m/s²) on the lumped mass, which is also the consistent load. `f` (N)
/// has 3 entries per vertex slot.
///
/// # Panics
/// If `f` is too short.
pub fn add_gravity(mesh: &TetMesh, assembler: &Assembler, g: [f64; 3], f: &mut [f64]) {
    for v in mesh.vertex_ids() {
        for axis in 0..3 {
            f[3 * v.index() + axis] += assembler.lumped_mass()[v.index()] * g[axis];
        }
    }
}

/// Adds the load of a traction `t(X)` (Pa, by rest position) on facets to `f` (N, 3 entries per vertex slot).
///
/// Evaluated at the midpoints of the three edges of each facet: exact for tractions linear in X.
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_traction(mesh: &TetMesh, facets: &[FacetSide], traction: impl Fn(Point) -> [f64; 3], f: &mut [f64]) {
    for &side in facets {
        let corners = mesh.facet_corners(side);
        let p = corners.map(|v| mesh.rest_position(v));
        let area = (p[1] - p[0]).cross(&(p[2] - p[0])).norm() / 2.0;
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let t = traction((p[a] + p[b]) / 2.0);
            // a third of the area, half of it to each end of the edge
            for v in [corners[a], corners[b]] {
                for axis in 0..3 {
                    f[3 * v.index() + axis] += area / 6.0 * t[axis];
                }
            }
        }
    }
}

/// Adds the load of a pressure (Pa, positive: pushing along the inward rest normal) on facets to `f` (N, 3 entries per
/// vertex slot).
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_pressure(mesh: &TetMesh, facets: &[FacetSide], pressure: f64, f: &mut [f64]) {
    for &side in facets {
        let corners = mesh.facet_corners(side);
        let p = corners.map(|v| mesh.rest_position(v));
        // the corners turn counter-clockwise seen from outside: the cross product points out
        let share = (p[1] - p[0]).cross(&(p[2] - p[0])) * (-pressure / 6.0);
        for v in corners {
            for axis in 0..3 {
                f[3 * v.index() + axis] += share[axis];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use kerfem_mesh::generate;

    use super::*;
    use crate::Material;

    fn total(f: &[f64]) -> [f64; 3] {
        f.chunks(3)
            .fold([0.0; 3], |s, x| [s[0] + x[0], s[1] + x[1], s[2] + x[2]])
    }

    fn close(a: [f64; 3], b: [f64; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn loads_add_up() {
        let mesh = generate::box_tets([2.0, 1.0, 0.5], [3, 2, 2], [0.0; 3]);
        let n = 3 * mesh.vertex_slots();
        let top: Vec<FacetSide> = mesh
            .boundary_facets()
            .filter(|&s| mesh.facet_corners(s).iter().all(|v| mesh.rest_position(*v).z > 0.499))
            .collect();

        let mut f = vec![0.0; n];
        add_pressure(&mesh, &top, 3.0, &mut f);
        assert!(close(total(&f), [0.0, 0.0, -6.0]), "{:?}", total(&f));

        let mut f = vec![0.0; n];
        add_traction(&mesh, &top, |p| [p.x, 1.0, -p.x * p.y], &mut f);
        assert!(close(total(&f), [2.0, 2.0, -1.0]), "{:?}", total(&f));
        let moment: f64 = (0..n / 3).map(|i| mesh.rest_positions()[i].x * f[3 * i]).sum();
        assert!(
            (moment - 8.0 / 3.0).abs() < 1e-12,
            "work of a linear traction in a linear field: {moment}"
        );

        let all: Vec<FacetSide> = mesh.boundary_facets().collect();
        let mut f = vec![0.0; n];
        add_pressure(&mesh, &all, 3.0, &mut f);
        assert!(close(total(&f), [0.0; 3]));

        let assembler = Assembler::new(&mesh, |_| Material::new(1e5, 0.3, 1000.0).unwrap()).unwrap();
        let mut f = vec![0.0; n];
        add_gravity(&mesh, &assembler, [0.0, 0.0, -10.0], &mut f);
        assert!((total(&f)[2] + 1e4).abs() < 1e-8);
    }
}
