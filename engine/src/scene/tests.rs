use super::*;
use crate::Simulation;

const BASE: &str = r#"name = "beam"
[mesh]
box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }
[material]
young = 1e5
poisson = 0.3
density = 1000.0
[[fixed]]
where = "x < 1e-9"
[[load]]
gravity = [0, 0, -9.81]
[time]
scheme = "backward-euler"
dt = 0.01
end = 0.1
[[cut]]
at = 0.05
sweep = "blade.obj"
"#;

/// The message for the base scene with `from` replaced by `to`.
fn message(from: &str, to: &str) -> String {
    assert!(BASE.contains(from), "{from}");
    match Scene::parse(&BASE.replace(from, to), "s.toml") {
        Ok(_) => "accepted".into(),
        Err(e) => {
            assert_eq!(e.exit_code(), 2);
            e.to_string()
        }
    }
}

#[test]
fn the_base_scene_is_accepted_with_its_defaults() {
    let scene = Scene::parse(BASE, "s.toml").unwrap();
    assert_eq!(scene.model.kind, ModelKind::Auto);
    assert_eq!(scene.cut[0].method, MethodName::Hybrid);
    assert_eq!(scene.cut[0].frame, Frame::Deformed);
    assert_eq!(scene.solver.tolerance, 1e-8);
}

#[test]
fn a_cut_snaps_less_where_elements_are_of_order_2() {
    let snap = |key: &str, order: u32| {
        let scene = Scene::parse(&BASE.replace("at = 0.05", &format!("at = 0.05\n{key}")), "s.toml").unwrap();
        scene.cut[0].options(order).snap
    };
    assert_eq!([snap("", 1), snap("", 2)], [0.2, 0.1]);
    assert_eq!([snap("snap = 0.3", 1), snap("snap = 0.3", 2)], [0.3, 0.3]);
}

