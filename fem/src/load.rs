//! Dead loads: work-equivalent nodal forces of gravity, tractions and pressures on the rest shape.
//!
//! Facets of a planar mesh are edges. What acts on them is given per length (N/m): for a body of some thickness, the traction
//! or pressure (Pa) times the thickness. Gravity acts on the mass, which knows the thickness.

use kerfem_mesh::{FacetSide, Point, SimplexMesh, VertexId};

use crate::Assembler;

/// `f += m_v g` for every vertex `v`: gravity `g` (m/s²) on the lumped mass, so that a body falls freely as one. Of order 1
/// this is also the consistent load. `f` (N) has 3 entries per vertex slot.
///
/// # Panics
/// If `f` is too short.
pub fn add_gravity<const N: usize>(mesh: &SimplexMesh<N>, assembler: &Assembler<N>, g: [f64; 3], f: &mut [f64]) {
    for v in mesh.vertex_ids() {
        add_to(f, v, assembler.lumped_mass()[v.index()], &g);
    }
}

/// [`add_gravity`] on the consistent mass: the work of a quadratic field in a uniform acceleration is exact, which order 2 needs
/// to converge at its rate.
///
/// # Panics
/// If `f` is too short.
pub fn add_consistent_gravity<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    g: [f64; 3],
    f: &mut [f64],
) {
    let mass = assembler.consistent_mass();
    for v in mesh.vertex_ids() {
        add_to(f, v, mass.row_sum(v), &g);
    }
}

/// Barycentric coordinates and weights of points in a facet: exact for polynomials of degree 3 over edges (two Gauss points) or
/// 2 over triangles (the midpoints of their edges).
const OF_ORDER_1: [&[([f64; 3], f64)]; 2] = [
    &[([1.0 - NEAR, NEAR, 0.0], 0.5), ([NEAR, 1.0 - NEAR, 0.0], 0.5)],
    &[
        ([0.5, 0.5, 0.0], 1.0 / 3.0),
        ([0.0, 0.5, 0.5], 1.0 / 3.0),
        ([0.5, 0.0, 0.5], 1.0 / 3.0),
    ],
];
/// (1 - 1/sqrt 3) / 2.
const NEAR: f64 = 0.211_324_865_405_187_13;

/// The same for order 2: exact for degree 5 over edges (three Gauss points) and 4 over triangles (Strang and Fix, six points).
const OF_ORDER_2: [&[([f64; 3], f64)]; 2] = [
    &[
        ([1.0 - NEAREST, NEAREST, 0.0], 5.0 / 18.0),
        ([0.5, 0.5, 0.0], 8.0 / 18.0),
        ([NEAREST, 1.0 - NEAREST, 0.0], 5.0 / 18.0),
    ],
    &[
        ([1.0 - 2.0 * A, A, A], WEIGHT_A),
        ([A, 1.0 - 2.0 * A, A], WEIGHT_A),
        ([A, A, 1.0 - 2.0 * A], WEIGHT_A),
        ([1.0 - 2.0 * B, B, B], WEIGHT_B),
        ([B, 1.0 - 2.0 * B, B], WEIGHT_B),
        ([B, B, 1.0 - 2.0 * B], WEIGHT_B),
    ],
];
/// (1 - sqrt(3/5)) / 2.
const NEAREST: f64 = 0.112_701_665_379_258_31;
const A: f64 = 0.445_948_490_915_964_9;
const B: f64 = 0.091_576_213_509_770_74;
const WEIGHT_A: f64 = 0.223_381_589_678_011_47;
const WEIGHT_B: f64 = 1.0 / 3.0 - WEIGHT_A;

