//! Loads.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::{AddAssign, Div};

use kerfem_fem::{Assembler, load};
use kerfem_mesh::{CellId, FacetLabel, FacetSide, MeshChange, Point, SimplexMesh, VertexId};
use nalgebra::Vector3;

use serde::{Deserialize, Serialize};

use super::Selector;
use super::copies::Copies;
use crate::input::MeshInput;
use crate::selections::{Extent, Selected};
use crate::{Components, EngineError, Expression, LoadSpec, MassKind, Scene};

/// What a load acts on.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Place {
    Body,
    /// Flags by original boundary facet, and the facets that descend from them now.
    Facets {
        labels: Vec<bool>,
        sides: BTreeSet<FacetSide>,
    },
    /// The share of the total force that each vertex takes; they add up to one.
    Vertices(BTreeMap<VertexId, f64>),
    /// The force (N) on each vertex.
    Nodal(BTreeMap<VertexId, Vector3<f64>>),
}

/// What acts there.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Action {
    /// Acceleration (m/s²), traction (Pa) or total force (N).
    Vector([Expression; 3]),
    Pressure(Expression),
    /// The forces of the vertices themselves.
    Nodal,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct Load {
    place: Place,
    action: Action,
}

/// All loads of a body. They are dead: they keep their direction and act per rest area.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Loads {
    loads: Vec<Load>,
    shared: Shared,
}

/// What all loads of a body have in common.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Shared {
    /// Of a planar body (m), else 1: facet loads are given per area of the boundary, which is length times this.
    thickness: f64,
    /// Whether gravity acts on the consistent mass: where nothing is accelerated by the lumped one.
    consistent_gravity: bool,
}

/// A load that has no finite value.
#[derive(Debug, thiserror::Error)]
#[error("load[{index}].{key}: {message}")]
pub(crate) struct NotFinite {
    index: usize,
    key: &'static str,
    message: String,
}

impl Loads {
    pub(crate) fn new<const N: usize>(scene: &Scene, input: &MeshInput<N>) -> Result<Self, EngineError> {
        let mut loads = Vec::with_capacity(scene.load.len());
        for (index, spec) in scene.load.iter().enumerate() {
            let (source, section) = (&scene.source, "load");
            loads.push(Load::new(
                &Selector {
                    input,
                    source,
                    section,
                    index,
                },
                spec,
            )?);
        }
        let moves = scene.time.scheme.steps() && scene.model.mass == MassKind::Lumped;
        let shared = Shared {
            thickness: scene.material.thickness.unwrap_or(1.0),
            consistent_gravity: scene.model.order == 2 && !moves,
        };
        Ok(Loads { loads, shared })
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.loads.len()
    }

    /// Whether loads that were stored fit a mesh.
    pub(crate) fn fit<const N: usize>(&self, mesh: &SimplexMesh<N>) -> bool {
        self.loads.iter().all(|l| match &l.place {
            Place::Body => matches!(l.action, Action::Vector(_)),
            Place::Facets { labels, sides } => {
                let carried = mesh.boundary_facets().filter(|s| carries(mesh, *s, labels));
                !matches!(l.action, Action::Nodal)
                    && labels.len() == mesh.original_facets().len()
                    && carried.eq(sides.iter().copied())
            }
            Place::Vertices(shares) => {
                matches!(l.action, Action::Vector(_)) && shares.keys().all(|v| mesh.has_vertex(*v))
            }
            Place::Nodal(forces) => matches!(l.action, Action::Nodal) && forces.keys().all(|v| mesh.has_vertex(*v)),
        })
    }

    /// Whether any load varies with time.
    pub(crate) fn uses_time(&self) -> bool {
        self.loads.iter().any(Load::uses_time)
    }

    /// Whether the total force is the same however the facets it acts on are divided.
    pub(crate) fn is_uniform(&self) -> bool {
        self.loads
            .iter()
            .all(|l| !l.expressions().iter().any(|e| e.uses_place()))
    }

    /// Which loads act on a facet of the original boundary: one bit for each of the first 61.
    pub(crate) fn on_facet(&self, label: FacetLabel) -> u64 {
        let acts = |l: &Load| match (&l.place, label.some()) {
            (Place::Facets { labels, .. }, Some(k)) => labels[k],
            _ => false,
        };
        self.loads
            .iter()
            .take(61)
            .enumerate()
            .fold(0, |bits, (i, l)| bits | u64::from(acts(l)) << i)
    }

    /// Whether a load acts on a vertex itself.
    pub(crate) fn on_vertex(&self, v: VertexId) -> bool {
        self.loads.iter().any(|l| match &l.place {
            Place::Vertices(shares) => shares.contains_key(&v),
            Place::Nodal(forces) => forces.contains_key(&v),
            Place::Body | Place::Facets { .. } => false,
        })
    }

