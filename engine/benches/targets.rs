//! The speed and locality targets of the project, measured in one run and printed as a table: `cargo bench -p kerfem-engine`.
//!
//! Ratios are between figures of the same run; times on their own are printed for orientation only. One thread. Names of
//! sections (`-- local f1`) choose what is run.

use std::collections::BTreeSet;
use std::hint::black_box;
use std::time::Instant;

use kerfem_cutting::{CutOptions, CutOutcome, Method, Sweep, cut};
use kerfem_engine::{Scene, Simulation};
use kerfem_fem::{
    Assembler, BlockMatrix, LinearSolver, Locking, Material, Model, PreconditionerKind, SolverKind, SolverOptions,
    Tangent, Touched, load,
};
use kerfem_mesh::{Aabb, BoxTree, CellId, Point, TetMesh, VertexId, generate};

/// One line of the table; `floor` and `aim` are upper limits (lower ones for a share of bandwidth).
struct Row {
    what: String,
    figure: f64,
    floor: f64,
    aim: f64,
    higher_is_better: bool,
}

#[derive(Default)]
struct Table(Vec<Row>);

impl Table {
    fn add(&mut self, what: impl Into<String>, figure: f64, floor: f64, aim: f64) {
        self.0.push(Row {
            what: what.into(),
            figure,
            floor,
            aim,
            higher_is_better: false,
        });
    }

    fn print(&self) {
        println!("\n| target | figure | floor | aim | |\n|---|---|---|---|---|");
        for r in &self.0 {
            let within = |limit: f64| {
                if r.higher_is_better {
                    r.figure >= limit
                } else {
                    r.figure <= limit
                }
            };
            let verdict = if within(r.aim) {
                "aim reached"
            } else if within(r.floor) {
                "floor reached"
            } else {
                "MISSED"
            };
            println!("| {} | {:.3} | {} | {} | {verdict} |", r.what, r.figure, r.floor, r.aim);
        }
    }
}

/// A part of the bench that fills in lines of the table.
type Section = fn(&mut Table);

const SECTIONS: [(&str, Section); 8] = [
    ("local", local_update),
    ("steps", steps),
    ("product", block_product),
    ("size", iterations_against_size),
    ("memory", memory),
    ("f1", conditioning_after_a_cut),
    ("yardstick-step", yardstick_steps),
    ("yardstick-static", yardstick_static),
];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .use_current_thread()
        .build_global()
        .expect("one thread");
    let mut table = Table::default();
    for (name, section) in SECTIONS {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            section(&mut table);
        }
    }
    table.print();
}

fn seconds<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let clock = Instant::now();
    let out = work();
    (clock.elapsed().as_secs_f64(), out)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn steel_free_material() -> Material {
    Material::new(1e5, 0.3, 1000.0).expect("in range")
}

fn cell_box(mesh: &TetMesh, c: u32) -> Aabb {
    Aabb::around(mesh.cell_rest_positions(CellId(c)))
}

/// A horizontal rectangle around a place, in a mesh of unit cells.
fn blade(x: f64, y: f64, z: f64, half: f64) -> Sweep {
    let p = |a: f64, b: f64| Point::new(x + a * half, y + b * half, z);
    let points = vec![p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0)];
    Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).expect("finite").0
}

struct Local {
    cells: usize,
    removed: usize,
    touched: Touched,
    tree_nodes: usize,
    allocations: u64,
    cut: f64,
    cold: f64,
    warm: f64,
    assembly: f64,
}

fn cut_and_follow(mesh: &mut TetMesh, tree: &mut BoxTree, sweep: &Sweep, options: &CutOptions) -> (CutOutcome, usize) {
    let positions = mesh.rest_positions().to_vec();
    let outcome = cut(mesh, tree, &positions, sweep, options).expect("a good sweep");
    let nodes = outcome.report.tree_nodes + follow_tree(mesh, tree, &outcome);
    (outcome, nodes)
}

/// Brings the tree after a cut; the nodes touched.
fn follow_tree(mesh: &TetMesh, tree: &mut BoxTree, outcome: &CutOutcome) -> usize {
    let (change, mut nodes) = (&outcome.change, 0);
    for c in &change.cells_added {
        nodes += tree.insert(c.id.0, Some(c.parent.0), |i| cell_box(mesh, i)).0;
    }
    for c in &change.cells_removed {
        nodes += tree.remove(c.id.0, |i| cell_box(mesh, i)).0;
    }
    let added: BTreeSet<CellId> = change.cells_added.iter().map(|c| c.id).collect();
    let around = change.vertices_moved.iter().flat_map(|v| mesh.cells_of_vertex(v.id));
    for c in around.filter(|c| !added.contains(c)).collect::<BTreeSet<_>>() {
        nodes += tree.update(c.0, |i| cell_box(mesh, i)).0;
    }
    nodes
}

