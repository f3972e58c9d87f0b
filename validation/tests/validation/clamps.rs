//! F34: a cut through a clamp and through loaded facets. Both copies of a doubled vertex stay held, no load is lost, and none
//! acts on the new faces.

use std::path::Path;

use kerfem_engine::run::{Ending, RunOptions, run};
use kerfem_engine::{AnySimulation, Scene, Simulation};
use kerfem_mesh::io::{VtuArray, VtuCells, VtuGrid, write_vtu};
use kerfem_mesh::{Point, SimplexMesh, generate};

use super::helpers::*;

const CUT: &str = "[[cut]]\nmethod = \"hybrid\"\nframe = \"rest\"\nsweep = \"blade.obj\"\n";

/// A body held at `x = 0`, of tetrahedra or of triangles in the plane.
#[derive(Clone, Copy)]
enum Body {
    Beam,
    Strip,
}

impl Body {
    fn dimension(self) -> usize {
        match self {
            Body::Beam => 3,
            Body::Strip => 2,
        }
    }

    /// The mesh with the clamp as a point array, and a force at each vertex; the blade that cuts it.
    fn write(self, folder: &Path) {
        match self {
            Body::Beam => {
                write_body(&generate::box_tets([2.0, 1.0, 1.0], [8, 4, 4], [0.0; 3]), folder);
                // along the beam, from outside through the clamp to beyond its middle, through top and bottom
                let (along, up) = (Point::new(0.9, 0.05, 0.02), Point::new(0.03, -0.06, 0.8));
                let blade = rectangle(Point::new(0.4, 0.47, 0.5), along, up);
                write_obj(&folder.join("blade.obj"), &blade);
            }
            Body::Strip => {
                write_body(&generate::rect_triangles([2.0, 1.0], [8, 4], [0.0; 2]).unwrap(), folder);
                // from outside through the clamp along the strip, and out through its top
                let line = "v -0.1 0.47 0\nv 0.9 0.51 0\nv 1.04 1.1 0\nl 1 2 3\n";
                std::fs::write(folder.join("blade.obj"), line).unwrap();
            }
        }
    }

    /// A scene loaded in every way, with `fixed` choosing the held vertices.
    fn scene(self, fixed: &str, model: &str, cut: &str) -> String {
        let dimension = self.dimension();
        let up = ["y", "z"][dimension - 2];
        let vector = |v: [f64; 3]| format!("{:?}", if dimension == 3 { v.to_vec() } else { vec![v[0], v[2]] });
        let reactions: String = ["x", "y", "z"][..dimension]
            .iter()
            .map(|axis| format!("[[quantity]]\nname = \"{axis}\"\nreaction = \"{axis}\"\nwhere = \"x < 1e-9\"\n"))
            .collect();
        format!(
            "name = \"clamp\"\n[mesh]\nfile = \"body.vtu\"\n{MATERIAL}[model]\nkind = \"{model}\"\n[[fixed]]\n{fixed}\n\
             [[load]]\ngravity = {}\n\
             [[load]]\nwhere = \"x > -1\"\ntraction = {}\n\
             [[load]]\nwhere = \"{up} > 1 - 1e-9\"\ntraction = {}\n\
             [[load]]\nwhere = \"{up} < 1e-9\"\npressure = 150\n\
             [[load]]\nwhere = \"{up} > 1 - 1e-9 && x < 1.1\"\nforce = {}\n\
             [[load]]\nnodal = {{ file = \"body.vtu\", array = \"push\" }}\n{reactions}\
             [time]\nscheme = \"static\"\n[solver]\nkind = \"cholesky\"\ntolerance = 1e-13\n{cut}",
            vector([0.5, -1.0, -9.81]),
            vector([10.0, 20.0, 30.0]),
            vector([100.0, -200.0, -300.0]),
            vector([10.0, 20.0, 30.0]),
        )
    }
}

fn write_body<const N: usize>(mesh: &SimplexMesh<N>, folder: &Path) {
    let points = mesh.rest_positions();
    let clamp: Vec<f64> = points.iter().map(|p| f64::from(u8::from(p.x < 1e-9))).collect();
    let third = if N == 3 { 0.0 } else { 1.0 };
    let push = points
        .iter()
        .flat_map(|p| [p.y - 3.0, 2.0 * p.x + p.y, third * (p.x - 5.0)]);
    let cells = mesh.cell_ids().map(|c| mesh.cell(c).map(|v| v.index()));
    let grid = VtuGrid {
        points: points.to_vec().into(),
        cells: match N {
            3 => VtuCells::Triangles(cells.map(|c| [c[0], c[1], c[2]]).collect::<Vec<_>>().into()),
            _ => VtuCells::Tets(cells.map(|c| [c[0], c[1], c[2], c[3]]).collect::<Vec<_>>().into()),
        },
        point_arrays: vec![
            VtuArray::reals("clamp", 1, clamp),
            VtuArray::reals("push", 3, push.collect::<Vec<_>>()),
        ],
        cell_arrays: Vec::new(),
    };
    write_vtu(folder.join("body.vtu"), &grid).unwrap();
}

