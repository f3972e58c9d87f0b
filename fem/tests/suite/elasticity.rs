//! What the matrices and forces of a body must do.

use kerfem_fem::{Assembler, BlockMatrix, Material, Model, Scales, Tangent};
use kerfem_mesh::{CellId, Point, TetMesh, VertexId, quality};
use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::helpers::{affine, assemble, body, entry, largest, product, random, rubber};

const MODELS: [Model; 2] = [Model::Linear, Model::Corotated];

fn turn(degrees: f64) -> Matrix3<f64> {
    Rotation3::new(Vector3::new(1.0, 2.0, -0.5).normalize() * degrees.to_radians()).into_inner()
}

fn internal(assembler: &Assembler, mesh: &TetMesh, model: Model, u: &[f64]) -> Vec<f64> {
    let mut f = vec![f64::NAN; u.len()];
    assembler.internal_force(mesh, model, u, &mut f);
    f
}

fn inner_vertices(mesh: &TetMesh) -> Vec<usize> {
    mesh.vertex_ids()
        .filter(|&v| !mesh.is_boundary_vertex(v))
        .map(VertexId::index)
        .collect()
}

#[test]
fn patch_test() {
    let mesh = body([4, 3, 3]);
    let assembler = assemble(&mesh);
    let a = Matrix3::new(1.02, 0.01, 0.0, 0.03, 0.97, -0.01, 0.02, 0.0, 1.05);
    let u = affine(&mesh, &a, Point::new(0.1, -2.0, 3.0));
    let inner = inner_vertices(&mesh);
    assert!(inner.len() > 8);
    for model in MODELS {
        let f = internal(&assembler, &mesh, model, &u);
        let rest = largest(&f);
        assert!(inner.iter().all(|&v| largest(&f[3 * v..3 * v + 3]) < 1e-13 * rest));
        let first = assembler.cauchy_like_stress(&mesh, model, CellId(0), &u);
        assert!((first - first.transpose()).norm() == 0.0);
        for c in mesh.cell_ids() {
            assert!((assembler.deformation_gradient(&mesh, c, &u) - a).norm() < 1e-13);
            let stress = assembler.cauchy_like_stress(&mesh, model, c, &u);
            assert!((stress - first).norm() < 1e-11 * first.norm());
        }
    }
    let e = (a + a.transpose()) / 2.0 - Matrix3::identity();
    let m = rubber();
    let expected = 2.0 * m.mu() * e + Matrix3::identity() * (m.lambda() * e.trace());
    let found = assembler.cauchy_like_stress(&mesh, Model::Linear, CellId(5), &u);
    assert!((found - expected).norm() < 1e-11 * expected.norm());
}

#[test]
fn stiffness_is_symmetric_and_ignores_rigid_motions() {
    let mesh = body([3, 3, 2]);
    let assembler = assemble(&mesh);
    let k = assembler.stiffness();
    let size = largest(
        &(0..k.rows())
            .map(|i| largest(k.row(i).1.as_flattened()))
            .collect::<Vec<_>>(),
    );
    let csr = k.to_csr();
    assert_eq!((csr.rows(), csr.nnz()), (3 * k.rows(), 9 * k.blocks()));
    for (value, (d, e)) in &csr {
        assert_eq!(*value, entry(k, d, e));
        assert!((value - entry(k, e, d)).abs() < 1e-14 * size);
    }
    let rigid = |w: Point, t: Point| -> Vec<f64> {
        mesh.rest_positions()
            .iter()
            .flat_map(|x| <[f64; 3]>::from(w.cross(x) + t))
            .collect()
    };
    for axis in 0..3 {
        let unit = Point::ith(axis, 1.0);
        for mode in [rigid(Point::zeros(), unit), rigid(unit, Point::zeros())] {
            assert!(largest(&product(k, &mode)) < 1e-12 * size);
        }
    }
    let stretch = affine(
        &mesh,
        &Matrix3::from_diagonal(&Vector3::new(1.1, 1.0, 1.0)),
        Point::zeros(),
    );
    assert!(largest(&product(k, &stretch)) > 1e-3 * size);
    let f = internal(&assembler, &mesh, Model::Linear, &stretch);
    let ku = product(k, &stretch);
    assert!(f.iter().zip(&ku).all(|(f, k)| (f - k).abs() < 1e-13 * size));
}

/// F22: the corotated model does not notice a rotation; the linear one takes it for strain.
#[test]
fn rotations_are_free_of_force_only_in_the_corotated_model() {
    let mesh = body([3, 2, 2]);
    let assembler = assemble(&mesh);
    let stretch = affine(
        &mesh,
        &Matrix3::from_diagonal(&Vector3::new(1.01, 1.0, 1.0)),
        Point::zeros(),
    );
    let scale = largest(&internal(&assembler, &mesh, Model::Corotated, &stretch));
    for degrees in [10.0, 30.0, 90.0, 180.0] {
        let u = affine(&mesh, &turn(degrees), Point::new(3.0, 2.0, 1.0));
        let corotated = internal(&assembler, &mesh, Model::Corotated, &u);
        assert!(
            largest(&corotated) < 1e-12 * 100.0 * scale,
            "{degrees}: {}",
            largest(&corotated) / scale
        );
        assert!(assembler.energy(&mesh, Model::Corotated, &u) < 1e-20 * scale);
        assert!(largest(&internal(&assembler, &mesh, Model::Linear, &u)) > scale);
    }
}

