//! Pieces cut free (F15), vertices without cells (F16), bodies without cells (F17).

use std::path::Path;

use kerfem_engine::EngineError;
use kerfem_engine::Scene;
use kerfem_engine::run::{Ending, RunOptions, run};
use kerfem_mesh::io::VtuGrid;
use kerfem_mesh::{Point, TetMesh, generate, io};

use super::helpers::*;

fn scene(cells: [usize; 3], conditions: &str) -> String {
    format!(
        "name = \"fragments\"\n[mesh]\nbox = {{ size = [2, 1, 1], cells = {cells:?} }}\n{MATERIAL}[model]\nkind = \"corotated\"\n\
         [solver]\ntolerance = 1e-10\n{conditions}"
    )
}

const CUT: &str = "[[cut]]\nframe = \"rest\"\nsweep = \"blade.obj\"\n";
const CLAMP: &str = "[[fixed]]\nwhere = \"x < 1e-9\"\n[[load]]\ngravity = [0, 0, -9.81]\n";

fn through_the_middle(folder: &Path) {
    let plane = rectangle(
        Point::new(1.05, 0.5, 0.5),
        Point::new(0.07, 1.0, 0.0),
        Point::new(-0.1, 0.05, 1.0),
    );
    write_obj(&folder.join("blade.obj"), &plane);
}

/// F15: nothing holds the piece that was cut free, and statics says so.
#[test]
fn statics_refuses_a_piece_that_falls() {
    let folder = tempfile::tempdir().unwrap();
    through_the_middle(folder.path());
    let mut s = simulation(&scene([8, 4, 4], &format!("{CLAMP}{CUT}")), folder.path());
    let error = s.step(0.0).unwrap_err();
    println!("{error}");
    assert_eq!(error.exit_code(), 3);
    let EngineError::Stopped { reason, .. } = &error else {
        panic!("{error}")
    };
    assert!(reason.contains("piece 2 of 2") && !reason.contains('\n'), "{reason}");
    // the place named is that of the free piece
    let center = reason.split("around (").nth(1).unwrap().split(',').next().unwrap();
    assert!(center.parse::<f64>().unwrap() > 1.2, "{reason}");
}

/// F15: in dynamics the piece falls freely, by `g dt² n (n + 1) / 2` after n steps of backward Euler.
#[test]
fn dynamics_lets_the_piece_fall() {
    let folder = tempfile::tempdir().unwrap();
    through_the_middle(folder.path());
    let (dt, steps) = (0.01, 10);
    let time = format!("[time]\nscheme = \"backward-euler\"\ndt = {dt}\nend = 1.0\n");
    let mut s = simulation(&scene([8, 4, 4], &format!("{CLAMP}{time}{CUT}")), folder.path());
    for _ in 0..steps {
        assert!(s.step(dt).unwrap().converged);
    }
    let (mesh, assembler) = (s.mesh(), assemble(s.mesh()));
    let (piece_of_cell, pieces) = mesh.pieces();
    assert_eq!(pieces, 2);
    let right = mesh
        .cell_ids()
        .zip(&piece_of_cell)
        .find(|(c, _)| mesh.cell_rest_positions(*c)[0].x > 1.6)
        .unwrap();
    let fallen: std::collections::BTreeSet<_> = mesh
        .cell_ids()
        .zip(&piece_of_cell)
        .filter(|(_, p)| *p == right.1)
        .flat_map(|(c, _)| mesh.cell(c))
        .collect();
    let (mut mass, mut moment) = (0.0, [0.0; 3]);
    for v in &fallen {
        let m = assembler.lumped_mass()[v.index()];
        mass += m;
        (0..3).for_each(|axis| moment[axis] += m * s.u()[3 * v.index() + axis]);
    }
    let drop = 9.81 * dt * dt * (steps * (steps + 1) / 2) as f64;
    println!("the piece fell {:.9} m, {drop:.9} m by the formula", -moment[2] / mass);
    assert!(
        (moment[2] / mass + drop).abs() < 1e-8 * drop,
        "{} against {drop}",
        -moment[2] / mass
    );
    assert!(moment[0].abs().max(moment[1].abs()) < 1e-8 * mass * drop);
    let held = mesh
        .vertex_ids()
        .filter(|v| !fallen.contains(v) && !mesh.cells_of_vertex(*v).is_empty());
    assert!(
        held.map(|v| s.u()[3 * v.index() + 2].abs()).fold(0.0, f64::max) < 0.1 * drop,
        "the clamped piece hardly sags"
    );
}

/// Loads that balance are solved for modulo the rigid motions: a bar pulled at both ends stretches by `s / E`.
#[test]
fn statics_solves_a_free_piece_whose_loads_balance() {
    let pull = "[[load]]\nwhere = \"x < 1e-9\"\ntraction = [-1e4, 0, 0]\n[[load]]\nwhere = \"x > 2 - 1e-9\"\ntraction = [1e4, 0, 0]\n";
    let text = scene([8, 4, 4], pull).replace("corotated", "linear");
    let s = statics(&text);
    let mesh = s.mesh();
    let assembler = assemble(mesh);
    for c in mesh.cell_ids() {
        let strain = assembler.deformation_gradient(mesh, c, s.u());
        let strain = (strain + strain.transpose()) / 2.0 - nalgebra::Matrix3::identity();
        let exact = nalgebra::Matrix3::from_diagonal(&Point::new(1e-3, -3e-4, -3e-4));
        assert!((strain - exact).norm() < 1e-9, "{strain}");
    }
}

