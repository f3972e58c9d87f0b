//! Triangles in the plane, through whole scenes.

use kerfem_engine::{AnySimulation, EngineError, Scene, Simulation, run};
use kerfem_mesh::TriMesh;
use kerfem_mesh::io::{VtuArray, VtuGrid, read_mesh, write_vtu};

use super::nodal;

fn planar(text: &str) -> Simulation<3> {
    Simulation::planar(Scene::parse(text, "test.toml").expect("the scene is accepted")).expect("the mesh is accepted")
}

/// A plate 2 x 1 with thickness 0.3 and the given sections; `plane` is "strain" or "stress".
fn plate_scene(cells: [usize; 2], plane: &str, sections: &str) -> String {
    format!(
        "name = 'plate'\n[mesh]\nplate = {{ size = [2, 1], cells = {cells:?} }}\n[material]\nyoung = 1e5\npoisson = 0.3\n\
         density = 1000\nplane = '{plane}'\nthickness = 0.3\n{sections}"
    )
}

fn refusal(text: &str) -> String {
    match Scene::parse(text, "test.toml").and_then(Simulation::planar) {
        Ok(_) => "accepted".into(),
        Err(e) => {
            assert_eq!(e.exit_code(), 2);
            e.to_string()
        }
    }
}

#[test]
fn size_and_mass_have_the_thickness() {
    let s = planar(&plate_scene([4, 2], "strain", ""));
    let figures = s.mesh_figures();
    assert!((figures.volume_m3 - 0.6).abs() < 1e-15 && (figures.mass_kg - 600.0).abs() < 1e-9);
    assert_eq!((figures.cells, figures.vertices, figures.pieces), (16, 15, 1));
    let q = figures.quality;
    // right triangles with two equal sides: 2 r / R = 2 sqrt 2 - 2
    assert!((q.min_radius_ratio - (8f64.sqrt() - 2.0)).abs() < 1e-12, "{q:?}");
    assert!((q.max_over_min_edge - 2f64.sqrt()).abs() < 1e-12 && q.max_over_min_volume < 1.0 + 1e-12);
}

#[test]
fn a_pull_gives_the_uniform_state_of_its_law_at_any_thickness() {
    let pull = "[[fixed]]\nwhere = 'x < 1e-9'\naxes = 'x'\n[[fixed]]\nvertices = [0]\n[[load]]\nwhere = 'x > 1.999'\n\
        traction = [200, 0]\n[[quantity]]\nname = 'long'\nmean = 'ux'\nwhere = 'x > 1.999'\n[[quantity]]\nname = 'side'\n\
        mean = 'uy'\nwhere = 'y > 0.999'\n[[quantity]]\nname = 'held'\nreaction = 'x'\nwhere = 'x < 1e-9'\n\
        [[quantity]]\nname = 'work'\nenergy = true\n[[quantity]]\nname = 'corner'\npoint = [2, 1]\n";
    let (young, nu, stress): (f64, f64, f64) = (1e5, 0.3, 200.0);
    for (plane, axial, lateral) in [
        ("stress", stress / young, -nu * stress / young),
        (
            "strain",
            stress * (1.0 - nu * nu) / young,
            -nu * (1.0 + nu) * stress / young,
        ),
    ] {
        for model in ["linear", "corotated"] {
            let mut s = planar(&plate_scene(
                [5, 3],
                plane,
                &format!("{pull}[model]\nkind = '{model}'\n"),
            ));
            let info = s.step(0.0).unwrap();
            assert!(info.converged);
            let q = s.quantities();
            let near = |name: &str, wanted: f64| {
                let found = q[name].unwrap();
                assert!(
                    (found - wanted).abs() < 1e-7 * wanted.abs(),
                    "{plane} {model} {name}: {found} {wanted}"
                );
            };
            near("long", 2.0 * axial);
            near("side", lateral);
            near("corner", lateral);
            near("held", -stress * 0.3);
            near("work", 0.5 * stress * axial * 0.6);
            assert!(s.u().iter().skip(2).step_by(3).all(|z| *z == 0.0));
        }
    }
}