fn local(n: usize, method: Method) -> Local {
    let options = CutOptions::of(method);
    let mut mesh = generate::box_tets([n as f64; 3], [n; 3], [0.0; 3]);
    let (assembly, mut assembler) = seconds(|| Assembler::new(&mesh, |_| steel_free_material()).expect("a good mesh"));
    let mut tree = BoxTree::of_cells(&mesh, mesh.rest_positions());
    let middle = n as f64 / 2.0;
    // the first update makes room in the arrays, amortised and counted apart
    let (first, _) = cut_and_follow(&mut mesh, &mut tree, &blade(3.4, 3.4, 3.37, 1.2), &options);
    assembler.update(&mesh, &first.change).expect("a good change");
    let sweep = blade(middle.floor() + 0.4, middle.floor() + 0.4, middle.floor() + 0.37, 2.7);
    let positions = mesh.rest_positions().to_vec();
    let (cut_seconds, outcome) = seconds(|| cut(&mut mesh, &tree, &positions, &sweep, &options).expect("good"));
    let tree_nodes = outcome.report.tree_nodes + follow_tree(&mesh, &mut tree, &outcome);
    let mut touched = Touched::default();
    let mut cold = 0.0;
    let counted = allocation_counter::measure(|| {
        let (s, t) = seconds(|| assembler.update(&mesh, &outcome.change).expect("a good change"));
        (cold, touched) = (s, t);
    });
    let warm = median(
        (0..9)
            .map(|_| seconds(|| black_box(assembler.update(&mesh, &outcome.change).expect("good"))).0)
            .collect(),
    );
    assert_eq!(assembler.verify(&mesh).stiffness_max_relative_difference, 0.0);
    Local {
        cells: mesh.num_cells(),
        removed: outcome.change.cells_removed.len(),
        touched,
        tree_nodes,
        allocations: counted.count_total,
        cut: cut_seconds,
        cold,
        warm,
        assembly,
    }
}

fn local_update(table: &mut Table) {
    for (name, method) in Method::NAMES {
        local_update_by(name, method, table);
    }
}

fn local_update_by(method_name: &str, method: Method, table: &mut Table) {
    let (small, large) = (local(12, method), local(55, method));
    for l in [&small, &large] {
        println!(
            "{method_name}, {} cells: assembly {:.4} s; the same cut {:.2} ms, {} tree nodes; update of K and M: {} rows, {} cells, {} allocations, {:.3} ms cold, {:.3} ms warm",
            l.cells,
            l.assembly,
            1e3 * l.cut,
            l.tree_nodes,
            l.touched.rows,
            l.touched.cells,
            l.allocations,
            1e3 * l.cold,
            1e3 * l.warm
        );
    }
    let name = format!("{method_name}, {} against {} cells", large.cells, small.cells);
    let mut ratio = |what: &str, of: fn(&Local) -> f64, floor, aim| {
        table.add(format!("{what}, {name}"), of(&large) / of(&small), floor, aim);
    };
    ratio("rows touched by the same cut", |l| l.touched.rows as f64, 1.2, 1.0);
    ratio(
        "cells removed and touched",
        |l| (l.removed + l.touched.cells) as f64,
        1.2,
        1.0,
    );
    ratio("tree nodes touched", |l| l.tree_nodes as f64, 1.2, 1.0);
    ratio("allocations of the update", |l| l.allocations as f64, 1.2, 1.0);
    ratio("time of the update, warm", |l| l.warm, 2.0, 1.2);
    ratio("time of the update, cold", |l| l.cold, 2.0, 1.2);
    table.add(
        format!("local update against assembly (cold, large mesh), {method_name}"),
        large.cold / large.assembly,
        1.0,
        0.01,
    );
}

fn beam(cells: [usize; 3], nonlinear: &str) -> Simulation {
    let text = format!(
        r#"
name = "bench"
[mesh]
box = {{ size = [0.2, 0.08, 0.08], cells = [{}, {}, {}], origin = [0, 0, 0] }}
[material]
young = 1.0e5
poisson = 0.45
density = 1000.0
[model]
kind = "corotated"
[[fixed]]
where = "x < 1e-9"
[[load]]
gravity = [0, 0, -9.81]
[time]
scheme = "backward-euler"
dt = 0.01
end = 1.0
nonlinear = "{nonlinear}"
[solver]
kind = "cg"
tolerance = 1e-9
"#,
        cells[0], cells[1], cells[2]
    );
    Simulation::new(Scene::parse(&text, "bench.toml").expect("a good scene")).expect("a good scene")
}

