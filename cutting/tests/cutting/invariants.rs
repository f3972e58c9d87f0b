//! What must hold after every cut (DESIGN "What always holds", 3 and 5, and what [`MeshChange`] promises).

use std::collections::{BTreeMap, BTreeSet};

use kerfem_cutting::{CutOutcome, Method};
use kerfem_mesh::{CellId, MeshChange, Point, SimplexMesh, VertexId, quality};

/// Relative change of volumes and areas that is rounding.
const ROUNDING: f64 = 1e-12;

/// Everything that must hold after a cut in the rest frame by a method that removes no cells for good.
pub(crate) fn check_cut<const N: usize>(
    before: &SimplexMesh<N>,
    after: &SimplexMesh<N>,
    outcome: &CutOutcome<N>,
) -> Result<(), String> {
    check_cut_by(Method::Hybrid, before, after, outcome)
}

/// [`check_cut`] for any method: [`Method::Delete`] may lose volume, surface and pieces, and nothing else.
pub(crate) fn check_cut_by<const N: usize>(
    method: Method,
    before: &SimplexMesh<N>,
    after: &SimplexMesh<N>,
    outcome: &CutOutcome<N>,
) -> Result<(), String> {
    after.check(true)?;
    if !outcome.report.refused.is_empty() && (before != after || !outcome.change.is_empty()) {
        return Err("a refused cut changed the mesh".into());
    }
    check_record(before, after, &outcome.change)?;
    check_closed(after)?;
    if method == Method::Delete {
        let grown = quality::volume(after) > quality::volume(before) * (1.0 + ROUNDING);
        return if grown {
            Err("deleting made the body larger".into())
        } else {
            Ok(())
        };
    }
    check_kept(before, after)
}

/// Volume, original surface and pieces of a body that is cut and loses nothing.
fn check_kept<const N: usize>(before: &SimplexMesh<N>, after: &SimplexMesh<N>) -> Result<(), String> {
    let (v0, v1) = (quality::volume(before), quality::volume(after));
    if (v1 - v0).abs() > ROUNDING * v0 + rounding_of_places(before) * total_area(before) {
        return Err(format!("rest volume went from {v0} to {v1}"));
    }
    let (a0, a1) = (original_area(before), original_area(after));
    if (a1 - a0).abs() > 10.0 * (ROUNDING * a0 + rounding_of_areas(before)) {
        return Err(format!("the original surface went from {a0} to {a1}"));
    }
    let (p0, p1) = (before.pieces().1, after.pieces().1);
    if p1 < p0 {
        return Err(format!("pieces went from {p0} to {p1}"));
    }
    Ok(())
}

/// Whether the change tells exactly what is different, and its weights reproduce the places.
pub(crate) fn check_record<const N: usize>(
    before: &SimplexMesh<N>,
    after: &SimplexMesh<N>,
    change: &MeshChange<N>,
) -> Result<(), String> {
    let removed: BTreeSet<CellId> = change.cells_removed.iter().map(|c| c.id).collect();
    let added: BTreeMap<CellId, [VertexId; N]> = change.cells_added.iter().map(|c| (c.id, c.corners)).collect();
    for c in &change.cells_removed {
        let known = before.has_cell(c.id)
            && before.cell(c.id) == c.corners
            && before.cell_rest_positions(c.id) == c.rest_positions;
        if !known || after.has_cell(c.id) {
            return Err(format!("removed cell {} is not recorded as it was", c.id.0));
        }
    }
    if let Some(c) = change.cells_added.iter().find(|c| !removed.contains(&c.parent)) {
        return Err(format!("added cell {} has parent {}, which stays", c.id.0, c.parent.0));
    }
    let expected = before
        .cell_ids()
        .filter(|c| !removed.contains(c))
        .map(|c| (c, before.cell(c)))
        .chain(added.iter().map(|(&c, &corners)| (c, corners)));
    if !expected.eq(after.cell_ids().map(|c| (c, after.cell(c)))) {
        return Err("the cells are not those of before less the removed and with the added".into());
    }
    check_vertices(before, after, change)
}

