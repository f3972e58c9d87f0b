//! The cure of volumetric locking: exact derivatives, local updates, and that it cures.

use kerfem_fem::{
    Assembler, BlockMatrix, LinearSolver, Locking, Material, Model, Plane, PreconditionerKind, SolverKind,
    SolverOptions, Tangent, load,
};
use kerfem_mesh::{CellId, Edit, FacetSide, Point, SimplexMesh, TetMesh, TriMesh, VertexId, generate};
use nalgebra::{DMatrix, Matrix3, SymmetricEigen};

use crate::helpers::{affine, body, entry, largest, product, random, random_edit, rubber, separate};

const MODELS: [Model; 2] = [Model::Linear, Model::Corotated];

fn nearly_incompressible(poisson: f64) -> Material {
    Material::new(1e5, poisson, 1000.0).unwrap()
}

/// A body of a material that is cured and one that is not.
fn two_materials(mesh: &TetMesh) -> Assembler {
    let soft = nearly_incompressible(0.499);
    let center = |c: CellId| mesh.cell_rest_positions(c).iter().sum::<Point>() / 4.0;
    Assembler::with_cure(mesh, Locking::Auto, |c| if center(c).x < 0.6 { rubber() } else { soft }).unwrap()
}

fn sheet(plane: Plane) -> (TriMesh, Assembler<3>) {
    let mesh = generate::rect_triangles([1.5, 1.0], [3, 2], [0.0; 2]).unwrap();
    let material = nearly_incompressible(0.49).in_plane(plane, 0.3).unwrap();
    let assembler = Assembler::with_cure(&mesh, Locking::Nodal, |_| material).unwrap();
    (mesh, assembler)
}

fn internal<const N: usize>(a: &Assembler<N>, mesh: &SimplexMesh<N>, model: Model, u: &[f64]) -> Vec<f64> {
    let mut f = vec![f64::NAN; u.len()];
    a.internal_force(mesh, model, u, &mut f);
    f
}

/// Small noise on a large stretch and turn, along the axes that the body has.
fn deformed<const N: usize>(mesh: &SimplexMesh<N>) -> Vec<f64> {
    let a = match N {
        3 => Matrix3::new(1.1, -0.5, 0.0, 0.4, 1.2, 0.0, 0.0, 0.0, 1.0),
        _ => Matrix3::new(1.2, -0.5, 0.1, 0.4, 1.1, 0.2, 0.0, 0.3, 1.15),
    };
    let mut next = random(5);
    let mut u = affine(mesh, &a, Point::zeros());
    for (d, u) in u.iter_mut().enumerate() {
        *u += if d % 3 < N - 1 { 0.02 * next() } else { 0.0 };
    }
    u
}

fn dense(k: &BlockMatrix) -> DMatrix<f64> {
    DMatrix::from_fn(3 * k.rows(), 3 * k.rows(), |d, e| entry(k, d, e))
}

#[test]
fn forces_and_tangents_are_exact_derivatives() {
    fn check<const N: usize>(mesh: &SimplexMesh<N>, a: &Assembler<N>) {
        assert!(a.locking() != Locking::None);
        let u = deformed(mesh);
        for model in MODELS {
            let f = internal(a, mesh, model, &u);
            let mut k = a.new_matrix();
            a.tangent(mesh, model, Tangent::Exact, &u, &mut k);
            let size = (0..k.rows()).fold(0.0, |m: f64, i| m.max(largest(k.row(i).1.as_flattened())));
            for d in (0..u.len()).filter(|d| d % 3 < N - 1) {
                let h = 1e-6;
                let mut ends = [u.clone(), u.clone()];
                ends[0][d] -= h;
                ends[1][d] += h;
                let [low, high] = ends.each_ref().map(|u| a.energy(mesh, model, u));
                assert!(
                    ((high - low) / (2.0 * h) - f[d]).abs() < 1e-6 * largest(&f),
                    "{model:?} {d}"
                );
                let [low, high] = ends.each_ref().map(|u| internal(a, mesh, model, u));
                for e in 0..u.len() {
                    let slope = (high[e] - low[e]) / (2.0 * h);
                    assert!((slope - entry(&k, e, d)).abs() < 1e-6 * size, "{model:?} {e} {d}");
                }
            }
        }
    }
    let mesh = body([2, 2, 2]);
    check(&mesh, &two_materials(&mesh));
    for plane in [Plane::Strain, Plane::Stress] {
        let (mesh, a) = sheet(plane);
        check(&mesh, &a);
    }
}

