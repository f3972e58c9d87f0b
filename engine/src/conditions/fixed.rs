//! Prescribed displacements.

use std::collections::BTreeMap;

use kerfem_mesh::{AddedVertex, FacetSide, MeshChange, Midpoints, Point, SimplexMesh, VertexId};

use serde::{Deserialize, Serialize};

use super::Selector;
use super::copies::Copies;
use crate::input::MeshInput;
use crate::selections::Extent;
use crate::{Condition, EngineError, Expression, Scene};

/// No set prescribes this component.
const FREE: u32 = u32::MAX;

/// One `[[fixed]]`: who belongs to it and what it prescribes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct FixedSet {
    /// Membership by vertex slot. Removed vertices keep theirs: it tells which original facets lie in the set.
    members: Vec<bool>,
    /// Decides about new and moved vertices, where the set was given by one.
    condition: Option<Condition>,
    axes: [bool; 3],
    displacement: [Expression; 3],
}

/// All prescribed displacements: which dofs, and their values over time. In the plane, displacements along z are zero.
#[derive(Clone, Debug)]
pub(crate) struct FixedDofs<const N: usize = 4> {
    sets: Vec<FixedSet>,
    /// By set, whether its vertices were given one by one.
    listed: Vec<bool>,
    /// For each vertex slot and axis the set that prescribes it, or `FREE`.
    owner: Vec<[u32; 3]>,
    /// Middles of edges of order 2 that no set holds where both ends are held.
    middles: BTreeMap<VertexId, Middle>,
    mask: Vec<bool>,
}

/// The middle of an edge of the original boundary whose ends are held by different sets given one by one: a displacement that
/// is given vertex by vertex is meant for what lies between them too. It follows the mean of the ends.
#[derive(Clone, Debug)]
struct Middle {
    ends: [VertexId; 2],
    /// Those that both ends are held along, and the middle by no set.
    axes: [bool; 3],
}

impl<const N: usize> FixedDofs<N> {
    /// The mask of a vertex that belongs to no set.
    const NONE: [bool; 3] = [false, false, N == 3];

    fn listed(scene: &Scene) -> Vec<bool> {
        scene.fixed.iter().map(|spec| spec.vertices.is_some()).collect()
    }

    pub(crate) fn new(scene: &Scene, input: &MeshInput<N>) -> Result<Self, EngineError> {
        let mut sets = Vec::with_capacity(scene.fixed.len());
        for (index, spec) in scene.fixed.iter().enumerate() {
            let (source, section) = (&scene.source, "fixed");
            let members = Selector {
                input,
                source,
                section,
                index,
            }
            .fixed(spec)?;
            let letters = spec.axes.as_deref().unwrap_or(&"xyz"[..N - 1]);
            let axes = ["x", "y", "z"].map(|a| letters.contains(a));
            let mut displacement = [(); 3].map(|()| Expression::constant(0.0));
            if let Some(given) = &spec.displacement {
                let all = given.len() >= N - 1;
                for (k, letter) in letters.chars().enumerate() {
                    let axis = "xyz".find(letter).unwrap_or(0);
                    displacement[axis] = given[if all { axis } else { k }].clone();
                }
            }
            let condition = spec.r#where.clone();
            sets.push(FixedSet {
                members,
                condition,
                axes,
                displacement,
            });
        }
        let mut fixed = FixedDofs {
            sets,
            listed: Self::listed(scene),
            owner: Vec::new(),
            middles: BTreeMap::new(),
            mask: Vec::new(),
        };
        fixed.refresh_all(&input.mesh, None);
        fixed.check_values(scene, &input.mesh)?;
        Ok(fixed)
    }

    /// The sets, to be stored; what else there is follows from them.
    pub(crate) fn sets(&self) -> &[FixedSet] {
        &self.sets
    }

    /// Takes back the stored sets of a scene.
    ///
    /// # Errors
    /// What does not fit the mesh.
    pub(crate) fn restored(
        scene: &Scene,
        sets: Vec<FixedSet>,
        mesh: &SimplexMesh<N>,
        midpoints: Option<&Midpoints<N>>,
    ) -> Result<Self, String> {
        if sets.iter().any(|s| s.members.len() != mesh.vertex_slots()) {
            return Err("a fixed set is of another mesh".into());
        }
        let mut fixed = FixedDofs {
            sets,
            listed: Self::listed(scene),
            owner: Vec::new(),
            middles: BTreeMap::new(),
            mask: Vec::new(),
        };
        fixed.refresh_all(mesh, midpoints);
        Ok(fixed)
    }

