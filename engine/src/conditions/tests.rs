use kerfem_fem::{Assembler, Material};
use kerfem_mesh::{CellId, Edit, FacetLabel, MeshChange, RemovedVertex, TetMesh, VertexId};
use nalgebra::Vector3;

use super::{FixedDofs, Loads};
use crate::Scene;
use crate::input::MeshInput;

/// A unit cube of 2x2x2 hexahedra with the given sections.
fn cube(sections: &str) -> (Scene, MeshInput) {
    let text = format!(
        "name = 'cube'\n[mesh]\nbox = {{ size = [1, 1, 1], cells = [2, 2, 2] }}\n[material]\nyoung = 1\npoisson = 0.3\n\
         density = 1\n{sections}"
    );
    let scene = Scene::parse(&text, "cube.toml").unwrap();
    let input = MeshInput::read(&scene.mesh, &scene.source).unwrap();
    (scene, input)
}

fn at(mesh: &TetMesh, x: f64, y: f64, z: f64) -> VertexId {
    mesh.vertex_ids()
        .find(|v| (mesh.rest_position(*v) - Vector3::new(x, y, z)).norm() < 1e-12)
        .unwrap()
}

/// Puts a vertex into the middle of an edge.
fn split(edit: &mut Edit<'_, 4>, a: VertexId, b: VertexId) -> VertexId {
    let rest = (edit.mesh().rest_position(a) + edit.mesh().rest_position(b)) / 2.0;
    let ring: Vec<CellId> = edit.mesh().cells_of_edge(a, b).collect();
    assert!(!ring.is_empty(), "no such edge");
    let p = edit.add_vertex(rest, &vec![(a, 0.5), (b, 0.5)]);
    for c in ring {
        let (corners, labels) = (edit.mesh().cell(c), edit.mesh().facet_labels(c));
        edit.remove_cell(c);
        for (gone, kept) in [(a, b), (b, a)] {
            // the facet between the two halves lies opposite the corner that is kept
            let labels = [0, 1, 2, 3].map(|k| {
                if corners[k] == kept {
                    FacetLabel::NONE
                } else {
                    labels[k]
                }
            });
            edit.add_cell(corners.map(|v| if v == gone { p } else { v }), c, labels);
        }
    }
    p
}

/// Gives the cells of `v` beyond x = 0.5 a copy of it.
fn double(edit: &mut Edit<'_, 4>, v: VertexId) -> VertexId {
    let beyond =
        |edit: &Edit<'_, 4>, c: CellId| edit.mesh().cell_rest_positions(c).iter().map(|p| p.x).sum::<f64>() / 4.0 > 0.5;
    let cells: Vec<CellId> = edit
        .mesh()
        .cells_of_vertex(v)
        .iter()
        .copied()
        .filter(|c| beyond(edit, *c))
        .collect();
    let copy = edit.add_vertex(edit.mesh().rest_position(v), &vec![(v, 1.0)]);
    for c in cells {
        let (corners, labels) = (edit.mesh().cell(c), edit.mesh().facet_labels(c));
        edit.remove_cell(c);
        edit.add_cell(corners.map(|w| if w == v { copy } else { w }), c, labels);
    }
    copy
}

fn assembler(mesh: &TetMesh) -> Assembler {
    let material = Material::new(1.0, 0.3, 1.0).unwrap();
    Assembler::new(mesh, |_| material).unwrap()
}

fn total(loads: &Loads, mesh: &TetMesh) -> Vector3<f64> {
    let mut f = vec![0.0; 3 * mesh.vertex_slots()];
    loads.force(mesh, &assembler(mesh), 0.0, &mut f).unwrap();
    f.as_chunks::<3>().0.iter().map(|f| Vector3::from(*f)).sum()
}

