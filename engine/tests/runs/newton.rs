//! How fast Newton's method converges where rotations are large.

use super::{box_scene, simulation};

/// Residuals from here on, relative as in `StepInfo`, are close to the solution.
const CLOSE: f64 = 1e-3;
/// The largest `r[k + 1] / r[k]²` there; with [`CLOSE`] a step thus gains a factor of 3 at least, and ever more from then on.
const CONSTANT: f64 = 300.0;
/// What rounding leaves of the residuals.
const ROUNDING: f64 = 1e-12;

/// Solves a static scene, prints the residuals that Newton's method met in its last stage and checks that it ends
/// quadratically, `r[k + 1] <= CONSTANT r[k]²`, over two steps at least. Convergence that is linear, however fast, fails.
fn check_quadratic_end(what: &str, sections: &str, size: [f64; 3], cells: [usize; 3]) {
    let solver = "[solver]\nkind = 'cholesky'\ntolerance = 1e-13\n";
    let mut s = simulation(&box_scene(size, cells, &format!("{sections}{solver}")));
    let info = s.step(0.0).unwrap();
    assert!(info.converged, "{what}: {info:?}");
    let residuals = s.newton_residuals();
    assert_eq!(residuals.last(), Some(&info.residual));
    println!(
        "{what}: {} Newton steps in all; relative residuals, and over the square of the one before:",
        info.newton_steps
    );
    println!("  {:.2e}", residuals[0]);
    let mut steps = 0;
    for r in residuals.windows(2) {
        println!("  {:.2e} {:>9.1e}", r[1], r[1] / (r[0] * r[0]));
        if r[0] <= CLOSE && r[0] > ROUNDING {
            assert!(
                r[1] <= CONSTANT * r[0] * r[0] + ROUNDING,
                "{what}: {r:?} of {residuals:?}"
            );
            steps += 1;
        }
    }
    assert!(steps >= 2, "{what}: {residuals:?}");
}

#[test]
fn on_the_elastica_it_ends_quadratically() {
    // a slender beam, fixed at one end; F L² / (E I) = 2 at the other
    let (length, side) = (2.0f64, 0.1f64);
    let force = 2.0 * 1e5 * side.powi(4) / 12.0 / (length * length);
    let sections = format!("[[fixed]]\nwhere = 'x < 1e-9'\n[[load]]\nwhere = 'x > 1.999'\nforce = [0, 0, -{force}]\n");
    check_quadratic_end("elastica", &sections, [length, side, side], [40, 2, 2]);
}

#[test]
fn on_the_twist_it_ends_quadratically() {
    for degrees in [90, 180] {
        let sections = format!(
            "[[fixed]]\nwhere = 'x < 1e-9'\n[[fixed]]\nwhere = 'x > 3.999'\n\
             displacement = [0, '(y - 0.5) * cos(pi*{degrees}/180) - (z - 0.5) * sin(pi*{degrees}/180) + 0.5 - y', \
             '(y - 0.5) * sin(pi*{degrees}/180) + (z - 0.5) * cos(pi*{degrees}/180) + 0.5 - z']\n"
        );
        check_quadratic_end(
            &format!("twist by {degrees} degrees"),
            &sections,
            [4.0, 1.0, 1.0],
            [12, 3, 3],
        );
    }
}
