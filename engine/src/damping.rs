//! Rayleigh damping by stiffness: what resists the motion of a step.
//!
//! The damping force is `-beta K v` with the warped stiffness `K = sum R Ke R^T`. The rotations `R` are those of the cells
//! half-way through the step as its velocities foretell it, at `u + dt/2 v`, and stay as they are while the step is
//! solved. So `K` is symmetric and positive semidefinite, the step is still a minimum of energy, and a body that only turns
//! meets no force: with the rotation half-way between two positions of a rigid body, `R^T (x' - x)` is an infinitesimal
//! rotation, whose strain is zero. (Two-step differences damp at the end of the step, with the rotations foretold there.) The rotation foretold differs from the one half-way by terms of the third order in `dt`.
//! Linear momentum is never touched; angular momentum is by torques of the order of the strain times the damping stress,
//! since stresses are turned by `R` alone. The linear model has no rotations; its `K` is the stiffness at rest.

use kerfem_fem::{BlockMatrix, Model, Tangent};

use crate::equilibrium::{Body, dot};

/// What damps a step: the energy `factor/2 |u - start|²_K`.
#[derive(Clone, Copy)]
pub(crate) struct Viscosity<'a> {
    /// Damping over the time from `start` to the `u` that is sought, `beta / dt`; zero without damping.
    pub(crate) factor: f64,
    /// Displacements that the step sets out from (m).
    pub(crate) start: &'a [f64],
    /// Velocities that it sets out with (m/s).
    pub(crate) velocity: &'a [f64],
    /// When they lead to where cells are turned as they are while damping acts (s); for most schemes half-way.
    pub(crate) half: f64,
}

/// Memory of the damping, kept from step to step; none without damping.
#[derive(Debug, Default)]
pub(crate) struct Damping {
    /// The warped stiffness of a corotated body.
    warped: Option<BlockMatrix>,
    /// Displacements half-way while a step begins, then `u - start` of the last [`Self::weigh`] (m).
    moved: Vec<f64>,
    force: Vec<f64>,
}

impl Damping {
    /// Makes ready for a step.
    pub(crate) fn begin<const N: usize>(&mut self, body: &Body<'_, N>, viscosity: &Viscosity<'_>) {
        if viscosity.factor == 0.0 {
            *self = Damping::default();
            return;
        }
        self.moved.resize(viscosity.start.len(), 0.0);
        self.force.resize(viscosity.start.len(), 0.0);
        if body.model == Model::Corotated {
            let Viscosity {
                start, velocity, half, ..
            } = *viscosity;
            let halfway = &mut self.moved;
            for (x, (u, v)) in halfway.iter_mut().zip(start.iter().zip(velocity)) {
                *x = u + half * v;
            }
            let warped = self.warped.get_or_insert_with(|| body.assembler.new_matrix());
            body.assembler
                .tangent(body.mesh, body.model, Tangent::Warped, halfway, warped);
        }
    }

    /// Forms the force (N) against the motion from the start of the step to `u`.
    pub(crate) fn weigh<const N: usize>(&mut self, body: &Body<'_, N>, viscosity: &Viscosity<'_>, u: &[f64]) {
        if viscosity.factor == 0.0 {
            return;
        }
        for (moved, (u, start)) in self.moved.iter_mut().zip(u.iter().zip(viscosity.start)) {
            *moved = u - start;
        }
        stiffness(&self.warped, body).multiply(&self.moved, &mut self.force);
        self.force.iter_mut().for_each(|f| *f *= viscosity.factor);
    }

    /// The force of the last [`Self::weigh`] (N, minus what acts on the body); empty without damping.
    pub(crate) fn force(&self) -> &[f64] {
        &self.force
    }

    /// The energy (J) whose gradient the force is.
    pub(crate) fn energy(&self) -> f64 {
        0.5 * dot(&self.force, &self.moved)
    }

    /// Adds the derivative of the force to a matrix of the pattern of the body.
    pub(crate) fn add_to<const N: usize>(&self, body: &Body<'_, N>, viscosity: &Viscosity<'_>, out: &mut BlockMatrix) {
        if viscosity.factor != 0.0 {
            out.add(viscosity.factor, stiffness(&self.warped, body));
        }
    }
}

