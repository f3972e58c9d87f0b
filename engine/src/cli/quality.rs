//! `kerfem quality`.

use std::path::Path;

use kerfem_engine::EngineError;
use kerfem_engine::report::QualityFigures;
use kerfem_mesh::SimplexMesh;
use kerfem_mesh::quality::{Histogram, histograms, volume};
use serde_json::json;

use super::MeshFile;

/// Ranges of each histogram.
const BINS: usize = 20;

pub(super) fn quality(path: &Path, as_json: bool) -> Result<u8, EngineError> {
    match MeshFile::read(path)? {
        MeshFile::Tets(mesh) => print(&mesh, as_json),
        MeshFile::Triangles(mesh) => print(&mesh, as_json),
    }
    Ok(0)
}

fn print<const N: usize>(mesh: &SimplexMesh<N>, as_json: bool) {
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
    say!("{size} {:e} {unit}", volume(mesh));
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
    for (ends, count) in h.edges.windows(2).zip(&h.counts) {
        let bar = "#".repeat(count * 40 / largest);
        say!("{:>11.3} {:>11.3} {count:>9} {bar}", ends[0], ends[1]);
    }
    if h.above > 0 {
        say!("{:>23} {:>9}", "above", h.above);
    }
}