#[test]
fn mistakes_get_one_line_with_place_and_what_is_accepted() {
    for (from, to, wanted) in [
        (
            "young = 1e5",
            "youngs = 1e5",
            "s.toml:5: material.youngs: unknown key \"youngs\"; did you mean \"young\"? accepted: \"young\", \"poisson\", \
             \"density\", \"damping\", \"plane\", \"thickness\"",
        ),
        ("young = 1e5", "", "s.toml:4: material: the key \"young\" is missing"),
        (
            "poisson = 0.3",
            "poisson = 0.5",
            "s.toml:6: material.poisson: poisson = 0.5 is not accepted: it must be greater than -1 and less than 0.5 (0.5, \
             incompressible, is not possible)",
        ),
        (
            "young = 1e5",
            "young = -1",
            "s.toml:5: material.young: young = -1 Pa is not accepted: it must be finite and greater than 0",
        ),
        (
            "density = 1000.0",
            "density = nan",
            "s.toml:7: material.density: density = NaN kg/m3 is not accepted: it must be finite and greater than 0",
        ),
        (
            "young = 1e5",
            "young = \"soft\"",
            "s.toml:5: material.young: string \"soft\" is not accepted; a number is needed",
        ),
        (
            "dt = 0.01",
            "dt = -0.01",
            "s.toml:14: time.dt: -0.01 is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "dt = 0.01",
            "",
            "s.toml:12: time.dt: it is missing; a scheme that steps needs \"dt\" and \"end\"",
        ),
        (
            "end = 0.1",
            "end = inf",
            "s.toml:15: time.end: inf is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "dt = 0.01",
            "dt = 1e-12",
            "s.toml:14: time.dt: 1e-12 s up to end = 0.1 s is more than 1e9 steps; a larger dt is needed",
        ),
        (
            "scheme = \"backward-euler\"",
            "scheme = \"backward-eular\"",
            "s.toml:13: time.scheme: unknown value \"backward-eular\"; did you mean \"backward-euler\"? accepted: \"static\", \
             \"evaluate\", \"backward-euler\", \"midpoint\", \"newmark\", \"bdf2\", \"central-difference\"",
        ),
        (
            "scheme = \"backward-euler\"",
            "scheme = 3",
            "s.toml:13: time.scheme: a text in quotes is needed",
        ),
        (
            "[time]",
            "[tiem]",
            "s.toml:12: tiem: unknown key \"tiem\"; did you mean \"time\"? accepted: \"name\", \"mesh\", \"material\", \
             \"region\", \"model\", \"fixed\", \"load\", \"initial\", \"time\", \"solver\", \"cut\", \"probe\", \"quantity\", \
             \"output\"",
        ),
        (
            "where = \"x < 1e-9\"",
            "where = \"x < 1e-9 &&\"",
            "s.toml:9: fixed.where: cannot read the expression \"x < 1e-9 &&\": it ends where a value is expected",
        ),
        (
            "where = \"x < 1e-9\"",
            "where = \"x\"",
            "s.toml:9: fixed.where: cannot read the expression \"x\": it is a number where a condition is needed, such as x < 0.5",
        ),
        (
            "where = \"x < 1e-9\"",
            "where = \"x < 1e-9\"\nvertices = [0]",
            "s.toml:9: fixed.where: \"where\", \"vertices\" are given; exactly one of \"where\", \"vertices\", \"group\" is accepted",
        ),
        (
            "where = \"x < 1e-9\"",
            "axes = \"xyz\"",
            "s.toml:8: fixed: exactly one of \"where\", \"vertices\", \"group\" is needed; none is given",
        ),
        (
            "where = \"x < 1e-9\"",
            "where = \"x < 1e-9\"\naxes = \"xw\"",
            "s.toml:10: fixed.axes: \"xw\" is not accepted; letters x, y, z, each at most once",
        ),
        (
            "where = \"x < 1e-9\"",
            "where = \"x < 1e-9\"\ndisplacement = [0, 1]",
            "s.toml:10: fixed.displacement: 2 components are given; 3 or one for each of \"xyz\" are needed",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "gravity = [0, 0, \"-9.81*x\"]",
            "s.toml:11: load.gravity: \"-9.81*x\" depends on the place; only t is accepted",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "gravity = [0, 0, -9.81]\nwhere = \"x > 1\"",
            "s.toml:12: load.where: gravity acts on the whole body; no selection is accepted",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "traction = [0, 0, 1]",
            "s.toml:10: load: exactly one of \"where\", \"facets\", \"vertices\", \"group\" is needed; none is given",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "gravity = [0, -9.81]",
            "s.toml:11: load.gravity: 2 components are given; 3 are needed",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "pressure = nan\nwhere = \"x > 1\"",
            "s.toml:11: load.pressure: NaN is not accepted; a finite number is needed",
        ),
        (
            "at = 0.05",
            "at = -1",
            "s.toml:17: cut.at: -1.0 is not accepted; a finite time from 0 is needed",
        ),
        (
            "at = 0.05",
            "at = 0.05\nsnap = 0.7",
            "s.toml:18: cut.snap: 0.7 is not accepted; a fraction from 0 to 0.45 is needed",
        ),
        (
            "at = 0.05",
            "at = 0.05\nmethod = \"delaunay\"",
            "s.toml:18: cut.method: \"delaunay\" is not available yet; accepted: \"delete\", \"subdivide\", \"snap\", \"hybrid\", \"collapse\", \"merge\"",
        ),
        (
            "sweep = \"blade.obj\"",
            "path = [[0, [0, 0]], [1, [1, 0]]]",
            "s.toml:18: cut.path: \"path\" is not available yet; accepted: \"at\", \"method\", \"sweep\", \"blade\", \"frame\", \"snap\", \"improve\", \"relax\", \"quality\", \"operations\"",
        ),
        (
            "name = \"beam\"",
            "name = \"a/b\"",
            "s.toml:1: name: \"a/b\" is not accepted; it names files: letters, digits, '-', '_', '.' and spaces, not starting with '.', \
             at most 200 bytes",
        ),
        (
            "cells = [2, 1, 1]",
            "cells = [2, 0, 1]",
            "s.toml:3: mesh.box: cells = [2, 0, 1] is not accepted; whole numbers from 1 with a product below 7e8",
        ),
        (
            "cells = [2, 1, 1]",
            "cells = [2, -1, 1]",
            "s.toml:3: mesh.box.cells: integer `-1` is not accepted; a whole number, zero or more, is needed",
        ),
        (
            "size = [2.0, 1.0, 1.0]",
            "size = [2.0, 0.0, 1.0]",
            "s.toml:3: mesh.box: 0.0 is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "ball = { radius = 1.0, layers = 0 }",
            "s.toml:3: mesh.ball: layers = 0 is not accepted; a whole number from 1 to 500",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, length = 4.0, layers = 2, slices = 0 }",
            "s.toml:3: mesh.cylinder: layers = 2, slices = 0 are not accepted; whole numbers from 1 with layers² slices \
             below 2e8",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, length = 4.0, layers = 20000, slices = 1 }",
            "s.toml:3: mesh.cylinder: layers = 20000, slices = 1 are not accepted; whole numbers from 1 with layers² slices \
             below 2e8",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = -1.0, length = 4.0, layers = 2, slices = 1 }",
            "s.toml:3: mesh.cylinder: -1.0 is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, length = inf, layers = 2, slices = 1 }",
            "s.toml:3: mesh.cylinder: inf is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, length = 4.0, layers = 2, slices = 1, axis = [0, 0, 0] }",
            "s.toml:3: mesh.cylinder: axis = [0.0, 0.0, 0.0] is not accepted; a direction other than zero is needed",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, length = 4.0, layers = 2, slices = 1, origin = [0, nan, 0] }",
            "s.toml:3: mesh.cylinder: NaN is not accepted; finite numbers are needed",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1.0, layers = 2, slices = 1 }",
            "s.toml:3: mesh.cylinder: the key \"length\" is missing",
        ),
        (
            "[mesh]",
            "[mesh]\ncylinder = { radius = 1.0, length = 4.0, layers = 2, slices = 1 }",
            "s.toml:4: mesh.box: \"box\", \"cylinder\" are given; exactly one of \"file\", \"box\", \"ball\", \"cylinder\", \
             \"plate\" is accepted",
        ),
        (
            "density = 1000.0",
            "density = 1000.0\ndamping = { stiffness = -0.1 }",
            "s.toml:8: material.damping: stiffness = -0.1 is not accepted; a finite number from 0 is needed",
        ),
        (
            "[material]",
            "scale = 0.0\n[material]",
            "s.toml:4: mesh.scale: 0.0 is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "[time]",
            "[[quantity]]\nname = \"q\"\njump = { at = [1, 0, 0], normal = [0, 0, 0] }\n[time]",
            "s.toml:14: quantity.jump: normal = 0 has no direction; a vector across the cut is needed",
        ),
        (
            "[time]",
            "[[quantity]]\nname = \"q\"\njump = { at = [1, 0], normal = [0, 0, 1] }\n[time]",
            "s.toml:14: quantity.jump: 2 components are given; 3 are needed",
        ),
        (
            "[time]",
            "[[quantity]]\nname = \"q\"\njump = { at = [1, 0, inf], normal = [0, 0, 1] }\n[time]",
            "s.toml:14: quantity.jump: inf is not accepted; finite numbers are needed",
        ),
        (
            "[time]",
            "[model]\norder = 3\n[time]",
            "s.toml:13: model.order: 3 is not accepted; accepted: 1, 2",
        ),
        (
            "[time]",
            "[model]\nlocking = \"bbar\"\n[time]",
            "s.toml:13: model.locking: \"bbar\" is not accepted; accepted: \"none\", \"auto\", \"nodal\"",
        ),
        (
            "[time]",
            "[solver]\ntolerance = 2\n[time]",
            "s.toml:13: solver.tolerance: 2.0 is not accepted; a number greater than 0 and less than 1 is needed",
        ),
        (
            "[time]",
            "[output]\nfields = [\"displacment\"]\n[time]",
            "s.toml:13: output.fields: unknown value \"displacment\"; did you mean \"displacement\"? accepted: \
             \"displacement\", \"velocity\", \"von_mises\", \"quality\", \"internal_force\", \"mass\", \"stress\", \"strain\", \
             \"region\"",
        ),
        (
            "[time]",
            "[output]\nevery = 0\n[time]",
            "s.toml:13: output.every: 0.0 is not accepted; a finite number greater than 0 is needed",
        ),
        (
            "[time]",
            "[initial]\nvelocity = [1, 2]\n[time]",
            "s.toml:13: initial.velocity: 2 components are given; 3 are needed",
        ),
        (
            "name = \"beam\"",
            "name = beam",
            "s.toml:1: name: string values must be quoted, expected literal string",
        ),
    ] {
        assert_eq!(message(from, to), wanted, "{from} -> {to}");
    }
}