#[test]
fn a_listed_set_takes_new_vertices_of_its_own_boundary_only() {
    let faces: Vec<usize> = {
        let (_, input) = cube("");
        let on_face = |v: &VertexId| [0.0, 1.0].contains(&input.mesh.rest_position(*v).x);
        input.mesh.vertex_ids().filter(on_face).map(VertexId::index).collect()
    };
    let (scene, mut input) = cube(&format!("[[fixed]]\nvertices = {faces:?}\naxes = 'xz'"));
    let mut fixed = FixedDofs::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let (a, b) = (at(mesh, 0.0, 0.0, 0.0), at(mesh, 0.0, 0.5, 0.0));
    let c = at(mesh, 0.5, 0.0, 0.0);
    let mut edit = Edit::new(mesh);
    let on_face = split(&mut edit, a, b);
    let off_face = split(&mut edit, a, c);
    let change = edit.commit();
    fixed.follow(mesh, None, &change);
    assert!(fixed.is_fixed(on_face, 0) && !fixed.is_fixed(on_face, 1) && fixed.is_fixed(on_face, 2));
    assert!((0..3).all(|axis| !fixed.is_fixed(off_face, axis)));
}

#[test]
fn an_edge_between_two_held_faces_is_not_held() {
    // one hexahedron: every vertex is on a held face, but the long edges are not
    let (scene, mut input) = cube("[[fixed]]\nvertices = [0, 2, 4, 6, 1, 3, 5, 7]");
    let one = kerfem_mesh::generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
    input.mesh = one;
    let mut fixed = FixedDofs::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let mut edit = Edit::new(mesh);
    // the diagonal through the middle of the body
    let inside = split(&mut edit, VertexId(0), VertexId(7));
    let change = edit.commit();
    fixed.follow(mesh, None, &change);
    assert!(!fixed.is_fixed(inside, 0));
}

#[test]
fn copies_of_held_vertices_are_held_and_conditions_are_asked_again() {
    let (scene, mut input) = cube("[[fixed]]\nvertices = [1]\n[[fixed]]\nwhere = 'y < 1e-9 && z < 1e-9'\naxes = 'y'");
    let mut fixed = FixedDofs::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let (a, v, c) = (
        at(mesh, 0.0, 0.0, 0.0),
        at(mesh, 0.5, 0.0, 0.0),
        at(mesh, 0.5, 0.5, 0.0),
    );
    assert_eq!(v, VertexId(1));
    let mut edit = Edit::new(mesh);
    let copy = double(&mut edit, v);
    let along = split(&mut edit, a, v);
    let away = split(&mut edit, v, c);
    let change = edit.commit();
    fixed.follow(mesh, None, &change);
    assert!((0..3).all(|axis| fixed.is_fixed(copy, axis)));
    assert!(fixed.is_fixed(along, 1) && !fixed.is_fixed(along, 0));
    assert!((0..3).all(|axis| !fixed.is_fixed(away, axis)));
}

#[test]
fn a_moved_vertex_is_asked_again_by_a_condition() {
    let (scene, mut input) = cube("[[fixed]]\nwhere = 'x < 0.25'");
    let mut fixed = FixedDofs::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let (v, w) = (at(mesh, 0.5, 0.5, 0.5), at(mesh, 0.0, 0.5, 0.5));
    let mut edit = Edit::new(mesh);
    edit.move_vertex(v, Vector3::new(0.2, 0.5, 0.5), &vec![(w, 0.6), (v, 0.4)]);
    let change = edit.commit();
    fixed.follow(mesh, None, &change);
    assert!(fixed.is_fixed(v, 0));
}

#[test]
fn loads_keep_their_total_through_splits_and_copies() {
    let loads = "[[load]]\nwhere = 'x > 0.999'\ntraction = [1, -2, 3]\n[[load]]\nwhere = 'z > 0.999'\npressure = 5\n\
                 [[load]]\nvertices = [1, 2]\nforce = [0, 0, 7]\n[[load]]\ngravity = [0, 0, -4]";
    let (scene, mut input) = cube(loads);
    let mut loads = Loads::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let before = total(&loads, mesh);
    assert!((before - Vector3::new(1.0, -2.0, 3.0 - 5.0 + 7.0 - 4.0)).norm() < 1e-12);
    let (a, b, c) = (
        at(mesh, 1.0, 0.0, 0.5),
        at(mesh, 1.0, 0.5, 0.5),
        at(mesh, 0.5, 0.0, 0.0),
    );
    let mut edit = Edit::new(mesh);
    split(&mut edit, a, b);
    let copy = double(&mut edit, c);
    let (p, q) = (at(edit.mesh(), 0.5, 0.5, 1.0), at(edit.mesh(), 1.0, 0.5, 1.0));
    split(&mut edit, p, q);
    let change = edit.commit();
    loads.follow(mesh, &change);
    assert!((total(&loads, mesh) - before).norm() < 1e-12);
    let mut f = vec![0.0; 3 * mesh.vertex_slots()];
    let only_force = cube("[[load]]\nvertices = [1, 2]\nforce = [0, 0, 7]");
    let mut only = Loads::new(&only_force.0, &only_force.1).unwrap();
    only.follow(mesh, &change);
    only.force(mesh, &assembler(mesh), 0.0, &mut f).unwrap();
    let share = |v: VertexId| f[3 * v.index() + 2];
    assert_eq!((share(VertexId(2)), share(c), share(copy)), (3.5, 1.75, 1.75));
}

