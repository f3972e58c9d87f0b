//! Numbers and formulas of a scene.

use super::harness::{Row, SOLID, Wrong, changed, changes, refused};

pub(crate) const NUMBERS: &[Row] = &[
    (
        "poisson 0.5",
        "poisson = 0.3",
        "poisson = 0.5",
        "scene.toml:6: material.poisson",
        &["poisson = 0.5 is not accepted: it must be greater than -1 and less than 0.5"],
    ),
    (
        "poisson -1",
        "poisson = 0.3",
        "poisson = -1",
        "scene.toml:6: material.poisson",
        &["poisson = -1 is not accepted: it must be greater than -1 and less than 0.5"],
    ),
    (
        "poisson that is not a number",
        "poisson = 0.3",
        "poisson = nan",
        "scene.toml:6: material.poisson",
        &["poisson = NaN is not accepted: it must be greater than -1 and less than 0.5"],
    ),
    (
        "young 0",
        "young = 1e5",
        "young = 0",
        "scene.toml:5: material.young",
        &["young = 0 Pa is not accepted: it must be finite and greater than 0"],
    ),
    (
        "young below 0",
        "young = 1e5",
        "young = -3",
        "scene.toml:5: material.young",
        &["young = -3 Pa is not accepted: it must be finite and greater than 0"],
    ),
    (
        "young infinite",
        "young = 1e5",
        "young = inf",
        "scene.toml:5: material.young",
        &["young = inf Pa is not accepted: it must be finite and greater than 0"],
    ),
    (
        "density 0",
        "density = 1000",
        "density = 0",
        "scene.toml:7: material.density",
        &["density = 0 kg/m3 is not accepted: it must be finite and greater than 0"],
    ),
    (
        "density below 0",
        "density = 1000",
        "density = -1",
        "scene.toml:7: material.density",
        &["density = -1 kg/m3 is not accepted: it must be finite and greater than 0"],
    ),
    (
        "a region with poisson 0.5",
        "[time]",
        "[[region]]\nwhere = 'x > 1'\npoisson = 0.5\n[time]",
        "scene.toml:14: region.poisson",
        &["poisson = 0.5 is not accepted"],
    ),
    (
        "damping below 0",
        "density = 1000",
        "density = 1000\ndamping = { mass = -1 }",
        "scene.toml:8: material.damping",
        &["mass = -1.0 is not accepted; a finite number from 0 is needed"],
    ),
    (
        "a negative step",
        "dt = 0.01",
        "dt = -0.01",
        "scene.toml:14: time.dt",
        &["-0.01 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "a step of zero",
        "dt = 0.01",
        "dt = 0",
        "scene.toml:14: time.dt",
        &["0.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "a step that is not a number",
        "dt = 0.01",
        "dt = nan",
        "scene.toml:14: time.dt",
        &["NaN is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "an end before the start",
        "end = 0.02",
        "end = -1",
        "scene.toml:15: time.end",
        &["-1.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "too many steps",
        "dt = 0.01",
        "dt = 1e-12",
        "scene.toml:14: time.dt",
        &["1e-12 s up to end = 0.02 s is more than 1e9 steps; a larger dt is needed"],
    ),
    (
        "a tolerance of zero",
        "[time]",
        "[solver]\ntolerance = 0\n[time]",
        "scene.toml:13: solver.tolerance",
        &["0.0 is not accepted; a number greater than 0 and less than 1 is needed"],
    ),
    (
        "a tolerance that is not a number",
        "[time]",
        "[solver]\ntolerance = nan\n[time]",
        "scene.toml:13: solver.tolerance",
        &["NaN is not accepted; a number greater than 0 and less than 1 is needed"],
    ),
    (
        "no iterations",
        "[time]",
        "[solver]\nmax_iterations = 0\n[time]",
        "scene.toml:13: solver.max_iterations",
        &["0 is not accepted; a whole number from 1 is needed"],
    ),
    (
        "an accuracy of zero",
        "[time]",
        "[model]\naccuracy = 0\n[time]",
        "scene.toml:13: model.accuracy",
        &["0.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "frames at no distance",
        "[time]",
        "[output]\nevery = 0\n[time]",
        "scene.toml:13: output.every",
        &["0.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "a cut before the start",
        "at = 0.01",
        "at = -0.01",
        "scene.toml:17: cut.at",
        &["-0.01 is not accepted; a finite time from 0 is needed"],
    ),
    (
        "snap below 0",
        "at = 0.01",
        "snap = -0.1",
        "scene.toml:17: cut.snap",
        &["-0.1 is not accepted; a fraction from 0 to 0.45 is needed"],
    ),
    (
        "snap too large",
        "at = 0.01",
        "snap = 0.5",
        "scene.toml:17: cut.snap",
        &["0.5 is not accepted; a fraction from 0 to 0.45 is needed"],
    ),
    (
        "snap that is not a number",
        "at = 0.01",
        "snap = nan",
        "scene.toml:17: cut.snap",
        &["NaN is not accepted; a fraction from 0 to 0.45 is needed"],
    ),
    (
        "a box with a side of zero",
        "size = [2, 1, 1]",
        "size = [2, 0, 1]",
        "scene.toml:3: mesh.box",
        &["0.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "a box whose volume overflows",
        "size = [2, 1, 1]",
        "size = [1e200, 1e200, 1e200]",
        "scene.toml:3: mesh.box",
        &["vertex 1 has a coordinate that is too large", "from -1e90 to 1e90"],
    ),
    (
        "a box whose volume underflows",
        "size = [2, 1, 1]",
        "size = [1e-200, 1e-200, 1e-200]",
        "scene.toml:3: mesh.box",
        &["cell 0"],
    ),
    (
        "a box of no cells",
        "cells = [2, 1, 1]",
        "cells = [2, 0, 1]",
        "scene.toml:3: mesh.box",
        &["cells = [2, 0, 1] is not accepted; whole numbers from 1"],
    ),
    (
        "a box of too many cells",
        "cells = [2, 1, 1]",
        "cells = [100000, 100000, 100000]",
        "scene.toml:3: mesh.box",
        &["cells = [100000, 100000, 100000] is not accepted; whole numbers from 1 with a product below"],
    ),
    (
        "a scale of zero",
        "[material]",
        "scale = 0\n[material]",
        "scene.toml:4: mesh.scale",
        &["0.0 is not accepted; a finite number greater than 0 is needed"],
    ),
    (
        "a probe that is not finite",
        "point = [2, 0.5, 0.5]",
        "point = [2, nan, 0.5]",
        "scene.toml:21: probe.point",
        &["NaN is not accepted; finite numbers are needed"],
    ),
    (
        "a name that leaves the folder",
        "name = 'beam'",
        "name = '../beam'",
        "scene.toml:1: name",
        &[
            "\"../beam\" is not accepted; it names files: letters, digits, '-', '_', '.' and spaces, not starting with '.'",
        ],
    ),
    (
        "a name that is a path",
        "name = 'beam'",
        "name = '/tmp/beam'",
        "scene.toml:1: name",
        &["\"/tmp/beam\" is not accepted; it names files"],
    ),
    (
        "a name longer than names of files may be",
        "name = 'beam'",
        "name = 'beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-\
         beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam-beam'",
        "scene.toml:1: name",
        &["is not accepted; it names files", "at most 200 bytes"],
    ),
    (
        "no name",
        "name = 'beam'",
        "name = ''",
        "scene.toml:1: name",
        &["\"\" is not accepted; it names files"],
    ),
    (
        "a name with a line end",
        "name = 'beam'",
        "name = \"be\\nam\"",
        "scene.toml:1: name",
        &["is not accepted; it names files"],
    ),
    (
        "two components",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, -9.81]",
        "scene.toml:11: load.gravity",
        &["2 components are given; 3 are needed"],
    ),
    (
        "four components",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, 0, -9.81]",
        "scene.toml:11: load.gravity",
        &["4 components are given; 3 are needed, 2 in the plane"],
    ),
    (
        "a displacement of two components",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9'\ndisplacement = [0, 1]",
        "scene.toml:10: fixed.displacement",
        &["2 components are given; 3 or one for each of \"xyz\" are needed"],
    ),
    (
        "axes that do not exist",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9'\naxes = 'xw'",
        "scene.toml:10: fixed.axes",
        &["\"xw\" is not accepted; letters x, y, z, each at most once"],
    ),
    (
        "no axes",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9'\naxes = ''",
        "scene.toml:10: fixed.axes",
        &["\"\" is not accepted; letters x, y, z, each at most once"],
    ),
];

#[test]
fn numbers() {
    refused(changes(SOLID, NUMBERS));
}

pub(crate) const FORMULAS: &[Row] = &[
    (
        "a condition that stops",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9 &&'",
        "scene.toml:9: fixed.where",
        &["cannot read the expression \"x < 1e-9 &&\": it ends where a value is expected"],
    ),
    (
        "a parenthesis that is not closed",
        "where = 'x < 1e-9'",
        "where = '(x < 1e-9'",
        "scene.toml:9: fixed.where",
        &["\")\" is missing at the end"],
    ),
    (
        "a condition of no words",
        "where = 'x < 1e-9'",
        "where = ''",
        "scene.toml:9: fixed.where",
        &["it ends where a value is expected"],
    ),
    (
        "an assignment",
        "where = 'x < 1e-9'",
        "where = 'x = 0'",
        "scene.toml:9: fixed.where",
        &["\"=\" is not an operator"],
    ),
    (
        "a name that does not exist",
        "where = 'x < 1e-9'",
        "where = 'r < 1e-9'",
        "scene.toml:9: fixed.where",
        &["\"r\" is not known", "x, y, z and t"],
    ),
    (
        "a name that sounds like nesting",
        "where = 'x < 1e-9'",
        "where = 'recursion < 1e-9'",
        "scene.toml:9: fixed.where",
        &["\"recursion\" is not known"],
    ),
    (
        "a function that does not exist",
        "where = 'x < 1e-9'",
        "where = 'abbs(x) < 1e-9'",
        "scene.toml:9: fixed.where",
        &["\"abbs\" is not known; did you mean \"abs\"?"],
    ),
    (
        "a function without its argument",
        "where = 'x < 1e-9'",
        "where = 'min(x) < 1e-9'",
        "scene.toml:9: fixed.where",
        &["\",\" is expected before \")\""],
    ),
    (
        "a number where a condition is needed",
        "where = 'x < 1e-9'",
        "where = 'x + 1'",
        "scene.toml:9: fixed.where",
        &["it is a number where a condition is needed, such as x < 0.5"],
    ),
    (
        "a condition where a number is needed",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, 'x < 1']",
        "scene.toml:11: load.gravity",
        &["it is a condition where a number is needed"],
    ),
    (
        "a fixed set that changes with time",
        "where = 'x < 1e-9'",
        "where = 'x < t'",
        "scene.toml:9: fixed.where",
        &["\"x < t\" depends on t; sets do not change with time, only x, y, z are accepted"],
    ),
    (
        "a quantity whose place changes with time",
        "where = 'x > 1.999'",
        "where = 'x > 2 - t'",
        "scene.toml:25: quantity.where",
        &["\"x > 2 - t\" depends on t; sets do not change with time, only x, y, z are accepted"],
    ),
    (
        "a region that changes with time",
        "[time]",
        "[[region]]\nwhere = 'x > t'\nyoung = 1\n[time]",
        "scene.toml:13: region.where",
        &["\"x > t\" depends on t; sets do not change with time"],
    ),
    (
        "a load whose place changes with time",
        "gravity = [0, 0, -9.81]",
        "pressure = 1\nwhere = 'x > 1 && t < 1'",
        "scene.toml:12: load.where",
        &["depends on t; sets do not change with time"],
    ),
    (
        "gravity that depends on the place",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, '-x']",
        "scene.toml:11: load.gravity",
        &["\"-x\" depends on the place; only t is accepted"],
    ),
    (
        "a force that depends on the place",
        "gravity = [0, 0, -9.81]",
        "force = [0, 'y', 0]\nvertices = [0]",
        "scene.toml:11: load.force",
        &["\"y\" depends on the place; only t is accepted"],
    ),
    (
        "a start that depends on time",
        "[time]",
        "[initial]\nvelocity = ['t', 0, 0]\n[time]",
        "scene.toml:13: initial.velocity",
        &["\"t\" depends on t; the state at the start is in x, y, z"],
    ),
    (
        "gravity that is not finite",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, 'sqrt(-1)']",
        "scene.toml:11: load.gravity",
        &["\"sqrt(-1)\" has no finite value at t = 0 s"],
    ),
    (
        "gravity that is not finite at the end",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, '1/(0.02 - t)']",
        "scene.toml:11: load.gravity",
        &["\"1/(0.02 - t)\" has no finite value at t = 0.02 s"],
    ),
    (
        "a force that is not finite",
        "gravity = [0, 0, -9.81]",
        "force = ['1/t', 0, 0]\nwhere = 'x > 1.9'",
        "scene.toml:11: load.force",
        &["\"1/t\" has no finite value at t = 0 s"],
    ),
    (
        "a traction that is not finite somewhere",
        "gravity = [0, 0, -9.81]",
        "traction = [0, 0, 'sqrt(y - 0.6)']\nwhere = 'x > 1.9'",
        "scene.toml:11: load.traction",
        &["\"sqrt(y - 0.6)\" has no finite value at (2, 0.5, 0) and t = 0 s"],
    ),
    (
        "a pressure that is not finite",
        "gravity = [0, 0, -9.81]",
        "pressure = '1/0'\nwhere = 'x > 1.9'",
        "scene.toml:11: load.pressure",
        &["\"1/0\" has no finite value at (2, 0.5, 0) and t = 0 s"],
    ),
    (
        "a load whose sum overflows",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, 1e308]",
        "scene.toml:11: load.gravity",
        &["the force at vertex 0 is too large to be finite"],
    ),
    (
        "a displacement that is not finite",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9'\ndisplacement = ['ln(x)', 0, 0]",
        "scene.toml:10: fixed.displacement",
        &["\"ln(x)\" has no finite value at vertex 0"],
    ),
    (
        "a displacement that is not finite at the end",
        "where = 'x < 1e-9'",
        "where = 'x < 1e-9'\ndisplacement = [0, 0, 'sqrt(0.01 - t)']",
        "scene.toml:10: fixed.displacement",
        &["\"sqrt(0.01 - t)\" has no finite value at vertex 0"],
    ),
    (
        "a velocity that is not finite",
        "[time]",
        "[initial]\nvelocity = ['1/x', 0, 0]\n[time]",
        "scene.toml:13: initial.velocity",
        &["\"1/x\" has no finite value at (0, 0, 0)"],
    ),
    (
        "a number of an expression with a huge exponent",
        "where = 'x < 1e-9'",
        "where = 'x < 1e999'",
        "scene.toml:9: fixed.where",
        &["1e999 is not a finite number"],
    ),
    (
        "a huge exponent",
        "gravity = [0, 0, -9.81]",
        "gravity = [0, 0, '10^1e9']",
        "scene.toml:11: load.gravity",
        &["\"10^1e9\" has no finite value at t = 0 s"],
    ),
    (
        "a number of the scene with a huge exponent",
        "young = 1e5",
        "young = 1e999",
        "scene.toml:5: material.young",
        &["the number is too large; a finite number is needed"],
    ),
    (
        "a formula of two lines",
        "where = 'x < 1e-9'",
        "where = '''x <\n\n1e-9 &'''",
        "scene.toml:9: fixed.where",
        &["cannot read the expression \"x < 1e-9 &\": it ends where a value is expected"],
    ),
];