#[test]
fn matrix_and_force_of_a_step_are_those_computed_alone() {
    let mesh = body([2, 2, 2]);
    let a = two_materials(&mesh);
    let u = deformed(&mesh);
    for model in MODELS {
        let (mut k, mut both) = (a.new_matrix(), a.new_matrix());
        a.tangent(&mesh, model, Tangent::Exact, &u, &mut k);
        let mut f = vec![0.0; u.len()];
        let scales = kerfem_fem::Scales {
            stiffness: 1.0,
            mass: 0.0,
        };
        a.linearize(&mesh, model, Tangent::Exact, &u, scales, &mut both, Some(&mut f));
        assert!((0..k.rows()).all(|i| k.row(i) == both.row(i)));
        assert_eq!(f, internal(&a, &mesh, model, &u));
    }
}

#[test]
fn constant_strain_is_reproduced_in_two_materials() {
    let mesh = body([4, 3, 3]);
    let a = Matrix3::new(1.02, 0.01, 0.0, 0.03, 0.97, -0.01, 0.02, 0.0, 1.05);
    let u = affine(&mesh, &a, Point::new(0.1, -2.0, 3.0));
    let plain = Assembler::new(&mesh, |_| nearly_incompressible(0.499)).unwrap();
    let cured = Assembler::with_cure(&mesh, Locking::Auto, |_| nearly_incompressible(0.499)).unwrap();
    let mixed = two_materials(&mesh);
    for model in MODELS {
        let f = internal(&cured, &mesh, model, &u);
        let inner = |v: &VertexId| !mesh.is_boundary_vertex(*v);
        assert!(
            mesh.vertex_ids()
                .filter(inner)
                .all(|v| largest(&f[3 * v.index()..3 * v.index() + 3]) < 1e-11 * largest(&f))
        );
        let (e, all) = (cured.energy(&mesh, model, &u), plain.energy(&mesh, model, &u));
        assert!((e / all - 1.0).abs() < 1e-12, "{model:?}: {e} {all}");
        for c in mesh.cell_ids() {
            let s = cured.cauchy_like_stress(&mesh, model, c, &u);
            let expected = plain.cauchy_like_stress(&mesh, model, c, &u);
            assert!((s - expected).norm() < 1e-9 * expected.norm());
            // also next to another material: no patch reaches into it
            let expected = match mixed.material(c).poisson() > 0.4 {
                true => expected,
                false => Assembler::new(&mesh, |_| rubber())
                    .unwrap()
                    .cauchy_like_stress(&mesh, model, c, &u),
            };
            assert!((mixed.cauchy_like_stress(&mesh, model, c, &u) - expected).norm() < 1e-9 * expected.norm());
            if c.0 > 40 {
                break;
            }
        }
    }
}

#[test]
fn a_rotation_costs_nothing() {
    let mesh = body([3, 2, 2]);
    let a = two_materials(&mesh);
    let turn = nalgebra::Rotation3::new(nalgebra::Vector3::new(1.0, 2.0, -0.5)).into_inner();
    let u = affine(&mesh, &turn, Point::new(3.0, 2.0, 1.0));
    let stretch = affine(&mesh, &Matrix3::from_diagonal_element(1.01), Point::zeros());
    let scale = largest(&internal(&a, &mesh, Model::Corotated, &stretch));
    assert!(largest(&internal(&a, &mesh, Model::Corotated, &u)) < 1e-11 * scale);
}

