//! The boundary of a body beside its frames.

use std::collections::BTreeMap;
use std::path::Path;

use kerfem_engine::Scene;
use kerfem_engine::run::{Ending, RunOptions, run};
use kerfem_mesh::io::{MeshData, read_mesh};
use kerfem_mesh::{Point, quality};

const SOLID: &str = "name = 'rod'\n[mesh]\ncylinder = { radius = 0.5, length = 2, layers = 2, slices = 6, axis = [1, 0, 0] }\n\
    [material]\nyoung = 1e5\npoisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\n\
    gravity = [0, 0, -9.81]\n[time]\nscheme = 'backward-euler'\ndt = 0.01\nend = 0.05\n[[cut]]\nat = 0.02\n\
    sweep = 'blade.obj'\n[output]\nevery = 0.02\nsurface = true\n";

const PLANAR: &str = "name = 'sheet'\n[mesh]\nplate = { size = [2, 1], cells = [8, 4] }\n\
    [material]\nyoung = 1e5\npoisson = 0.3\ndensity = 1000\n[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\n\
    gravity = [0, -9.81]\n[time]\nscheme = 'backward-euler'\ndt = 0.01\nend = 0.05\n[[cut]]\nat = 0.02\n\
    sweep = 'line.obj'\n[output]\nevery = 0.02\nsurface = true\n";

fn run_in(folder: &Path, text: &str) {
    let blade = "v 1.07 -5 0.01\nv 1.13 5 0.02\nv 1.11 5 5\nv 1.06 -5 5\nf 1 2 3\nf 1 3 4\n";
    std::fs::write(folder.join("blade.obj"), blade).unwrap();
    std::fs::write(folder.join("line.obj"), "v 1.07 0.43 0\nv 1.11 2 0\nl 1 2\n").unwrap();
    let options = RunOptions {
        folder: folder.to_owned(),
        ..RunOptions::default()
    };
    let scene = Scene::parse(text, folder.join("scene.toml")).unwrap();
    assert_eq!(run(scene, &options, |_| true).unwrap(), Ending::Done);
}

/// Corners of each facet, cell or line, whichever a file holds.
fn facets(data: &MeshData) -> Vec<Vec<usize>> {
    let triangles = data.triangles.iter().map(|t| t.to_vec());
    triangles.chain(data.segments.iter().map(|s| s.to_vec())).collect()
}

/// Each side of a facet is passed as often one way as the other: nothing is open.
fn is_closed(facets: &[Vec<usize>]) -> bool {
    let mut passes: BTreeMap<Vec<usize>, i64> = BTreeMap::new();
    for f in facets {
        match f[..] {
            [a, b] => {
                *passes.entry(vec![a]).or_default() -= 1;
                *passes.entry(vec![b]).or_default() += 1;
            }
            _ => (0..3).for_each(|k| {
                let (a, b) = (f[k], f[(k + 1) % 3]);
                *passes.entry(vec![a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
            }),
        }
    }
    passes.values().all(|n| *n == 0)
}

/// The volume inside triangles whose normals point outwards, or the area inside lines that run counter-clockwise.
fn inside(points: &[Point], facet: &[usize]) -> f64 {
    match *facet {
        [a, b] => points[a].cross(&points[b]).z / 2.0,
        _ => points[facet[0]].cross(&points[facet[1]]).dot(&points[facet[2]]) / 6.0,
    }
}

/// Checks the surface of a step against its frame; how many facets it has.
fn check(folder: &Path, name: &str, step: usize) -> usize {
    let read = |file: String| read_mesh(folder.join(file)).unwrap();
    let surface = read(format!("surface/{name}_{step:06}.vtp"));
    let frame = read(format!("frames/{name}_{step:06}.vtu"));
    let facets = facets(&surface);
    assert!(surface.tets.is_empty() && is_closed(&facets));
    let mut used: Vec<usize> = facets.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len(), surface.points.len(), "no point off the boundary");
    let row_of: BTreeMap<u64, usize> = (frame.point_arrays["vertex_id"].values.iter().enumerate())
        .map(|(row, id)| (id.to_bits(), row))
        .collect();
    let ids = &surface.point_arrays["vertex_id"].values;
    assert!(ids.is_sorted());
    for (i, id) in ids.iter().enumerate() {
        let row = row_of[&id.to_bits()];
        assert_eq!(surface.points[i], frame.points[row], "points lie at rest");
        for array in ["displacement", "velocity"] {
            assert_eq!(surface.point_arrays[array].row(i), frame.point_arrays[array].row(row));
        }
    }
    let inside: f64 = facets.iter().map(|f| inside(&surface.points, f)).sum();
    let size = match frame.tets.is_empty() {
        true => quality::volume(&frame.into_tri_mesh().unwrap()),
        false => quality::volume(&frame.into_tet_mesh().unwrap()),
    };
    assert!(
        (inside / size - 1.0).abs() < 1e-12,
        "{name} {step}: {inside} in a body of {size}"
    );
    facets.len()
}

#[test]
fn surfaces_are_the_closed_boundary_of_each_frame() {
    for (name, scene, at_first) in [("rod", SOLID, 2 * 24 + 2 * 12 * 6), ("sheet", PLANAR, 24)] {
        let folder = tempfile::tempdir().unwrap();
        run_in(folder.path(), scene);
        let counts = [0, 2, 4].map(|step| check(folder.path(), name, step));
        assert_eq!((counts[0], counts[1]), (at_first, at_first), "{name}");
        assert!(counts[2] > at_first + 4, "{name}: the faces of the cut belong to it");
        let list = |file: &str| std::fs::read_to_string(folder.path().join(file)).unwrap();
        let frames = list(&format!("{name}.pvd"));
        assert_eq!(frames.matches("<DataSet").count(), 3);
        assert_eq!(
            list(&format!("{name}_surface.pvd")),
            frames.replace("frames/", "surface/").replace(".vtu", ".vtp")
        );
    }
}

#[test]
fn surfaces_of_an_earlier_run_do_not_stay() {
    let folder = tempfile::tempdir().unwrap();
    let exists = |file: &str| folder.path().join(file).exists();
    run_in(folder.path(), SOLID);
    assert!(exists("surface/rod_000004.vtp") && exists("rod_surface.pvd"));
    std::fs::write(folder.path().join("surface/rod_a_000000.vtp"), "another's").unwrap();
    run_in(folder.path(), &SOLID.replace("end = 0.05", "end = 0.02"));
    assert!(exists("surface/rod_000002.vtp") && !exists("surface/rod_000004.vtp"));
    run_in(folder.path(), &SOLID.replace("surface = true", ""));
    assert!(!exists("surface/rod_000002.vtp") && !exists("rod_surface.pvd"));
    assert!(exists("surface/rod_a_000000.vtp") && exists("frames/rod_000004.vtu") && exists("rod.pvd"));
}
