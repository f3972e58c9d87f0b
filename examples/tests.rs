//! Every example runs, and its number is right.

#[path = "cut_mesh.rs"]
mod cut_mesh;
#[path = "falling_beam.rs"]
mod falling_beam;
#[path = "organ.rs"]
mod organ;
#[path = "real_time.rs"]
mod real_time;

use kerfem_engine::Simulation;
use kerfem_mesh::predicates::contains;
use kerfem_mesh::{Aabb, BoxTree, CellId, Point};

#[test]
fn cut_mesh_keeps_good_cells() {
    let dir = std::env::temp_dir().join(format!("kerfem-cut-mesh-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let worst = cut_mesh::run(&dir).unwrap();
    assert!(worst > 0.05, "{worst}");
    assert!(dir.join("cut_ball.vtu").is_file());
    std::fs::remove_dir_all(&dir).unwrap();
}

#[test]
fn the_loose_piece_falls_as_it_should() {
    let error = falling_beam::run().unwrap();
    assert!(error < 1e-6, "{error}");
}

#[test]
fn the_incision_gapes() {
    let gape = organ::run().unwrap();
    assert!((0.002..0.05).contains(&gape), "{gape}");
}

#[test]
fn the_loop_cuts_in_mid_flight_and_allocates_nothing_once_warm() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut body = real_time::Loop::new().unwrap();
        let frames = |body: &mut real_time::Loop, numbers: std::ops::Range<u32>| {
            let counted = allocation_counter::measure(|| numbers.for_each(|n| body.frame(n).unwrap()));
            counted.count_total
        };
        assert!(frames(&mut body, 0..2) > 0, "what is allocated is counted");
        assert_eq!(frames(&mut body, 2..20), 0);
        let hanging = body.lowest();
        let replaced = body.cut().unwrap();
        assert!((50..1000).contains(&replaced), "{replaced}");
        assert!(frames(&mut body, 20..22) > 0);
        assert_eq!(frames(&mut body, 22..40), 0);
        assert!(
            body.lowest() < hanging && hanging < -0.05,
            "{hanging} {}",
            body.lowest()
        );
    });
}

#[test]
fn the_scalpel_draws_a_slit() {
    let scene = kerfem_engine::Scene::read("scenes/scalpel.toml").unwrap();
    let (dt, steps) = (scene.time.dt.unwrap(), 12);
    let blade = scene.cut[0].blade.as_ref().unwrap().blade().unwrap();
    let mut body = Simulation::new(scene).unwrap();
    body.verify(true);
    let mut swept = 0.0;
    for k in 0..steps {
        let [from, to] = [k, k + 1].map(|k| blade.at(k as f64 * dt));
        swept += area_inside(&body, from, to);
        assert!(body.step(dt).unwrap().converged);
    }
    assert_eq!(body.verification().unwrap().invariants, "ok");
    assert_eq!(
        (body.mesh().pieces().1, body.warnings().len()),
        (1, 0),
        "{:?}",
        body.warnings()
    );
    let area: f64 = body.cuts().iter().map(|c| c.area_m2).sum();
    assert!(swept > 0.02 && (area - swept).abs() < 0.15 * swept, "{area} {swept}");
    let tip = body.cuts().iter().filter_map(|c| c.tip_distance_m).fold(0.0, f64::max);
    println!("area {area} of {swept}, tip {tip}");
    assert!(tip < 0.018, "{tip}");
    assert!(body.cuts().iter().all(|c| c.refused.is_empty()));
}

/// What a blade sweeps inside a body as it lies (m2), by the midpoints of a grid on the ruled surface.
fn area_inside(body: &Simulation, from: [Point; 2], to: [Point; 2]) -> f64 {
    const PARTS: usize = 64;
    let positions = body.positions();
    let tree = BoxTree::of_cells(body.mesh(), &positions);
    let at = |i: usize, j: usize, half: f64| {
        let [s, g] = [i, j].map(|k| (k as f64 + half) / PARTS as f64);
        let over = |line: [Point; 2]| line[0] + (line[1] - line[0]) * s;
        over(from) + (over(to) - over(from)) * g
    };
    let is_inside = |p: Point| {
        let mut inside = false;
        tree.query(&Aabb::around([p]), |c| {
            inside |= contains(&body.mesh().cell(CellId(c)).map(|v| positions[v.index()]), p);
        });
        inside
    };
    let squares = (0..PARTS).flat_map(|i| (0..PARTS).map(move |j| (i, j)));
    let inside = squares.filter(|&(i, j)| is_inside(at(i, j, 0.5)));
    let area = |(i, j)| {
        let corner = at(i, j, 0.0);
        (at(i + 1, j, 0.0) - corner).cross(&(at(i, j + 1, 0.0) - corner)).norm()
    };
    inside.map(area).sum()
}
