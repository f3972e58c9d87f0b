//! What a scene acts on: sets, facets, groups, probes, places of quantities.

use super::harness::{PLANAR, Row, SOLID, Wrong, changed, changes, refused};
use super::meshes::vtu_with_array;

const GRAVITY: &str = "gravity = [0, 0, -9.81]";
const CLAMP: &str = "where = 'x < 1e-9'";
const MEAN: &str = "mean = 'uz'\nwhere = 'x > 1.999'";

pub(crate) const SELECTIONS: &[Row] = &[
    (
        "a fixed set of nothing",
        CLAMP,
        "where = 'x < -1'",
        "scene.toml:9: fixed.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a condition without a value",
        CLAMP,
        "where = 'sqrt(-1 - x) < 1'",
        "scene.toml:9: fixed.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "no vertices",
        CLAMP,
        "vertices = []",
        "scene.toml:9: fixed.vertices",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a vertex out of range",
        CLAMP,
        "vertices = [0, 12]",
        "scene.toml:9: fixed.vertices",
        &["vertex 12 does not exist; the mesh has vertices 0 to 11"],
    ),
    (
        "a group of a mesh without groups",
        CLAMP,
        "group = 'clamp'",
        "scene.toml:9: fixed.group",
        &["there is no group \"clamp\"; the mesh has no groups"],
    ),
    (
        "two selections at once",
        CLAMP,
        "where = 'x < 1e-9'\nvertices = [0]",
        "scene.toml:9: fixed.where",
        &["\"where\", \"vertices\" are given; exactly one of \"where\", \"vertices\", \"group\" is accepted"],
    ),
    (
        "no selection",
        CLAMP,
        "axes = 'x'",
        "scene.toml:8: fixed",
        &["exactly one of \"where\", \"vertices\", \"group\" is needed; none is given"],
    ),
    (
        "a traction on nothing",
        GRAVITY,
        "traction = [0, 0, 1]\nwhere = 'x > 3'",
        "scene.toml:12: load.where",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a traction nowhere",
        GRAVITY,
        "traction = [0, 0, 1]",
        "scene.toml:10: load",
        &["exactly one of \"where\", \"facets\", \"vertices\", \"group\" is needed; none is given"],
    ),
    (
        "a traction on vertices that span no facet",
        GRAVITY,
        "traction = [0, 0, 1]\nvertices = [0, 11]",
        "scene.toml:12: load.vertices",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a pressure on one vertex",
        GRAVITY,
        "pressure = 1\nwhere = 'x < 1e-9 && y < 1e-9 && z < 1e-9'",
        "scene.toml:12: load.where",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a facet that is not on the boundary",
        GRAVITY,
        "traction = [0, 0, 1]\nfacets = [[0, 1, 11]]",
        "scene.toml:12: load.facets",
        &["[0, 1, 11] is no boundary facet of the mesh"],
    ),
    (
        "a facet of a vertex that does not exist",
        GRAVITY,
        "traction = [0, 0, 1]\nfacets = [[0, 1, 99]]",
        "scene.toml:12: load.facets",
        &["[0, 1, 99] is no boundary facet of the mesh"],
    ),
    (
        "a facet of two vertices",
        GRAVITY,
        "traction = [0, 0, 1]\nfacets = [[0, 1]]",
        "scene.toml:12: load.facets",
        &["[0, 1] is no facet; 3 different vertices each are needed"],
    ),
    (
        "a facet that repeats a vertex",
        GRAVITY,
        "traction = [0, 0, 1]\nfacets = [[0, 1, 1]]",
        "scene.toml:12: load.facets",
        &["[0, 1, 1] is no facet; 3 different vertices each are needed"],
    ),
    (
        "no facets",
        GRAVITY,
        "pressure = 1\nfacets = []",
        "scene.toml:12: load.facets",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a force on nothing",
        GRAVITY,
        "force = [0, 0, 1]\nwhere = 'z < -1'",
        "scene.toml:12: load.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a force on facets",
        GRAVITY,
        "force = [0, 0, 1]\nfacets = [[0, 1, 2]]",
        "scene.toml:12: load.facets",
        &["a force acts on vertices; accepted: \"where\", \"vertices\", \"group\""],
    ),
    (
        "gravity somewhere",
        GRAVITY,
        "gravity = [0, 0, -9.81]\nwhere = 'x > 1'",
        "scene.toml:12: load.where",
        &["gravity acts on the whole body; no selection is accepted"],
    ),
    (
        "a region of nothing",
        "[time]",
        "[[region]]\nwhere = 'x > 5'\nyoung = 1\n[time]",
        "scene.toml:13: region.where",
        &["it selects no cell; a selection must not be empty"],
    ),
    (
        "a mean over nothing",
        "where = 'x > 1.999'",
        "where = 'x > 3'",
        "scene.toml:25: quantity.where",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a mean over vertices that span no facet",
        "where = 'x > 1.999'",
        "where = 'x > 1.999 && y < 0.1 && z < 0.1'",
        "scene.toml:25: quantity.where",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "a largest value of nothing",
        MEAN,
        "max = 'uz'\nwhere = 'x > 3'",
        "scene.toml:25: quantity.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a smallest value of nothing",
        MEAN,
        "min = 'uz'\nwhere = 'x > 3'",
        "scene.toml:25: quantity.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a reaction of nothing",
        MEAN,
        "reaction = 'z'\nwhere = 'x > 3'",
        "scene.toml:25: quantity.where",
        &["it selects no vertex; a selection must not be empty"],
    ),
    (
        "a reaction of vertices that are free",
        MEAN,
        "reaction = 'z'\nwhere = 'x > 1.999'",
        "scene.toml:25: quantity.where",
        &["none of the 4 vertices it selects is fixed along z; a [[fixed]] must hold at least one"],
    ),
    (
        "a reaction along an axis that is free",
        "[[load]]\ngravity = [0, 0, -9.81]",
        "axes = 'xy'\n[[quantity]]\nname = 'r'\nreaction = 'z'\nwhere = 'x < 1e-9'",
        "scene.toml:14: quantity[0].where",
        &["none of the 4 vertices it selects is fixed along z"],
    ),
    (
        "a probe outside",
        "point = [2, 0.5, 0.5]",
        "point = [2.1, 0.5, 0.5]",
        "scene.toml:21: probe.point",
        &["(2.1, 0.5, 0.5) does not lie in the mesh"],
    ),
    (
        "a probe of the name of another",
        "[[quantity]]",
        "[[probe]]\nname = 'tip'\npoint = [1, 0, 0]\n[[quantity]]",
        "scene.toml:23: probe[1].name",
        &["\"tip\" is not accepted; a name of its own without commas or quotes"],
    ),
    (
        "a probe with a comma in its name",
        "name = 'tip'",
        "name = 'a,b'",
        "scene.toml:20: probe.name",
        &["\"a,b\" is not accepted; a name of its own without commas or quotes"],
    ),
    (
        "a quantity at a point outside",
        MEAN,
        "point = [9, 0, 0]",
        "scene.toml:24: quantity.point",
        &["(9, 0, 0) does not lie in the mesh"],
    ),
    (
        "a quantity of the name of another",
        "[[probe]]",
        "[[quantity]]\nname = 'sag'\nenergy = true\n[[probe]]",
        "scene.toml:26: quantity[1].name",
        &["\"sag\" is not accepted; a name of its own is needed"],
    ),
];

