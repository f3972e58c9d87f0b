//! Triangles in the plane: what has no counterpart among the tests of tetrahedra, and the same laws again.

use kerfem_fem::{
    Assembler, FemError, LinearSolver, Locking, Material, Model, Plane, SolverKind, SolverOptions, Tangent, load,
};
use kerfem_mesh::{CellId, Edit, FacetLabel, FacetSide, MeshChange, Point, TetMesh, TriMesh, VertexId, generate};
use nalgebra::{DMatrix, Matrix3, Rotation3, SymmetricEigen, Vector3};

use crate::helpers::{affine, largest, product, random};

const THICKNESS: f64 = 0.3;

fn rubber(plane: Plane) -> Material {
    let m = Material::new(1e5, 0.3, 1000.0).unwrap();
    m.in_plane(plane, THICKNESS).unwrap()
}

/// A rectangle whose inner vertices are moved off the grid.
fn sheet(cells: [usize; 2]) -> TriMesh {
    let size = cells.map(|n| 0.5 * n as f64);
    let plain = generate::rect_triangles(size, cells, [0.0; 2]).unwrap();
    let inside = |p: &Point| (0..2).all(|k| p[k] > 1e-9 && p[k] < size[k] - 1e-9);
    let mut next = random(7);
    let mut moved = |p: &Point| {
        if inside(p) {
            p + Point::new(next(), next(), 0.0) * 0.1
        } else {
            *p
        }
    };
    let points = plain.rest_positions().iter().map(&mut moved).collect();
    let cells = plain.cell_ids().map(|c| plain.cell(c).map(|v| v.index())).collect();
    TriMesh::new(points, cells).unwrap()
}

fn internal(assembler: &Assembler<3>, mesh: &TriMesh, model: Model, u: &[f64]) -> Vec<f64> {
    let mut f = vec![f64::NAN; u.len()];
    assembler.internal_force(mesh, model, u, &mut f);
    f
}

/// The dofs along z, and those of the vertices that `also` holds for.
fn fixed(mesh: &TriMesh, also: impl Fn(&Point) -> bool) -> Vec<bool> {
    let points = mesh.rest_positions().iter();
    points.flat_map(|p| [also(p), also(p), true]).collect()
}

fn solve(mesh: &TriMesh, assembler: &Assembler<3>, fixed: &[bool], f: &[f64], mut u: Vec<f64>) -> Vec<f64> {
    let mut solver = LinearSolver::new(SolverOptions {
        kind: SolverKind::Cholesky,
        ..SolverOptions::default()
    });
    let info = solver.solve(assembler.stiffness(), fixed, f, &mut u).unwrap();
    assert!(info.converged && mesh.vertex_slots() == u.len() / 3);
    u
}

fn edges_where(mesh: &TriMesh, on: impl Fn(&Point) -> bool) -> Vec<FacetSide> {
    let all = |s: &FacetSide| mesh.facet_corners(*s).iter().all(|v| on(&mesh.rest_position(*v)));
    mesh.boundary_facets().filter(all).collect()
}

