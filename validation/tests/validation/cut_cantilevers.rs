//! A6 after a cut: scikit-fem on the mesh that the cut produced, K and M updated by the change alone (DESIGN invariants 1,
//! 2, 3).

use kerfem_engine::{Scene, Simulation};
use kerfem_fem::Assembler;
use kerfem_mesh::{TetMesh, quality};
use kerfem_validation::norms::relative_difference;
use kerfem_validation::{Reference, cut_beam, reference_file};

use super::helpers::*;

fn assert_same_mesh(mesh: &TetMesh, reference: &TetMesh) {
    assert_eq!(mesh.vertex_slots(), reference.vertex_slots());
    for (a, b) in mesh.rest_positions().iter().zip(reference.rest_positions()) {
        assert!((a - b).norm() < 1e-12, "{a} against {b}");
    }
    let corners = |m: &TetMesh| m.cell_ids().map(|c| m.cell(c)).collect::<Vec<_>>();
    assert!(corners(mesh) == corners(reference), "the cells differ");
}

fn assert_same_bits(updated: &Assembler, fresh: &Assembler) {
    let (k, l) = (updated.stiffness(), fresh.stiffness());
    assert_eq!(k.rows(), l.rows());
    for i in 0..k.rows() {
        assert_eq!(k.row(i).0, l.row(i).0, "columns of row {i}");
        let bits = |m: &[[f64; 9]]| m.as_flattened().iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(k.row(i).1), bits(l.row(i).1), "row {i} of K");
    }
    let (m, n) = (updated.consistent_mass().to_csr(), fresh.consistent_mass().to_csr());
    assert!(m.indptr() == n.indptr() && m.indices() == n.indices(), "pattern of M");
    let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(m.data()), bits(n.data()), "M");
    assert_eq!(bits(updated.lumped_mass()), bits(fresh.lumped_mass()), "lumped M");
}

fn compare(name: &str) {
    let reference = Reference::read(name).unwrap();
    let mut mesh = cut_beam::beam();
    let mut assembler = assemble(&mesh);
    let uncut = assembler.clone();
    let (rows, volume) = (mesh.vertex_slots(), quality::volume(&mesh));

    let outcome = cut_beam::cut_by(&mut mesh, name).unwrap();
    assert_same_mesh(&mesh, &reference.mesh);
    assert_eq!(mesh.pieces().1, 1, "the cut is partial");
    assert!(!outcome.change.vertices_added.is_empty());
    assert!((quality::volume(&mesh) / volume - 1.0).abs() < 1e-12);

    let touched = assembler.update(&mesh, &outcome.change).unwrap();
    println!(
        "{name}: {} of {} rows updated, {} added",
        touched.rows,
        mesh.vertex_slots(),
        mesh.vertex_slots() - rows
    );
    assert!(
        touched.rows < mesh.vertex_slots() * 2 / 3,
        "the update is local: {} rows",
        touched.rows
    );
    assert_same_bits(&assembler, &assemble(&mesh));

    let u = solve(
        &assembler,
        &reference.fixed,
        &reference.load,
        vec![0.0; 3 * mesh.vertex_slots()],
    );
    let difference = relative_difference(&u, &reference.displacement);
    println!("{name}: fem {difference:e}");
    assert!(difference < 1e-9, "{name}: fem differs by {difference:e}");

    // the whole way through a scene, which finds supports and loads after the cut itself
    let scene = Scene::read(reference_file(&format!("{name}.toml"))).unwrap();
    let mut simulation = Simulation::new(scene).unwrap();
    assert!(simulation.step(0.0).unwrap().converged);
    assert_same_mesh(simulation.mesh(), &reference.mesh);
    let difference = relative_difference(simulation.u(), &reference.displacement);
    println!("{name}: engine {difference:e}");
    assert!(difference < 1e-9, "{name}: the engine differs by {difference:e}");

    // the cut is felt: the same loads bend the uncut beam less
    let dofs = 3 * rows;
    let bent = solve(
        &uncut,
        &reference.fixed[..dofs],
        &reference.load[..dofs],
        vec![0.0; dofs],
    );
    let (cut, whole) = (largest(u), largest(bent));
    println!("{name}: largest displacement {cut:.4} m, uncut {whole:.4} m");
    assert!(cut > 1.1 * whole, "{cut} against {whole}");
}

#[test]
fn a_beam_cut_by_a_tilted_plane() {
    compare("cut_plane");
}

#[test]
fn a_beam_cut_by_a_curved_sheet() {
    compare("cut_curved");
}
