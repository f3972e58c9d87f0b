//! A body whose cells are turned inside out comes back to its shape at rest.

use kerfem_engine::Simulation;

use super::{box_scene, simulation};

const HOLD: &str = "[[fixed]]\nwhere = 'x < 1e-9'\n";

/// A tangle that leaves the face x = 0 in place: every other vertex thrown about by up to a third of the body, and one corner
/// pushed out through the opposite side.
const SCRAMBLED: &str = "[initial]\ndisplacement = [\n\
    'if(x < 1e-9, 0, 0.3 * sin(37 * x + 91 * y + 53 * z) - 1.5 * max(0, x + y + z - 2.9) / 0.1)',\n\
    'if(x < 1e-9, 0, 0.3 * sin(71 * x + 23 * y + 87 * z) - 1.5 * max(0, x + y + z - 2.9) / 0.1)',\n\
    'if(x < 1e-9, 0, 0.3 * sin(13 * x + 67 * y + 29 * z) - 1.5 * max(0, x + y + z - 2.9) / 0.1)']\n";

/// The body turned inside out as in a mirror, through the face that is held.
const MIRRORED: &str = "[initial]\ndisplacement = ['-2 * x', 0, 0]\n";

/// How many cells are inside out at the present positions.
fn inverted(s: &Simulation) -> usize {
    let x = s.positions();
    let volume = |c| kerfem_mesh::quality::tet_volume(&s.mesh().cell(c).map(|v| x[v.index()]));
    s.mesh().cell_ids().filter(|c| volume(*c) <= 0.0).count()
}

fn largest(field: &[f64]) -> f64 {
    field.iter().fold(0.0, |m, u| f64::max(m, u.abs()))
}

#[test]
fn it_comes_back_to_rest_at_once() {
    for order in [1, 2] {
        for (what, tangle) in [("scrambled", SCRAMBLED), ("mirrored", MIRRORED)] {
            let sections = format!("{HOLD}{tangle}[model]\norder = {order}\n");
            let mut s = simulation(&box_scene([1.0; 3], [4; 3], &sections));
            let (before, cells) = (inverted(&s), s.mesh().num_cells());
            let energy = s.energies().elastic;
            assert!(before > cells / 5, "{before} of {cells}");
            let info = s.step(0.0).unwrap();
            println!(
                "order {order}, {what}: {before} of {cells} cells inside out and {energy:.3e} J; after {} Newton steps {} and \
                 {:.3e} J",
                info.newton_steps,
                inverted(&s),
                info.energies.elastic
            );
            assert!(info.converged, "{info:?}");
            assert_eq!(inverted(&s), 0);
            assert!(info.energies.elastic < 1e-12 * energy, "{info:?}");
            assert!(largest(s.u()) < 1e-6, "{}", largest(s.u()));
        }
    }
}

#[test]
fn it_comes_back_to_rest_in_time() {
    for order in [1, 2] {
        for (what, tangle) in [("scrambled", SCRAMBLED), ("mirrored", MIRRORED)] {
            let sections = format!(
                "{HOLD}{tangle}[model]\norder = {order}\n[time]\nscheme = 'backward-euler'\ndt = 0.05\nend = 5\n"
            );
            let mut s = simulation(&box_scene([1.0; 3], [4; 3], &sections));
            let (before, energy) = (inverted(&s), s.energies().elastic);
            for k in 0..100 {
                let info = s.step(0.05).unwrap();
                assert!(info.converged, "{info:?}");
                if k < 5 || k % 20 == 19 {
                    println!(
                        "order {order}, {what}, {:.2} s: {} of {before} cells inside out, {:.3e} of {energy:.3e} J, {} Newton steps",
                        info.time,
                        inverted(&s),
                        info.energies.elastic + info.energies.kinetic,
                        info.newton_steps
                    );
                }
            }
            assert_eq!(inverted(&s), 0);
            assert!(s.energies().elastic + s.energies().kinetic < 1e-6 * energy);
        }
    }
}