#[test]
fn formulas() {
    refused(changes(SOLID, FORMULAS));
}

#[test]
fn long_and_deep_formulas() {
    let place = "scene.toml:9: fixed.where";
    let with = |condition: &str| changed(SOLID, "where = 'x < 1e-9'", &format!("where = '{condition}'"));
    let nested = |open: &str, close: &str, n: usize| with(&format!("{}x{} < 1", open.repeat(n), close.repeat(n)));
    let deep = |name: &str, text: String| Wrong::scene(name, text).at(place).says(&["it is nested too deeply"]);
    refused([
        deep("parentheses nested too deeply", nested("(", ")", 10_000)),
        deep("functions nested too deeply", nested("abs(", ")", 5_000)),
        deep("signs nested too deeply", nested("-", "", 20_000)),
        deep("powers nested too deeply", nested("2^", "", 20_000)),
        deep("operands nested too deeply", nested("1+(", ")", 60)),
        Wrong::scene("negations without end", with(&"!".repeat(30_000)))
            .at(place)
            .says(&["it is nested too deeply"]),
        Wrong::scene(
            "a formula that is too long",
            with(&format!("x < 0{}", "+1".repeat(1_000_000))),
        )
        .at(place)
        .says(&["2000005 characters", "at most 65536 are accepted"]),
        Wrong::scene(
            "a long formula with a mistake",
            with(&format!("x < 0{} $", "+1".repeat(30_000))),
        )
        .at(place)
        .says(&["\"$\" is not an operator"]),
    ]);
}