#[test]
fn constant_strain_is_reproduced_and_has_the_stress_of_its_law() {
    let mesh = sheet([5, 4]);
    let a = Matrix3::new(1.02, 0.01, 0.0, 0.03, 0.97, 0.0, 0.0, 0.0, 1.0);
    let u = affine(&mesh, &a, Point::new(0.1, -2.0, 0.0));
    let e = (a + a.transpose()) / 2.0 - Matrix3::identity();
    for plane in [Plane::Strain, Plane::Stress] {
        let material = rubber(plane);
        let assembler = Assembler::new(&mesh, |_| material).unwrap();
        // prescribed on the boundary, found inside
        let hold = fixed(&mesh, |p| {
            edges_where(&mesh, |_| true).iter().any(|s| on_side(&mesh, *s, p))
        });
        let start: Vec<f64> = u.iter().zip(&hold).map(|(u, f)| if *f { *u } else { 0.0 }).collect();
        let found = solve(&mesh, &assembler, &hold, &vec![0.0; u.len()], start);
        assert!(found.iter().zip(&u).all(|(a, b)| (a - b).abs() < 1e-12 * largest(&u)));
        let inner: Vec<usize> = (0..u.len()).filter(|d| !hold[*d]).collect();
        assert!(inner.len() > 20);

        let (nu, mu) = (material.poisson(), material.mu());
        let lambda = material.lambda();
        let mut full = e;
        if plane == Plane::Stress {
            full[(2, 2)] = -nu / (1.0 - nu) * e.trace();
        }
        let expected = full * (2.0 * mu) + Matrix3::identity() * (lambda * full.trace());
        match plane {
            Plane::Stress => assert!(expected[(2, 2)].abs() < 1e-12 * expected.norm()),
            Plane::Strain => {
                let sum = expected[(0, 0)] + expected[(1, 1)];
                assert!((expected[(2, 2)] - nu * sum).abs() < 1e-12 * expected.norm());
            }
        }
        for c in mesh.cell_ids() {
            let stress = assembler.cauchy_like_stress(&mesh, Model::Linear, c, &u);
            assert!(
                (stress - expected).norm() < 1e-11 * expected.norm(),
                "{stress} {expected}"
            );
            let turned = assembler.cauchy_like_stress(&mesh, Model::Corotated, c, &u);
            assert!((turned - expected).norm() < 0.06 * expected.norm());
            assert_eq!(turned[(2, 2)] == 0.0, plane == Plane::Stress);
        }
        for model in [Model::Linear, Model::Corotated] {
            let f = internal(&assembler, &mesh, model, &u);
            assert!(inner.iter().all(|&d| f[d].abs() < 1e-12 * largest(&f)));
        }
        // energy = stress : strain / 2 times the volume
        let volume = 2.5 * 2.0 * THICKNESS;
        let energy = assembler.energy(&mesh, Model::Linear, &u);
        let density = 0.5 * expected.component_mul(&full).sum();
        assert!((energy - density * volume).abs() < 1e-12 * energy);
    }
}

fn on_side(mesh: &TriMesh, side: FacetSide, p: &Point) -> bool {
    mesh.facet_corners(side).iter().any(|v| mesh.rest_position(*v) == *p)
}

#[test]
fn plane_stress_is_plane_strain_of_another_material() {
    let mesh = sheet([3, 3]);
    let (young, nu) = (1e5, 0.3);
    let stress = Assembler::new(&mesh, |_| rubber(Plane::Stress)).unwrap();
    let other = young * (1.0 + 2.0 * nu) / ((1.0 + nu) * (1.0 + nu));
    let equal = Material::new(other, nu / (1.0 + nu), 1000.0).unwrap();
    let strain = Assembler::new(&mesh, |_| equal.in_plane(Plane::Strain, THICKNESS).unwrap()).unwrap();
    let (a, b) = (stress.stiffness(), strain.stiffness());
    for i in 0..a.rows() {
        let size = largest(a.row(i).1.as_flattened());
        let pairs = a.row(i).1.as_flattened().iter().zip(b.row(i).1.as_flattened());
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-14 * size));
    }
}

#[test]
fn a_prism_in_plane_strain_agrees_with_tetrahedra_that_cannot_move_along_z() {
    // one layer of tetrahedra held along z carries the plane strain of a uniform state exactly
    let plain = generate::box_tets([1.0, 1.0, THICKNESS], [2, 2, 1], [0.0; 3]);
    let mesh: &TetMesh = &plain;
    let tets = Assembler::new(mesh, |_| rubber(Plane::Strain)).unwrap();
    let flat = generate::rect_triangles([1.0, 1.0], [2, 2], [0.0; 2]).unwrap();
    let triangles = Assembler::new(&flat, |_| rubber(Plane::Strain)).unwrap();
    let a = Matrix3::new(1.1, 0.2, 0.0, -0.1, 0.8, 0.0, 0.0, 0.0, 1.0);
    for model in [Model::Linear, Model::Corotated] {
        let solid = tets.energy(mesh, model, &affine(mesh, &a, Point::zeros()));
        let planar = triangles.energy(&flat, model, &affine(&flat, &a, Point::zeros()));
        assert!((solid - planar).abs() < 1e-13 * solid, "{model:?}: {solid} {planar}");
    }
    let mass = |m: &[f64]| m.iter().sum::<f64>();
    assert!((mass(tets.lumped_mass()) - mass(triangles.lumped_mass())).abs() < 1e-12 * 300.0);
    assert!((mass(triangles.lumped_mass()) - 1000.0 * THICKNESS).abs() < 1e-10);
}

