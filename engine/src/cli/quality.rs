//! `kerfem quality`.

use std::collections::BTreeMap;
use std::path::Path;

use kerfem_engine::EngineError;
use kerfem_engine::report::QualityFigures;
use kerfem_mesh::io::{DataArray, MeshData, read_mesh};
use kerfem_mesh::quality::{Histogram, histograms, volume};
use kerfem_mesh::{Aabb, SimplexMesh};
use serde_json::json;

use super::MeshFile;

/// Ranges of each histogram.
const BINS: usize = 20;

pub(super) fn quality(path: &Path, as_json: bool) -> Result<u8, EngineError> {
    let data = read_mesh(path).map_err(EngineError::Read)?;
    let groups = groups(&data);
    match MeshFile::of(path, data)? {
        MeshFile::Tets(mesh) => print(&mesh, &groups, as_json),
        MeshFile::Triangles(mesh) => print(&mesh, &groups, as_json),
    }
    Ok(0)
}

/// What a scene can name in the file by `group`, with how much of what belongs to it.
fn groups(data: &MeshData) -> BTreeMap<String, Vec<(&'static str, usize)>> {
    let mut all = BTreeMap::new();
    for (name, g) in &data.groups {
        let counts = [
            ("tetrahedra", g.tets.len()),
            ("triangles", g.triangles.len()),
            ("lines", g.segments.len()),
            ("vertices", g.vertices.len()),
        ];
        all.insert(name.clone(), counts.into_iter().filter(|(_, n)| *n > 0).collect());
    }
    let marked = |a: &DataArray| a.values.iter().filter(|v| **v != 0.0).count();
    for (arrays, what) in [
        (&data.cell_arrays, "marked cells"),
        (&data.point_arrays, "marked vertices"),
    ] {
        for (name, array) in arrays.iter().filter(|(_, a)| a.components == 1) {
            all.insert(name.clone(), vec![(what, marked(array))]);
        }
    }
    all
}

fn print<const N: usize>(mesh: &SimplexMesh<N>, groups: &BTreeMap<String, Vec<(&str, usize)>>, as_json: bool) {
    let bounds = Aabb::around(mesh.cell_ids().flat_map(|c| mesh.cell_rest_positions(c)));
    let corners = [bounds.min, bounds.max].map(<[f64; 3]>::from);
    let figures = QualityFigures::of(mesh);
    let histograms = histograms(mesh, mesh.rest_positions(), BINS);
    let pieces = mesh.pieces().1;
    let (size, unit, angle, size_key) = match N {
        3 => ("area", "m2", "corner", "area_m2"),
        _ => ("volume", "m3", "dihedral", "volume_m3"),
    };
    if as_json {
        let histograms: Vec<_> = histograms
            .iter()
            .map(|h| json!({ "measure": h.measure, "edges": h.edges, "counts": h.counts, "below": h.below, "above": h.above }))
            .collect();
        let all = json!({
            "vertices": mesh.num_vertices(),
            "cells": mesh.num_cells(),
            "pieces": pieces,
            "box": corners,
            "groups": groups.iter().map(|(name, g)| (name, g.iter().copied().collect())).collect::<BTreeMap<_, BTreeMap<_, _>>>(),
            (size_key): volume(mesh),
            "quality": figures,
            "histograms": histograms,
        });
        say!("{all:#}");
        return;
    }
    say!("vertices {}", mesh.num_vertices());
    say!("cells {}", mesh.num_cells());
    say!("pieces {pieces}");
    say!("box {:?} .. {:?}", corners[0], corners[1]);
    for (name, counts) in groups {
        let counts: Vec<String> = counts.iter().map(|(what, n)| format!("{n} {what}")).collect();
        say!("group \"{name}\": {}", counts.join(", "));
    }
    say!("{size} {:.6e} {unit}", volume(mesh));
    say!(
        "radius ratio: min {:.4}, mean {:.4}",
        figures.min_radius_ratio,
        figures.mean_radius_ratio
    );
    say!(
        "{angle} angle: min {:.2}, max {:.2} deg",
        figures.min_dihedral_deg,
        figures.max_dihedral_deg
    );
    say!("longest edge over inradius: max {:.3}", figures.max_edge_over_inradius);
    say!("{size}: max over min {:.3}", figures.max_over_min_volume);
    say!("edge: max over min {:.3}", figures.max_over_min_edge);
    histograms.iter().for_each(print_histogram);
}

fn print_histogram(h: &Histogram) {
    say!("\n{}", h.measure);
    let largest = h.counts.iter().copied().max().unwrap_or(0).max(1);
    if h.below > 0 {
        say!("{:>23} {:>9}", "below", h.below);
    }
    // empty ranges at both ends tell nothing
    let first = h.counts.iter().position(|c| *c > 0).unwrap_or(0);
    let last = h.counts.iter().rposition(|c| *c > 0).map_or(0, |k| k + 1);
    for (ends, count) in h.edges.windows(2).zip(&h.counts).take(last).skip(first) {
        let bar = "#".repeat(count * 40 / largest);
        say!("{:>11.3} {:>11.3} {count:>9} {bar}", ends[0], ends[1]);
    }
    if h.above > 0 {
        say!("{:>23} {:>9}", "above", h.above);
    }
}