#[test]
fn a_rotated_state_has_rotated_forces_and_stress() {
    let mesh = body([2, 2, 2]);
    let assembler = assemble(&mesh);
    let mut next = random(3);
    let u: Vec<f64> = (0..3 * mesh.vertex_slots()).map(|_| 0.05 * next()).collect();
    let r = turn(73.0);
    let turned: Vec<f64> = mesh
        .rest_positions()
        .iter()
        .zip(u.chunks(3))
        .flat_map(|(x, u)| <[f64; 3]>::from(r * (x + Point::from_column_slice(u)) - x))
        .collect();
    let f = internal(&assembler, &mesh, Model::Corotated, &u);
    let g = internal(&assembler, &mesh, Model::Corotated, &turned);
    let size = largest(&f);
    for (f, g) in f.chunks(3).zip(g.chunks(3)) {
        assert!((r * Point::from_column_slice(f) - Point::from_column_slice(g)).norm() < 1e-12 * size);
    }
    let s = assembler.cauchy_like_stress(&mesh, Model::Corotated, CellId(3), &u);
    let t = assembler.cauchy_like_stress(&mesh, Model::Corotated, CellId(3), &turned);
    assert!((r * s * r.transpose() - t).norm() < 1e-12 * s.norm());
}

#[test]
fn force_and_tangent_are_derivatives() {
    let mesh = body([2, 2, 1]);
    let assembler = assemble(&mesh);
    // stretched: no curvature is clamped
    let a = turn(35.0) * Matrix3::from_diagonal(&Vector3::new(1.3, 1.25, 1.4));
    let mut u = affine(&mesh, &a, Point::zeros());
    let mut next = random(11);
    u.iter_mut().for_each(|u| *u += 0.01 * next());
    let step = 1e-6;
    for model in MODELS {
        let f = internal(&assembler, &mesh, model, &u);
        let mut k = assembler.new_matrix();
        assembler.tangent(&mesh, model, Tangent::Exact, &u, &mut k);
        let size = largest(&(0..u.len()).map(|d| entry(&k, d, d)).collect::<Vec<_>>());
        for d in (0..u.len()).step_by(5) {
            let [low, high] = [-step, step].map(|h| {
                let mut u = u.clone();
                u[d] += h;
                (
                    assembler.energy(&mesh, model, &u),
                    internal(&assembler, &mesh, model, &u),
                )
            });
            let slope = (high.0 - low.0) / (2.0 * step);
            assert!(
                (slope - f[d]).abs() < 1e-6 * largest(&f),
                "{model:?} {d}: {slope} {}",
                f[d]
            );
            for e in 0..u.len() {
                let slope = (high.1[e] - low.1[e]) / (2.0 * step);
                assert!((slope - entry(&k, e, d)).abs() < 1e-7 * size, "{model:?} {d} {e}");
            }
        }
    }
}

#[test]
fn linearize_gives_what_its_parts_give() {
    let mesh = body([2, 2, 2]);
    let assembler = assemble(&mesh);
    let mut next = random(5);
    let u: Vec<f64> = (0..3 * mesh.vertex_slots()).map(|_| 0.1 * next()).collect();
    for model in MODELS {
        for tangent in [Tangent::Warped, Tangent::Exact, Tangent::Projected] {
            let (mut whole, mut parts) = (assembler.new_matrix(), assembler.new_matrix());
            let mut f = vec![0.0; u.len()];
            let scales = Scales {
                stiffness: 1e-3,
                mass: 2.0,
            };
            assembler.linearize(&mesh, model, tangent, &u, scales, &mut whole, Some(&mut f));
            assembler.tangent(&mesh, model, tangent, &u, &mut parts);
            parts.scale(1e-3);
            parts.add_diagonal(2.0, assembler.lumped_mass());
            assert_eq!(f, internal(&assembler, &mesh, model, &u));
            let size = largest(parts.row(0).1.as_flattened());
            for i in 0..whole.rows() {
                let (a, b) = (whole.row(i).1.as_flattened(), parts.row(i).1.as_flattened());
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-13 * size));
            }
        }
    }
}