#[test]
fn rigid_motions_exert_nothing_and_a_rotation_turns_forces() {
    let mesh = sheet([3, 4]);
    let assembler = Assembler::new(&mesh, |_| rubber(Plane::Strain)).unwrap();
    let k = assembler.stiffness();
    let size = (0..k.rows())
        .map(|i| largest(k.row(i).1.as_flattened()))
        .fold(0.0, f64::max);
    let turning = mesh.rest_positions().iter().flat_map(|p| [-p.y, p.x, 0.0]).collect();
    let along = |axis: usize| -> Vec<f64> {
        (0..3 * mesh.vertex_slots())
            .map(|d| f64::from(u8::from(d % 3 == axis)))
            .collect()
    };
    for motion in [turning, along(0), along(1), along(2)] {
        assert!(largest(&product(k, &motion)) < 1e-13 * size);
    }
    for degrees in [10.0, 90.0, 180.0, 271.0] {
        let r = Rotation3::new(Vector3::z() * f64::to_radians(degrees)).into_inner();
        let u = affine(&mesh, &r, Point::new(3.0, -1.0, 0.0));
        assert!(largest(&internal(&assembler, &mesh, Model::Corotated, &u)) < 1e-13 * size);
        assert!(assembler.energy(&mesh, Model::Corotated, &u) < 1e-25 * size);
        // the forces of a deformed state turn with it
        let mut next = random(3);
        let bent: Vec<f64> = (0..u.len())
            .map(|d| if d % 3 == 2 { 0.0 } else { 0.05 * next() })
            .collect();
        let f = internal(&assembler, &mesh, Model::Corotated, &bent);
        let turned: Vec<f64> = (mesh.rest_positions().iter().zip(bent.chunks(3)))
            .flat_map(|(p, u)| <[f64; 3]>::from(r * (p + Point::new(u[0], u[1], 0.0)) - p))
            .collect();
        let g = internal(&assembler, &mesh, Model::Corotated, &turned);
        for (f, g) in f.chunks(3).zip(g.chunks(3)) {
            assert!((r * Point::from_row_slice(f) - Point::from_row_slice(g)).norm() < 1e-12 * size);
        }
    }
}

#[test]
fn forces_and_tangents_are_derivatives() {
    let mesh = sheet([2, 3]);
    let n = 3 * mesh.vertex_slots();
    let mut next = random(11);
    let u: Vec<f64> = (0..n).map(|d| if d % 3 == 2 { 0.0 } else { 0.04 * next() }).collect();
    for plane in [Plane::Strain, Plane::Stress] {
        let assembler = Assembler::new(&mesh, |_| rubber(plane)).unwrap();
        for model in [Model::Linear, Model::Corotated] {
            let f = internal(&assembler, &mesh, model, &u);
            let mut k = assembler.new_matrix();
            assembler.tangent(&mesh, model, Tangent::Exact, &u, &mut k);
            let csr = k.to_csr().to_dense();
            for d in 0..n {
                let ends = [-1e-6, 1e-6].map(|h| {
                    let mut u = u.clone();
                    u[d] += h;
                    u
                });
                let [low, high] = ends.each_ref().map(|u| assembler.energy(&mesh, model, u));
                assert!(((high - low) / 2e-6 - f[d]).abs() < 1e-6 * largest(&f), "{model:?} {d}");
                let [low, high] = ends.map(|u| internal(&assembler, &mesh, model, &u));
                for e in 0..n {
                    let slope = (high[e] - low[e]) / 2e-6;
                    assert!((slope - csr[[e, d]]).abs() < 1e-7 * 3e5, "{model:?} {e} {d}");
                }
            }
        }
    }
}

#[test]
fn the_warped_tangent_is_positive_definite_on_the_free_dofs_whatever_the_state() {
    let mesh = sheet([3, 3]);
    let assembler = Assembler::new(&mesh, |_| rubber(Plane::Stress)).unwrap();
    let hold = fixed(&mesh, |p| p.x < 1e-9);
    let free: Vec<usize> = (0..hold.len()).filter(|d| !hold[*d]).collect();
    let mut next = random(5);
    for size in [0.05, 0.5, 5.0] {
        let u: Vec<f64> = hold.iter().map(|f| if *f { 0.0 } else { size * next() }).collect();
        let mut k = assembler.new_matrix();
        for tangent in [Tangent::Warped, Tangent::Projected] {
            assembler.tangent(&mesh, Model::Corotated, tangent, &u, &mut k);
            let csr = k.to_csr().to_dense();
            let dense = DMatrix::from_fn(free.len(), free.len(), |i, j| csr[[free[i], free[j]]]);
            let values = SymmetricEigen::new(dense).eigenvalues;
            let least = if tangent == Tangent::Warped { 1e-6 } else { -1e-12 };
            assert!(
                values.min() > least * values.max(),
                "{size} {tangent:?}: {}",
                values.min()
            );
        }
    }
}

