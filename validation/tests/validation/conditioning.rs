//! F1: a plane close to a layer of vertices must cost neither iterations nor the step of explicit schemes.

use kerfem_cutting::{CutOptions, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, TetMesh, generate};
use kerfem_validation::conditioning::{LOADS, jacobi_iterations, stable_step};

/// What a mesh means for solvers.
struct Cost {
    /// Iterations of Jacobi-CG to 1e-8, held at both ends in x, for each load.
    iterations: [usize; LOADS],
    /// Longest stable step of central differences with the lumped mass.
    step: f64,
}

impl Cost {
    fn of(mesh: &TetMesh) -> Cost {
        let held = |p: Point| !(1e-9..1.0 - 1e-9).contains(&p.x);
        Cost {
            iterations: jacobi_iterations(mesh, held).unwrap(),
            step: stable_step(mesh).unwrap(),
        }
    }

    /// The least, the mean and the largest ratio of iterations, over the loads, and the ratio of the steps.
    fn over(&self, other: &Cost) -> ([f64; 3], f64) {
        let pairs = self.iterations.iter().zip(&other.iterations);
        let ratios: Vec<f64> = pairs.map(|(own, other)| *own as f64 / *other as f64).collect();
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = ratios.iter().copied().fold(0.0, f64::max);
        let mean = ratios.iter().sum::<f64>() / LOADS as f64;
        ([least, mean, largest], self.step / other.step)
    }
}

fn cut_at(z: f64, method: Method) -> TetMesh {
    let mut mesh = generate::box_tets([1.0; 3], [8; 3], [0.0; 3]);
    let corners = [[-0.2, -0.2], [1.2, -0.2], [1.2, 1.2], [-0.2, 1.2]];
    let points = corners.map(|[x, y]| Point::new(x, y, z)).to_vec();
    let sweep = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap().0;
    let positions = mesh.rest_positions().to_vec();
    let tree = BoxTree::of_cells(&mesh, &positions);
    let outcome = cut(&mut mesh, &tree, &positions, &sweep, &CutOptions::of(method)).unwrap();
    assert!(outcome.report.refused.is_empty() && mesh.pieces().1 == 2);
    mesh
}

#[test]
fn f1_a_plane_close_to_a_layer_of_vertices() {
    let uncut = Cost::of(&generate::box_tets([1.0; 3], [8; 3], [0.0; 3]));
    let cut_by = |method, eps: f64| Cost::of(&cut_at(0.5 + eps / 8.0, method)).over(&uncut);
    for eps in [0.2, 0.1, 1e-2, 1e-4, 1e-6] {
        let (iterations, step) = cut_by(Method::Hybrid, eps);
        println!("eps {eps}: iterations x {iterations:.3?} (least, mean and largest of the loads), stable step x {step:.3}");
        assert!(iterations[2] <= 1.25 && step >= 0.85, "eps {eps}: {iterations:?} {step}");
    }
    for method in [Method::Collapse, Method::Merge] {
        let (iterations, step) = cut_by(method, 1e-4);
        assert!(iterations[2] <= 1.5 && step >= 0.3, "{method:?}: {iterations:?} {step}");
    }
    let (iterations, step) = cut_by(Method::Subdivide, 1e-4);
    assert!(iterations[0] > 3.0 && step < 0.1, "{iterations:?} {step}");
}
