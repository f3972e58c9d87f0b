//! Large rotations: F22, F18, DESIGN invariant 7.

use kerfem_cutting::{CutOptions, Method, Sweep};
use kerfem_engine::Simulation;
use kerfem_fem::{Assembler, Material, Model};
use kerfem_mesh::{Point, TetMesh, VertexId, generate};
use nalgebra::{Matrix3, Rotation3};

use super::helpers::*;

/// F22: the linear model takes a rotation by 10, 30, 90 degrees for a strain of -1.5, -13, -100 percent; the corotated one
/// for nothing.
#[test]
fn a_rotation_strains_the_linear_model_only() {
    let mesh = generate::box_tets([1.0, 1.0, 1.0], [2, 2, 2], [0.0; 3]);
    let material = Material::new(1e7, 0.0, 1000.0).unwrap();
    let assembler = Assembler::new(&mesh, |_| material).unwrap();
    for (degrees, strain) in [(10.0_f64, -0.01519), (30.0, -0.13397), (90.0, -1.0)] {
        let turn = *Rotation3::from_axis_angle(&Point::z_axis(), degrees.to_radians()).matrix();
        let u = field(&mesh, |p| turn * p - p);
        for c in mesh.cell_ids() {
            // without lateral contraction the stress is twice the shear modulus, that is Young's modulus, times the strain
            let linear = assembler.cauchy_like_stress(&mesh, Model::Linear, c, &u) / 1e7;
            let expected = Matrix3::from_diagonal(&Point::new(strain, strain, 0.0));
            assert!((linear - expected).norm() < 1e-5, "{degrees} degrees: {linear}");
            let corotated = assembler.cauchy_like_stress(&mesh, Model::Corotated, c, &u) / 1e7;
            assert!(corotated.norm() < 1e-14, "{degrees} degrees: {corotated}");
        }
        assert!(largest(force(&assembler, &mesh, &u)) < 1e-12 * 1e7);
    }
}

/// A bar of 4 x 1 x 1 m with the given displacement (expressions), nothing solved.
fn bar(displacement: [&str; 3]) -> Simulation {
    let text = format!(
        "name = \"bar\"\n[mesh]\nbox = {{ size = [4, 1, 1], cells = [16, 4, 4] }}\n{MATERIAL}[model]\nkind = \"corotated\"\n\
         [initial]\ndisplacement = {displacement:?}\n[time]\nscheme = \"evaluate\"\n"
    );
    let mut s = simulation(&text, std::path::Path::new("."));
    s.record_figures(true);
    s
}

/// Bent by 60 degrees: the axis lies on an arc of 4 m.
fn bent() -> Simulation {
    let (radius, angle) = ("(12/3.141592653589793)", "(x*3.141592653589793/12)");
    let x = format!("({radius} - (z - 0.5))*sin({angle}) - x");
    let z = format!("{radius} - ({radius} - (z - 0.5))*cos({angle}) - z");
    bar([&x, "0", &z])
}

/// Nearly across the bent bar, at its middle: `offset` above its axis, `half_height` up and down (m).
fn across_the_middle(offset: f64, half_height: f64) -> Sweep {
    let radius = 12.0 / std::f64::consts::PI;
    let angle = 29.3_f64.to_radians();
    let center = Point::new(radius * angle.sin(), 0.5, radius * (1.0 - angle.cos()));
    let (along, up) = (Point::new(0.04, 1.0, 0.09), Point::new(-angle.sin(), 0.05, angle.cos()));
    let (points, triangles) = rectangle(center + up * offset, along, up * half_height);
    Sweep::new(points, triangles).unwrap().0
}

fn field(mesh: &TetMesh, displacement: impl Fn(&Point) -> Point) -> Vec<f64> {
    mesh.rest_positions()
        .iter()
        .flat_map(|p| <[f64; 3]>::from(displacement(p)))
        .collect()
}

fn force(assembler: &Assembler, mesh: &TetMesh, u: &[f64]) -> Vec<f64> {
    let mut f = vec![0.0; u.len()];
    assembler.internal_force(mesh, Model::Corotated, u, &mut f);
    f
}