    /// What each load acts on, in the order of the scene.
    pub(crate) fn selected<const N: usize>(&self, mesh: &SimplexMesh<N>) -> Vec<Selected> {
        let thickness = self.shared.thickness;
        let selected = |l: &Load| {
            let extent = match &l.place {
                Place::Body => Extent::of_cells(mesh, mesh.cell_ids(), thickness),
                Place::Facets { sides, .. } => Extent::of_facets(mesh, sides.iter().copied(), thickness),
                Place::Vertices(shares) => Extent::of_vertices(mesh, shares.keys().copied()),
                Place::Nodal(forces) => Extent::of_vertices(mesh, forces.keys().copied()),
            };
            let (key, uses_time) = (l.key(), l.uses_time());
            Selected { extent, key, uses_time }
        };
        self.loads.iter().map(selected).collect()
    }

    /// The sum (N) of one load at time `t`.
    pub(crate) fn total<const N: usize>(
        &self,
        index: usize,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
        t: f64,
    ) -> Vector3<f64> {
        let mut f = vec![0.0; 3 * mesh.vertex_slots()];
        let _ = self.loads[index].add(mesh, assembler, self.shared, t, &mut f);
        f.as_chunks::<3>().0.iter().map(|f| Vector3::from(*f)).sum()
    }

    /// Replaces the vector of a load: gravity (m/s²), traction (Pa) or total force (N); false for another load or none.
    pub(crate) fn set_vector(&mut self, index: usize, vector: [f64; 3]) -> bool {
        match self.loads.get_mut(index).map(|l| &mut l.action) {
            Some(Action::Vector(own)) => {
                *own = vector.map(Expression::constant);
                true
            }
            _ => false,
        }
    }

    /// The nodal forces (N, flat, 3 a vertex slot) at time `t`; overwrites `f`.
    ///
    /// # Errors
    /// The first load that has no finite value.
    pub(crate) fn force<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
        t: f64,
        f: &mut [f64],
    ) -> Result<(), NotFinite> {
        f.fill(0.0);
        for (index, load) in self.loads.iter().enumerate() {
            load.add(mesh, assembler, self.shared, t, f).map_err(|message| {
                let key = load.key();
                NotFinite { index, key, message }
            })?;
        }
        Ok(())
    }

    /// Refuses a load that has no finite value at the start or the end, as far as the scene alone can tell.
    pub(crate) fn check_values<const N: usize>(
        &self,
        scene: &Scene,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
    ) -> Result<(), EngineError> {
        let mut f = vec![0.0; 3 * mesh.vertex_slots()];
        for t in [0.0, scene.time.end.unwrap_or(0.0)] {
            self.force(mesh, assembler, t, &mut f)
                .map_err(|e| scene.source.error("load", e.index, e.key, e.message))?;
        }
        Ok(())
    }

    /// Follows a change of the mesh: facets keep their load in their descendants, a doubled vertex shares its force
    /// equally with its copies, a merged one passes it on.
    pub(crate) fn follow<const N: usize>(&mut self, mesh: &SimplexMesh<N>, change: &MeshChange<N>) {
        for load in &mut self.loads {
            match &mut load.place {
                Place::Body => {}
                Place::Facets { labels, sides } => follow_facets(labels, sides, mesh, change),
                Place::Vertices(shares) => follow_vertices(shares, mesh, change),
                Place::Nodal(forces) => follow_vertices(forces, mesh, change),
            }
        }
    }
}

impl Load {
    fn new<const N: usize>(select: &Selector<'_, N>, spec: &LoadSpec) -> Result<Self, EngineError> {
        let vector = |v: &Components<Expression>| Action::Vector(v.in_space());
        if let Some(g) = &spec.gravity {
            return Ok(Load {
                place: Place::Body,
                action: vector(g),
            });
        }
        if let Some(force) = &spec.force {
            let flags = select.force(spec)?;
            let mesh = &select.input.mesh;
            // a vertex without cells has no equation that could take a force
            let takes = |v: &VertexId| flags[v.index()] && !mesh.cells_of_vertex(*v).is_empty();
            let members: Vec<VertexId> = mesh.vertex_ids().filter(takes).collect();
            if members.is_empty() {
                return select.fail(
                    "force",
                    "it acts on vertices of no cell only; at least one must belong to a cell",
                );
            }
            let share = 1.0 / members.len() as f64;
            let place = Place::Vertices(members.into_iter().map(|v| (v, share)).collect());
            return Ok(Load {
                place,
                action: vector(force),
            });
        }
        if let Some(nodal) = &spec.nodal {
            return Ok(Load {
                place: Place::Nodal(select.nodal(nodal, spec)?),
                action: Action::Nodal,
            });
        }
        let labels = select.facets(spec)?;
        let mesh = &select.input.mesh;
        let sides = mesh.boundary_facets().filter(|s| carries(mesh, *s, &labels)).collect();
        let action = match (&spec.traction, &spec.pressure) {
            (Some(t), _) => vector(t),
            (None, Some(p)) => Action::Pressure(p.clone()),
            (None, None) => return select.fail("traction", "no load is given"),
        };
        Ok(Load {
            place: Place::Facets { labels, sides },
            action,
        })
    }

    fn uses_time(&self) -> bool {
        self.expressions().iter().any(|e| e.uses_time())
    }

    fn expressions(&self) -> &[Expression] {
        match &self.action {
            Action::Vector(v) => v,
            Action::Pressure(p) => std::slice::from_ref(p),
            Action::Nodal => &[],
        }
    }

