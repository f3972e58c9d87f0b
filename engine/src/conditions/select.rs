//! Selections of a scene as vertices and boundary facets of its mesh.

use std::collections::BTreeMap;

use kerfem_mesh::{FacetLabel, VertexId};
use nalgebra::Vector3;

use crate::input::{MeshInput, point_array};
use crate::scene::source::Source;
use crate::{Condition, EngineError, FixedSpec, LoadSpec, NodalForces};

/// Resolves the selections of one section of a scene.
pub(crate) struct Selector<'a, const N: usize> {
    pub(crate) input: &'a MeshInput<N>,
    pub(crate) source: &'a Source,
    pub(crate) section: &'static str,
    pub(crate) index: usize,
}

impl<const N: usize> Selector<'_, N> {
    pub(super) fn fail<T>(&self, key: &str, message: impl Into<String>) -> Result<T, EngineError> {
        Err(self.source.error(self.section, self.index, key, message))
    }

    /// Members of a fixed set, one flag a vertex slot.
    pub(crate) fn fixed(&self, spec: &FixedSpec) -> Result<Vec<bool>, EngineError> {
        self.vertices(spec.r#where.as_ref(), spec.vertices.as_deref(), spec.group.as_deref())
    }

    /// Vertices that a nodal force acts on, one flag a vertex slot.
    pub(crate) fn force(&self, spec: &LoadSpec) -> Result<Vec<bool>, EngineError> {
        self.vertices(spec.r#where.as_ref(), spec.vertices.as_deref(), spec.group.as_deref())
    }

    /// Forces (N) given vertex by vertex; those of a file where they are not zero.
    pub(crate) fn nodal(
        &self,
        forces: &NodalForces,
        spec: &LoadSpec,
    ) -> Result<BTreeMap<VertexId, Vector3<f64>>, EngineError> {
        let mesh = &self.input.mesh;
        let mut acting: BTreeMap<VertexId, Vector3<f64>> = BTreeMap::new();
        match forces {
            NodalForces::Here(list) => {
                let vertices = spec.vertices.as_deref().unwrap_or_default();
                self.flags(vertices, "vertices")?;
                for (v, force) in vertices.iter().zip(list) {
                    *acting.entry(VertexId(*v as u32)).or_default() += Vector3::from(force.in_space());
                }
            }
            NodalForces::File { file, array } => {
                let fail = |message| self.source.error(self.section, self.index, "nodal", message);
                let values = point_array(self.source, file, array, mesh.vertex_slots(), N - 1, fail)?;
                let all = values.as_chunks::<3>().0.iter().map(|f| Vector3::from(*f));
                let numbered = all.enumerate().map(|(v, f)| (VertexId(v as u32), f));
                acting.extend(numbered.filter(|(_, f)| *f != Vector3::zeros()));
            }
        }
        match acting.keys().find(|v| mesh.cells_of_vertex(**v).is_empty()) {
            Some(v) => self.fail(
                "nodal",
                format!("vertex {} belongs to no cell that could take a force", v.0),
            ),
            None => Ok(acting),
        }
    }

    fn vertices(
        &self,
        condition: Option<&Condition>,
        indices: Option<&[usize]>,
        group: Option<&str>,
    ) -> Result<Vec<bool>, EngineError> {
        let points = self.input.mesh.rest_positions();
        let (flags, key): (Vec<bool>, &str) = match (condition, indices, group) {
            (Some(c), _, _) => (points.iter().map(|p| c.0.holds(p)).collect(), "where"),
            (_, Some(list), _) => (self.flags(list, "vertices")?, "vertices"),
            (_, _, name) => (self.flags(&self.group(name)?.vertices, "group")?, "group"),
        };
        match flags.contains(&true) {
            true => Ok(flags),
            false => self.fail(key, "it selects no vertex; a selection must not be empty"),
        }
    }

    fn group(&self, name: Option<&str>) -> Result<&crate::input::NamedSet, EngineError> {
        self.input
            .set(name.unwrap_or(""))
            .or_else(|message| self.fail("group", message))
    }

    fn flags(&self, list: &[usize], key: &str) -> Result<Vec<bool>, EngineError> {
        let count = self.input.mesh.vertex_slots();
        let mut flags = vec![false; count];
        for &v in list {
            match flags.get_mut(v) {
                Some(flag) => *flag = true,
                None => {
                    let message = format!(
                        "vertex {v} does not exist; the mesh has vertices 0 to {}",
                        count.wrapping_sub(1)
                    );
                    return self.fail(key, message);
                }
            }
        }
        Ok(flags)
    }

    /// Boundary facets that a traction or a pressure acts on, one flag for each original boundary facet.
    pub(crate) fn facets(&self, spec: &LoadSpec) -> Result<Vec<bool>, EngineError> {
        let mesh = &self.input.mesh;
        let all_of = |flags: &[bool]| {
            let facets = mesh.original_facets().iter();
            facets
                .map(|f| f.iter().all(|v| flags[v.index()]))
                .collect::<Vec<bool>>()
        };
        let (labels, key) = if let Some(c) = &spec.r#where {
            let flags: Vec<bool> = mesh.rest_positions().iter().map(|p| c.0.holds(p)).collect();
            (all_of(&flags), "where")
        } else if let Some(list) = &spec.facets {
            (self.listed_facets(list)?, "facets")
        } else if let Some(list) = &spec.vertices {
            (all_of(&self.flags(list, "vertices")?), "vertices")
        } else {
            let set = self.group(spec.group.as_deref())?;
            match set.facets.is_empty() {
                true => (all_of(&self.flags(&set.vertices, "group")?), "group"),
                false => (self.labels(&set.facets, "group")?, "group"),
            }
        };
        match labels.contains(&true) {
            true => Ok(labels),
            false => self.fail(key, "it selects no boundary facet; a selection must not be empty"),
        }
    }

    fn listed_facets(&self, list: &[Vec<usize>]) -> Result<Vec<bool>, EngineError> {
        let mut facets = Vec::with_capacity(list.len());
        for f in list {
            let distinct = (1..f.len()).all(|k| !f[..k].contains(&f[k]));
            match (f.as_slice(), N) {
                (&[a, b, c], 4) if distinct => facets.push([a, b, c]),
                (&[a, b], 3) if distinct => facets.push([a, b, b]),
                _ => {
                    let message = format!("{f:?} is no facet; {} different vertices each are needed", N - 1);
                    return self.fail("facets", message);
                }
            }
        }
        self.labels(&facets, "facets")
    }

    fn labels(&self, facets: &[[usize; 3]], key: &str) -> Result<Vec<bool>, EngineError> {
        let originals = self.input.mesh.original_facets();
        // an edge repeats one of its ends
        let sorted = |mut f: [usize; 3]| {
            f.sort_unstable();
            if f[0] == f[1] { [f[0], f[2], f[2]] } else { f }
        };
        let by_corners: BTreeMap<[usize; 3], FacetLabel> = (originals.iter().enumerate())
            .map(|(i, f)| (sorted(f.map(VertexId::index)), FacetLabel(i as u32)))
            .collect();
        let mut labels = vec![false; originals.len()];
        for f in facets {
            match by_corners.get(&sorted(*f)) {
                Some(label) => labels[label.0 as usize] = true,
                None => return self.fail(key, format!("{:?} is no boundary facet of the mesh", &f[..N - 1])),
            }
        }
        Ok(labels)
    }
}
