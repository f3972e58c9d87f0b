//! Linear systems.

use kerfem_fem::{
    Assembler, BlockMatrix, FemError, LinearSolver, PreconditionerKind, SolveInfo, SolverKind, SolverOptions, load,
};
use kerfem_mesh::{TetMesh, generate};

use crate::helpers::{assemble, body, largest, product, random};

const PRECONDITIONERS: [PreconditionerKind; 4] = [
    PreconditionerKind::None,
    PreconditionerKind::Jacobi,
    PreconditionerKind::BlockJacobi,
    PreconditionerKind::BlockIc0,
];

fn options(kind: SolverKind, preconditioner: PreconditionerKind) -> SolverOptions {
    SolverOptions {
        kind,
        preconditioner,
        tolerance: 1e-11,
        max_iterations: 5000,
    }
}

fn cg(preconditioner: PreconditionerKind) -> SolverOptions {
    options(SolverKind::Cg, preconditioner)
}

fn cholesky() -> SolverOptions {
    options(SolverKind::Cholesky, PreconditionerKind::None)
}

/// A bar held at `x = 0`, pulled to a prescribed `u_x` at its other end, under gravity.
fn bar(cells: [usize; 3]) -> (TetMesh, Assembler, Vec<bool>, Vec<f64>, Vec<f64>) {
    let mesh = body(cells);
    let assembler = assemble(&mesh);
    let n = 3 * mesh.vertex_slots();
    let end = 0.5 * cells[0] as f64;
    let at = |d: usize| mesh.rest_positions()[d / 3].x;
    let fixed: Vec<bool> = (0..n)
        .map(|d| at(d) < 1e-9 || (at(d) > end - 1e-9 && d % 3 == 0))
        .collect();
    let x = (0..n)
        .map(|d| if fixed[d] && at(d) > 1e-9 { 0.1 } else { 0.0 })
        .collect();
    let mut b = vec![0.0; n];
    load::add_gravity(&mesh, &assembler, [0.0, 0.0, -9.81], &mut b);
    (mesh, assembler, fixed, b, x)
}

