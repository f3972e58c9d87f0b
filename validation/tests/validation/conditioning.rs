//! F1: a plane close to a layer of vertices must cost neither iterations nor the step of explicit schemes.

use kerfem_cutting::{CutOptions, Method, Sweep, cut};
use kerfem_mesh::{BoxTree, Point, TetMesh, generate};
use kerfem_validation::conditioning::Cost;

fn cost(mesh: &TetMesh) -> Cost {
    Cost::of(mesh, |p: Point| !(1e-9..1.0 - 1e-9).contains(&p.x)).unwrap()
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
    let uncut = cost(&generate::box_tets([1.0; 3], [8; 3], [0.0; 3]));
    let cut_by = |method, eps: f64| cost(&cut_at(0.5 + eps / 8.0, method)).over(&uncut);
    for eps in [0.2, 0.1, 1e-2, 1e-4, 1e-6] {
        let ratios = cut_by(Method::Hybrid, eps);
        println!("eps {eps}: {ratios:.3?}");
        assert!(ratios.largest <= 1.25 && ratios.step >= 0.85, "eps {eps}: {ratios:?}");
    }
    for method in [Method::Collapse, Method::Merge] {
        let ratios = cut_by(method, 1e-4);
        assert!(ratios.largest <= 1.5 && ratios.step >= 0.3, "{method:?}: {ratios:?}");
    }
    let ratios = cut_by(Method::Subdivide, 1e-4);
    assert!(ratios.least > 3.0 && ratios.step < 0.1, "{ratios:?}");
}