/// What a stable step of an explicit scheme goes by: averages of strain have no more energy than the strains.
#[test]
fn the_cure_takes_stiffness_away_and_leaves_it_positive() {
    let mesh = body([2, 2, 2]);
    for poisson in [-0.5, 0.2, 0.499] {
        let m = nearly_incompressible(poisson);
        let cured = Assembler::with_cure(&mesh, Locking::Nodal, |_| m).unwrap();
        let plain = dense(&cured.stiffness_without_cure(&mesh).unwrap());
        let own = dense(cured.stiffness());
        let size = plain.amax();
        assert_eq!(&plain, &dense(Assembler::new(&mesh, |_| m).unwrap().stiffness()));
        assert!((&own - own.transpose()).amax() < 1e-14 * size);
        let lost = SymmetricEigen::new(&plain - &own).eigenvalues;
        assert!(lost.min() > -1e-12 * size && lost.max() > 1e-3 * size, "{lost}");
        let values = SymmetricEigen::new(own).eigenvalues;
        let rigid = values.iter().filter(|v| v.abs() < 1e-11 * size).count();
        assert!(rigid == 6 && values.min() > -1e-11 * size, "{values}");
        let bound = mesh.cell_ids().map(|c| cured.largest_eigenvalue(c)).fold(0.0, f64::max);
        let roots: Vec<f64> = cured.lumped_mass().iter().map(|m| m.sqrt()).collect();
        let own = dense(cured.stiffness());
        let scaled = DMatrix::from_fn(own.nrows(), own.ncols(), |d, e| {
            own[(d, e)] / (roots[d / 3] * roots[e / 3])
        });
        assert!(SymmetricEigen::new(scaled).eigenvalues.max() < bound);
    }
}

#[test]
fn what_needs_no_cure_keeps_its_bits() {
    let mesh = body([2, 2, 2]);
    let plain = Assembler::new(&mesh, |_| rubber()).unwrap();
    let auto = Assembler::with_cure(&mesh, Locking::Auto, |_| rubber()).unwrap();
    assert_eq!(auto.locking(), Locking::None);
    assert!((0..mesh.vertex_slots()).all(|i| plain.stiffness().row(i) == auto.stiffness().row(i)));
    let u = deformed(&mesh);
    for model in MODELS {
        assert_eq!(internal(&plain, &mesh, model, &u), internal(&auto, &mesh, model, &u));
        assert_eq!(plain.energy(&mesh, model, &u), auto.energy(&mesh, model, &u));
    }
    let (flat, _) = sheet(Plane::Stress);
    let thin = nearly_incompressible(0.49).in_plane(Plane::Stress, 0.3).unwrap();
    assert_eq!(
        Assembler::with_cure(&flat, Locking::Auto, |_| thin).unwrap().locking(),
        Locking::None
    );
}

#[test]
fn updates_equal_a_fresh_assembly_to_the_bit_at_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut mesh = body([3, 3, 3]);
            let mut a = two_materials(&mesh);
            let mut matrix = a.new_matrix();
            let mut next = random(42);
            for round in 0..200 {
                let change = random_edit(&mut mesh, &mut next);
                a.update(&mesh, &change).unwrap();
                a.follow(&mut matrix);
                if round % 10 == 9 {
                    let v = a.verify(&mesh);
                    assert!(v.pattern_equal);
                    let differences = (v.stiffness_max_relative_difference, v.mass_max_relative_difference);
                    assert_eq!(differences, (0.0, 0.0));
                }
            }
            mesh.check(false).unwrap();
            let u: Vec<f64> = (0..3 * mesh.vertex_slots()).map(|_| 0.02 * next()).collect();
            let fresh = Assembler::with_cure(&mesh, a.locking(), |c| *a.material(c)).unwrap();
            let mut k = fresh.new_matrix();
            fresh.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut k);
            a.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut matrix);
            assert!((0..k.rows()).all(|i| k.row(i) == matrix.row(i)));
            let f = internal(&a, &mesh, Model::Corotated, &u);
            assert_eq!(f, internal(&fresh, &mesh, Model::Corotated, &u));
            let energy = a.energy(&mesh, Model::Corotated, &u);
            assert_eq!(energy, fresh.energy(&mesh, Model::Corotated, &u));
            (f, energy, product(&matrix, &u), product(a.stiffness(), &u))
        })
    };
    assert!(run(1) == run(4));
}