#[test]
fn collapsed_and_inverted_states_stay_finite_and_move_continuously() {
    let mesh = body([2, 1, 1]);
    let assembler = assemble(&mesh);
    let mut k = assembler.new_matrix();
    let mut last: Option<Vec<f64>> = None;
    for step in 0..=200 {
        // flattened along x, then turned inside out
        let squeeze = 1.0 - 0.01 * f64::from(step);
        let a = Matrix3::from_diagonal(&Vector3::new(squeeze, 1.2, 1.3));
        let u = affine(&mesh, &a, Point::zeros());
        let f = internal(&assembler, &mesh, Model::Corotated, &u);
        assembler.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut k);
        assert!(f.iter().all(|f| f.is_finite()));
        assert!((0..k.rows()).all(|i| k.row(i).1.as_flattened().iter().all(|k| k.is_finite())));
        if let Some(before) = last {
            let jump: Vec<f64> = f.iter().zip(&before).map(|(a, b)| a - b).collect();
            assert!(largest(&jump) < 0.05 * largest(&before).max(1e3), "{squeeze}");
        }
        last = Some(f);
    }
    let zero = affine(&mesh, &Matrix3::zeros(), Point::zeros());
    assert!(
        internal(&assembler, &mesh, Model::Corotated, &zero)
            .iter()
            .all(|f| f.is_finite())
    );
}

#[test]
fn masses_add_up() {
    let mesh = body([3, 2, 2]);
    let assembler = assemble(&mesh);
    let expected = 1000.0 * quality::volume(&mesh);
    let lumped = assembler.lumped_mass();
    assert!((lumped.iter().sum::<f64>() - expected).abs() < 1e-12 * expected);

    let mass = assembler.consistent_mass();
    let n = 3 * mesh.vertex_slots();
    let mut rows = vec![0.0; n];
    mass.multiply(&vec![1.0; n], &mut rows);
    for (d, row) in rows.iter().enumerate() {
        assert!((row - lumped[d / 3]).abs() < 1e-12 * lumped[d / 3]);
    }
    let csr = mass.to_csr();
    let total: f64 = csr.iter().map(|(m, _)| m).sum();
    assert!((total - 3.0 * expected).abs() < 1e-12 * expected);
    let mut next = random(2);
    let v: Vec<f64> = (0..n).map(|_| next()).collect();
    let mut mv = vec![0.0; n];
    mass.multiply(&v, &mut mv);
    let sparse: Vec<f64> = csr
        .outer_iterator()
        .map(|row| row.iter().map(|(c, m)| m * v[c]).sum())
        .collect();
    assert!(
        mv.iter()
            .zip(&sparse)
            .all(|(a, b)| (a - b).abs() < 1e-12 * largest(&mv))
    );

    // linear momentum of a rigid motion, and the matrix added into another
    let mut a: BlockMatrix = assembler.new_matrix();
    mass.add_to(3.0, &mut a);
    let momentum = product(&a, &[2.0, 0.0, 0.0].repeat(n / 3));
    assert!((momentum.iter().sum::<f64>() - 6.0 * expected).abs() < 1e-11 * expected);
}

#[test]
fn regions_keep_their_material() {
    let mesh = body([2, 1, 1]);
    let stiff = Material::new(7e6, 0.1, 500.0).unwrap();
    let assembler = Assembler::new(&mesh, |c| if c.0 < 6 { stiff } else { rubber() }).unwrap();
    assert_eq!(*assembler.material(CellId(2)), stiff);
    assert_eq!(*assembler.material(CellId(9)), rubber());
    let stiffness = |k: &BlockMatrix| (0..k.rows()).map(|i| largest(k.row(i).1.as_flattened())).sum::<f64>();
    assert!(stiffness(assembler.stiffness()) > 10.0 * stiffness(assemble(&mesh).stiffness()));
}

#[test]
fn empty_mesh_and_unreferenced_vertex() {
    let empty = TetMesh::new(Vec::new(), Vec::new()).unwrap();
    let assembler = assemble(&empty);
    assert_eq!(assembler.stiffness().rows(), 0);
    assert_eq!(assembler.energy(&empty, Model::Corotated, &[]), 0.0);
    assert!(internal(&assembler, &empty, Model::Corotated, &[]).is_empty());
    assert_eq!(assembler.verify(&empty).stiffness_max_relative_difference, 0.0);
    assert_eq!(assembler.stiffness().to_csr().rows(), 0);

    let points = vec![Point::zeros(), Point::x(), Point::y(), Point::repeat(9.0), Point::z()];
    let mesh = TetMesh::new(points, vec![[0, 1, 2, 4]]).unwrap();
    let assembler = assemble(&mesh);
    assert_eq!(assembler.stiffness().row(3), (&[][..], &[][..]));
    assert_eq!(assembler.lumped_mass()[3], 0.0);
    assert_eq!(assembler.stiffness().to_csr().rows(), 15);
    let f = internal(
        &assembler,
        &mesh,
        Model::Corotated,
        &affine(&mesh, &(turn(20.0) * 1.1), Point::zeros()),
    );
    assert!(f[9..12] == [0.0; 3] && largest(&f) > 0.0);
}
