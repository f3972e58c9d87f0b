//! Closed forms: what a finer mesh converges to, and how fast.
//!
//! Elements of order 1 make a bent beam too stiff by a factor `1 + C h²`; its deflection and energy under a load are too
//! small by the same factor. So the errors whose order is measured are those of the stiffness, `exact / found - 1`.

use kerfem_engine::fit::order;
use kerfem_mesh::Point;

use super::helpers::*;

fn beam(cells: [usize; 3], rest: &str) -> String {
    format!(
        "name = \"beam\"\n[mesh]\nbox = {{ size = [4, 1, 1], cells = {cells:?}, origin = [0, -0.5, -0.5] }}\n{MATERIAL}\
         [model]\nkind = \"linear\"\n[solver]\nkind = \"cholesky\"\ntolerance = 1e-12\n{rest}"
    )
}

/// Pure bending by the traction `c z` on the end: `u = c/E (x z, -nu y z, -(x² + nu (z² - y²))/2)` exactly, so that
/// Euler and Bernoulli's deflection `M L² / (2 E I)` holds on the axis. Its energy and deflection converge with order 2.
#[test]
fn pure_bending_converges_with_order_two() {
    let (young, c, length) = (1e7, 1e4, 4.0_f64);
    let conditions = "[[fixed]]\nwhere = \"x < 1e-9\"\n\
        displacement = [\"0\", \"-3e-4*y*z\", \"-1.5e-4*(z*z - y*y)\"]\n\
        [[load]]\nwhere = \"x > 4 - 1e-9\"\ntraction = [\"1e4*z\", \"0\", \"0\"]\n";
    let deflection = -c * length * length / (2.0 * young);
    let inertia: f64 = 1.0 / 12.0;
    let moment = c * inertia;
    assert!((deflection + moment * length * length / (2.0 * young * inertia)).abs() < 1e-15);
    let energy = c * c * inertia * length / (2.0 * young);

    let (mut of_tip, mut of_energy) = (Vec::new(), Vec::new());
    for n in [2, 4, 8] {
        let s = statics(&beam([4 * n, n, n], conditions));
        let end = Point::new(length, 0.0, 0.0);
        let tip = s
            .mesh()
            .rest_positions()
            .iter()
            .position(|p| (p - end).norm() < 1e-9)
            .unwrap();
        let h = 1.0 / n as f64;
        of_tip.push((h, deflection / s.u()[3 * tip + 2] - 1.0));
        of_energy.push((h, energy / s.energies().elastic - 1.0));
    }
    let (tip_rate, energy_rate) = (order(&of_tip).unwrap(), order(&of_energy).unwrap());
    println!("pure bending: tip {of_tip:?} rate {tip_rate:.3}; energy {of_energy:?} rate {energy_rate:.3}");
    assert!((tip_rate - 2.0).abs() < 0.15, "rate of the deflection {tip_rate}");
    assert!((energy_rate - 2.0).abs() < 0.15, "rate of the energy {energy_rate}");
    assert!(of_tip[2].1 < 0.08 && of_energy[2].1 < 0.08);
}

/// A cantilever under a shear traction on its end: the stiffness of three meshes, extrapolated, is that of Timoshenko's
/// deflection `P L³ / (3 E I) + P L / (k G A)`, k = 5/6, to two percent (the clamp stiffens a solid a little).
#[test]
fn a_cantilever_converges_to_timoshenko() {
    let conditions = "[[fixed]]\nwhere = \"x < 1e-9\"\n[[load]]\nwhere = \"x > 4 - 1e-9\"\ntraction = [0, 0, -1000]\n\
        [[quantity]]\nname = \"tip\"\nmean = \"uz\"\nwhere = \"x > 4 - 1e-9\"\n";
    let tips = [3, 6, 12].map(|n| {
        let s = statics(&beam([4 * n, n, n], conditions));
        s.quantities()["tip"].unwrap()
    });
    let stiffness = tips.map(|tip| -1000.0 / tip);
    let (first, last) = (stiffness[0] - stiffness[1], stiffness[1] - stiffness[2]);
    let rate = (first / last).log2();
    let limit = -1000.0 / (stiffness[2] - last / (2.0_f64.powf(rate) - 1.0));
    let (young, shear) = (1e7, 1e7 / 2.6);
    let timoshenko = -1000.0 * (64.0 / (3.0 * young / 12.0) + 4.0 / (5.0 / 6.0 * shear));
    println!("cantilever: {tips:?}, rate {rate:.3}, limit {limit:.6}, Timoshenko {timoshenko:.6}");
    assert!((rate - 2.0).abs() < 0.25, "rate {rate}");
    assert!((limit / timoshenko - 1.0).abs() < 0.02, "{limit} against {timoshenko}");
    assert!(
        tips[0].abs() < tips[1].abs() && tips[1].abs() < tips[2].abs(),
        "displacements are bounded from below"
    );
}