#[test]
fn selections() {
    refused(changes(SOLID, SELECTIONS));
}

/// Two tetrahedra with a group on a facet, one of cells and one of points.
pub(crate) const GROUPS: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"clamped\"\n3 2 \"tumour\"\n2 3 \"within\"\n\
    $EndPhysicalNames\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n$Elements\n4\n1 2 2 1 1 1 3 4\n\
    2 4 2 2 1 1 2 3 4\n3 4 2 9 1 2 5 3 4\n4 2 2 3 1 2 3 4\n$EndElements\n";

pub(crate) const GROUP_ROWS: &[Row] = &[
    (
        "a group that does not exist, like one that does",
        CLAMP,
        "group = 'clampd'",
        "scene.toml:9: fixed.group",
        &[
            "there is no group \"clampd\"; did you mean \"clamped\"?",
            "the mesh has",
            "\"clamped\", \"tumour\", \"within\"",
        ],
    ),
    (
        "a group that does not exist",
        CLAMP,
        "group = 'front'",
        "scene.toml:9: fixed.group",
        &["there is no group \"front\"; the mesh has", "\"clamped\""],
    ),
    (
        "a region of a group that does not exist",
        "[time]",
        "[[region]]\ngroup = 'tumor'\nyoung = 1\n[time]",
        "scene.toml:13: region.group",
        &["there is no group \"tumor\"; did you mean \"tumour\"?"],
    ),
    (
        "a region of a group without cells",
        "[time]",
        "[[region]]\ngroup = 'clamped'\nyoung = 1\n[time]",
        "scene.toml:13: region.group",
        &["it selects no cell; a selection must not be empty"],
    ),
    (
        "a traction on a group inside the body",
        GRAVITY,
        "traction = [0, 0, 1]\ngroup = 'within'",
        "scene.toml:12: load.group",
        &["[1, 2, 3] is no boundary facet of the mesh"],
    ),
];