/// Adds the load of a traction `t(X)` (Pa, planar meshes N/m; by rest position) on facets to `f` (N, 3 entries per vertex slot).
///
/// Exact for tractions linear in X, of order 2 also for quadratic ones.
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_traction<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    facets: impl IntoIterator<Item = FacetSide>,
    traction: impl Fn(Point) -> [f64; 3],
    f: &mut [f64],
) {
    let midpoints = assembler.midpoints();
    let rules = if midpoints.is_some() { OF_ORDER_2 } else { OF_ORDER_1 };
    for side in facets {
        let corners = mesh.facet_corners(side);
        let p = corners.map(|v| mesh.rest_position(v));
        let area = mesh.facet_normal(side).norm();
        for (at, weight) in rules[N - 3] {
            let t = traction(p[0] * at[0] + p[1] * at[1] + p[2] * at[2]);
            match midpoints {
                None => {
                    for (v, share) in corners.into_iter().zip(at).take(N - 1) {
                        add_to(f, v, area * weight * share, &t);
                    }
                }
                Some(midpoints) => {
                    let (nodes, count) = midpoints.facet_nodes(mesh, side);
                    for (v, share) in nodes.into_iter().zip(facet_shapes::<N>(at)).take(count) {
                        add_to(f, v, area * weight * share, &t);
                    }
                }
            }
        }
    }
}

/// Quadratic shape functions of a facet, in the order of [`kerfem_mesh::Midpoints::facet_nodes`].
fn facet_shapes<const N: usize>(&[a, b, c]: &[f64; 3]) -> [f64; 6] {
    let corner = |w: f64| (2.0 * w - 1.0) * w;
    match N {
        3 => [corner(a), corner(b), 4.0 * a * b, 0.0, 0.0, 0.0],
        _ => [corner(a), corner(b), corner(c), 4.0 * a * b, 4.0 * b * c, 4.0 * c * a],
    }
}

fn add_to(f: &mut [f64], v: VertexId, factor: f64, vector: &[f64; 3]) {
    for axis in 0..3 {
        f[3 * v.index() + axis] += factor * vector[axis];
    }
}

/// Adds the load of a pressure (Pa, planar meshes N/m; positive: pushing along the inward rest normal) on facets to `f` (N, 3 entries per
/// vertex slot).
///
/// # Panics
/// If `f` is too short or a facet's cell does not exist.
pub fn add_pressure<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    facets: &[FacetSide],
    pressure: f64,
    f: &mut [f64],
) {
    for &side in facets {
        let traction = mesh.facet_normal(side).normalize() * -pressure;
        add_traction(mesh, assembler, [side], |_| traction.into(), f);
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
        let assembler = Assembler::new(&mesh, |_| Material::new(1e5, 0.3, 1000.0).unwrap()).unwrap();
        let n = 3 * mesh.vertex_slots();
        let top: Vec<FacetSide> = mesh
            .boundary_facets()
            .filter(|&s| mesh.facet_corners(s).iter().all(|v| mesh.rest_position(*v).z > 0.499))
            .collect();

        let mut f = vec![0.0; n];
        add_pressure(&mesh, &assembler, &top, 3.0, &mut f);
        assert!(close(total(&f), [0.0, 0.0, -6.0]), "{:?}", total(&f));

        let mut f = vec![0.0; n];
        add_traction(&mesh, &assembler, top, |p| [p.x, 1.0, -p.x * p.y], &mut f);
        assert!(close(total(&f), [2.0, 2.0, -1.0]), "{:?}", total(&f));
        let moment: f64 = (0..n / 3).map(|i| mesh.rest_positions()[i].x * f[3 * i]).sum();
        assert!(
            (moment - 8.0 / 3.0).abs() < 1e-12,
            "work of a linear traction in a linear field: {moment}"
        );

        let all: Vec<FacetSide> = mesh.boundary_facets().collect();
        let mut f = vec![0.0; n];
        add_pressure(&mesh, &assembler, &all, 3.0, &mut f);
        assert!(close(total(&f), [0.0; 3]));

        let mut f = vec![0.0; n];
        add_gravity(&mesh, &assembler, [0.0, 0.0, -10.0], &mut f);
        assert!((total(&f)[2] + 1e4).abs() < 1e-8);
    }
}