#[test]
fn a_cantilever_approaches_the_beam_with_shear() {
    // Timoshenko: F L^3 / (3 E I) + F L / (k G A), k = 10 (1 + nu) / (12 + 11 nu)
    let scene = |cells: [usize; 2]| {
        format!(
            "name = 'beam'\n[mesh]\nplate = {{ size = [8, 1], cells = {cells:?} }}\n[material]\nyoung = 1e5\npoisson = 0.3\n\
             density = 1\nplane = 'stress'\nthickness = 0.3\n[model]\nkind = 'linear'\n[[fixed]]\nwhere = 'x < 1e-9'\n\
             [[load]]\nwhere = 'x > 7.999'\ntraction = [0, '1.5 * (1 - (2*y - 1)^2)']\n[[quantity]]\nname = 'tip'\n\
             mean = 'uy'\nwhere = 'x > 7.999'\n"
        )
    };
    let (young, nu, length, force): (f64, f64, f64, f64) = (1e5, 0.3, 8.0, 0.3);
    let (area, inertia, shear) = (0.3, 0.3 / 12.0, young / (2.0 * (1.0 + nu)));
    let k = 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu);
    let beam = force * length.powi(3) / (3.0 * young * inertia) + force * length / (k * shear * area);
    let mut errors = Vec::new();
    for n in [8, 16, 32] {
        let mut s = planar(&scene([8 * n, n]));
        s.step(0.0).unwrap();
        errors.push(1.0 - s.quantities()["tip"].unwrap() / beam);
    }
    assert!(
        errors[0] > errors[1] && errors[1] > errors[2] && errors[2].abs() < 0.015,
        "{errors:?}"
    );
    assert!((errors[0] / errors[1]).log2() > 1.7, "{errors:?}");
}

#[test]
fn a_pressure_acts_along_the_inward_normal_of_edges() {
    let load = "[[load]]\nwhere = 'y > 0.999'\npressure = 10\n[[fixed]]\nwhere = 'y < 1e-9'\n[[quantity]]\nname = 'up'\n\
        reaction = 'y'\nwhere = 'y < 1e-9'\n";
    let mut s = planar(&plate_scene([4, 2], "strain", load));
    s.step(0.0).unwrap();
    assert!((s.quantities()["up"].unwrap() - 10.0 * 2.0 * 0.3).abs() < 1e-6);
    assert_eq!(
        s.selections(),
        [
            "fixed[0] holds 5 vertices, xy, in [0, 0] .. [2, 0]",
            "load[0] (pressure) acts on 4 facets of 0.6 m2, in [0, 1] .. [2, 1]: [0, -6] N in all"
        ]
    );
}

#[test]
fn free_fall_and_a_spin_are_those_of_a_rigid_body() {
    let fall = "[[load]]\ngravity = [0, -10]\n[[probe]]\nname = 'a'\npoint = [1, 0.5]\n[time]\nscheme = 'midpoint'\n\
        dt = 0.01\nend = 0.2\n[solver]\ntolerance = 1e-13\n";
    let mut s = planar(&plate_scene([4, 2], "stress", fall));
    (0..20).for_each(|_| assert!(s.step(0.01).unwrap().converged));
    for i in 0..s.mesh().vertex_slots() {
        assert!((nodal(s.u(), i) - nalgebra::Vector3::new(0.0, -0.2, 0.0)).norm() < 1e-9);
        assert!((nodal(s.v(), i) - nalgebra::Vector3::new(0.0, -2.0, 0.0)).norm() < 1e-8);
    }
    let spin = "[initial]\nvelocity = ['-(y - 0.5)', 'x - 1']\n[time]\nscheme = 'midpoint'\ndt = 0.02\nend = 1\n";
    let mut s = planar(&plate_scene([8, 4], "strain", spin));
    let moment = |s: &Simulation<3>| {
        let points = s.positions();
        let mass = |i: usize| {
            let cells = s.mesh().cells_of_vertex(kerfem_mesh::VertexId(i as u32)).len();
            1000.0 * 0.3 * cells as f64 / (32.0 * 3.0)
        };
        let about_z = |i: usize| mass(i) * points[i].cross(&nodal(s.v(), i)).z;
        (0..points.len()).map(about_z).sum::<f64>()
    };
    let start = (moment(&s), s.energies().kinetic);
    (0..50).for_each(|_| assert!(s.step(0.02).unwrap().converged));
    assert!((moment(&s) / start.0 - 1.0).abs() < 1e-3, "{} {}", moment(&s), start.0);
    let energy = s.energies().kinetic + s.energies().elastic;
    assert!((energy / start.1 - 1.0).abs() < 1e-3, "{energy} {}", start.1);
}

#[test]
fn a_turned_body_is_at_rest_and_knows_it() {
    // 60 degrees about (0.3, -0.2)
    let turned = "[initial]\ndisplacement = ['(x-0.3)*cos(pi/3) - (y+0.2)*sin(pi/3) + 0.3 - x', \
        '(x-0.3)*sin(pi/3) + (y+0.2)*cos(pi/3) - 0.2 - y']\n[time]\nscheme = 'static'\n";
    for (model, at_rest) in [("corotated", true), ("linear", false)] {
        let s = planar(&plate_scene(
            [4, 2],
            "stress",
            &format!("{turned}[model]\nkind = '{model}'\n"),
        ));
        assert_eq!(
            s.energies().elastic < 1e-20 * 1e5,
            at_rest,
            "{model} {}",
            s.energies().elastic
        );
    }
}

