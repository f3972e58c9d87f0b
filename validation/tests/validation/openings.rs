//! A1, F24: an edge crack under tension, against the handbook (Tada, Paris, Irwin: The Stress Analysis of Cracks).

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;

use kerfem_engine::{Scene, Simulation};

const YOUNG: f64 = 1e7;
const POISSON: f64 = 0.3;
const STRESS: f64 = 1e3;

/// Plane strain.
const STIFFNESS: f64 = YOUNG / (1.0 - POISSON * POISSON);

/// A strip of width 1 and length 3 in equilibrium, of a given mesh, with a crack of length `a`, which `method` cuts.
fn strip(mesh: &str, order: usize, method: &str, a: f64, folder: &Path) -> Simulation<3> {
    let text = format!(
        "name = \"crack\"\n[mesh]\n{mesh}\n[material]\nyoung = {YOUNG}\n\
         poisson = {POISSON}\ndensity = 1\nplane = \"strain\"\n[model]\nkind = \"linear\"\norder = {order}\n\
         [[load]]\nwhere = \"y > 3 - 1e-9\"\ntraction = [0, {STRESS}]\n[[load]]\nwhere = \"y < 1e-9\"\n\
         traction = [0, -{STRESS}]\n[solver]\ntolerance = 1e-10\n\
         [[cut]]\nsweep = \"crack.obj\"\nframe = \"rest\"\nmethod = \"{method}\"\n\
         [[quantity]]\nname = \"mouth\"\njump = {{ at = [0, 1.5], normal = [0, 1] }}\n\
         [[quantity]]\nname = \"energy\"\nenergy = true\n"
    );
    std::fs::write(folder.join("crack.obj"), format!("v -1 1.5 0\nv {a} 1.5 0\nl 1 2\n")).unwrap();
    let mut s = Simulation::planar(Scene::parse(&text, folder.join("scene.toml")).unwrap()).unwrap();
    assert!(s.step(0.0).unwrap().converged);
    s
}

#[test]
fn an_edge_crack_opens_as_the_handbook_says() {
    let (a, x) = (0.5, std::f64::consts::FRAC_PI_4);
    let shape = (1.46 + 3.42 * (1.0 - x.cos())) / x.cos().powi(2);
    let handbook = 4.0 * STRESS * a / STIFFNESS * shape;
    let folder = tempfile::tempdir().unwrap();
    let opening = |n| {
        let mesh = format!("plate = {{ size = [1, 3], cells = [{n}, {}] }}", 3 * n);
        strip(&mesh, 1, "hybrid", a, folder.path()).quantities()["mouth"].unwrap()
    };
    let errors = [16, 32, 64].map(|n| opening(n) / handbook - 1.0);
    println!("opening of the mouth against {handbook:e} m: errors {errors:.4?} at h = a/8, a/16, a/32");
    // linear triangles are too stiff, and the handbook is right to 1 %
    assert!(errors[0] < errors[1] && errors[1] < errors[2], "{errors:?}");
    assert!(errors[2] > -0.04 && errors[2] < 0.01, "{errors:?}");
}

/// The strip as squares, `n` across, each divided by the same diagonal: legacy VTK.
fn one_way_diagonals(n: usize) -> String {
    let (mut points, mut cells, mut types) = (String::new(), String::new(), String::new());
    for j in 0..=3 * n {
        for i in 0..=n {
            writeln!(points, "{:?} {:?} 0", i as f64 / n as f64, j as f64 / n as f64).unwrap();
        }
    }
    for a in (0..3 * n).flat_map(|j| (0..n).map(move |i| j * (n + 1) + i)) {
        let above = a + n + 1;
        writeln!(cells, "3 {a} {} {}\n3 {a} {} {above}", a + 1, above + 1, above + 1).unwrap();
        types += "5\n5\n";
    }
    let (points_count, count) = ((n + 1) * (3 * n + 1), 6 * n * n);
    format!(
        "# vtk DataFile Version 3.0\nstrip\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {points_count} double\n{points}\
         CELLS {count} {}\n{cells}CELL_TYPES {count}\n{types}",
        4 * count
    )
}

/// F24's figures are those of the energy that is released between cracks one cell shorter and one cell longer. That difference is
/// itself too large, by 11, 2.6, .7 and .2% of `K_I` for the sizes here: hence the sign of the first figure of order 2.
#[test]
fn f24_the_stress_intensity_of_an_edge_crack() {
    let a = 0.5_f64;
    let x = PI * a / 2.0;
    let shape = (x.tan() / x).sqrt() * (0.752 + 2.02 * a + 0.37 * (1.0 - x.sin()).powi(3)) / x.cos();
    let handbook = STRESS * (PI * a).sqrt() * shape;
    let folder = tempfile::tempdir().unwrap();
    let error = |n: usize, order: usize, method: &str| {
        let h = 1.0 / n as f64;
        std::fs::write(folder.path().join("strip.vtk"), one_way_diagonals(n)).unwrap();
        let energy = |a| strip("file = \"strip.vtk\"", order, method, a, folder.path()).quantities()["energy"].unwrap();
        let released = (energy(a + h) - energy(a - h)) / (2.0 * h);
        100.0 * ((released * STIFFNESS).sqrt() / handbook - 1.0)
    };
    for method in ["subdivide", "hybrid"] {
        for (order, sizes, figures) in [
            (1, &[8, 16, 32, 64][..], &[-12.5, -8.2, -4.7, -2.5][..]),
            (2, &[8, 16, 32][..], &[4.5, -0.3, -0.8][..]),
        ] {
            for (&n, figure) in sizes.iter().zip(figures) {
                let found = error(n, order, method);
                println!(
                    "{method}, order {order}, h = a/{}: K_I off by {found:.2}%, F24 {figure}%",
                    n / 2
                );
                assert!((found - figure).abs() < 0.1, "{method} {order} {n}: {found} {figure}");
            }
        }
    }
}