#[test]
fn groups() {
    let base = changed(
        SOLID,
        "box = { size = [2, 1, 1], cells = [2, 1, 1] }",
        "file = 'groups.msh'",
    );
    let base = base.split("[[cut]]").next().unwrap();
    refused(changes(base, GROUP_ROWS).map(|case| case.file("groups.msh", GROUPS)));
}

pub(crate) const PLANAR_ROWS: &[Row] = &[
    (
        "a traction on vertices that span no edge",
        "where = 'x > 1.999'",
        "vertices = [0]",
        "scene.toml:13: load.vertices",
        &["it selects no boundary facet; a selection must not be empty"],
    ),
    (
        "an edge inside a plate",
        "where = 'x > 1.999'",
        "facets = [[5, 6]]",
        "scene.toml:13: load.facets",
        &["[5, 6] is no boundary facet of the mesh"],
    ),
    (
        "a probe outside a plate",
        "[[load]]",
        "[[probe]]\nname = 'p'\npoint = [3, 0]\n[[load]]",
        "scene.toml:14: probe.point",
        &["(3, 0, 0) does not lie in the mesh"],
    ),
];

#[test]
fn a_force_on_vertices_of_no_cell() {
    let force = changed(SOLID, GRAVITY, "force = [0, 0, -1]\nvertices = [5]");
    let scene = changed(
        &force,
        "box = { size = [2, 1, 1], cells = [2, 1, 1] }",
        "file = 'm.msh'",
    );
    let lonely = GROUPS
        .replace("$Nodes\n5\n", "$Nodes\n6\n")
        .replace("5 1 1 1\n", "5 1 1 1\n6 3 3 3\n");
    refused([
        Wrong::scene("a force on a vertex of no cell", scene.split("[[cut]]").next().unwrap())
            .file("m.msh", lonely)
            .at("scene.toml:11: load.force")
            .says(&["it acts on vertices of no cell only; at least one must belong to a cell"]),
    ]);
}

#[test]
fn selections_of_a_plate() {
    refused(changes(PLANAR, PLANAR_ROWS));
}

#[test]
fn initial_fields() {
    let with = |field: &str| changed(SOLID, "[time]", &format!("[initial]\nvelocity = {field}\n[time]"));
    let place = "scene.toml:13: initial.velocity";
    let of_file = with("{ file = 'one.vtu', array = 'v' }");
    let own = changed(
        &of_file,
        "box = { size = [2, 1, 1], cells = [2, 1, 1] }",
        "file = 'one.vtu'",
    );
    let own = own.split("[[cut]]").next().unwrap();
    let file = |name: &str, rows: &[&str; 4]| vtu_with_array(name, rows);
    let case = |name: &str, scene: &str, parts: &[&str]| Wrong::scene(name, scene).at(place).says(parts);
    refused([
        case(
            "an initial field of a missing file",
            &with("{ file = 'none.vtu', array = 'v' }"),
            &["none.vtu: cannot be read: No such file", "relative to the scene"],
        ),
        case(
            "an initial field of a file of another kind",
            &with("{ file = 'blade.obj', array = 'v' }"),
            &["blade.obj: a mesh is read from .vtu,"],
        ),
        case(
            "an initial field of another mesh",
            &of_file,
            &["array \"v\" has 4 rows of 3; 12 rows of 3 are needed"],
        )
        .file("one.vtu", file("v", &["0 0 0"; 4])),
        case(
            "an initial field that is not finite",
            own,
            &["array \"v\" is not finite at point 2 (from zero)"],
        )
        .file("one.vtu", file("v", &["0 0 0", "0 0 0", "0 nan 0", "0 0 0"])),
        case(
            "an array that does not exist",
            own,
            &["has no point array \"v\"", "it has \"vel\""],
        )
        .file("one.vtu", file("vel", &["0 0 0"; 4])),
        case(
            "an array of one component",
            own,
            &["array \"v\" has 4 rows of 1; 4 rows of 3 are needed"],
        )
        .file(
            "one.vtu",
            file("v", &["0"; 4]).replace("Name='v' NumberOfComponents='3'", "Name='v'"),
        ),
        case(
            "an initial field without its array",
            &with("{ file = 'one.vtu' }"),
            &["the key \"array\" is missing"],
        ),
        case(
            "an initial field with another key",
            &with("{ file = 'one.vtu', aray = 'v' }"),
            &["unknown key \"aray\"; did you mean \"array\"?"],
        )
        .at("scene.toml:13: initial.velocity.aray"),
        case(
            "an initial field that is a text",
            &with("'fast'"),
            &["string \"fast\" is not accepted; a list in brackets, or { file ="],
        ),
    ]);
}