/// The message of the base scene, without its cut, when it meets its mesh.
fn message_with_mesh(from: &str, to: &str) -> String {
    let text = BASE.split("[[cut]]").next().unwrap().replace(from, to);
    let scene = Scene::parse(&text, "s.toml").unwrap();
    let error = Simulation::new(scene).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

#[test]
fn stress_intensities_need_a_front_and_a_direction() {
    for (crack, wanted) in [
        (
            "front = [1, 0, 0], normal = [0, 0, 0]",
            "quantity.KI: normal = 0 has no direction",
        ),
        ("front = [1, 0, 0]", "the key \"normal\" is missing"),
        (
            "front = [1, 0, 0], normal = [0, 0, 1], radii = [0.2, 0.1]",
            "0 < inner < outer is needed",
        ),
        (
            "front = [1, 0, 0], normal = [0, 0, 1], radius = 1",
            "did you mean \"radii\"?",
        ),
    ] {
        let found = message(
            "[time]",
            &format!("[[quantity]]\nname = \"q\"\nKI = {{ {crack} }}\n[time]"),
        );
        assert!(found.contains(wanted), "{crack}: {found}");
    }
}

#[test]
fn what_a_scene_selects_must_exist() {
    for (from, to, wanted) in [
        (
            "where = \"x < 1e-9\"",
            "where = \"x < -1\"",
            "s.toml:9: fixed.where: it selects no vertex; a selection must not be empty",
        ),
        (
            "where = \"x < 1e-9\"",
            "vertices = [0, 99]",
            "s.toml:9: fixed.vertices: vertex 99 does not exist; the mesh has vertices 0 to 11",
        ),
        (
            "where = \"x < 1e-9\"",
            "vertices = []",
            "s.toml:9: fixed.vertices: it selects no vertex; a selection must not be empty",
        ),
        (
            "where = \"x < 1e-9\"",
            "group = \"clamp\"",
            "s.toml:9: fixed.group: there is no group \"clamp\"; the mesh has no groups",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "traction = [0, 0, 1]\nwhere = \"x > 3\"",
            "s.toml:12: load.where: it selects no boundary facet; a selection must not be empty",
        ),
        (
            "gravity = [0, 0, -9.81]",
            "traction = [0, 0, 1]\nfacets = [[0, 1, 11]]",
            "s.toml:12: load.facets: [0, 1, 11] is no boundary facet of the mesh",
        ),
        (
            "[[load]]",
            "[[probe]]\nname = \"tip\"\npoint = [9, 0, 0]\n[[load]]",
            "s.toml:12: probe.point: (9, 0, 0) does not lie in the mesh",
        ),
        (
            "[[load]]",
            "[[region]]\nwhere = \"z > 5\"\n[[load]]",
            "s.toml:11: region.where: it selects no cell; a selection must not be empty",
        ),
        (
            "[[load]]",
            "[initial]\nvelocity = [\"1/x\", 0, 0]\n[[load]]",
            "s.toml:11: initial.velocity: \"1/x\" has no finite value at (0, 0, 0)",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "cylinder = { radius = 1e-20, length = 1e-20, layers = 1, slices = 1, origin = [1, 1, 1] }",
            "s.toml:3: mesh.cylinder: cell 0 has no volume: its corners [0, 1, 2, 9] are degenerate",
        ),
        (
            "box = { size = [2.0, 1.0, 1.0], cells = [2, 1, 1] }",
            "file = \"none.vtu\"",
            "s.toml:3: mesh.file: none.vtu: cannot be read: No such file or directory (os error 2); a file that can be read is \
             needed, its path relative to the scene",
        ),
    ] {
        assert_eq!(message_with_mesh(from, to), wanted, "{from} -> {to}");
    }
    let missing_sweep = Simulation::new(Scene::parse(BASE, "s.toml").unwrap()).unwrap_err();
    assert_eq!(
        missing_sweep.to_string(),
        "s.toml:18: cut.sweep: blade.obj: cannot be read: No such file or directory (os error 2); a file that can be read is \
         needed, its path relative to the scene"
    );
}