#[test]
fn rows_touched_are_those_of_the_patches_around_an_edit_at_any_size_of_the_mesh() {
    let touched = |n: usize| {
        let mut mesh = generate::box_tets([n as f64; 3], [n; 3], [0.0; 3]);
        let mut a = Assembler::with_cure(&mesh, Locking::Nodal, |_| rubber()).unwrap();
        let middle = VertexId((mesh.vertex_slots() / 2) as u32);
        let mut edit = Edit::new(&mut mesh);
        separate(&mut edit, middle, Point::new(0.1, 0.3, 1.0));
        let change = edit.commit();
        let touched = a.update(&mesh, &change).unwrap();
        assert!(a.verify(&mesh).pattern_equal);
        (touched.rows, touched.cells)
    };
    let small = touched(6);
    assert_eq!(small, touched(10));
    // two rings around a vertex of the box have 65 vertices
    assert!(small.0 < 70, "{small:?}");
}

#[test]
fn no_patch_reaches_across_a_cut() {
    let mesh = parted(
        &generate::box_tets([2.0, 1.0, 1.0], [4, 2, 2], [0.0; 3]),
        |p| (p.x - 1.0).abs() < 1e-9,
        1.0,
    );
    let a = Assembler::with_cure(&mesh, Locking::Auto, |_| nearly_incompressible(0.499)).unwrap();
    let pieces = mesh.pieces();
    assert_eq!(pieces.1, 2);
    let right = |v: usize| {
        mesh.cells_of_vertex(VertexId(v as u32))
            .iter()
            .any(|c| center(&mesh, *c).x > 1.0)
    };
    for i in 0..mesh.vertex_slots() {
        assert!(a.stiffness().row(i).0.iter().all(|&j| right(i) == right(j as usize)));
    }
}

fn center<const N: usize>(mesh: &SimplexMesh<N>, c: CellId) -> Point {
    mesh.cell_rest_positions(c).iter().sum::<Point>() / N as f64
}

/// The mesh with its vertices where `on` holds doubled: the cells beyond x = `at` get the copies.
fn parted<const N: usize>(mesh: &SimplexMesh<N>, on: impl Fn(&Point) -> bool, at: f64) -> SimplexMesh<N> {
    let mut points = mesh.rest_positions().to_vec();
    let copies: Vec<usize> = (0..points.len())
        .map(|v| {
            if !on(&points[v]) {
                return v;
            }
            points.push(points[v]);
            points.len() - 1
        })
        .collect();
    let corners = |c: CellId| {
        mesh.cell(c).map(|v| {
            if center(mesh, c).x > at {
                copies[v.index()]
            } else {
                v.index()
            }
        })
    };
    SimplexMesh::new(points, mesh.cell_ids().map(corners).collect()).unwrap()
}

/// Work (J) of an end shear of 1 Pa along -`axis` at x = `length` on a body clamped at x = 0.
fn bend<const N: usize>(
    mesh: &SimplexMesh<N>,
    a: &Assembler<N>,
    length: f64,
    solver: SolverOptions,
) -> (f64, Vec<f64>) {
    let points = mesh.rest_positions();
    let fixed: Vec<bool> = points
        .iter()
        .flat_map(|p| [p.x < 1e-9, p.x < 1e-9, p.x < 1e-9 || N == 3])
        .collect();
    let end: Vec<FacetSide> = mesh
        .boundary_facets()
        .filter(|s| {
            mesh.facet_corners(*s)
                .iter()
                .all(|v| mesh.rest_position(*v).x > length - 1e-9)
        })
        .collect();
    let (mut f, mut u) = (vec![0.0; fixed.len()], vec![0.0; fixed.len()]);
    let traction = if N == 3 { [0.0, -1.0, 0.0] } else { [0.0, 0.0, -1.0] };
    load::add_traction(mesh, a, end, |_| traction, &mut f);
    let mut solver = LinearSolver::new(solver);
    solver.set_positions(points.iter().map(|p| (*p).into()));
    let info = solver.solve(a.stiffness(), &fixed, &f, &mut u).unwrap();
    assert!(info.converged, "{info:?}");
    (f.iter().zip(&u).map(|(f, u)| f * u).sum(), u)
}

