//! Order 2: exact for quadratic fields, convergent at its rate, and current after edits.

use std::collections::BTreeSet;

use kerfem_fem::{Assembler, LinearSolver, Material, Model, SolverKind, SolverOptions, Tangent, load};
use kerfem_mesh::{
    CellId, EDGES, Edit, FacetSide, Midpoints, Point, SimplexMesh, TetMesh, TriMesh, VertexId, generate,
};
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};

use crate::helpers::{affine, body, entry, largest, product, random, rubber, separate, split_edge};

const MODELS: [Model; 2] = [Model::Linear, Model::Corotated];

fn quadratic<const N: usize>(mesh: &mut SimplexMesh<N>) -> Assembler<N> {
    let midpoints = Midpoints::new(mesh);
    Assembler::quadratic(mesh, midpoints, |_| rubber()).unwrap()
}

/// A rectangle whose inner vertices are moved off the grid.
fn sheet(cells: [usize; 2]) -> TriMesh {
    let plain = generate::rect_triangles([1.0, 1.0], cells, [0.0; 2]).unwrap();
    let mut next = random(3);
    let mut moved = |p: &Point| {
        let inside = [p.x, p.y].iter().all(|x| *x > 1e-9 && *x < 1.0 - 1e-9);
        let reach = if inside { 0.1 / cells[0] as f64 } else { 0.0 };
        p + Point::new(next(), next(), 0.0) * reach
    };
    let points = plain.rest_positions().iter().map(&mut moved).collect();
    let cells = plain.cell_ids().map(|c| plain.cell(c).map(VertexId::index)).collect();
    TriMesh::new(points, cells).unwrap()
}

fn field<const N: usize>(mesh: &SimplexMesh<N>, u: impl Fn(&Point) -> [f64; 3]) -> Vec<f64> {
    mesh.rest_positions().iter().flat_map(u).collect()
}

fn internal<const N: usize>(assembler: &Assembler<N>, mesh: &SimplexMesh<N>, model: Model, u: &[f64]) -> Vec<f64> {
    let mut f = vec![f64::NAN; u.len()];
    assembler.internal_force(mesh, model, u, &mut f);
    f
}

/// Internal forces of a quadratic field balance its body force and its tractions at every node.
fn balances<const N: usize>(
    mut mesh: SimplexMesh<N>,
    u: fn(&Point) -> [f64; 3],
    gradient: fn(&Point) -> Matrix3<f64>,
    divergence: fn(f64, f64) -> [f64; 3],
) {
    let assembler = quadratic(&mut mesh);
    let m = rubber();
    let stress = |p: &Point| {
        let h = gradient(p);
        (h + h.transpose()) * m.mu() + Matrix3::identity() * (m.lambda() * h.trace())
    };
    let u = field(&mesh, u);
    let mut external = vec![0.0; u.len()];
    let gravity = divergence(m.lambda(), m.mu()).map(|d| -d / m.density());
    load::add_consistent_gravity(&mesh, &assembler, gravity, &mut external);
    let facets: Vec<FacetSide> = mesh.boundary_facets().collect();
    for side in facets {
        let normal = mesh.facet_normal(side).normalize();
        load::add_traction(
            &mesh,
            &assembler,
            [side],
            |p| (stress(&p) * normal).into(),
            &mut external,
        );
    }
    let f = internal(&assembler, &mesh, Model::Linear, &u);
    let lost: Vec<f64> = f.iter().zip(&external).map(|(a, b)| a - b).collect();
    assert!(
        largest(&lost) < 1e-12 * largest(&f),
        "{} of {}",
        largest(&lost),
        largest(&f)
    );
    let by_matrix = product(assembler.stiffness(), &u);
    let lost: Vec<f64> = f.iter().zip(&by_matrix).map(|(a, b)| a - b).collect();
    assert!(largest(&lost) < 1e-12 * largest(&f));
    let energy: f64 = 0.5 * f.iter().zip(&u).map(|(f, u)| f * u).sum::<f64>();
    assert!((assembler.energy(&mesh, Model::Linear, &u) / energy - 1.0).abs() < 1e-12);
}