/// The `K` of the damping.
fn stiffness<'a, const N: usize>(warped: &'a Option<BlockMatrix>, body: &Body<'a, N>) -> &'a BlockMatrix {
    warped.as_ref().unwrap_or(body.assembler.stiffness())
}

#[cfg(test)]
mod tests {
    use kerfem_fem::{Assembler, Material};
    use kerfem_mesh::{Point, SimplexMesh, generate};
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use crate::MassKind;

    /// Force and energy of a motion from `start` to `end` with the velocities that lead half-way between both.
    fn damped<const N: usize>(
        mesh: &SimplexMesh<N>,
        motion: impl Fn(&Point, f64) -> Point,
        factor: f64,
    ) -> (Vec<f64>, f64, Damping) {
        let material = Material::new(1e4, 0.3, 1.0).unwrap();
        let assembler = Assembler::new(mesh, |_| material).unwrap();
        let body = Body {
            mesh,
            assembler: &assembler,
            model: Model::Corotated,
            mass: MassKind::Lumped,
        };
        let [start, end] = [0.0, 1.0].map(|t| -> Vec<f64> {
            let moved = mesh.rest_positions().iter().map(|p| motion(p, t) - p);
            moved.flat_map(|u| [u.x, u.y, u.z]).collect()
        });
        let velocity: Vec<f64> = end.iter().zip(&start).map(|(b, a)| b - a).collect();
        let viscosity = Viscosity {
            factor,
            start: &start,
            velocity: &velocity,
            half: 0.5,
        };
        let mut damping = Damping::default();
        damping.begin(&body, &viscosity);
        damping.weigh(&body, &viscosity, &end);
        (damping.force().to_vec(), damping.energy(), damping)
    }

    fn largest(force: &[f64]) -> f64 {
        force.iter().fold(0.0, |m, f| m.max(f.abs()))
    }

    #[test]
    fn turning_by_any_angle_meets_no_force() {
        let mesh = generate::box_tets([2.0, 1.0, 1.0], [2, 1, 1], [0.0; 3]);
        let plate = generate::rect_triangles([2.0, 1.0], [2, 1], [0.0; 2]).unwrap();
        for angle in [0.1, 1.0, 2.5] {
            let about = |axis: Vector3<f64>| {
                move |p: &Point, t: f64| Rotation3::from_scaled_axis((0.3 + t * angle) * axis) * p + Vector3::x() * t
            };
            let (force, energy, _) = damped(&mesh, about(Vector3::new(2.0, -1.0, 2.0) / 3.0), 1.0);
            assert!(largest(&force) < 1e-9 && energy < 1e-9, "{angle}: {}", largest(&force));
            let (force, energy, _) = damped(&plate, about(Vector3::z()), 1.0);
            assert!(largest(&force) < 1e-9 && energy < 1e-9, "{angle}: {}", largest(&force));
        }
        let (force, energy, _) = damped(&mesh, |p, t| p * (1.0 + 0.1 * t), 1.0);
        assert!(largest(&force) > 100.0 && energy > 10.0, "stretching does");
    }

    #[test]
    fn the_force_has_no_sum_and_is_the_slope_of_its_energy() {
        let mesh = generate::box_tets([2.0, 1.0, 1.0], [2, 1, 1], [0.0; 3]);
        let motion = |p: &Point, t: f64| p + Point::new(p.y * p.y, -0.3 * p.x, p.x * p.z) * t;
        let (force, energy, _) = damped(&mesh, motion, 2.0);
        for axis in 0..3 {
            let sum: f64 = force.iter().skip(axis).step_by(3).sum();
            assert!(sum.abs() < 1e-10 * largest(&force));
        }
        // of a quadratic form
        let moved = mesh.rest_positions().iter().flat_map(|p| {
            let u = motion(p, 1.0) - motion(p, 0.0);
            [u.x, u.y, u.z]
        });
        let work: f64 = moved.zip(&force).map(|(u, f)| u * f).sum();
        assert!((work - 2.0 * energy).abs() < 1e-12 * work && work > 0.0);
    }

    #[test]
    fn without_damping_there_is_nothing() {
        let mesh = generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
        let (force, energy, damping) = damped(&mesh, |p, t| p * (1.0 + t), 0.0);
        assert!(force.is_empty() && energy == 0.0 && damping.warped.is_none());
    }
}