    /// Takes the mid-edge vertices of order 2 into the sets: those that satisfy the condition of a set, of another set those
    /// between two of its vertices, as the field along such an edge is prescribed. For those between vertices of different sets
    /// see [`Middle`].
    pub(crate) fn add_midpoints(&mut self, mesh: &SimplexMesh<N>, midpoints: &Midpoints<N>) {
        for set in &mut self.sets {
            set.members.resize(mesh.vertex_slots(), false);
            for (v, ends) in midpoints.edges() {
                set.members[v.index()] = match &set.condition {
                    Some(condition) => condition.0.holds(&mesh.rest_position(v)),
                    None => ends.iter().all(|e| set.members[e.index()]),
                };
            }
        }
        self.refresh_all(mesh, Some(midpoints));
    }

    fn refresh_all(&mut self, mesh: &SimplexMesh<N>, midpoints: Option<&Midpoints<N>>) {
        self.owner = vec![[FREE; 3]; mesh.vertex_slots()];
        self.mask = Self::NONE.repeat(mesh.vertex_slots());
        for v in mesh.vertex_ids() {
            self.refresh(v);
        }
        for (v, _) in midpoints.iter().flat_map(|m| m.edges()) {
            self.hold_middle(mesh, midpoints, v);
        }
    }

    fn check_values(&self, scene: &Scene, mesh: &SimplexMesh<N>) -> Result<(), EngineError> {
        let end = scene.time.end.unwrap_or(0.0);
        for v in mesh.vertex_ids() {
            let place = mesh.rest_position(v);
            for (axis, &owner) in self.owner[v.index()].iter().enumerate() {
                let Some(set) = self.sets.get(owner as usize) else {
                    continue;
                };
                let e = &set.displacement[axis];
                if !(e.value(&place, 0.0).is_finite() && e.value(&place, end).is_finite()) {
                    let message = format!("\"{}\" has no finite value at vertex {}", e.shown(), v.0);
                    return Err(scene.source.error("fixed", owner as usize, "displacement", message));
                }
            }
        }
        Ok(())
    }

    /// One line for each two sets of which the later one prescribes another displacement of a vertex and wins.
    pub(crate) fn conflicts(&self, scene: &Scene, mesh: &SimplexMesh<N>) -> Vec<String> {
        let end = scene.time.end.unwrap_or(0.0);
        // by loser and winner: the vertices, ascending, and what is told of the first
        let mut pairs: BTreeMap<[usize; 2], (Vec<VertexId>, String)> = BTreeMap::new();
        for v in mesh.vertex_ids() {
            for (axis, &owner) in self.owner[v.index()].iter().enumerate().filter(|(_, o)| **o != FREE) {
                let held = |i: &usize| self.sets[*i].axes[axis] && self.sets[*i].members[v.index()];
                for loser in (0..owner as usize).filter(held) {
                    let pair = [loser, owner as usize];
                    let Some(difference) = self.difference(pair, axis, &mesh.rest_position(v), end) else {
                        continue;
                    };
                    let first = || format!("along {} at vertex {} first ({difference})", ["x", "y", "z"][axis], v.0);
                    let (vertices, _) = pairs.entry(pair).or_insert_with(|| (Vec::new(), first()));
                    vertices.push(v);
                }
            }
        }
        let lines = pairs.into_iter().map(|([loser, winner], (mut vertices, first))| {
            vertices.dedup();
            let count = match vertices.len() {
                1 => "1 vertex".into(),
                n => format!("{n} vertices"),
            };
            format!(
                "fixed[{loser}] and fixed[{winner}] prescribe different displacements at {count}, {first}: the later one wins"
            )
        });
        lines.collect()
    }