fn residual(a: &BlockMatrix, fixed: &[bool], b: &[f64], x: &[f64]) -> f64 {
    let prescribed: Vec<f64> = x.iter().zip(fixed).map(|(x, &f)| if f { *x } else { 0.0 }).collect();
    let (ax, moved) = (product(a, x), product(a, &prescribed));
    let norm = |r: &dyn Fn(usize) -> f64| {
        (0..b.len())
            .filter(|&d| !fixed[d])
            .map(|d| r(d).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    norm(&|d| b[d] - ax[d]) / norm(&|d| b[d] - moved[d])
}

#[test]
fn all_solvers_agree_and_report_the_true_residual() {
    let (_, assembler, fixed, b, start) = bar([6, 2, 2]);
    let a = assembler.stiffness();
    let mut reference = start.clone();
    let info = LinearSolver::new(cholesky())
        .solve(a, &fixed, &b, &mut reference)
        .unwrap();
    assert!(info.converged && info.iterations <= 1);
    assert!((info.residual - residual(a, &fixed, &b, &reference)).abs() < 1e-14);
    let mut iterations = Vec::new();
    for kind in PRECONDITIONERS {
        let mut x = start.clone();
        let mut solver = LinearSolver::new(cg(kind));
        let info = solver.solve(a, &fixed, &b, &mut x).unwrap();
        assert!(info.converged && info.residual <= 1e-11, "{kind:?} {info:?}");
        assert!((info.residual - residual(a, &fixed, &b, &x)).abs() < 1e-14);
        assert!(
            fixed.iter().zip(x.iter().zip(&start)).all(|(f, (x, s))| !f || x == s),
            "prescribed values stay"
        );
        let difference: Vec<f64> = x.iter().zip(&reference).map(|(x, r)| x - r).collect();
        assert!(largest(&difference) < 1e-9 * largest(&reference), "{kind:?}");
        // from the solution nothing is left to do; the same again from the start gives the same bits
        let warm = solver.solve(a, &fixed, &b, &mut x.clone()).unwrap();
        assert!(warm.iterations <= 1, "{kind:?} {warm:?}");
        let mut again = start.clone();
        assert_eq!(solver.solve(a, &fixed, &b, &mut again).unwrap(), info);
        assert_eq!(again, x);
        iterations.push(info.iterations);
    }
    assert!(
        iterations[3] * 2 < iterations[2],
        "IC(0) against block Jacobi: {iterations:?}"
    );
    assert!(iterations[2] < iterations[0], "{iterations:?}");
}

/// F29: at the cap the last iterate comes back with its true residual, flagged.
#[test]
fn iteration_cap_is_flagged() {
    let (_, assembler, fixed, b, start) = bar([6, 2, 2]);
    let a = assembler.stiffness();
    let mut last = f64::INFINITY;
    for cap in [0, 10, 20] {
        let mut x = start.clone();
        let mut solver = LinearSolver::new(SolverOptions {
            max_iterations: cap,
            ..cg(PreconditionerKind::BlockIc0)
        });
        let info = solver.solve(a, &fixed, &b, &mut x).unwrap();
        assert_eq!((info.iterations, info.converged), (cap, false));
        assert!((info.residual - residual(a, &fixed, &b, &x)).abs() < 1e-9 * info.residual);
        assert!(info.residual < last);
        last = info.residual;
    }
}

/// Bars of different lengths side by side, each held at one end and loaded at random, `loads` times as much.
fn bars(lengths: &[usize], loads: &[f64]) -> (Assembler, Vec<bool>, Vec<f64>) {
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    let (mut fixed, mut b, mut next) = (Vec::new(), Vec::new(), random(3));
    for (k, (&length, load)) in lengths.iter().zip(loads).enumerate() {
        let (bar, first) = (body([length, 2, 2]), points.len());
        cells.extend(bar.cell_ids().map(|c| bar.cell(c).map(|v| first + v.index())));
        for p in bar.rest_positions() {
            fixed.extend([p.x < 1e-9; 3]);
            b.extend([(); 3].map(|()| load * next()));
            points.push(p + kerfem_mesh::Point::new(0.0, 9.0 * k as f64, 0.0));
        }
    }
    (assemble(&TetMesh::new(points, cells).unwrap()), fixed, b)
}

#[test]
fn a_body_in_pieces_is_solved_piece_by_piece() {
    for preconditioner in PRECONDITIONERS {
        let solve = |lengths: &[usize], loads: &[f64]| {
            let (assembler, fixed, b) = bars(lengths, loads);
            let mut x = vec![0.0; b.len()];
            let mut solver = LinearSolver::new(cg(preconditioner));
            let info = solver.solve(assembler.stiffness(), &fixed, &b, &mut x).unwrap();
            assert!(info.converged);
            info.iterations
        };
        // the loads of a bar are the same wherever it stands first
        let [long, short] = [solve(&[12], &[1.0]), solve(&[7], &[1.0])];
        let both = solve(&[12, 7], &[1.0, 1.0]);
        println!("{preconditioner:?}: {long} iterations for the longer bar, {short} for the shorter, {both} for both");
        assert!(both.abs_diff(long) <= 2 && short + 10 < long, "{both} {long} {short}");
        // what carries nothing costs nothing, and what carries little is solved no better than the whole asks for
        for little in [0.0, 1e-13] {
            let found = solve(&[7, 12], &[1.0, little]);
            assert!(found.abs_diff(short) <= 2, "{found} {short}");
        }
    }
}

/// Two large pieces and three small ones that are taken together, with prescribed values, some of them for single axes, from values
/// that are not zero.
#[test]
fn pieces_of_all_sizes_are_solved() {
    let (assembler, mut fixed, b) = bars(&[9, 1, 8, 1, 1], &[1.0, 2.0, 0.0, 3.0, 1e-20]);
    let mut next = random(5);
    let start: Vec<f64> = b.iter().map(|_| 0.1 * next()).collect();
    let a = assembler.stiffness();
    let last = fixed.len() - 2;
    (fixed[last], fixed[100]) = (true, true);
    let mut exact = start.clone();
    assert!(
        LinearSolver::new(cholesky())
            .solve(a, &fixed, &b, &mut exact)
            .unwrap()
            .converged
    );
    for preconditioner in PRECONDITIONERS {
        let mut solver = LinearSolver::new(cg(preconditioner));
        let mut x = start.clone();
        for _ in 0..2 {
            let info = solver.solve(a, &fixed, &b, &mut x).unwrap();
            assert!(info.converged && (info.residual - residual(a, &fixed, &b, &x)).abs() < 1e-12);
        }
        let off = x.iter().zip(&exact).map(|(x, e)| (x - e).abs()).fold(0.0, f64::max);
        assert!(off < 1e-8 * largest(&exact), "{preconditioner:?}: {off}");
        assert!((0..x.len()).all(|d| !fixed[d] || x[d] == start[d]));
    }
}

/// The cap is of each piece, and hitting it in one is flagged for the whole.
#[test]
fn one_piece_at_its_cap_is_flagged() {
    let (assembler, fixed, b) = bars(&[12, 3], &[1.0, 1.0]);
    let mut x = vec![0.0; b.len()];
    let mut solver = LinearSolver::new(SolverOptions {
        max_iterations: 80,
        ..cg(PreconditionerKind::BlockJacobi)
    });
    let info = solver.solve(assembler.stiffness(), &fixed, &b, &mut x).unwrap();
    assert_eq!((info.iterations, info.converged), (80, false));
    assert!((info.residual - residual(assembler.stiffness(), &fixed, &b, &x)).abs() < 1e-9 * info.residual);
    // the short one is solved
    let rest: Vec<f64> = product(assembler.stiffness(), &x);
    let first_of_short = fixed.len() - 3 * body([3, 2, 2]).vertex_slots();
    let worst = (first_of_short..fixed.len())
        .filter(|&d| !fixed[d])
        .map(|d| (b[d] - rest[d]).abs());
    assert!(worst.fold(0.0, f64::max) < 1e-9);
}

#[test]
fn nothing_to_solve() {
    let done = SolveInfo {
        iterations: 0,
        residual: 0.0,
        converged: true,
    };
    let empty = TetMesh::new(Vec::new(), Vec::new()).unwrap();
    let (_, assembler, fixed, b, _) = bar([2, 1, 1]);
    for options in PRECONDITIONERS.map(cg).into_iter().chain([cholesky()]) {
        let mut solver = LinearSolver::new(options);
        assert_eq!(solver.solve(assemble(&empty).stiffness(), &[], &[], &mut []), Ok(done));
        let a = assembler.stiffness();
        let mut x = vec![0.5; b.len()];
        assert_eq!(solver.solve(a, &vec![true; b.len()], &b, &mut x), Ok(done));
        assert!(x.iter().all(|&x| x == 0.5));
        // b = 0 with zero prescribed values
        x.iter_mut()
            .zip(&fixed)
            .filter(|(_, f)| **f)
            .for_each(|(x, _)| *x = 0.0);
        assert_eq!(solver.solve(a, &fixed, &vec![0.0; b.len()], &mut x), Ok(done));
        assert!(x.iter().all(|&x| x == 0.0));
    }
}

/// F16: an unreferenced vertex keeps its value, and the rest is solved.
#[test]
fn an_unreferenced_vertex_is_left_alone() {
    let plain = body([2, 1, 1]);
    let cells = plain.cell_ids().map(|c| plain.cell(c).map(|v| v.index())).collect();
    let mut points = plain.rest_positions().to_vec();
    points.push(kerfem_mesh::Point::repeat(5.0));
    let mesh = TetMesh::new(points, cells).unwrap();
    let assembler = assemble(&mesh);
    let n = 3 * mesh.vertex_slots();
    let fixed: Vec<bool> = (0..n).map(|d| mesh.rest_positions()[d / 3].x < 1e-9).collect();
    for options in [
        cg(PreconditionerKind::BlockIc0),
        cg(PreconditionerKind::BlockJacobi),
        cholesky(),
    ] {
        let mut x = vec![0.0; n];
        x[n - 1] = 7.0;
        let info = LinearSolver::new(options)
            .solve(assembler.stiffness(), &fixed, &vec![1.0; n], &mut x)
            .unwrap();
        assert!(info.converged);
        assert_eq!(x[n - 3..], [0.0, 0.0, 7.0]);
    }
}

#[test]
fn a_free_body_is_refused_in_statics() {
    let mesh = body([2, 2, 2]);
    let a = assemble(&mesh);
    let n = 3 * mesh.vertex_slots();
    let mut next = random(4);
    let b: Vec<f64> = (0..n).map(|_| next()).collect();
    let mut x = vec![0.25; n];
    let result = LinearSolver::new(cholesky()).solve(a.stiffness(), &vec![false; n], &b, &mut x);
    assert!(
        matches!(result, Err(FemError::NotPositiveDefinite { .. })),
        "{result:?}"
    );
    assert!(x.iter().all(|&x| x == 0.25));
    let message = result.unwrap_err().to_string();
    assert!(message.contains("free piece"), "{message}");
}

#[test]
fn bad_input_is_named_and_never_passed_on() {
    let (_, assembler, fixed, b, start) = bar([2, 1, 1]);
    let n = b.len();
    for options in PRECONDITIONERS.map(cg).into_iter().chain([cholesky()]) {
        let mut solver = LinearSolver::new(options);
        let a = assembler.stiffness();
        let mut x = start.clone();
        let short = solver.solve(a, &fixed[1..], &b, &mut x);
        assert!(matches!(short, Err(FemError::Length { found, expected, .. }) if found + 1 == expected));
        let mut broken = b.clone();
        broken[5] = f64::NAN;
        let nan = solver.solve(a, &fixed, &broken, &mut x);
        assert_eq!(nan, Err(FemError::NotFinite { what: "`b`", index: 5 }));
        let mut negative = a.clone();
        negative.scale(-1.0);
        let indefinite = solver.solve(&negative, &fixed, &b, &mut x);
        assert!(
            matches!(indefinite, Err(FemError::NotPositiveDefinite { .. })),
            "{options:?} {indefinite:?}"
        );
        let mut rotten = a.clone();
        rotten.scale(f64::NAN);
        let nan = solver.solve(&rotten, &fixed, &b, &mut x);
        assert!(
            matches!(nan, Err(FemError::NotFinite { what: "the matrix", .. })),
            "{options:?} {nan:?}"
        );
        assert_eq!(x, start);
        // and the solver still works
        assert!(solver.solve(a, &fixed, &b, &mut x).unwrap().converged);
        assert_eq!(x.len(), n);
    }
}

#[test]
fn a_solver_follows_changes_of_pattern_and_supports() {
    for options in [cg(PreconditionerKind::BlockIc0), cholesky()] {
        let mut solver = LinearSolver::new(options);
        for cells in [[3, 2, 2], [4, 1, 1], [2, 2, 3]] {
            let (_, assembler, mut fixed, b, start) = bar(cells);
            for _ in 0..2 {
                let mut x = start.clone();
                assert!(
                    solver
                        .solve(assembler.stiffness(), &fixed, &b, &mut x)
                        .unwrap()
                        .converged
                );
                fixed.iter_mut().skip(1).step_by(7).for_each(|f| *f = true);
            }
        }
        solver.pattern_changed();
    }
}

#[test]
fn near_incompressible_and_slender_bodies_are_solved() {
    let mesh = generate::box_tets([10.0, 0.2, 0.2], [60, 2, 2], [0.0; 3]);
    let material = kerfem_fem::Material::new(1e6, 0.4999, 1000.0).unwrap();
    let assembler = Assembler::new(&mesh, |_| material).unwrap();
    let n = 3 * mesh.vertex_slots();
    let fixed: Vec<bool> = (0..n).map(|d| mesh.rest_positions()[d / 3].x < 1e-9).collect();
    let mut b = vec![0.0; n];
    load::add_gravity(&mesh, &assembler, [0.0, 0.0, -9.81], &mut b);
    let mut x = vec![0.0; n];
    let mut solver = LinearSolver::new(SolverOptions {
        tolerance: 1e-6,
        ..cholesky()
    });
    let info = solver.solve(assembler.stiffness(), &fixed, &b, &mut x).unwrap();
    assert!(info.converged, "{info:?}");
    let mut y = vec![0.0; n];
    let mut solver = LinearSolver::new(SolverOptions {
        tolerance: 1e-6,
        ..cg(PreconditionerKind::BlockIc0)
    });
    let info = solver.solve(assembler.stiffness(), &fixed, &b, &mut y).unwrap();
    assert!(info.converged, "{info:?}");
    let difference: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x - y).collect();
    assert!(largest(&difference) < 1e-3 * largest(&x));
}