fn check_vertices<const N: usize>(
    before: &SimplexMesh<N>,
    after: &SimplexMesh<N>,
    change: &MeshChange<N>,
) -> Result<(), String> {
    let gone: BTreeSet<VertexId> = change.vertices_removed.iter().map(|v| v.id).collect();
    let new: BTreeSet<VertexId> = change.vertices_added.iter().map(|v| v.id).collect();
    let moved: BTreeMap<VertexId, Point> = change
        .vertices_moved
        .iter()
        .map(|v| (v.id, v.old_rest_position))
        .collect();
    for v in before.vertex_ids().filter(|v| !gone.contains(v)) {
        if !after.has_vertex(v) {
            return Err(format!("vertex {} is gone without a word", v.0));
        }
        let old = before.rest_position(v);
        if *moved.get(&v).unwrap_or(&after.rest_position(v)) != old {
            return Err(format!("vertex {} moved without a word, or from elsewhere", v.0));
        }
    }
    if !after
        .vertex_ids()
        .filter(|v| !before.has_vertex(*v))
        .eq(new.iter().copied())
    {
        return Err("the new vertices are not those recorded".into());
    }
    if let Some(v) = gone.iter().find(|v| !before.has_vertex(**v) || after.has_vertex(**v)) {
        return Err(format!("removed vertex {} is not gone, or never was", v.0));
    }
    let placed = change.vertices_added.iter().map(|v| (v.id, &v.parents));
    let shifted = change.vertices_moved.iter().map(|v| (v.id, &v.parents));
    for (v, parents) in placed.chain(shifted) {
        let sum: f64 = parents.iter().map(|(_, w)| w).sum();
        let size: f64 = parents.iter().map(|(_, w)| w.abs()).sum();
        if (sum - 1.0).abs() > ROUNDING * size || parents.iter().any(|(p, _)| !before.has_vertex(*p)) {
            return Err(format!("weights of vertex {} are {parents:?}", v.0));
        }
        let place: Point = parents.iter().map(|&(p, w)| before.rest_position(p) * w).sum();
        let largest = parents
            .iter()
            .map(|&(p, _)| before.rest_position(p).norm())
            .fold(0.0, f64::max);
        if (place - after.rest_position(v)).norm() > ROUNDING * size * largest {
            return Err(format!("vertex {} does not lie where its weights say", v.0));
        }
        if after.cells_of_vertex(v).is_empty() && !before.has_vertex(v) {
            return Err(format!("new vertex {} has no cell", v.0));
        }
    }
    Ok(())
}

/// The boundary is closed: its normals add up to nothing.
fn check_closed<const N: usize>(mesh: &SimplexMesh<N>) -> Result<(), String> {
    if N == 3 && !mesh.is_planar() {
        return Ok(());
    }
    let (mut sum, mut size) = (Point::zeros(), 0.0);
    for n in mesh.boundary_facets().map(|side| mesh.facet_normal(side)) {
        sum += n;
        size += n.norm();
    }
    if sum.norm() > ROUNDING * size + rounding_of_areas(mesh) {
        return Err(format!(
            "the boundary is open: its normals add up to {} of {size}",
            sum.norm()
        ));
    }
    Ok(())
}

/// Rounding (m) of the coordinates of a mesh.
fn rounding_of_places<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let largest = mesh
        .vertex_ids()
        .map(|v| mesh.rest_position(v).amax())
        .fold(0.0, f64::max);
    4.0 * f64::EPSILON * largest
}

/// Rounding (m²) of the area of all facets together; in the plane of their length (m).
fn rounding_of_areas<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let cells = mesh.num_cells() as f64;
    let edges = if N == 4 {
        (total_area(mesh) * cells).sqrt()
    } else {
        cells
    };
    rounding_of_places(mesh) * edges
}

/// Area (m²) of the facets of all cells; in the plane their length.
fn total_area<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let sides = mesh
        .cell_ids()
        .flat_map(|cell| (0..N as u8).map(move |local| kerfem_mesh::FacetSide { cell, local }));
    sides.map(|side| mesh.facet_normal(side).norm()).sum()
}

/// Area (m²) of what is left of the original boundary.
fn original_area<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let original = |s: &kerfem_mesh::FacetSide| mesh.facet_labels(s.cell)[s.local as usize].some().is_some();
    mesh.boundary_facets()
        .filter(original)
        .map(|s| mesh.facet_normal(s).norm())
        .sum()
}
