//! The state of a body and how it follows a change of the mesh.

use std::collections::BTreeMap;

use kerfem_mesh::{MeshChange, SimplexMesh, VertexId, Weights};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Displacements, velocities and the clock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Displacement (m), flat: three entries a vertex slot.
    pub u: Vec<f64>,
    /// Velocity (m/s), flat: three entries a vertex slot.
    pub v: Vec<f64>,
    /// Time (s).
    pub time: f64,
    /// Steps done.
    pub step: usize,
    /// What rounding has added to the time so far (compensated summation).
    carry: f64,
}

/// Displacement and velocity of the moved vertices before a change.
pub(crate) type OldValues = BTreeMap<VertexId, (Vector3<f64>, Vector3<f64>)>;

/// Entry `v` of a flat nodal field.
#[inline]
pub(crate) fn nodal(field: &[f64], v: VertexId) -> Vector3<f64> {
    let i = 3 * v.index();
    Vector3::new(field[i], field[i + 1], field[i + 2])
}

pub(crate) fn set_nodal(field: &mut [f64], v: VertexId, value: &Vector3<f64>) {
    field[3 * v.index()..][..3].copy_from_slice(value.as_slice());
}

impl State {
    /// At rest at time zero, for a mesh of so many vertex slots.
    pub fn at_rest(vertex_slots: usize) -> Self {
        State {
            u: vec![0.0; 3 * vertex_slots],
            v: vec![0.0; 3 * vertex_slots],
            ..State::default()
        }
    }

    /// The time after another `dt` (s).
    pub(crate) fn time_after(&self, dt: f64) -> f64 {
        self.time + (dt - self.carry)
    }

    /// Moves the clock; many equal steps end where their sum does, to one rounding.
    pub(crate) fn advance_clock(&mut self, dt: f64) {
        let time = self.time_after(dt);
        self.carry = (time - self.time) - (dt - self.carry);
        self.time = time;
    }

    /// Carries both fields over a change: new and moved vertices take the weighted mean of their parents in the old fields.
    /// Slots of removed vertices keep their last values. Returns what the moved vertices had.
    pub(crate) fn apply<const N: usize>(&mut self, mesh: &SimplexMesh<N>, change: &MeshChange<N>) -> OldValues {
        let mean = |field: &[f64], weights: &Weights| {
            weights
                .iter()
                .fold(Vector3::zeros(), |sum, &(p, w)| sum + w * nodal(field, p))
        };
        // all values come from the old fields: nothing is written before everything is read
        let places = (change.vertices_added.iter().map(|a| (a.id, &a.parents)))
            .chain(change.vertices_moved.iter().map(|m| (m.id, &m.parents)));
        let new: Vec<_> = places.map(|(id, w)| (id, mean(&self.u, w), mean(&self.v, w))).collect();
        let old = change
            .vertices_moved
            .iter()
            .map(|m| (m.id, (nodal(&self.u, m.id), nodal(&self.v, m.id))));
        let old = old.collect();
        self.u.resize(3 * mesh.vertex_slots(), 0.0);
        self.v.resize(3 * mesh.vertex_slots(), 0.0);
        for (id, u, v) in &new {
            set_nodal(&mut self.u, *id, u);
            set_nodal(&mut self.v, *id, v);
        }
        old
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kerfem_mesh::{AddedVertex, Edit, MovedVertex, Point, generate};

    #[test]
    fn many_steps_add_up() {
        let mut state = State::at_rest(0);
        (0..1_000_000).for_each(|_| state.advance_clock(0.1));
        assert!((state.time - 1e5).abs() <= 1e5 * f64::EPSILON);
    }

    #[test]
    fn new_values_come_from_the_old_field_alone() {
        let mut mesh = generate::box_tets([1.0; 3], [1; 3], [0.0; 3]);
        let mut state = State::at_rest(8);
        state.u = (0..24).map(f64::from).collect();
        let (a, b) = (VertexId(0), VertexId(7));
        let weights = vec![(a, 0.5), (b, 0.5)];
        let change = MeshChange {
            vertices_moved: vec![MovedVertex {
                id: a,
                old_rest_position: Point::zeros(),
                parents: weights.clone(),
            }],
            vertices_added: vec![AddedVertex {
                id: VertexId(8),
                parents: weights,
            }],
            ..MeshChange::default()
        };
        let mut edit = Edit::new(&mut mesh);
        edit.add_vertex(Point::repeat(0.5), &vec![(a, 0.5), (b, 0.5)]);
        edit.commit();
        let old = state.apply(&mesh, &change);
        assert_eq!(nodal(&state.u, a), Vector3::new(10.5, 11.5, 12.5));
        assert_eq!(nodal(&state.u, VertexId(8)), Vector3::new(10.5, 11.5, 12.5));
        assert_eq!(old[&a].0, Vector3::new(0.0, 1.0, 2.0));
    }
}