fn direct() -> SolverOptions {
    SolverOptions {
        kind: SolverKind::Cholesky,
        ..SolverOptions::default()
    }
}

/// Work (J) of an end shear of 1 Pa on the cantilever of F21 with E = 1 Pa, from quadratic hexahedra, see
/// `validation/compare_locking.py`: at nu = .499, with a slit of half its height in the middle, and at nu = .4999.
const F21: f64 = 256.1;
const F21_CUT: f64 = 399.6;
const F21_4999: f64 = 256.0;

/// F21, with 8 cells across.
#[test]
fn a_nearly_incompressible_cantilever_bends_as_it_should() {
    let whole = generate::box_tets([4.0, 1.0, 1.0], [32, 8, 8], [0.0; 3]);
    let slit = parted(&whole, |p| (p.x - 2.0).abs() < 1e-9 && p.z > 0.5 + 1e-9, 2.0);
    let multigrid = SolverOptions {
        kind: SolverKind::Cg,
        preconditioner: PreconditionerKind::Multigrid,
        tolerance: 1e-6,
        max_iterations: 400,
    };
    for (mesh, poisson, truth, solver) in [
        (&whole, 0.499, F21, multigrid),
        (&slit, 0.499, F21_CUT, multigrid),
        (&whole, 0.4999, F21_4999, direct()),
    ] {
        let m = Material::new(1.0, poisson, 1.0).unwrap();
        let cured = Assembler::with_cure(mesh, Locking::Auto, |_| m).unwrap();
        let (work, _) = bend(mesh, &cured, 4.0, solver);
        let ratio = work / truth;
        assert!((ratio - 1.0).abs() < 0.05, "{poisson}: {ratio}");
    }
    let plain = Assembler::new(&whole, |_| Material::new(1.0, 0.499, 1.0).unwrap()).unwrap();
    let ratio = bend(&whole, &plain, 4.0, direct()).0 / F21;
    assert!(ratio < 0.25, "without a cure: {ratio}");
}

/// How much the mean stress jumps from cell to cell in the middle of the beam: a twelfth of what it does without a cure, as
/// `validation/compare_locking.py` finds too.
#[test]
fn pressure_has_no_checkerboard() {
    let mesh = generate::box_tets([4.0, 1.0, 1.0], [16, 4, 4], [0.0; 3]);
    let jumps = |locking: Locking| {
        let a = Assembler::with_cure(&mesh, locking, |_| Material::new(1.0, 0.499, 1.0).unwrap()).unwrap();
        let (_, u) = bend(&mesh, &a, 4.0, direct());
        let cells: Vec<CellId> = mesh.cell_ids().collect();
        let stress: Vec<f64> = cells
            .iter()
            .map(|&c| a.cauchy_like_stress(&mesh, Model::Linear, c, &u).trace() / 3.0)
            .collect();
        let mut across = Vec::new();
        for &c in cells.iter().filter(|c| (0.6..3.4).contains(&center(&mesh, **c).x)) {
            let others = mesh.neighbors(c).into_iter().filter(|o| mesh.has_cell(*o));
            across.extend(others.map(|o| stress[c.index()] - stress[o.index()]));
        }
        (across.iter().map(|j| j * j).sum::<f64>() / across.len() as f64).sqrt()
    };
    let (plain, cured) = (jumps(Locking::None), jumps(Locking::Auto));
    assert!(cured < 0.09 * plain, "{cured} {plain}");
}
