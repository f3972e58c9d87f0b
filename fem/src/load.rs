//! Dead loads: work-equivalent nodal forces of gravity, tractions and pressures on the rest shape.
//!
//! Facets of a planar mesh are edges. What acts on them is given per length (N/m): for a body of some thickness, the traction
//! or pressure (Pa) times the thickness. Gravity acts on the mass, which knows the thickness.

use kerfem_mesh::{FacetSide, Point, SimplexMesh};

use crate::Assembler;

/// Barycentric coordinates of the two Gauss points of an edge.
const GAUSS: [[f64; 2]; 2] = {
    const NEAR: f64 = 0.211_324_865_405_187_13; // (1 - 1/sqrt 3) / 2
    [[1.0 - NEAR, NEAR], [NEAR, 1.0 - NEAR]]
};

/// `f += m_v g` for every vertex `v`: gravity `g` (m/s²) on the lumped mass, which is also the consistent load. `f` (N)
/// has 3 entries per vertex slot.
///
/// # Panics
/// If `f` is too short.
pub fn add_gravity<const N: usize>(mesh: &SimplexMesh<N>, assembler: &Assembler<N>, g: [f64; 3], f: &mut [f64]) {
    for v in mesh.vertex_ids() {
        for axis in 0..3 {
            f[3 * v.index() + axis] += assembler.lumped_mass()[v.index()] * g[axis];
        }
    }
}

/// Adds the load of a traction `t(X)` (Pa, planar meshes N/m; by rest position) on facets to `f` (N, 3 entries per vertex slot).
///
/// Evaluated at the midpoints of the three edges of each facet, or at the two Gauss points of an edge: exact for tractions
/// linear in X.
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_traction<const N: usize>(
    mesh: &SimplexMesh<N>,
    facets: impl IntoIterator<Item = FacetSide>,
    traction: impl Fn(Point) -> [f64; 3],
    f: &mut [f64],
) {
    for side in facets {
        let corners = mesh.facet_corners(side);
        let p = corners.map(|v| mesh.rest_position(v));
        let area = mesh.facet_normal(side).norm();
        if N == 3 {
            for share in GAUSS {
                let t = traction(p[0] * share[0] + p[1] * share[1]);
                for (v, share) in [corners[0], corners[1]].into_iter().zip(share) {
                    for axis in 0..3 {
                        f[3 * v.index() + axis] += 0.5 * area * share * t[axis];
                    }
                }
            }
            continue;
        }
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

/// Adds the load of a pressure (Pa, planar meshes N/m; positive: pushing along the inward rest normal) on facets to `f` (N, 3 entries per
/// vertex slot).
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_pressure<const N: usize>(mesh: &SimplexMesh<N>, facets: &[FacetSide], pressure: f64, f: &mut [f64]) {
    for &side in facets {
        let share = mesh.facet_normal(side) * (-pressure / (N - 1) as f64);
        for &v in &mesh.facet_corners(side)[..N - 1] {
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
        add_traction(&mesh, top, |p| [p.x, 1.0, -p.x * p.y], &mut f);
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