/// F16: a vertex that no cell names is an ordinary state.
#[test]
fn a_vertex_without_cells_stays_where_it_is() {
    let mut points: Vec<Point> = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]
        .map(Point::from)
        .to_vec();
    points.insert(1, Point::new(9.0, 9.0, 9.0));
    let mesh = TetMesh::new(points, vec![[0, 2, 3, 4]]).unwrap();
    let assembler = assemble(&mesh);
    let mut fixed = vec![false; 15];
    fixed[0..3].fill(true);
    fixed[6..12].fill(true);
    let mut load = vec![0.0; 15];
    load[14] = -10.0;
    load[5] = -10.0;
    let u = solve(&assembler, &fixed, &load, vec![0.0; 15]);
    assert!(u[14] < 0.0 && u[3..6] == [0.0; 3], "{u:?}");
}

/// F16: the same through a scene: such a vertex of the file is kept, and neither statics nor dynamics moves it.
#[test]
fn a_scene_keeps_a_vertex_without_cells() {
    let folder = tempfile::tempdir().unwrap();
    let body = generate::box_tets([2.0, 1.0, 1.0], [4, 2, 2], [0.0; 3]);
    let mut grid = VtuGrid::from_tet_mesh(&body);
    grid.points.to_mut().push(Point::new(9.0, 9.0, 9.0));
    io::write_vtu(folder.path().join("body.vtu"), &grid).unwrap();
    for time in [
        "[time]\nscheme = \"static\"\n",
        "[time]\nscheme = \"backward-euler\"\ndt = 0.01\nend = 0.03\n",
    ] {
        let text = scene([4, 2, 2], &format!("{CLAMP}{time}"));
        let text = text.replace("box = { size = [2, 1, 1], cells = [4, 2, 2] }", "file = \"body.vtu\"");
        let mut s = simulation(&text, folder.path());
        assert!(s.step(0.01).unwrap().converged);
        assert_eq!(s.mesh().num_vertices(), body.num_vertices() + 1);
        let (rest, last) = s.u().split_at(3 * body.num_vertices());
        assert!(largest(rest.iter().copied()) > 1e-4 && last == [0.0; 3], "{last:?}");
    }
}

/// Two planes that cross two neighbouring layers of cells: `delete` leaves the vertices between them without cells.
#[test]
fn deleting_cells_around_a_vertex_leaves_a_body_that_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let layer = |x: f64| {
        rectangle(
            Point::new(x, 0.5, 0.5),
            Point::new(0.0, 1.0, 0.0),
            Point::new(0.0, 0.0, 1.0),
        )
    };
    let (mut points, mut triangles) = layer(0.875);
    let (more, others) = layer(1.125);
    triangles.extend(others.iter().map(|t| t.map(|i| i + points.len())));
    points.extend(more);
    write_obj(&folder.path().join("blade.obj"), &(points, triangles));
    let ends = "[[fixed]]\nwhere = \"x < 1e-9 || x > 2 - 1e-9\"\n[[load]]\ngravity = [0, 0, -9.81]\n";
    let cut = CUT.replace("frame", "method = \"delete\"\nframe");
    for time in [
        "[time]\nscheme = \"static\"\n",
        "[time]\nscheme = \"backward-euler\"\ndt = 0.01\nend = 0.05\n",
    ] {
        let text = scene([8, 2, 2], &format!("{ends}{time}{cut}"));
        let mut s = simulation(&text, folder.path());
        for _ in 0..3 {
            assert!(s.step(0.01).unwrap().converged);
        }
        let mesh = s.mesh();
        assert_eq!((mesh.num_cells(), mesh.pieces().1), (6 * 6 * 4, 2));
        let idle = mesh
            .vertex_ids()
            .filter(|v| mesh.cells_of_vertex(*v).is_empty())
            .count();
        let gone = mesh.vertex_slots() - mesh.num_vertices();
        println!("{idle} vertices without cells, {gone} removed");
        assert_eq!(idle + gone, 9, "the layer of vertices between the planes");
        assert!(s.u().iter().all(|u| u.is_finite()) && largest(s.u().iter().copied()) > 0.0);
    }
}

/// F17: the last cell removed; everything goes on with nothing.
#[test]
fn a_body_that_vanishes_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let center = Point::new(1.0, 0.5, 0.5);
    write_obj(
        &folder.path().join("blade.obj"),
        &rectangle(center, Point::new(1.0, -2.0, 0.1), Point::new(1.0, 0.1, -2.0) * 1.5),
    );
    let cut = CUT.replace("frame", "method = \"delete\"\nframe");
    for time in [
        "[time]\nscheme = \"static\"\n",
        "[time]\nscheme = \"backward-euler\"\ndt = 0.01\nend = 0.03\n",
    ] {
        let text = scene([1, 1, 1], &format!("{CLAMP}{time}{cut}"));
        let out = folder.path().join("out");
        let options = RunOptions {
            folder: out.clone(),
            verify: true,
            export_system: true,
            ..RunOptions::default()
        };
        let parsed = Scene::parse(&text, folder.path().join("scene.toml")).unwrap();
        assert_eq!(
            run(parsed, &options, |info| info.converged).unwrap(),
            Ending::Done,
            "{time}"
        );
        let left = io::read_mesh(out.join("final.vtu")).unwrap();
        assert_eq!(left.tets.len(), 0);
        assert!(out.join("report.json").is_file() && out.join("steps.csv").is_file());
    }
}