    fn add<const N: usize>(
        &self,
        mesh: &SimplexMesh<N>,
        assembler: &Assembler<N>,
        shared: Shared,
        t: f64,
        f: &mut [f64],
    ) -> Result<(), String> {
        let thickness = shared.thickness;
        // the first expression without a finite value, and where
        let fault: Cell<Option<(&Expression, Option<Point>)>> = Cell::new(None);
        let value = |e, place: Option<Point>| -> f64 {
            let value = Expression::value(e, &place.unwrap_or_default(), t);
            if !value.is_finite() && fault.get().is_none() {
                fault.set(Some((e, place)));
            }
            value
        };
        match (&self.place, &self.action) {
            (Place::Body, Action::Vector(g)) => {
                let g = g.each_ref().map(|e| value(e, None));
                match shared.consistent_gravity {
                    true => load::add_consistent_gravity(mesh, assembler, g, f),
                    false => load::add_gravity(mesh, assembler, g, f),
                }
            }
            (Place::Facets { sides, .. }, Action::Vector(traction)) => {
                let traction = |p| traction.each_ref().map(|e| thickness * value(e, Some(p)));
                load::add_traction(mesh, assembler, sides.iter().copied(), traction, f);
            }
            (Place::Facets { sides, .. }, Action::Pressure(pressure)) => {
                for side in sides {
                    let outward = mesh.facet_normal(*side).normalize();
                    let traction = |p| (outward * (-thickness * value(pressure, Some(p)))).into();
                    load::add_traction(mesh, assembler, [*side], traction, f);
                }
            }
            (Place::Vertices(shares), Action::Vector(total)) => {
                let total = total.each_ref().map(|e| value(e, None));
                for (v, share) in shares {
                    for axis in 0..3 {
                        f[3 * v.index() + axis] += share * total[axis];
                    }
                }
            }
            (Place::Nodal(forces), _) => {
                for (v, force) in forces {
                    for axis in 0..3 {
                        f[3 * v.index() + axis] += force[axis];
                    }
                }
            }
            (Place::Body | Place::Vertices(_), Action::Pressure(_)) | (_, Action::Nodal) => {}
        }
        match (fault.get(), f.iter().position(|x| !x.is_finite())) {
            (Some((e, None)), _) => Err(format!("\"{}\" has no finite value at t = {t} s", e.shown())),
            (Some((e, Some(p))), _) => Err(format!(
                "\"{}\" has no finite value at ({}, {}, {}) and t = {t} s",
                e.shown(),
                p.x,
                p.y,
                p.z
            )),
            (None, Some(dof)) => Err(format!("the force at vertex {} is too large to be finite", dof / 3)),
            (None, None) => Ok(()),
        }
    }

    /// The key of the scene that says what acts.
    fn key(&self) -> &'static str {
        match (&self.place, &self.action) {
            (_, Action::Pressure(_)) => "pressure",
            (Place::Body, _) => "gravity",
            (Place::Facets { .. }, _) => "traction",
            (Place::Vertices(_), _) => "force",
            (Place::Nodal(_), _) => "nodal",
        }
    }
}

fn carries<const N: usize>(mesh: &SimplexMesh<N>, side: FacetSide, labels: &[bool]) -> bool {
    mesh.facet_labels(side.cell)[side.local as usize]
        .some()
        .is_some_and(|i| labels[i])
}

fn follow_facets<const N: usize>(
    labels: &[bool],
    sides: &mut BTreeSet<FacetSide>,
    mesh: &SimplexMesh<N>,
    change: &MeshChange<N>,
) {
    let all = |cell: CellId| (0..N as u8).map(move |local| FacetSide { cell, local });
    for cell in &change.cells_removed {
        for side in all(cell.id) {
            sides.remove(&side);
        }
    }
    for cell in &change.cells_added {
        sides.extend(all(cell.id).filter(|s| carries(mesh, *s, labels)));
    }
}

/// A vertex that is doubled shares what acts on it equally with its copies, one that is merged passes it on.
fn follow_vertices<T: Copy + Default + AddAssign + Div<f64, Output = T>, const N: usize>(
    acting: &mut BTreeMap<VertexId, T>,
    mesh: &SimplexMesh<N>,
    change: &MeshChange<N>,
) {
    let copies = Copies::of(change);
    let mut copies_of: BTreeMap<VertexId, Vec<VertexId>> = BTreeMap::new();
    for v in &change.vertices_added {
        if let Some(original) = copies.original(v).filter(|o| acting.contains_key(o)) {
            copies_of.entry(original).or_default().push(v.id);
        }
    }
    for (original, mut all) in copies_of {
        if mesh.has_vertex(original) {
            all.push(original);
        }
        let share = acting.remove(&original).unwrap_or_default() / all.len() as f64;
        acting.extend(all.into_iter().map(|v| (v, share)));
    }
    for v in &change.vertices_removed {
        if let (Some(share), Some(target)) = (acting.remove(&v.id), v.merged_into) {
            *acting.entry(target).or_default() += share;
        }
    }
}