#[test]
fn a_cantilever_converges_to_the_beam_with_shear() {
    // Timoshenko and Goodier, Theory of Elasticity, art. 21: parabolic shear at the free end, plane stress; the support
    // has the exact displacements
    let (length, height, force, nu) = (4.0, 1.0, 2.0, 0.3);
    let inertia = THICKNESS * height * height * height / 12.0;
    let young = 1e5;
    let exact = |p: &Point| {
        let (x, y) = (length - p.x, p.y - height / 2.0);
        let c = force / (6.0 * young * inertia);
        let u = c * y * (3.0 * x * x - (2.0 + nu) * y * y);
        let v = c * (x * x * x + 3.0 * nu * x * y * y - 1.5 * (1.0 + nu) * height * height * x);
        [u, v, 0.0]
    };
    let mut errors = Vec::new();
    for n in [8, 16, 32] {
        let mesh = generate::rect_triangles([length, height], [4 * n, n], [0.0; 2]).unwrap();
        let assembler = Assembler::new(&mesh, |_| rubber(Plane::Stress)).unwrap();
        let hold = fixed(&mesh, |p| p.x < 1e-9);
        let mut u: Vec<f64> = mesh.rest_positions().iter().flat_map(exact).collect();
        let wanted = u.clone();
        u.iter_mut()
            .zip(&hold)
            .filter(|(_, h)| !**h)
            .for_each(|(u, _)| *u = 0.0);
        let mut f = vec![0.0; u.len()];
        // the parabolic shear of the exact solution at the free end, as N/m
        let shear = |p: Point| {
            let y = p.y - height / 2.0;
            [
                0.0,
                force / (2.0 * inertia) * (height * height / 4.0 - y * y) * THICKNESS,
                0.0,
            ]
        };
        load::add_traction(
            &mesh,
            &assembler,
            edges_where(&mesh, |p| p.x > length - 1e-9),
            shear,
            &mut f,
        );
        let found = solve(&mesh, &assembler, &hold, &f, u);
        let difference = found
            .iter()
            .zip(&wanted)
            .map(|(a, b)| (a - b) * (a - b))
            .sum::<f64>()
            .sqrt();
        let size = wanted.iter().map(|b| b * b).sum::<f64>().sqrt();
        errors.push(difference / size);
    }
    let rates: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    assert!(errors[2] < 0.012 && rates[1] > 1.95, "{errors:?} {rates:?}");
}

#[test]
fn loads_on_edges_add_up() {
    let mesh = generate::rect_triangles([2.0, 1.0], [3, 2], [0.0; 2]).unwrap();
    let n = 3 * mesh.vertex_slots();
    let top = edges_where(&mesh, |p| p.y > 0.999);
    assert_eq!(top.len(), 3);
    let total = |f: &[f64]| f.chunks(3).fold(Point::zeros(), |s, x| s + Point::from_row_slice(x));
    let assembler = Assembler::new(&mesh, |_| rubber(Plane::Strain)).unwrap();
    let mut f = vec![0.0; n];
    load::add_pressure(&mesh, &assembler, &top, 3.0, &mut f);
    assert!((total(&f) - Point::new(0.0, -6.0, 0.0)).norm() < 1e-14);
    let mut f = vec![0.0; n];
    load::add_traction(&mesh, &assembler, top, |p| [p.x, 1.0, 0.0], &mut f);
    assert!((total(&f) - Point::new(2.0, 2.0, 0.0)).norm() < 1e-14);
    let moment: f64 = (0..n / 3).map(|i| mesh.rest_positions()[i].x * f[3 * i]).sum();
    assert!(
        (moment - 8.0 / 3.0).abs() < 1e-14,
        "work of a linear traction in a linear field: {moment}"
    );
    let all: Vec<FacetSide> = mesh.boundary_facets().collect();
    let mut f = vec![0.0; n];
    load::add_pressure(&mesh, &assembler, &all, 3.0, &mut f);
    assert!(total(&f).norm() < 1e-14);
    let mut f = vec![0.0; n];
    load::add_gravity(&mesh, &assembler, [0.0, -10.0, 0.0], &mut f);
    assert!((total(&f).y + 2.0 * THICKNESS * 1e4).abs() < 1e-9);
}

