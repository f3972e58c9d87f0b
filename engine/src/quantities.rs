//! Single numbers of a state (`[[quantity]]`).

use std::collections::BTreeMap;

use kerfem_mesh::{FacetSide, Point, VertexId};
use nalgebra::Vector3;

use crate::equilibrium::mass_times;
use crate::jump::jump;
use crate::momentum;
use crate::probes::locate;
use crate::state::nodal;
use crate::stress_intensity::stress_intensity;
use crate::{Axis, Component, EngineError, QuantitySpec, Simulation};

impl<const N: usize> Simulation<N> {
    /// The quantities of the scene at the present state; none where a quantity has no value (its `where` selects nothing).
    pub fn quantities(&self) -> BTreeMap<String, Option<f64>> {
        self.scene
            .quantity
            .iter()
            .map(|q| (q.name.clone(), self.quantity(q)))
            .collect()
    }

    /// Refuses a quantity that has no value: one of nothing, of a point outside, or of a support where there is none.
    pub(crate) fn check_quantities(&self) -> Result<(), EngineError> {
        for (i, q) in self.scene.quantity.iter().enumerate() {
            let fail = |key: &str, message: String| Err(self.scene.source.error("quantity", i, key, message));
            let nothing = |what: &str| format!("it selects no {what}; a selection must not be empty");
            if let Some(point) = &q.point {
                let p = Point::from(point.in_space());
                if locate(&self.mesh, &p, self.mesh.cell_ids()).is_none() {
                    return fail("point", format!("({}, {}, {}) does not lie in the mesh", p.x, p.y, p.z));
                }
            } else if q.jump.is_some() || q.stress_intensity.is_some() {
                // a cut to come may open there
            } else if q.energy.is_some() || q.momentum.is_some() || q.angular_momentum.is_some() {
                // of the whole body
            } else if q.mean.is_some() {
                if self.facets_of(q).next().is_none() {
                    return fail("where", nothing("boundary facet"));
                }
            } else if let Some(axis) = q.reaction {
                let count = self.vertices_of(q).count();
                if count == 0 {
                    return fail("where", nothing("vertex"));
                }
                if self.supports_of(axis, q).next().is_none() {
                    let axis = ["x", "y", "z"][axis as usize];
                    let message = format!(
                        "none of the {count} vertices it selects is fixed along {axis}; a [[fixed]] must hold at least one"
                    );
                    return fail("where", message);
                }
            } else if self.vertices_of(q).next().is_none() {
                return fail("where", nothing("vertex"));
            }
        }
        Ok(())
    }

    fn quantity(&self, q: &QuantitySpec) -> Option<f64> {
        if let Some(component) = q.mean {
            return self.mean(component, q);
        }
        if let Some(component) = q.max {
            return self
                .vertices_of(q)
                .map(|v| self.component(v, component))
                .reduce(f64::max);
        }
        if let Some(component) = q.min {
            return self
                .vertices_of(q)
                .map(|v| self.component(v, component))
                .reduce(f64::min);
        }
        if let Some(point) = &q.point {
            let (cell, weights) = locate(&self.mesh, &Point::from(point.in_space()), self.mesh.cell_ids())?;
            let u = self.assembler.interpolate(&self.mesh, cell, &weights, &self.state.u);
            let upwards = if N == 3 { Component::Uy } else { Component::Uz };
            return Some(u[q.component.unwrap_or(upwards) as usize]);
        }
        if let Some(spec) = &q.jump {
            let (at, normal) = (Point::from(spec.at.in_space()), Point::from(spec.normal.in_space()));
            let jump = jump(&self.mesh, &self.assembler, &self.state.u, &at, &normal)?;
            return Some(match q.component {
                Some(component) => jump[component as usize],
                None => jump.dot(&normal.normalize()),
            });
        }
        if let Some(axis) = q.reaction {
            return self.reaction(axis, q);
        }
        if let Some(axis) = q.momentum {
            let momentum = momentum::linear(&self.mesh, &self.assembler, &self.inertia(), &self.state.v);
            return Some(momentum[axis as usize]);
        }
        if let Some(axis) = q.angular_momentum {
            return Some(self.angular_momentum()[axis as usize]);
        }
        if let Some(crack) = &q.stress_intensity {
            return stress_intensity(&self.mesh, &self.assembler, &self.state.u, crack);
        }
        Some(self.energies.elastic)
    }

    /// About the origin (kg m²/s), of the mass that the body moves with: what a scheme keeps. Cuts keep that of the consistent mass.
    fn angular_momentum(&self) -> Vector3<f64> {
        let mut carried = vec![0.0; self.state.v.len()];
        mass_times(&self.body(), &self.state.v, &mut carried);
        let place = |v: VertexId| self.mesh.rest_position(v) + nodal(&self.state.u, v);
        let vertices = self.mesh.vertex_ids();
        vertices.map(|v| place(v).cross(&nodal(&carried, v))).sum()
    }

    fn component(&self, v: VertexId, component: Component) -> f64 {
        self.state.u[3 * v.index() + component as usize]
    }

    fn selects(&self, q: &QuantitySpec, v: VertexId) -> bool {
        q.r#where
            .as_ref()
            .is_none_or(|w| w.0.holds(&self.mesh.rest_position(v)))
    }

    fn vertices_of<'a>(&'a self, q: &'a QuantitySpec) -> impl Iterator<Item = VertexId> + 'a {
        self.mesh.vertex_ids().filter(|v| self.selects(q, *v))
    }

    /// Boundary facets whose vertices are all selected.
    fn facets_of<'a>(&'a self, q: &'a QuantitySpec) -> impl Iterator<Item = FacetSide> + 'a {
        let selected = |s: &FacetSide| self.mesh.facet_corners(*s).iter().all(|v| self.selects(q, *v));
        self.mesh.boundary_facets().filter(selected)
    }

    /// Selected vertices that are fixed along an axis.
    fn supports_of<'a>(&'a self, axis: Axis, q: &'a QuantitySpec) -> impl Iterator<Item = VertexId> + 'a {
        self.vertices_of(q)
            .filter(move |v| self.fixed.is_fixed(*v, axis as usize))
    }

    /// Mean over the boundary facets whose vertices are all selected, by rest area.
    fn mean(&self, component: Component, q: &QuantitySpec) -> Option<f64> {
        let (mut sum, mut area) = (0.0, 0.0);
        for side in self.facets_of(q) {
            let own = self.mesh.facet_normal(side).norm();
            area += own;
            let means = self.assembler.facet_means(&self.mesh, side);
            sum += own
                * means
                    .iter()
                    .map(|(v, mean)| mean * self.component(*v, component))
                    .sum::<f64>();
        }
        (area > 0.0).then(|| sum / area)
    }

    /// What the supports exert on the selected vertices (N); none if they hold none of them or nothing was solved for.
    fn reaction(&self, axis: Axis, q: &QuantitySpec) -> Option<f64> {
        let fixed = self.supports_of(axis, q);
        let reactions = fixed.map(|v| self.equilibrium.reaction(3 * v.index() + axis as usize));
        reactions.reduce(|sum, own| Some(sum? + own?)).flatten()
    }
}