#[test]
fn a_free_plate_is_named_with_its_motion_and_solved_for_if_its_loads_balance() {
    let free = "[[fixed]]\nvertices = [0]\n[[load]]\nwhere = 'x > 1.999'\ntraction = [0, 5]\n";
    let mut s = planar(&plate_scene([4, 2], "strain", free));
    let stopped = s.step(0.0).unwrap_err();
    assert_eq!(stopped.exit_code(), 3);
    let text = stopped.to_string();
    assert!(
        text.contains("piece 1 of 1 (15 vertices") && text.contains("free to turn about z"),
        "{text}"
    );

    let pulled =
        "[[load]]\nwhere = 'x > 1.999'\ntraction = [50, 0]\n[[load]]\nwhere = 'x < 1e-9'\ntraction = [-50, 0]\n";
    for model in ["linear", "corotated"] {
        let mut s = planar(&plate_scene(
            [4, 2],
            "stress",
            &format!("{pulled}[model]\nkind = '{model}'\n"),
        ));
        assert!(s.step(0.0).unwrap().converged);
        let (left, right) = (nodal(s.u(), 5), nodal(s.u(), 9));
        assert!((right.x - left.x - 2.0 * 50.0 / 1e5).abs() < 1e-9);
    }
}

#[test]
fn the_same_bits_at_any_number_of_threads() {
    let scene = plate_scene(
        [24, 12],
        "strain",
        "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\ngravity = [0, -9.81]\n[time]\nscheme = 'backward-euler'\ndt = 0.01\nend = 1\n",
    );
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut s = planar(&scene);
            (0..5).for_each(|_| assert!(s.step(0.01).unwrap().converged));
            (s.u().to_vec(), s.v().to_vec(), s.energies())
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(8));
}

#[test]
fn results_have_triangles_three_components_and_two_dofs_a_vertex() {
    let folder = tempfile::tempdir().unwrap();
    let sections = "[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 1.999'\ntraction = [0, -20]\n[model]\n\
        kind = 'linear'\n[output]\nfields = ['stress', 'strain', 'von_mises', 'quality', 'mass', 'region']\n";
    for plane in ["strain", "stress"] {
        let scene = Scene::parse(&plate_scene([4, 2], plane, sections), "test.toml").unwrap();
        let options = run::RunOptions {
            folder: folder.path().join(plane),
            export_system: true,
            ..run::RunOptions::default()
        };
        assert_eq!(run::run(scene, &options, |_| true).unwrap(), run::Ending::Done);
        let data = read_mesh(options.folder.join("final.vtu")).unwrap();
        assert_eq!((data.tets.len(), data.triangles.len(), data.points.len()), (0, 16, 15));
        assert_eq!(data.point_arrays["displacement"].components, 3);
        assert!((data.point_arrays["mass"].values.iter().sum::<f64>() - 600.0).abs() < 1e-9);
        let (stress, strain) = (&data.cell_arrays["stress"], &data.cell_arrays["strain"]);
        for c in 0..16 {
            let (s, e) = (stress.row(c), strain.row(c));
            let size = s.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            match plane {
                "stress" => {
                    assert_eq!(s[8], 0.0);
                    assert!((e[8] + 0.3 / 0.7 * (e[0] + e[4])).abs() < 1e-12 * size / 1e5);
                }
                _ => {
                    assert_eq!(e[8], 0.0);
                    assert!((s[8] - 0.3 * (s[0] + s[4])).abs() < 1e-12 * size);
                }
            }
            // Hooke's law in space holds for both
            let (lambda, mu) = (0.3e5 / (1.3 * 0.4), 1e5 / 2.6);
            for (i, (s, e)) in s.iter().zip(e).enumerate() {
                let trace = if i % 4 == 0 {
                    lambda * (strain.row(c)[0] + strain.row(c)[4] + strain.row(c)[8])
                } else {
                    0.0
                };
                assert!((s - 2.0 * mu * e - trace).abs() < 1e-11 * size);
            }
        }
        let read = |file: &str| std::fs::read_to_string(options.folder.join(file)).unwrap();
        let sizes = |file: &str| read(file).lines().nth(1).unwrap().to_owned();
        for file in ["K.mtx", "K_tangent.mtx", "M.mtx"] {
            assert!(sizes(&format!("system/{file}")).starts_with("30 30 "), "{file}");
        }
        assert_eq!(sizes("system/M_lumped.mtx"), "30 30 30");
        assert_eq!(read("system/f.mtx").lines().count(), 32);
        // K u = f on the free dofs, in the numbering of the files
        let u: Vec<f64> = data.point_arrays["displacement"]
            .values
            .chunks(3)
            .flat_map(|u| [u[0], u[1]])
            .collect();
        let mut residual: Vec<f64> = read("system/f.mtx")
            .lines()
            .skip(2)
            .map(|l| -l.parse::<f64>().unwrap())
            .collect();
        for line in read("system/K.mtx").lines().skip(2) {
            let entry: Vec<&str> = line.split(' ').collect();
            let [i, j] = [0, 1].map(|k| entry[k].parse::<usize>().unwrap() - 1);
            residual[i] += entry[2].parse::<f64>().unwrap() * u[j];
        }
        for (i, r) in residual.iter().enumerate() {
            assert!(data.points[i / 2].x == 0.0 || r.abs() < 1e-6, "{i}: {r}");
        }
        let table = read("steps.csv");
        let row: Vec<&str> = table.lines().nth(1).unwrap().split(',').collect();
        assert_eq!(row[3..6], ["16", "15", "30"]);
    }
}

