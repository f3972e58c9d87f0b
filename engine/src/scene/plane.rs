//! What a scene may say about z, once it is known whether its mesh lies in a plane.

use super::check::Checked;
use super::{Axis, Component, InitialField, MethodName, NodalForces, Scene};
use crate::Expression;

const IN_PLANE: &str = "the mesh is planar: nothing moves along z";

impl Scene {
    /// Checks that the scene fits a mesh of two or three dimensions.
    pub(crate) fn check_dimension(&self, dimension: usize) -> Checked {
        for (key, given) in [
            ("plane", self.material.plane.is_some()),
            ("thickness", self.material.thickness.is_some()),
        ] {
            if given && dimension == 3 {
                let message = "the mesh is made of tetrahedra; only a planar mesh (triangles with z = 0) has this";
                return self.fail("material", 0, key, message);
            }
        }
        self.check_fixed_in(dimension)?;
        for (i, c) in self.cut.iter().enumerate().filter(|_| dimension == 2) {
            if matches!(c.method, MethodName::Collapse | MethodName::Merge) {
                let message = "the mesh is planar; \"delete\", \"subdivide\", \"snap\", \"hybrid\" cut triangles";
                return self.fail("cut", i, "method", message);
            }
            for (key, given) in [("improve", c.improve == Some(true)), ("relax", c.relax)] {
                if given {
                    return self.fail("cut", i, key, "the mesh is planar; only tetrahedra are improved");
                }
            }
        }
        for (i, l) in self.load.iter().enumerate() {
            for (key, vector) in [("gravity", &l.gravity), ("traction", &l.traction), ("force", &l.force)] {
                if let Some(vector) = vector {
                    self.check_expressions("load", i, key, &vector.0, dimension)?;
                }
            }
            if let Some(NodalForces::Here(forces)) = &l.nodal {
                for force in forces {
                    self.check_in_plane("load", i, "nodal", &force.0, dimension)?;
                }
            }
        }
        for (key, field) in [
            ("displacement", &self.initial.displacement),
            ("velocity", &self.initial.velocity),
        ] {
            if let Some(InitialField::Here(vector)) = field {
                self.check_expressions("initial", 0, key, &vector.0, dimension)?;
            }
        }
        if let (2, Some(i)) = (dimension, self.cut.iter().position(|c| c.blade.is_some())) {
            let message = "the mesh is planar, and a blade cuts tetrahedra; accepted: \"sweep\"";
            return self.fail("cut", i, "blade", message);
        }
        for (i, p) in self.probe.iter().enumerate() {
            self.check_in_plane("probe", i, "point", &p.point.0, dimension)?;
        }
        self.check_quantities_in(dimension)
    }

    fn check_fixed_in(&self, dimension: usize) -> Checked {
        for (i, f) in self.fixed.iter().enumerate() {
            let axes = f.axes.as_deref().unwrap_or(&"xyz"[..dimension]);
            if dimension == 2 && axes.contains('z') {
                let message = format!("\"{axes}\" is not accepted, {IN_PLANE}; letters x, y are");
                return self.fail("fixed", i, "axes", message);
            }
            match &f.displacement {
                Some(d) if d.len() == axes.chars().count() && d.len() < dimension => {}
                Some(d) if dimension == 3 && d.len() != 3 => {
                    let message = format!(
                        "{} components are given; 3 or one for each of \"{axes}\" are needed",
                        d.len()
                    );
                    return self.fail("fixed", i, "displacement", message);
                }
                Some(d) => self.check_expressions("fixed", i, "displacement", d, dimension)?,
                None => {}
            }
        }
        Ok(())
    }

    fn check_expressions(
        &self,
        section: &str,
        i: usize,
        key: &str,
        vector: &[Expression],
        dimension: usize,
    ) -> Checked {
        let zero =
            |e: &Expression| !e.uses_time() && !e.uses_place() && e.value(&kerfem_mesh::Point::zeros(), 0.0) == 0.0;
        match vector.get(2) {
            None if dimension == 3 => self.needs_three(section, i, key, vector.len()),
            Some(z) if dimension == 2 && !zero(z) => {
                let message = format!(
                    "\"{}\" along z is not accepted, {IN_PLANE}; two components, or 0",
                    z.shown()
                );
                self.fail(section, i, key, message)
            }
            _ => Ok(()),
        }
    }

    fn check_in_plane(&self, section: &str, i: usize, key: &str, vector: &[f64], dimension: usize) -> Checked {
        match vector.get(2) {
            None if dimension == 3 => self.needs_three(section, i, key, vector.len()),
            Some(z) if dimension == 2 && *z != 0.0 => {
                let message = format!("z = {z:?} does not lie in the plane z = 0 of the mesh");
                self.fail(section, i, key, message)
            }
            _ => Ok(()),
        }
    }

    fn needs_three(&self, section: &str, i: usize, key: &str, count: usize) -> Checked {
        self.fail(section, i, key, format!("{count} components are given; 3 are needed"))
    }

    fn check_quantities_in(&self, dimension: usize) -> Checked {
        for (i, q) in self.quantity.iter().enumerate() {
            if let Some(point) = &q.point {
                self.check_in_plane("quantity", i, "point", &point.0, dimension)?;
            }
            if let Some(crack) = &q.stress_intensity {
                self.check_in_plane("quantity", i, "KI", &crack.front.0, dimension)?;
                self.check_in_plane("quantity", i, "KI", &crack.normal.0, dimension)?;
            }
            if let Some(jump) = &q.jump {
                self.check_in_plane("quantity", i, "jump", &jump.at.0, dimension)?;
                self.check_in_plane("quantity", i, "jump", &jump.normal.0, dimension)?;
            }
            let along_z = [
                ("mean", q.mean == Some(Component::Uz)),
                ("max", q.max == Some(Component::Uz)),
                ("min", q.min == Some(Component::Uz)),
                ("component", q.component == Some(Component::Uz)),
                ("momentum", q.momentum == Some(Axis::Z)),
                ("reaction", q.reaction == Some(Axis::Z)),
            ];
            if let Some((key, _)) = along_z.iter().find(|(_, z)| *z && dimension == 2) {
                return self.fail("quantity", i, key, format!("z is not accepted, {IN_PLANE}"));
            }
            if dimension == 2 && q.angular_momentum.is_some_and(|axis| axis != Axis::Z) {
                let message = format!("an axis in the plane is not accepted, {IN_PLANE}; \"z\" is");
                return self.fail("quantity", i, "angular_momentum", message);
            }
        }
        Ok(())
    }
}