fn is_untouched(v: VertexId, before: &TetMesh, after: &TetMesh) -> bool {
    let same =
        |c: &_| after.cell(*c) == before.cell(*c) && after.cell_rest_positions(*c) == before.cell_rest_positions(*c);
    before.cells_of_vertex(v) == after.cells_of_vertex(v) && before.cells_of_vertex(v).iter().all(same)
}

/// F18: cutting a bar that is bent by 60 degrees, at its middle and as it lies, leaves the forces at vertices of untouched
/// cells as they were; nothing is twisted.
#[test]
fn a_cut_through_a_bent_bar_does_not_twist_it() {
    for (offset, half_height, pieces) in [(0.83, 0.8, 1), (0.0, 1.0, 2)] {
        for method in [Method::Hybrid, Method::Subdivide] {
            let mut s = bent();
            let (mesh, before) = (s.mesh().clone(), force(&assemble(s.mesh()), s.mesh(), s.u()));
            let scale = largest(before.iter().copied());
            assert!(scale > 1e3, "the bar is strained: {scale} N");

            let options = CutOptions::of(method);
            let record = s.cut(&across_the_middle(offset, half_height), &options).unwrap();
            assert!(record.refused.is_empty() && record.area_m2 > 0.4, "{record:?}");
            assert_eq!(s.mesh().pieces().1, pieces);

            let after = force(&assemble(s.mesh()), s.mesh(), s.u());
            let untouched: Vec<_> = mesh
                .vertex_ids()
                .filter(|v| is_untouched(*v, &mesh, s.mesh()))
                .collect();
            assert!(untouched.len() > mesh.num_vertices() / 2 && untouched.len() < mesh.num_vertices());
            let dofs = untouched
                .iter()
                .flat_map(|v| [0, 1, 2].map(|axis| 3 * v.index() + axis));
            let change = largest(dofs.map(|d| after[d] - before[d])) / scale;
            println!(
                "bent bar, {method:?}, {pieces} pieces: {} vertices untouched, forces change by {change:e}",
                untouched.len()
            );
            assert!(change < 1e-12, "{change:e}");

            if method == Method::Subdivide {
                // no vertex moves, so the deformed shape is the same function of place, and its energy the same number
                let energy = (record.energy_after / record.energy_before - 1.0).abs();
                println!("bent bar: energy changes by {energy:e}");
                assert!(energy < 1e-12, "{energy:e}");
            }
        }
    }
}

/// F18: a bar turned by 60 degrees bears no force, cut or not, where vertices moved or not.
#[test]
fn a_turned_bar_bears_no_force_after_a_cut() {
    let (cos, sin) = ("0.5", "0.8660254037844386");
    let x = format!("{cos}*x - {sin}*z - x");
    let z = format!("{sin}*x + {cos}*z - z");
    for method in [Method::Hybrid, Method::Subdivide] {
        let mut s = bar([&x, "0", &z]);
        let turned =
            |x: f64, y: f64, z: f64| Point::new(0.5 * x - 0.75_f64.sqrt() * z, y, 0.75_f64.sqrt() * x + 0.5 * z);
        let (points, triangles) = rectangle(turned(1.9, 0.5, 0.9), turned(0.1, 1.0, 0.0), turned(-0.1, 0.07, 0.6));
        let sweep = Sweep::new(points, triangles).unwrap().0;
        let record = s.cut(&sweep, &CutOptions::of(method)).unwrap();
        assert!(record.refused.is_empty() && record.area_m2 > 0.5);
        let residual = largest(force(&assemble(s.mesh()), s.mesh(), s.u()));
        // a linear model would answer with forces of the size of Young's modulus times the area of a facet
        println!("turned bar, {method:?}: {residual:e} N");
        assert!(residual < 1e-12 * 1e7, "{residual:e} N");
        let mut linear = vec![0.0; s.u().len()];
        assemble(s.mesh()).internal_force(s.mesh(), Model::Linear, s.u(), &mut linear);
        assert!(largest(linear) > 1e4);
    }
}