/// Sum and sum of sizes, by axis, of the external load (N) that `--export-system` writes, and how many vertices it has.
fn exported_load(text: &str, dimension: usize, folder: &Path) -> (Vec<[f64; 2]>, usize) {
    let scene = Scene::parse(text, folder.join("scene.toml")).unwrap();
    let options = RunOptions {
        folder: folder.join("out"),
        verify: true,
        export_system: true,
        ..RunOptions::default()
    };
    assert_eq!(run(scene, &options, |_| true).unwrap(), Ending::Done);
    let file = std::fs::read_to_string(folder.join("out/system/f.mtx")).unwrap();
    let numbers = file.lines().filter(|l| !l.starts_with('%')).skip(1);
    let load: Vec<f64> = numbers.map(|l| l.trim().parse().unwrap()).collect();
    let of = |axis| load.iter().skip(axis).step_by(dimension);
    let sums = (0..dimension).map(|axis| [of(axis).sum(), of(axis).map(|f| f.abs()).sum()]);
    (sums.collect(), load.len() / dimension)
}

fn check(body: Body, fixed: &str) {
    let (folder, dimension) = (tempfile::tempdir().unwrap(), body.dimension());
    body.write(folder.path());
    for model in ["linear", "corotated"] {
        let (whole, before) = exported_load(&body.scene(fixed, model, ""), dimension, folder.path());
        let (cut, after) = exported_load(&body.scene(fixed, model, CUT), dimension, folder.path());
        assert!(after > before, "the cut doubles vertices");
        for ([a, size], [b, _]) in whole.iter().zip(&cut) {
            println!("{dimension} dimensions, {model}: total load {a} N, after the cut {b} N");
            assert!((a - b).abs() < 1e-12 * size, "{a} N became {b} N");
            assert!(a.abs() > 10.0);
        }
        let scene = Scene::parse(&body.scene(fixed, model, CUT), folder.path().join("scene.toml")).unwrap();
        match AnySimulation::new(scene).unwrap() {
            AnySimulation::Solid(s) => check_held(s, &cut, 6),
            AnySimulation::Planar(s) => check_held(s, &cut, 2),
        }
    }
}

/// At the clamp everything is held, elsewhere nothing, and the reactions carry the loads.
fn check_held<const N: usize>(mut s: Simulation<N>, loads: &[[f64; 2]], least_doubled: usize) {
    assert!(s.step(0.0).unwrap().converged);
    let mesh = s.mesh();
    let held: Vec<_> = mesh
        .vertex_ids()
        .filter(|v| mesh.rest_position(*v).x.abs() < 1e-9)
        .collect();
    let is_double = |p: Point| {
        held.iter()
            .filter(|v| (mesh.rest_position(**v) - p).norm() < 1e-12)
            .count()
            == 2
    };
    let doubled = held.iter().filter(|v| is_double(mesh.rest_position(**v))).count();
    println!(
        "{} vertices at the clamp, {doubled} of them one of two copies",
        held.len()
    );
    assert!(doubled >= least_doubled, "the cut crosses the clamp");
    for v in &held {
        assert_eq!(s.u()[3 * v.index()..][..3], [0.0; 3], "vertex {v:?} is held");
    }
    let free = mesh.vertex_ids().filter(|v| !held.contains(v));
    assert!(
        free.map(|v| largest(s.u()[3 * v.index()..][..3].iter().copied()))
            .all(|u| u > 0.0)
    );
    for (axis, [load, size]) in ["x", "y", "z"].into_iter().zip(loads) {
        let reaction = s.quantities()[axis].unwrap();
        println!("{reaction} N along {axis} hold {load} N");
        assert!((reaction + load).abs() < 1e-9 * size, "{reaction} N holds {load} N");
    }
}

#[test]
fn a_clamp_given_by_a_condition() {
    check(Body::Beam, "where = \"x < 1e-9\"");
    check(Body::Strip, "where = \"x < 1e-9\"");
}

#[test]
fn a_clamp_given_by_its_vertices() {
    let vertices = |count: usize| (0..count).map(|k| 9 * k).collect::<Vec<_>>();
    check(Body::Beam, &format!("vertices = {:?}", vertices(25)));
    check(Body::Strip, &format!("vertices = {:?}", vertices(5)));
}

#[test]
fn a_clamp_given_by_a_group() {
    check(Body::Beam, "group = \"clamp\"");
    check(Body::Strip, "group = \"clamp\"");
}