    /// How what two sets prescribe differs by more than rounding, at the first of five times from the start to the end.
    fn difference(&self, pair: [usize; 2], axis: usize, place: &Point, end: f64) -> Option<String> {
        let times = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * end);
        times.into_iter().find_map(|t| {
            let [a, b] = pair.map(|i| self.sets[i].displacement[axis].value(place, t));
            let differ = (a - b).abs() > 1e-12 * a.abs().max(b.abs());
            differ.then(|| format!("{a} and {b} m at t = {t} s"))
        })
    }

    /// One flag a dof: whether it is prescribed.
    pub(crate) fn mask(&self) -> &[bool] {
        &self.mask
    }

    /// What each set holds, and along which axes, in the order of the scene.
    pub(crate) fn selected(&self, mesh: &SimplexMesh<N>) -> Vec<(Extent, String)> {
        let extent = |s: &FixedSet| {
            let members = mesh.vertex_ids().filter(|v| s.members[v.index()]);
            Extent::of_vertices(mesh, members)
        };
        let letters = |s: &FixedSet| (0..3).filter(|&k| s.axes[k]).map(|k| ['x', 'y', 'z'][k]).collect();
        self.sets.iter().map(|s| (extent(s), letters(s))).collect()
    }

    /// Whether a component of a vertex is prescribed.
    pub(crate) fn is_fixed(&self, v: VertexId, axis: usize) -> bool {
        self.mask[3 * v.index() + axis]
    }

    /// Which components are prescribed at all corners of a facet: one bit an axis.
    pub(crate) fn on_facet(&self, corners: [VertexId; 3]) -> u64 {
        (0..3).fold(0, |bits, axis| {
            bits | u64::from(corners.iter().all(|&v| self.is_fixed(v, axis))) << axis
        })
    }

    /// Whether any component of a vertex is prescribed.
    pub(crate) fn holds(&self, v: VertexId) -> bool {
        self.owner[v.index()] != [FREE; 3]
    }

    /// Replaces what the set `index` prescribes (m).
    pub(crate) fn set_displacement(&mut self, index: usize, displacement: [f64; 3]) -> bool {
        match self.sets.get_mut(index) {
            Some(set) => {
                set.displacement = displacement.map(Expression::constant);
                true
            }
            None => false,
        }
    }

    /// Writes the prescribed displacements at time `t` into `u` (flat, 3 a vertex slot).
    ///
    /// # Errors
    /// The vertex and the expression that has no finite value.
    pub(crate) fn prescribe(&self, mesh: &SimplexMesh<N>, t: f64, u: &mut [f64]) -> Result<(), String> {
        self.evaluate(mesh, u, |displacement, place| displacement.value(place, t))
    }

    /// By how much the velocities (m/s) of the prescribed dofs at time `t` exceed their mean over the `dt` before, to the second
    /// order in `dt`: from displacements at both ends of that time and half-way.
    pub(crate) fn prescribe_gain(
        &self,
        mesh: &SimplexMesh<N>,
        t: f64,
        dt: f64,
        gain: &mut [f64],
    ) -> Result<(), String> {
        self.evaluate(mesh, gain, |displacement, place| {
            let at = |t: f64| displacement.value(place, t);
            match displacement.uses_time() {
                true => 2.0 * (at(t) - 2.0 * at(t - 0.5 * dt) + at(t - dt)) / dt,
                false => 0.0,
            }
        })
    }

    /// Writes what `value` makes of a displacement at a rest position into `out`, for each prescribed dof.
    ///
    /// # Errors
    /// The first value that is not finite, in words.
    fn evaluate(
        &self,
        mesh: &SimplexMesh<N>,
        out: &mut [f64],
        value: impl Fn(&Expression, &Point) -> f64,
    ) -> Result<(), String> {
        for (v, owners) in self.owner.iter().enumerate().filter(|(_, o)| **o != [FREE; 3]) {
            for (axis, &owner) in owners.iter().enumerate() {
                let Some(set) = self.sets.get(owner as usize) else {
                    continue;
                };
                let displacement = &set.displacement[axis];
                out[3 * v + axis] = value(displacement, &mesh.rest_positions()[v]);
                if !out[3 * v + axis].is_finite() {
                    let text = displacement.shown();
                    return Err(format!("the displacement \"{text}\" of vertex {v} has no finite value"));
                }
            }
        }
        for (v, Middle { ends, axes }) in &self.middles {
            for axis in (0..3).filter(|&axis| axes[axis]) {
                let [a, b] = ends.map(|e| out[3 * e.index() + axis]);
                out[3 * v.index() + axis] = (a + b) / 2.0;
            }
        }
        Ok(())
    }

    /// Follows a change of the mesh (INTERFACE "Sets after a cut"); of order 2 `midpoints` have followed already.
    ///
    /// A set given by a condition takes new and moved vertices whose rest position satisfies it. Another set takes copies
    /// of its vertices, and new vertices whose parents all belong to it and that lie on a descendant of an original
    /// boundary facet whose vertices all belong to it.
    pub(crate) fn follow(&mut self, mesh: &SimplexMesh<N>, midpoints: Option<&Midpoints<N>>, change: &MeshChange<N>) {
        let copies = Copies::of(change);
        for set in &mut self.sets {
            set.members.resize(mesh.vertex_slots(), false);
            for v in &change.vertices_added {
                set.members[v.id.index()] = set.takes(mesh, midpoints, v, &copies);
            }
            if let Some(condition) = &set.condition {
                for v in &change.vertices_moved {
                    set.members[v.id.index()] = condition.0.holds(&mesh.rest_position(v.id));
                }
            }
        }
        self.owner.resize(mesh.vertex_slots(), [FREE; 3]);
        let slots = self.mask.len() / 3..mesh.vertex_slots();
        self.mask.extend(slots.flat_map(|_| Self::NONE));
        let added = change.vertices_added.iter().map(|v| v.id);
        let renewed = added.chain(change.vertices_moved.iter().map(|v| v.id));
        renewed.clone().for_each(|v| self.refresh(v));
        renewed.for_each(|v| self.hold_middle(mesh, midpoints, v));
        for v in &change.vertices_removed {
            self.owner[v.id.index()] = [FREE; 3];
            self.middles.remove(&v.id);
            self.mask[3 * v.id.index()..][..3].copy_from_slice(&Self::NONE);
        }
    }

    fn refresh(&mut self, v: VertexId) {
        let mut owner = [FREE; 3];
        for (i, set) in self.sets.iter().enumerate().filter(|(_, s)| s.members[v.index()]) {
            for axis in (0..3).filter(|&a| set.axes[a]) {
                owner[axis] = i as u32;
            }
        }
        self.owner[v.index()] = owner;
        let mask = [0, 1, 2].map(|axis| Self::NONE[axis] || owner[axis] != FREE);
        self.mask[3 * v.index()..][..3].copy_from_slice(&mask);
    }

    /// Holds a vertex as a [`Middle`], if it is one, once all owners are known.
    fn hold_middle(&mut self, mesh: &SimplexMesh<N>, midpoints: Option<&Midpoints<N>>, v: VertexId) {
        self.middles.remove(&v);
        let Some((midpoints, ends)) = midpoints.and_then(|m| Some((m, m.ends_of(mesh, v)?))) else {
            return;
        };
        let owner = |v: VertexId, axis: usize| self.owner[v.index()][axis];
        let is_listed = |owner: u32| self.listed.get(owner as usize) == Some(&true);
        let axes = [0, 1, 2].map(|axis| {
            let [a, b] = ends.map(|e| owner(e, axis));
            owner(v, axis) == FREE && a != b && is_listed(a) && is_listed(b)
        });
        let is_original = |side: FacetSide| mesh.facet_labels(side.cell)[side.local as usize].some().is_some();
        if axes.contains(&true) && midpoints.boundary_facets_of(mesh, v).any(is_original) {
            for axis in (0..3).filter(|&axis| axes[axis]) {
                self.mask[3 * v.index() + axis] = true;
            }
            self.middles.insert(v, Middle { ends, axes });
        }
    }
}

impl FixedSet {
    fn takes<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        midpoints: Option<&Midpoints<N>>,
        v: &AddedVertex,
        copies: &Copies<'_>,
    ) -> bool {
        if let Some(condition) = &self.condition {
            return condition.0.holds(&mesh.rest_position(v.id));
        }
        if let Some(original) = copies.original(v) {
            return self.members[original.index()];
        }
        let is_held = |side: FacetSide| {
            let label = mesh.facet_labels(side.cell)[side.local as usize];
            let original = label.some().map(|i| mesh.original_facets()[i]);
            original.is_some_and(|f| f.iter().all(|w| self.members[w.index()]))
        };
        let on_its_boundary = || match midpoints {
            Some(midpoints) => midpoints.boundary_facets_of(mesh, v.id).any(is_held),
            None => mesh.boundary_facets_of_vertex(v.id).any(is_held),
        };
        v.parents.iter().all(|(p, _)| self.members[p.index()]) && on_its_boundary()
    }
}
