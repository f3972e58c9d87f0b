//! Local updates after edits equal a fresh assembly to the bit and cost what the edit touches.

use kerfem_fem::{Assembler, FemError, Material, Model, Tangent, Touched};
use kerfem_mesh::{CellId, Edit, MeshChange, Point, TetMesh, VertexId, generate};

use crate::helpers::{assemble, body, product, random, random_edit, rubber, separate, split_edge};

fn assert_exact(assembler: &Assembler, mesh: &TetMesh) {
    let v = assembler.verify(mesh);
    assert!(v.pattern_equal);
    assert_eq!(
        (v.stiffness_max_relative_difference, v.mass_max_relative_difference),
        (0.0, 0.0)
    );
}

#[test]
fn updates_equal_a_fresh_assembly_to_the_bit() {
    let mut mesh = body([3, 3, 3]);
    let stiff = Material::new(9e5, 0.4, 1500.0).unwrap();
    let mut assembler = Assembler::new(&mesh, |c| if c.0 % 3 == 0 { stiff } else { rubber() }).unwrap();
    let mut matrix = assembler.new_matrix();
    let mut next = random(42);
    let (mut compactions, mut moves) = (0, 0);
    for round in 0..400 {
        let change = random_edit(&mut mesh, &mut next);
        let parents: Vec<_> = change
            .cells_added
            .iter()
            .map(|c| (c.id, *assembler.material(c.parent)))
            .collect();
        let touched = assembler.update(&mesh, &change).unwrap();
        compactions += usize::from(touched.compacted);
        moves += touched.rows_moved;
        for (c, material) in parents {
            assert_eq!(*assembler.material(c), material);
        }
        if round % 10 == 0 {
            assert_exact(&assembler, &mesh);
        }
        assembler.follow(&mut matrix);
        if round % 40 == 0 {
            let u: Vec<f64> = (0..3 * mesh.vertex_slots()).map(|_| 0.01 * next()).collect();
            assembler.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut matrix);
            let mut fresh = assembler.new_matrix();
            assembler.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut fresh);
            assert!((0..fresh.rows()).all(|i| fresh.row(i) == matrix.row(i)));
        }
    }
    assert_exact(&assembler, &mesh);
    mesh.check(false).unwrap();
    assert!(
        moves > 100 && compactions > 0,
        "{moves} moves, {compactions} compactions"
    );
}

#[test]
fn a_matrix_left_behind_is_brought_up_to_date_by_the_next_fill() {
    let mut mesh = body([2, 2, 2]);
    let mut assembler = assemble(&mesh);
    let mut old = assembler.new_matrix();
    let mut next = random(1);
    for _ in 0..3 {
        let change = random_edit(&mut mesh, &mut next);
        assembler.update(&mesh, &change).unwrap();
    }
    let u = vec![0.0; 3 * mesh.vertex_slots()];
    assembler.tangent(&mesh, Model::Linear, Tangent::Warped, &u, &mut old);
    assert!((0..old.rows()).all(|i| old.row(i) == assembler.stiffness().row(i)));
}

/// The same edit in the middle of a body of `n` cells a side.
fn edit_in_the_middle(n: usize) -> Touched {
    let mut mesh = generate::box_tets([n as f64; 3], [n; 3], [0.0; 3]);
    let mut assembler = assemble(&mesh);
    let middle = (mesh.vertex_slots() / 2) as u32;
    let mut edit = Edit::new(&mut mesh);
    let p = split_edge(&mut edit, VertexId(middle), VertexId(middle + 1), 0.4);
    split_edge(&mut edit, p, VertexId(middle + 1), 0.5);
    separate(&mut edit, p, Point::new(0.0, 0.3, 1.0));
    let rest = edit.mesh().rest_position(VertexId(middle)) + Point::new(0.0, 0.05, 0.0);
    edit.move_vertex(VertexId(middle), rest, &vec![(VertexId(middle), 1.0)]);
    let change = edit.commit();
    let touched = assembler.update(&mesh, &change).unwrap();
    assert_exact(&assembler, &mesh);
    touched
}

#[test]
fn work_is_that_of_the_edit_at_any_size_of_the_mesh() {
    let (small, large) = (edit_in_the_middle(4), edit_in_the_middle(12));
    assert_eq!(
        (small.rows, small.cells, small.rows_moved, small.compacted),
        (large.rows, large.cells, large.rows_moved, large.compacted)
    );
    assert!(small.rows < 40 && small.rows == small.row_ids.len());
}

#[test]
fn the_last_cell_may_go() {
    let mut mesh = TetMesh::new(
        vec![Point::zeros(), Point::x(), Point::y(), Point::z()],
        vec![[0, 1, 2, 3]],
    )
    .unwrap();
    let mut assembler = assemble(&mesh);
    let mut edit = Edit::new(&mut mesh);
    edit.remove_cell(CellId(0));
    edit.remove_vertex(VertexId(3), None);
    let change = edit.commit();
    let touched = assembler.update(&mesh, &change).unwrap();
    assert_eq!((touched.rows, touched.cells), (4, 0));
    assert_exact(&assembler, &mesh);
    assert!((0..4).all(|i| assembler.stiffness().row(i).0.is_empty()));
    assert_eq!(assembler.lumped_mass(), [0.0; 4]);
}

#[test]
fn a_refused_update_changes_nothing() {
    let mut mesh = body([2, 2, 2]);
    let mut assembler = assemble(&mesh);
    let before = mesh.clone();
    let mut edit = Edit::new(&mut mesh);
    // far outside: some of its cells turn inside out
    edit.move_vertex(VertexId(13), Point::new(40.0, 3.0, 7.0), &vec![(VertexId(13), 1.0)]);
    let change = edit.commit();
    match assembler.update(&mesh, &change) {
        Err(FemError::InvertedCell { volume, .. }) => assert!(volume < 0.0),
        other => panic!("{other:?}"),
    }
    assert_exact(&assembler, &before);
    let mut change = MeshChange::default();
    change.cells_added.push(kerfem_mesh::AddedCell {
        id: CellId(0),
        corners: before.cell(CellId(0)),
        parent: CellId(999),
    });
    let refused = assembler.update(&before, &change);
    assert_eq!(refused, Err(FemError::UnknownParent { cell: 0, parent: 999 }));
}

#[test]
fn the_same_bits_at_any_number_of_threads() {
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| {
                let mut mesh = body([6, 6, 6]);
                let mut assembler = assemble(&mesh);
                let mut next = random(9);
                for _ in 0..20 {
                    let change = random_edit(&mut mesh, &mut next);
                    assembler.update(&mesh, &change).unwrap();
                }
                let u: Vec<f64> = (0..3 * mesh.vertex_slots()).map(|_| 0.05 * next()).collect();
                let mut k = assembler.new_matrix();
                assembler.tangent(&mesh, Model::Corotated, Tangent::Exact, &u, &mut k);
                let mut f = vec![0.0; u.len()];
                assembler.internal_force(&mesh, Model::Corotated, &u, &mut f);
                let blocks: Vec<_> = (0..k.rows()).flat_map(|i| k.row(i).1.to_vec()).collect();
                let energy = assembler.energy(&mesh, Model::Corotated, &u);
                (blocks, f, energy, product(&k, &u), product(assembler.stiffness(), &u))
            })
    };
    assert!(run(1) == run(4));
}