#[test]
fn a_file_of_triangles_brings_sets_and_fields() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = plate();
    let points = mesh.rest_positions();
    let mut grid = VtuGrid::from_tri_mesh(&mesh);
    let clamp: Vec<f64> = points.iter().map(|p| f64::from(u8::from(p.x == 0.0))).collect();
    let push: Vec<f64> = points.iter().flat_map(|p| [0.1 * p.x, -0.2 * p.y]).collect();
    let soft: Vec<f64> = mesh.cell_ids().map(|c| f64::from(u8::from(c.0 < 8))).collect();
    grid.point_arrays = vec![VtuArray::reals("clamp", 1, clamp), VtuArray::reals("push", 2, push)];
    grid.cell_arrays = vec![VtuArray::reals("soft", 1, soft)];
    write_vtu(folder.path().join("mesh.vtu"), &grid).unwrap();
    let text = "name = 'files'\n[mesh]\nfile = 'mesh.vtu'\n[material]\nyoung = 1e4\npoisson = 0.3\ndensity = 1\n\
        [[region]]\ngroup = 'soft'\ndensity = 3\n[[fixed]]\ngroup = 'clamp'\n[[load]]\nfacets = [[14, 9], [4, 9]]\n\
        traction = [1, 0, 0]\n[initial]\ndisplacement = { file = 'mesh.vtu', array = 'push' }\n[time]\nscheme = 'evaluate'\n";
    let path = folder.path().join("scene.toml");
    let s = Simulation::planar(Scene::parse(text, &path).unwrap()).unwrap();
    assert_eq!(
        s.selections(),
        [
            "region[0] has 8 cells of 1 m3, in [0, 0] .. [2, 0.5]",
            "fixed[0] holds 3 vertices, xy, in [0, 0] .. [0, 1]",
            "load[0] (traction) acts on 2 facets of 1 m2, in [2, 0] .. [2, 1]: [1, 0] N in all",
            "initial displacement is in [0, -0.2] .. [0.2, 0] m"
        ]
    );
    assert_eq!(nodal(s.u(), 14), nalgebra::Vector3::new(0.2, -0.2, 0.0));
    assert!((s.mesh_figures().mass_kg - 4.0).abs() < 1e-12);
    assert!(matches!(
        AnySimulation::new(Scene::parse(text, &path).unwrap()),
        Ok(AnySimulation::Planar(_))
    ));

    let refused = |text: &str| {
        let made = Scene::parse(text, &path).and_then(AnySimulation::new);
        made.unwrap_err().to_string()
    };
    let triple = refused(&text.replace("[14, 9]", "[14, 9, 8]"));
    assert!(
        triple.contains("load.facets: [14, 9, 8] is no facet; 2 different vertices each are needed"),
        "{triple}"
    );
    let inner = refused(&text.replace("[14, 9]", "[6, 7]"));
    assert!(
        inner.contains("load.facets: [6, 7] is no boundary facet of the mesh"),
        "{inner}"
    );
    let solid = Simulation::new(Scene::parse(text, &path).unwrap())
        .unwrap_err()
        .to_string();
    assert!(solid.contains("it is planar; tetrahedra are needed here"), "{solid}");

    grid.points.to_mut()[3].z = 0.25;
    write_vtu(folder.path().join("mesh.vtu"), &grid).unwrap();
    let lifted = refused(text);
    assert!(
        lifted.contains(
            "vertex 3 has z = 0.25; a planar mesh lies in the plane z = 0; surfaces in space have no mechanics"
        ),
        "{lifted}"
    );
}

