//! Single numbers of a state (`[[quantity]]`).

use std::collections::BTreeMap;

use kerfem_mesh::{Point, VertexId};

use crate::jump::jump;
use crate::probes::{interpolate, locate};
use crate::{Axis, Component, QuantitySpec, Simulation};

impl<const N: usize> Simulation<N> {
    /// The quantities of the scene at the present state; none where a quantity has no value (its `where` selects nothing).
    pub fn quantities(&self) -> BTreeMap<String, Option<f64>> {
        self.scene
            .quantity
            .iter()
            .map(|q| (q.name.clone(), self.quantity(q)))
            .collect()
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
            let u = interpolate(&self.mesh, cell, &weights, &self.state.u);
            let upwards = if N == 3 { Component::Uy } else { Component::Uz };
            return Some(u[q.component.unwrap_or(upwards) as usize]);
        }
        if let Some(spec) = &q.jump {
            let (at, normal) = (Point::from(spec.at.in_space()), Point::from(spec.normal.in_space()));
            let jump = jump(&self.mesh, &self.state.u, &at, &normal)?;
            return Some(match q.component {
                Some(component) => jump[component as usize],
                None => jump.dot(&normal.normalize()),
            });
        }
        if let Some(axis) = q.reaction {
            return self.reaction(axis, q);
        }
        Some(self.energies.elastic)
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

    /// Mean over the boundary facets whose vertices are all selected, by rest area.
    fn mean(&self, component: Component, q: &QuantitySpec) -> Option<f64> {
        let (mut sum, mut area) = (0.0, 0.0);
        for side in self.mesh.boundary_facets() {
            let corners = self.mesh.facet_corners(side);
            if corners.iter().all(|v| self.selects(q, *v)) {
                let corners = &corners[..N - 1];
                let own = self.mesh.facet_normal(side).norm();
                area += own;
                sum += own * corners.iter().map(|v| self.component(*v, component)).sum::<f64>() / corners.len() as f64;
            }
        }
        (area > 0.0).then(|| sum / area)
    }

    /// What the supports exert on the selected vertices (N); none if they hold none of them or nothing was solved for.
    fn reaction(&self, axis: Axis, q: &QuantitySpec) -> Option<f64> {
        let axis = axis as usize;
        let fixed = self.vertices_of(q).filter(|v| self.fixed.is_fixed(*v, axis));
        let reactions = fixed.map(|v| self.equilibrium.reaction(3 * v.index() + axis));
        reactions.reduce(|sum, own| Some(sum? + own?)).flatten()
    }
}
