//! Prints times; run with `cargo test --release -p kerfem-fem --test suite figures -- --ignored --nocapture`.

use std::time::Instant;

use kerfem_fem::{
    Assembler, LinearSolver, Material, Model, PreconditionerKind, Scales, SolverKind, SolverOptions, Tangent,
};
use kerfem_mesh::generate;

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    1e3 * times[times.len() / 2]
}

/// Twelve steps of `(M + dt^2 K) dv = dt (f_ext - f - dt K v)` on a clamped bar under gravity.
#[test]
#[ignore = "prints times"]
fn cost_of_a_step() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for cells in [[18, 3, 3], [37, 6, 6], [58, 12, 12]] {
        for kind in [PreconditionerKind::BlockJacobi, PreconditionerKind::BlockIc0] {
            pool.install(|| steps(cells, kind));
        }
    }
}

fn steps(cells: [usize; 3], preconditioner: PreconditionerKind) {
    let mesh = generate::box_tets([1.0, 0.2, 0.2], cells, [0.0; 3]);
    let start = Instant::now();
    let assembler = Assembler::new(&mesh, |_| Material::new(1e5, 0.45, 1000.0).unwrap()).unwrap();
    let setup = start.elapsed().as_secs_f64();
    let n = 3 * mesh.vertex_slots();
    let (dt, mut u, mut v) = (0.01, vec![0.0; n], vec![0.0; n]);
    let fixed: Vec<bool> = (0..n).map(|d| mesh.rest_positions()[d / 3].x < 1e-6).collect();
    let mut a = assembler.new_matrix();
    let (mut f, mut kv, mut b) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut solver = LinearSolver::new(SolverOptions {
        kind: SolverKind::Cg,
        preconditioner,
        tolerance: 1e-9,
        max_iterations: 2000,
    });
    let (mut assemble, mut solve, mut iterations, mut residual) = (Vec::new(), Vec::new(), 0, 0.0f64);
    for _ in 0..12 {
        let start = Instant::now();
        let scales = Scales {
            stiffness: dt * dt,
            mass: 1.0,
        };
        assembler.linearize(
            &mesh,
            Model::Corotated,
            Tangent::Warped,
            &u,
            scales,
            &mut a,
            Some(&mut f),
        );
        assemble.push(start.elapsed().as_secs_f64());
        let start = Instant::now();
        a.multiply(&v, &mut kv);
        for d in 0..n {
            let m = assembler.lumped_mass()[d / 3];
            let gravity = if d % 3 == 2 { -9.81 } else { 0.0 };
            b[d] = dt * (m * gravity - f[d]) - (kv[d] - m * v[d]);
        }
        let mut dv = vec![0.0; n];
        let info = solver.solve(&a, &fixed, &b, &mut dv).unwrap();
        solve.push(start.elapsed().as_secs_f64());
        (iterations, residual) = (info.iterations, info.residual.max(residual));
        for d in 0..n {
            v[d] += dv[d];
            u[d] += dt * v[d];
        }
    }
    let start = Instant::now();
    let mut y = vec![0.0; n];
    for _ in 0..100 {
        a.multiply(&u, &mut y);
    }
    let product = start.elapsed().as_secs_f64() / 100.0;
    let tip = u.chunks(3).map(|u| u[2]).fold(0.0, f64::min);
    println!(
        "{:6} tets {preconditioner:?}: set-up {:.1} ms, linearize {:.3} ms, solve {:.3} ms ({iterations} iterations, \
         residual {residual:.1e}), product {:.4} ms, lowest {tip:.9}",
        mesh.num_cells(),
        1e3 * setup,
        median(assemble),
        median(solve),
        1e3 * product,
    );
}