#[test]
fn forces_one_by_one_are_shared_by_copies_and_passed_on() {
    let (scene, mut input) = cube("[[load]]\nvertices = [1, 2, 13]\nnodal = [[0, 0, 6], [1, 2, 3], [0.5, 0, 0]]");
    let mut loads = Loads::new(&scene, &input).unwrap();
    let mesh = &mut input.mesh;
    let before = total(&loads, mesh);
    assert_eq!(before, Vector3::new(1.5, 2.0, 9.0));
    let (doubled, alone) = (at(mesh, 0.5, 0.0, 0.0), at(mesh, 1.0, 0.0, 0.0));
    let mut edit = Edit::new(mesh);
    let copy = double(&mut edit, doubled);
    let between = split(&mut edit, alone, copy);
    let change = edit.commit();
    loads.follow(mesh, &change);
    let mut f = vec![0.0; 3 * mesh.vertex_slots()];
    loads.force(mesh, &assembler(mesh), 0.0, &mut f).unwrap();
    let of = |v: VertexId| Vector3::from_column_slice(&f[3 * v.index()..][..3]);
    assert_eq!((of(doubled), of(copy)), (Vector3::z() * 3.0, Vector3::z() * 3.0));
    assert_eq!(
        (of(alone), of(between)),
        (Vector3::new(1.0, 2.0, 3.0), Vector3::zeros())
    );
    assert_eq!(total(&loads, mesh), before);

    // a vertex that is merged into another one leaves its force there
    let merged = MeshChange {
        vertices_removed: vec![RemovedVertex {
            id: alone,
            merged_into: Some(doubled),
        }],
        ..MeshChange::default()
    };
    loads.follow(mesh, &merged);
    loads.force(mesh, &assembler(mesh), 0.0, &mut f).unwrap();
    assert_eq!(f[3 * doubled.index()..][..3], [1.0, 2.0, 6.0]);
}

#[test]
fn facets_given_by_vertices_are_the_same_load_as_those_of_a_condition() {
    let (scene, input) = cube("[[load]]\nwhere = 'x > 0.999'\ntraction = ['y', 0, 't + 1']");
    let by_condition = Loads::new(&scene, &input).unwrap();
    let mesh = &input.mesh;
    let on_face = |f: &&[VertexId; 3]| f.iter().all(|v| mesh.rest_position(*v).x > 0.999);
    let facets: Vec<[usize; 3]> = mesh
        .original_facets()
        .iter()
        .filter(on_face)
        .map(|f| [f[2], f[0], f[1]].map(VertexId::index))
        .collect();
    let (other, _) = cube(&format!("[[load]]\nfacets = {facets:?}\ntraction = ['y', 0, 't + 1']"));
    let by_facets = Loads::new(&other, &input).unwrap();
    let sum = total(&by_condition, mesh);
    assert!((sum - Vector3::new(0.5, 0.0, 1.0)).norm() < 1e-12);
    assert!((total(&by_facets, mesh) - sum).norm() < 1e-15);
    assert!(by_condition.uses_time() && !by_condition.is_uniform());
}

#[test]
fn nothing_happens_without_a_change() {
    let (scene, input) = cube("[[fixed]]\nwhere = 'x < 0.1'\n[[load]]\nvertices = [1]\nforce = [1, 0, 0]");
    let mut fixed = FixedDofs::new(&scene, &input).unwrap();
    let mask = fixed.mask().to_vec();
    fixed.follow(&input.mesh, None, &MeshChange::default());
    assert_eq!(fixed.mask(), mask);
}