#[test]
fn a_surface_in_space_and_a_bad_thickness_are_refused() {
    let points = vec![Point::zeros(), Point::x(), Point::new(0.0, 1.0, 1e-9)];
    let mesh = TriMesh::new(points, vec![[0, 1, 2]]).unwrap();
    let refused = Assembler::new(&mesh, |_| rubber(Plane::Strain));
    assert_eq!(refused.map(|_| ()), Err(FemError::NotPlanar));
    let material = Material::new(1.0, 0.3, 1.0).unwrap();
    for thickness in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            material.in_plane(Plane::Strain, thickness),
            Err(FemError::Thickness(_))
        ));
    }
}

/// Splits, doublings and moves, as cuts make them.
fn random_edit(mesh: &mut TriMesh, next: &mut impl FnMut() -> f64) -> MeshChange<3> {
    let cells: Vec<CellId> = mesh.cell_ids().collect();
    let mut pick = |n: usize| ((next() + 1.0) / 2.0 * n as f64) as usize % n;
    let corners = mesh.cell(cells[pick(cells.len())]);
    let (i, shift) = (pick(3), 1 + pick(2));
    let (a, b) = (corners[i], corners[(i + shift) % 3]);
    let (kind, t, angle) = (next(), 0.5 + 0.2 * next(), 4.0 * next());
    let mut edit = Edit::new(mesh);
    let (p, q) = (edit.mesh().rest_position(a), edit.mesh().rest_position(b));
    if kind < 0.0 {
        let ring: Vec<CellId> = edit.mesh().cells_of_edge(a, b).collect();
        let middle = edit.add_vertex(p * (1.0 - t) + q * t, &vec![(a, 1.0 - t), (b, t)]);
        for c in ring {
            let corners = edit.mesh().cell(c);
            edit.remove_cell(c);
            for gone in [a, b] {
                let corners = corners.map(|v| if v == gone { middle } else { v });
                edit.add_cell(corners, c, [FacetLabel::NONE; 3]);
            }
        }
    } else if kind < 0.5 {
        let normal = Point::new(angle.cos(), angle.sin(), 0.0);
        let center = |c: CellId| edit.mesh().cell_rest_positions(c).iter().sum::<Point>() / 3.0;
        let around = edit.mesh().cells_of_vertex(a).iter().copied();
        let far: Vec<CellId> = around.filter(|c| (center(*c) - p).dot(&normal) > 0.0).collect();
        let copy = edit.add_vertex(p, &vec![(a, 1.0)]);
        for c in far {
            let corners = edit.mesh().cell(c).map(|v: VertexId| if v == a { copy } else { v });
            edit.remove_cell(c);
            edit.add_cell(corners, c, [FacetLabel::NONE; 3]);
        }
    } else {
        edit.move_vertex(a, p * 0.98 + q * 0.02, &vec![(a, 0.98), (b, 0.02)]);
    }
    edit.commit()
}

#[test]
fn updates_equal_a_fresh_assembly_to_the_bit_at_any_number_of_threads() {
    let run = |threads: usize, locking: Locking| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut mesh = sheet([8, 8]);
            let (soft, stiff) = (rubber(Plane::Stress), Material::new(9e5, 0.4, 1500.0).unwrap());
            let stiff = stiff.in_plane(Plane::Stress, 0.5).unwrap();
            let material = |c: CellId| if c.0.is_multiple_of(3) { stiff } else { soft };
            let mut assembler = Assembler::with_cure(&mesh, locking, material).unwrap();
            let mut next = random(42);
            for round in 0..300 {
                let change = random_edit(&mut mesh, &mut next);
                assembler.update(&mesh, &change).unwrap();
                if round % 20 == 0 || round == 299 {
                    let v = assembler.verify(&mesh);
                    assert!(v.pattern_equal);
                    let differences = (v.stiffness_max_relative_difference, v.mass_max_relative_difference);
                    assert_eq!(differences, (0.0, 0.0));
                }
            }
            mesh.check(false).unwrap();
            let n = 3 * mesh.vertex_slots();
            let u: Vec<f64> = (0..n).map(|d| if d % 3 == 2 { 0.0 } else { 0.05 * next() }).collect();
            let mut k = assembler.new_matrix();
            assembler.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut k);
            let f = internal(&assembler, &mesh, Model::Corotated, &u);
            let blocks: Vec<_> = (0..k.rows()).flat_map(|i| k.row(i).1.to_vec()).collect();
            (
                blocks,
                f,
                assembler.energy(&mesh, Model::Corotated, &u),
                product(&k, &u),
            )
        })
    };
    for locking in [Locking::None, Locking::Nodal] {
        let one = run(1, locking);
        assert!(one == run(2, locking) && one == run(8, locking));
    }
}