fn steps(table: &mut Table) {
    for (cells, name) in [([24, 9, 9], "12k"), ([52, 18, 18], "100k")] {
        let mut sim = beam(cells, "one-step");
        for _ in 0..4 {
            sim.step(0.01).expect("a good step");
        }
        let plain = median(
            (0..7)
                .map(|_| seconds(|| sim.step(0.01).expect("a good step")).0)
                .collect(),
        );
        let h = 0.2 / cells[0] as f64;
        let positions = sim.positions();
        let lowest = positions.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        // a vertical cut into the lower side, about a hundred cells
        let x = 0.1 + 0.37 * h;
        let p = |y: f64, z: f64| Point::new(x, y, z);
        let (low, high) = (lowest - h, 0.0);
        let points = vec![
            p(0.03, low),
            p(0.03 + 4.5 * h, low),
            p(0.03 + 4.5 * h, high + 2.5 * h),
            p(0.03, high + 2.5 * h),
        ];
        let sweep = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).expect("finite").0;
        let (with_cut, record) = seconds(|| {
            let record = sim.cut(&sweep, &CutOptions::default()).expect("a good cut");
            sim.step(0.01).expect("a good step");
            record
        });
        println!(
            "{name} cells: plain step {:.2} ms, step with a cut {:.2} ms (find {:.2}, remesh {:.2}, update {:.2} ms; {} cells replaced by {}, {} rows)",
            1e3 * plain,
            1e3 * with_cut,
            1e3 * record.seconds.find,
            1e3 * record.seconds.remesh,
            1e3 * record.seconds.update,
            record.cells_removed,
            record.cells_added,
            record.rows_updated
        );
        table.add(
            format!("step with a cut against a plain step, {name} cells"),
            with_cut / plain,
            3.0,
            1.5,
        );
        let counted = allocation_counter::measure(|| {
            for _ in 0..3 {
                sim.step(0.01).expect("a good step");
            }
        });
        table.add(
            format!("allocations in three warm steps, {name} cells"),
            counted.count_total as f64,
            0.0,
            0.0,
        );
    }
}

fn rest_stiffness(mesh: &TetMesh) -> (Assembler, BlockMatrix) {
    let assembler = Assembler::new(mesh, |_| steel_free_material()).expect("a good mesh");
    let mut k = assembler.new_matrix();
    let u = vec![0.0; 3 * mesh.vertex_slots()];
    assembler.tangent(mesh, Model::Linear, Tangent::Warped, &u, &mut k);
    (assembler, k)
}

fn block_product(table: &mut Table) {
    let mesh = generate::box_tets([1.0; 3], [32; 3], [0.0; 3]);
    let (_, k) = rest_stiffness(&mesh);
    let n = 3 * k.rows();
    let (x, mut y) = (vec![1.0; n], vec![0.0; n]);
    let product = median(
        (0..15)
            .map(|_| seconds(|| k.multiply(black_box(&x), &mut y)).0)
            .collect(),
    );
    let bytes = k.blocks() as f64 * 76.0 + n as f64 * 16.0;
    let m = 16 << 20;
    let (a, b, mut c) = (vec![1.0f64; m], vec![2.0f64; m], vec![0.0f64; m]);
    let triad = median(
        (0..9)
            .map(|_| {
                seconds(|| {
                    for ((c, a), b) in c.iter_mut().zip(&a).zip(&b) {
                        *c = a + 3.0 * b;
                    }
                    black_box(&c);
                })
                .0
            })
            .collect(),
    );
    let share = (bytes / product) / (24.0 * m as f64 / triad);
    println!(
        "block product: {:.2} GB/s, triad {:.2} GB/s",
        bytes / product / 1e9,
        24.0 * m as f64 / triad / 1e9
    );
    let what = "block matrix product, share of triad bandwidth".into();
    table.0.push(Row {
        what,
        figure: share,
        floor: 0.6,
        aim: 0.8,
        higher_is_better: true,
    });
}