fn plate() -> TriMesh {
    let at = |i: usize, j: usize| kerfem_mesh::Point::new(0.5 * i as f64, 0.5 * j as f64, 0.0);
    let points = (0..3).flat_map(|j| (0..5).map(move |i| at(i, j))).collect();
    let cells = (0..2).flat_map(|j| (0..4).map(move |i| i + 5 * j));
    TriMesh::planar(
        points,
        cells.flat_map(|a| [[a, a + 1, a + 6], [a, a + 5, a + 6]]).collect(),
    )
    .unwrap()
}

#[test]
fn what_leaves_the_plane_is_refused() {
    let base = plate_scene(
        [2, 2],
        "strain",
        "[[fixed]]\nwhere = 'x < 1e-9'\naxes = 'xy'\n[[load]]\ngravity = [0, -1]\n[[probe]]\nname = 'p'\npoint = [1, 0.5]\n\
         [[quantity]]\nname = 'q'\nmax = 'uy'\n[initial]\nvelocity = [0, 1]\n",
    );
    assert_eq!(refusal(&base), "accepted");
    for (from, to, wanted) in [
        (
            "axes = 'xy'",
            "axes = 'z'",
            "test.toml:12: fixed.axes: \"z\" is not accepted, the mesh is planar: nothing moves along z; letters x, y are",
        ),
        (
            "axes = 'xy'",
            "displacement = [0, 0, 1]",
            "test.toml:12: fixed.displacement: \"1.0\" along z is not accepted",
        ),
        (
            "gravity = [0, -1]",
            "gravity = [0, 0, -1]",
            "test.toml:14: load.gravity: \"-1.0\" along z is not accepted",
        ),
        (
            "gravity = [0, -1]",
            "gravity = [0]",
            "test.toml:14: load.gravity: 1 components are given; 3 are needed, 2 in the plane",
        ),
        (
            "point = [1, 0.5]",
            "point = [1, 0.5, 0.1]",
            "test.toml:17: probe.point: z = 0.1 does not lie in the plane z = 0",
        ),
        (
            "max = 'uy'",
            "max = 'uz'",
            "test.toml:20: quantity.max: z is not accepted",
        ),
        (
            "velocity = [0, 1]",
            "velocity = [0, 1, 'x']",
            "test.toml:22: initial.velocity: \"x\" along z is not accepted",
        ),
        (
            "thickness = 0.3",
            "thickness = 0",
            "test.toml:9: material.thickness: 0.0 is not accepted; a finite number greater than 0",
        ),
        (
            "plane = 'strain'",
            "plane = 'bent'",
            "test.toml:8: material.plane: unknown value \"bent\"; accepted: \"strain\", \"stress\"",
        ),
        (
            "size = [2, 1]",
            "size = [2, -1]",
            "test.toml:3: mesh.plate: -1.0 is not accepted",
        ),
        (
            "size = [2, 1]",
            "size = [2, 1], origin = [1e300, 0]",
            "test.toml:3: mesh.plate:",
        ),
        (
            "cells = [2, 2]",
            "cells = [0, 2]",
            "test.toml:3: mesh.plate: cells = [0, 2] is not accepted",
        ),
        (
            "cells = [2, 2]",
            "cells = [4000000000, 4000000000]",
            "test.toml:3: mesh.plate: cells",
        ),
    ] {
        assert!(base.contains(from), "{from}");
        let message = refusal(&base.replace(from, to));
        assert!(message.starts_with(wanted), "{from} -> {to}: {message}");
    }
    // three components with zero along z, and the other name
    let three = base
        .replace("gravity = [0, -1]", "gravity = [0, -1, 0]")
        .replace("plate = {", "plate2d = {");
    assert_eq!(refusal(&three), "accepted");
}

#[test]
fn tetrahedra_have_no_plane_and_no_thickness() {
    for key in ["plane = 'stress'", "thickness = 0.5"] {
        let text = format!(
            "name = 'box'\n[mesh]\nbox = {{ size = [1, 1, 1], cells = [1, 1, 1] }}\n[material]\nyoung = 1\npoisson = 0\n\
             density = 1\n{key}\n"
        );
        let refused: EngineError = Scene::parse(&text, "test.toml").unwrap_err();
        let name = key.split(' ').next().unwrap();
        let wanted = format!("test.toml:8: material.{name}: the mesh is made of tetrahedra; only a planar mesh");
        assert!(refused.to_string().starts_with(&wanted), "{refused}");
    }
}
