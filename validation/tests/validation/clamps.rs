//! F34: a cut through a clamp and through loaded facets. Both copies of a doubled vertex stay held, and no load is lost.

use std::path::Path;

use kerfem_engine::Scene;
use kerfem_engine::run::{Ending, RunOptions, run};
use kerfem_mesh::Point;

use super::helpers::*;

const CUT: &str = "[[cut]]\nmethod = \"hybrid\"\nframe = \"rest\"\nsweep = \"blade.obj\"\n";

/// A beam held at `x = 0` and loaded in every way, with `fixed` choosing the held vertices.
fn scene(fixed: &str, cut: &str) -> String {
    format!(
        "name = \"clamp\"\n[mesh]\nbox = {{ size = [2, 1, 1], cells = [8, 4, 4] }}\n{MATERIAL}[model]\nkind = \"linear\"\n\
         [[fixed]]\n{fixed}\n\
         [[load]]\ngravity = [0.5, -1, -9.81]\n\
         [[load]]\nwhere = \"z > 1 - 1e-9\"\ntraction = [100, -200, -300]\n\
         [[load]]\nwhere = \"z < 1e-9\"\npressure = 150\n\
         [[load]]\nwhere = \"z > 1 - 1e-9 && x < 0.9\"\nforce = [10, 20, 30]\n\
         [[quantity]]\nname = \"reaction\"\nreaction = \"z\"\nwhere = \"x < 1e-9\"\n\
         [time]\nscheme = \"static\"\n[solver]\nkind = \"cholesky\"\ntolerance = 1e-13\n{cut}"
    )
}

/// Along the beam, from outside through the clamp to beyond its middle, between the loaded faces.
fn blade(folder: &Path) {
    let (along, up) = (Point::new(0.9, 0.05, 0.02), Point::new(0.03, -0.06, 0.8));
    write_obj(
        &folder.join("blade.obj"),
        &rectangle(Point::new(0.4, 0.47, 0.5), along, up),
    );
}

/// The external load (N) that `--export-system` writes.
fn exported_load(text: &str, folder: &Path) -> Vec<f64> {
    let scene = Scene::parse(text, folder.join("scene.toml")).unwrap();
    let options = RunOptions {
        folder: folder.join("out"),
        verify: true,
        export_system: true,
        until: None,
    };
    assert_eq!(run(scene, &options, |_| true).unwrap(), Ending::Done);
    let file = std::fs::read_to_string(folder.join("out/system/f.mtx")).unwrap();
    let numbers = file.lines().filter(|l| !l.starts_with('%')).skip(1);
    numbers.map(|l| l.trim().parse().unwrap()).collect()
}

fn check(fixed: &str) {
    let folder = tempfile::tempdir().unwrap();
    blade(folder.path());
    let whole = exported_load(&scene(fixed, ""), folder.path());
    let cut = exported_load(&scene(fixed, CUT), folder.path());
    assert!(cut.len() > whole.len(), "the cut doubles vertices");
    for axis in 0..3 {
        let (a, b) = (sum(&whole, axis), sum(&cut, axis));
        let size: f64 = whole.iter().skip(axis).step_by(3).map(|f| f.abs()).sum();
        println!("total load along axis {axis}: {a} N, after the cut {b} N");
        assert!((a - b).abs() < 1e-12 * size, "{a} N became {b} N");
        assert!(a.abs() > 100.0);
    }

    let mut s = simulation(&scene(fixed, CUT), folder.path());
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
    assert!(doubled >= 6, "the cut crosses the clamp from face to face");
    for v in &held {
        assert_eq!(s.u()[3 * v.index()..][..3], [0.0; 3], "vertex {v:?} is held");
    }
    let free = mesh.vertex_ids().filter(|v| !held.contains(v));
    assert!(
        free.map(|v| largest(s.u()[3 * v.index()..][..3].iter().copied()))
            .all(|u| u > 0.0)
    );
    let (reaction, total) = (s.quantities()["reaction"].unwrap(), sum(&cut, 2));
    assert!(
        (reaction + total).abs() < 1e-9 * total.abs(),
        "{reaction} N holds {total} N"
    );
}

#[test]
fn a_clamp_given_by_a_condition() {
    check("where = \"x < 1e-9\"");
}

#[test]
fn a_clamp_given_by_its_vertices() {
    let vertices: Vec<usize> = (0..25).map(|k| 9 * k).collect();
    check(&format!("vertices = {vertices:?}"));
}