/// Iterations and seconds of one solve with the stiffness at rest.
fn solve_static(mesh: &TetMesh, fixed: impl Fn(Point) -> bool, preconditioner: PreconditionerKind) -> (usize, f64) {
    let (assembler, k) = rest_stiffness(mesh);
    let mut f = vec![0.0; 3 * mesh.vertex_slots()];
    load::add_gravity(mesh, &assembler, [0.3, 0.2, -9.81], &mut f);
    solve_with(mesh, &k, fixed, preconditioner, &f)
}

fn solve_with(
    mesh: &TetMesh,
    k: &BlockMatrix,
    fixed: impl Fn(Point) -> bool,
    preconditioner: PreconditionerKind,
    f: &[f64],
) -> (usize, f64) {
    let mut mask = vec![false; 3 * mesh.vertex_slots()];
    for v in mesh.vertex_ids().filter(|&v| fixed(mesh.rest_position(v))) {
        mask[3 * v.index()..3 * v.index() + 3].fill(true);
    }
    let mut x = vec![0.0; mask.len()];
    let options = SolverOptions {
        kind: SolverKind::Cg,
        preconditioner,
        tolerance: 1e-8,
        max_iterations: 100_000,
    };
    let (s, info) = seconds(|| {
        let mut solver = LinearSolver::new(options);
        solver.set_positions(mesh.rest_positions().iter().map(|p| (*p).into()));
        solver.solve(k, &mask, f, &mut x).expect("solvable")
    });
    assert!(info.converged);
    (info.iterations, s)
}

/// Iterations of multigrid CG to 1e-8 for a cube that stands on one side, of `n` cells a side, after a hybrid cut half through
/// it or before; a line of what was found is printed.
fn iterations_of_cube(n: usize, poisson: f64, locking: Locking, is_cut: bool) -> f64 {
    let mut mesh = generate::box_tets([1.0; 3], [n; 3], [0.0; 3]);
    if is_cut {
        let mut tree = BoxTree::of_cells(&mesh, mesh.rest_positions());
        // aside of the facets, at the same place of a cell for every n
        let z = ((n / 2) as f64 + 0.37) / n as f64;
        let p = |x: f64, y: f64| Point::new(x, y, z);
        let points = vec![p(-0.1, -0.1), p(0.5, -0.1), p(0.5, 1.1), p(-0.1, 1.1)];
        let sweep = Sweep::new(points, vec![[0, 1, 2], [0, 2, 3]]).expect("finite").0;
        let (outcome, _) = cut_and_follow(&mut mesh, &mut tree, &sweep, &CutOptions::default());
        assert!(outcome.change.cells_added.len() > n * n);
    }
    let material = Material::new(1e5, poisson, 1000.0).expect("in range");
    let assembler = Assembler::with_cure(&mesh, locking, |_| material).expect("a good mesh");
    let u = vec![0.0; 3 * mesh.vertex_slots()];
    let mut k = assembler.new_matrix();
    assembler.tangent(&mesh, Model::Linear, Tangent::Warped, &u, &mut k);
    let mut f = u;
    load::add_gravity(&mesh, &assembler, [0.3, 0.2, -9.81], &mut f);
    drop(assembler);
    let (iterations, s) = solve_with(&mesh, &k, |p| p.z < 1e-9, PreconditionerKind::Multigrid, &f);
    println!(
        "| {poisson} | {locking:?} | {is_cut} | {} | {iterations} | {s:.2} |",
        3 * mesh.num_vertices()
    );
    iterations as f64
}

fn iterations_against_size(table: &mut Table) {
    println!("| nu | locking | cut | dofs | iterations of multigrid CG to 1e-8 | s |\n|---|---|---|---|---|---|");
    for is_cut in [false, true] {
        let name = if is_cut { "cut" } else { "uncut" };
        for poisson in [0.3, 0.45] {
            let counts = [14, 30, 46, 69].map(|n| iterations_of_cube(n, poisson, Locking::None, is_cut));
            let what = format!("CG iterations (multigrid), 1M against 10k dofs, nu = {poisson}, {name}");
            table.add(what, counts[3] / counts[0], 2.0, 1.3);
        }
        let counts = [14, 30].map(|n| iterations_of_cube(n, 0.499, Locking::Nodal, is_cut));
        let what = format!("CG iterations (multigrid), 90k against 10k dofs, nu = 0.499, locking cured, {name}");
        table.add(what, counts[1] / counts[0], 2.0, 1.3);
    }
}