#[test]
fn quadratic_fields_are_exact() {
    balances(
        body([3, 3, 2]),
        |p| [p.x * p.x + p.y * p.z, p.x * p.y - p.z * p.z, p.y * p.y + p.x * p.z],
        |p| Matrix3::new(2.0 * p.x, p.z, p.y, p.y, p.x, -2.0 * p.z, p.z, 2.0 * p.y, p.x),
        |lambda, mu| [6.0 * mu + 4.0 * lambda, -2.0 * mu, 2.0 * mu],
    );
    balances(
        sheet([4, 3]),
        |p| [p.x * p.x + p.x * p.y, p.x * p.y - p.y * p.y, 0.0],
        |p| Matrix3::new(2.0 * p.x + p.y, p.x, 0.0, p.y, p.x - 2.0 * p.y, 0.0, 0.0, 0.0, 0.0),
        |lambda, mu| [5.0 * mu + 3.0 * lambda, -3.0 * mu - lambda, 0.0],
    );
}

/// Root mean square error in the middles of cells, of the gradient of a harmonic function: in equilibrium without a body force.
fn error<const N: usize>(mut mesh: SimplexMesh<N>, exact: fn(&Point) -> [f64; 3], order: u32) -> f64 {
    let assembler = match order {
        2 => quadratic(&mut mesh),
        _ => Assembler::new(&mesh, |_| rubber()).unwrap(),
    };
    let outside = |v: VertexId| match assembler.midpoints() {
        Some(midpoints) => midpoints.boundary_facets_of(&mesh, v).next().is_some(),
        None => mesh.is_boundary_vertex(v),
    };
    let held = |v: VertexId| [outside(v), outside(v), outside(v) || N == 3];
    let fixed: Vec<bool> = mesh.vertex_ids().flat_map(held).collect();
    let mut u = field(&mesh, exact);
    u.iter_mut()
        .zip(&fixed)
        .filter(|(_, f)| !**f)
        .for_each(|(u, _)| *u = 0.0);
    let mut solver = LinearSolver::new(SolverOptions {
        kind: SolverKind::Cholesky,
        ..SolverOptions::default()
    });
    let zero = vec![0.0; u.len()];
    assert!(
        solver
            .solve(assembler.stiffness(), &fixed, &zero, &mut u)
            .unwrap()
            .converged
    );
    let (mut sum, mut count) = (0.0, 0);
    for c in mesh.cell_ids() {
        let middle = mesh.cell_rest_positions(c).iter().sum::<Point>() / N as f64;
        let found = Vector3::from(assembler.interpolate(&mesh, c, &[1.0 / N as f64; N], &u));
        sum += (found - Vector3::from(exact(&middle))).norm_squared();
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}

#[test]
fn errors_fall_at_the_rate_of_the_order() {
    let flat = |p: &Point| [p.x.exp() * p.y.cos(), -p.x.exp() * p.y.sin(), 0.0];
    let deep = |p: &Point| {
        let (a, b) = (0.6 * p.y, 0.8 * p.z);
        [a.cos() * b.cos(), -0.6 * a.sin() * b.cos(), -0.8 * a.cos() * b.sin()].map(|x| x * p.x.exp())
    };
    let cube = |n: usize| generate::box_tets([1.0; 3], [n; 3], [0.0; 3]);
    for (order, least) in [(1, 1.8), (2, 2.8)] {
        let in_the_plane = [4, 8].map(|n| error(sheet([n, n]), flat, order));
        let in_space = [2, 4].map(|n| error(cube(n), deep, order));
        for errors in [in_the_plane, in_space] {
            let rate = (errors[0] / errors[1]).log2();
            assert!(rate > least, "order {order}: {errors:?}, rate {rate}");
        }
    }
}

/// Wavy displacements of a few per cent.
fn wave<const N: usize>(mesh: &SimplexMesh<N>) -> Vec<f64> {
    let mut next = random(11);
    let flat = if N == 3 { 0.0 } else { 1.0 };
    let mut at = |p: &Point| {
        let bent = [0.2 * p.y * p.y + 0.3 * p.x, -0.3 * p.x * p.y, 0.25 * p.x * p.x * flat];
        [0, 1, 2].map(|k| bent[k] + 0.01 * next() * if k == 2 { flat } else { 1.0 })
    };
    mesh.rest_positions().iter().flat_map(&mut at).collect()
}

fn derivatives_agree<const N: usize>(mut mesh: SimplexMesh<N>) {
    let assembler = quadratic(&mut mesh);
    let u = wave(&mesh);
    for model in MODELS {
        let f = internal(&assembler, &mesh, model, &u);
        let mut tangent = assembler.new_matrix();
        assembler.tangent(&mesh, model, Tangent::Exact, &u, &mut tangent);
        let (mut next, h) = (random(5), 1e-6);
        for _ in 0..4 {
            let mut along: Vec<f64> = u.iter().map(|_| next()).collect();
            if N == 3 {
                along.iter_mut().skip(2).step_by(3).for_each(|z| *z = 0.0);
            }
            let at = |t: f64| -> Vec<f64> { u.iter().zip(&along).map(|(u, d)| u + t * d).collect() };
            let energy = |t: f64| assembler.energy(&mesh, model, &at(t));
            let slope = (energy(h) - energy(-h)) / (2.0 * h);
            let exact: f64 = f.iter().zip(&along).map(|(f, d)| f * d).sum();
            assert!(
                (slope - exact).abs() < 1e-6 * exact.abs().max(largest(&f)),
                "{model:?}: {slope} {exact}"
            );
            let (low, high) = (
                internal(&assembler, &mesh, model, &at(-h)),
                internal(&assembler, &mesh, model, &at(h)),
            );
            let turned = product(&tangent, &along);
            let off = (0..u.len())
                .map(|d| ((high[d] - low[d]) / (2.0 * h) - turned[d]).abs())
                .fold(0.0, f64::max);
            assert!(
                off < 1e-6 * largest(&turned),
                "{model:?}: {off} of {}",
                largest(&turned)
            );
        }
        let mut asymmetry: f64 = 0.0;
        for (d, e) in (0..60).flat_map(|d| (0..60).map(move |e| (d, e))) {
            asymmetry = asymmetry.max((entry(&tangent, d, e) - entry(&tangent, e, d)).abs());
        }
        assert!(asymmetry < 1e-9 * rubber().young());
    }
}

#[test]
fn forces_and_tangents_are_derivatives() {
    derivatives_agree(body([2, 2, 1]));
    derivatives_agree(sheet([3, 2]));
}

#[test]
fn rotations_give_no_force() {
    let mut mesh = body([2, 2, 2]);
    let assembler = quadratic(&mut mesh);
    let scale = largest(&internal(&assembler, &mesh, Model::Corotated, &wave(&mesh)));
    for degrees in [1.0f64, 90.0, 180.0] {
        let turn = Rotation3::new(Vector3::new(1.0, 2.0, -0.5).normalize() * degrees.to_radians()).into_inner();
        let u = affine(&mesh, &turn, Point::new(3.0, 0.0, -1.0));
        let f = internal(&assembler, &mesh, Model::Corotated, &u);
        assert!(largest(&f) < 1e-12 * scale, "{degrees}: {}", largest(&f));
    }
}

fn masses_are_those_of_the_body<const N: usize>(mut mesh: SimplexMesh<N>) {
    let assembler = quadratic(&mut mesh);
    let mass = rubber().density() * kerfem_mesh::quality::volume(&mesh);
    let lumped: f64 = assembler.lumped_mass().iter().sum();
    let consistent: f64 = mesh.vertex_ids().map(|v| assembler.consistent_mass().row_sum(v)).sum();
    assert!((lumped / mass - 1.0).abs() < 1e-13 && (consistent / mass - 1.0).abs() < 1e-13);
    assert!(mesh.vertex_ids().all(|v| assembler.lumped_mass()[v.index()] > 0.0));
    // the kinetic energy of a quadratic velocity, against a rule of high degree: v = x² along x over the unit square or cube
    let v = field(&mesh, |p| [p.x * p.x, 0.0, 0.0]);
    let mut momentum = vec![0.0; v.len()];
    assembler.consistent_mass().multiply(&v, &mut momentum);
    let energy: f64 = momentum.iter().zip(&v).map(|(p, v)| p * v).sum();
    assert!((energy / (mass / 5.0) - 1.0).abs() < 1e-12, "{energy}");
}

#[test]
fn masses_are_exact() {
    masses_are_those_of_the_body(generate::box_tets([1.0; 3], [2, 3, 2], [0.0; 3]));
    masses_are_those_of_the_body(sheet([3, 2]));
}

#[test]
fn no_frequency_exceeds_that_of_the_fastest_cell() {
    let mut mesh = body([2, 1, 1]);
    let assembler = quadratic(&mut mesh);
    let bound = mesh
        .cell_ids()
        .map(|c| assembler.largest_eigenvalue(c))
        .fold(0.0, f64::max);
    let roots: Vec<f64> = assembler.lumped_mass().iter().map(|m| m.sqrt()).collect();
    let n = 3 * mesh.vertex_slots();
    let scaled = DMatrix::from_fn(n, n, |d, e| {
        entry(assembler.stiffness(), d, e) / (roots[d / 3] * roots[e / 3])
    });
    let largest = scaled.symmetric_eigenvalues().max();
    assert!(largest <= bound && largest > 0.5 * bound, "{largest} {bound}");
}

/// A quadratic function of the rest position, as a nodal field.
fn sampled(mesh: &TetMesh) -> Vec<f64> {
    field(mesh, |p| {
        [p.x * p.x - p.y, p.x * p.y + p.z * p.z, p.y * p.z - 2.0 * p.x]
    })
}

#[test]
fn updates_equal_a_fresh_assembly_and_carry_quadratic_fields() {
    let mut mesh = body([3, 2, 2]);
    let mut assembler = quadratic(&mut mesh);
    let mut u = sampled(&mesh);
    let mut next = random(42);
    for round in 0..120 {
        let cells: Vec<CellId> = mesh.cell_ids().collect();
        let mut pick = |n: usize| ((next() + 1.0) / 2.0 * n as f64) as usize % n;
        let corners = mesh.cell(cells[pick(cells.len())]);
        let (a, b) = (corners[pick(4)], pick(3));
        let b = corners.into_iter().filter(|v| *v != a).nth(b).unwrap();
        let mut edit = Edit::new(&mut mesh);
        match round % 3 {
            0 => {
                split_edge(&mut edit, a, b, 0.5 + 0.2 * next());
            }
            1 => {
                separate(&mut edit, a, Point::new(next(), next(), next()));
            }
            _ => {
                let place = edit.mesh().rest_position(a) * 0.99 + edit.mesh().rest_position(b) * 0.01;
                edit.move_vertex(a, place, &vec![(a, 0.99), (b, 0.01)]);
            }
        }
        let change = edit.commit();
        let change = assembler.follow_midpoints(&mut mesh, &change);
        assembler.update(&mesh, &change).unwrap();
        let verified = assembler.verify(&mesh);
        assert!(verified.pattern_equal, "round {round}");
        assert_eq!(verified.stiffness_max_relative_difference, 0.0);
        assert_eq!(verified.mass_max_relative_difference, 0.0);

        let old = u.clone();
        u.resize(3 * mesh.vertex_slots(), 0.0);
        let added = change.vertices_added.iter().map(|v| (v.id, &v.parents));
        for (v, parents) in added.chain(change.vertices_moved.iter().map(|v| (v.id, &v.parents))) {
            for axis in 0..3 {
                u[3 * v.index() + axis] = parents.iter().map(|(p, w)| w * old[3 * p.index() + axis]).sum();
            }
        }
        let wanted = sampled(&mesh);
        for v in mesh.vertex_ids() {
            let d = 3 * v.index()..3 * v.index() + 3;
            let off = (0..3)
                .map(|k| (u[d.clone()][k] - wanted[d.clone()][k]).abs())
                .fold(0.0, f64::max);
            assert!(off < 1e-11, "round {round}: vertex {} is off by {off}", v.0);
        }
        // no mid-edge vertex is left over, none is missing
        let restored = Midpoints::restored(&mesh, &assembler.midpoints().unwrap().edges()).unwrap();
        assert_eq!(restored.edges().len(), edges_of(&mesh).len());
    }
}

fn edges_of(mesh: &TetMesh) -> BTreeSet<[VertexId; 2]> {
    let sorted = |[a, b]: [VertexId; 2]| if a < b { [a, b] } else { [b, a] };
    let of_cell = |c: CellId| EDGES.map(|[i, j]| sorted([mesh.cell(c)[i], mesh.cell(c)[j]]));
    mesh.cell_ids().flat_map(of_cell).collect()
}

#[test]
fn a_stiffer_material_is_stiffer_and_the_patch_test_holds() {
    let mut mesh = body([2, 2, 2]);
    let midpoints = Midpoints::new(&mut mesh);
    let stiff = Material::new(1e7, 0.3, 1000.0).unwrap();
    let assembler = Assembler::quadratic(&mesh, midpoints, |_| stiff).unwrap();
    let a = Matrix3::new(1.02, 0.01, 0.0, 0.03, 0.97, -0.01, 0.02, 0.0, 1.05);
    let u = affine(&mesh, &a, Point::new(0.1, -2.0, 3.0));
    for model in MODELS {
        let f = internal(&assembler, &mesh, model, &u);
        let inside = mesh.vertex_ids().filter(|v| {
            assembler
                .midpoints()
                .unwrap()
                .boundary_facets_of(&mesh, *v)
                .next()
                .is_none()
        });
        for v in inside {
            assert!(largest(&f[3 * v.index()..][..3]) < 1e-12 * largest(&f));
        }
        for c in mesh.cell_ids() {
            assert!((assembler.deformation_gradient(&mesh, c, &u) - a).norm() < 1e-13);
        }
    }
}