fn conditioning_after_a_cut(table: &mut Table) {
    // held at the ends in x, so that both halves stay held at both ends
    let held = |p: Point| p.x < 1e-9 || p.x > 1.0 - 1e-9;
    let before = generate::box_tets([1.0; 3], [8; 3], [0.0; 3]);
    let iterations = |eps: Option<f64>| {
        let mut mesh = before.clone();
        let mut tree = BoxTree::of_cells(&mesh, mesh.rest_positions());
        if let Some(eps) = eps {
            let sweep = blade(0.5, 0.5, 0.5 + eps / 8.0, 0.7);
            cut_and_follow(&mut mesh, &mut tree, &sweep, &CutOptions::default());
        }
        // a load without any symmetry: on a symmetric one CG does not see half of the spectrum
        let waves = |i: usize| (12.9898 * i as f64).sin() + (78.233 * i as f64).cos();
        let f: Vec<f64> = (0..3 * mesh.vertex_slots()).map(waves).collect();
        solve_with(&mesh, &rest_stiffness(&mesh).1, held, PreconditionerKind::Jacobi, &f).0
    };
    // two halves that hang at one end each are a harder system than one block held at both, however good the cells
    let (uncut, parted) = (iterations(None), iterations(Some(0.0)));
    let cut: Vec<usize> = [0.2, 0.1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6]
        .map(|eps| iterations(Some(eps)))
        .to_vec();
    println!("F1: Jacobi-CG iterations: {uncut} uncut, {parted} parted along facets, {cut:?} cut at eps .2 to 1e-6");
    let worst = cut.iter().copied().max().unwrap_or(0) as f64;
    table.add(
        "F1: Jacobi-CG iterations after a hybrid cut against uncut, worst eps",
        worst / uncut as f64,
        1.25,
        1.1,
    );
    table.add(
        "F1: the same against parting along facets (same mechanics)",
        worst / parted as f64,
        1.25,
        1.1,
    );
}

/// Peak memory of a million tetrahedra that step, are cut and step again.
fn memory(table: &mut Table) {
    let mut cells = 0;
    let peak = allocation_counter::measure(|| {
        let mut sim = beam([56, 56, 54], "one-step");
        cells = sim.mesh().num_cells();
        assert!(sim.step(0.01).expect("a good step").converged);
        let record = sim.cut(&blade(0.1, 0.04, 0.0406, 0.15), &CutOptions::default());
        assert!(record.expect("a good sweep").cells_added > 0);
        assert!(sim.step(0.01).expect("a good step").converged);
    })
    .bytes_max as f64;
    let (gigabytes, each) = (peak / 1e9, peak / cells as f64);
    println!("memory: {cells} tets stepped and cut, peak {gigabytes:.2} GB, {each:.0} bytes a tet");
    table.add("peak memory of a step and a cut, 1M tets (GB)", gigabytes, 8.0, 8.0);
}

/// Times to hold against `step_yardstick.py` run in the same session on boxes of the same cells.
fn yardstick_steps(_: &mut Table) {
    for (cells, name) in [([10, 4, 4], "1k"), ([20, 8, 8], "8k"), ([37, 15, 15], "50k")] {
        let mut sim = beam(cells, "one-step");
        let mut times = Vec::new();
        let mut iterations = 0;
        for k in 0..12 {
            let (s, info) = seconds(|| sim.step(0.01).expect("a good step"));
            assert!(info.converged, "{info:?}");
            if k >= 2 {
                times.push(s);
                iterations = info.iterations;
            }
        }
        let tip = sim.mesh().vertex_ids().max_by_key(|v: &VertexId| {
            let p = sim.mesh().rest_position(*v);
            ((p.x * 1e6) as i64, std::cmp::Reverse(v.0))
        });
        let z = tip.map_or(0.0, |v| sim.positions()[v.index()].z);
        println!(
            "yardstick step {name}: {:.3} ms, {iterations} iterations, tip z {z:.9}",
            1e3 * median(times)
        );
    }
}

/// Times to hold against `static_yardstick.py`: assembly and solve from nothing, to 1e-8.
fn yardstick_static(_: &mut Table) {
    for (cells, name) in [([40, 8, 8], "10k"), ([70, 14, 14], "48k"), ([105, 21, 21], "154k")] {
        let mesh = generate::box_tets([1.0, 0.2, 0.2], cells, [0.0; 3]);
        let (total, (iterations, solve)) =
            seconds(|| solve_static(&mesh, |p| p.x < 1e-12, PreconditionerKind::Multigrid));
        println!(
            "yardstick static {name} dofs: {total:.3} s with assembly, {solve:.3} s solve, {iterations} iterations"
        );
    }
}
