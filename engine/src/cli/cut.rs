//! `kerfem cut`.

use kerfem_cutting::{CutOptions, Method};
use kerfem_engine::geometry::{GeometryCut, cut_at_rest};
use kerfem_engine::{EngineError, output};
use kerfem_mesh::SimplexMesh;

use super::arguments::{bad, check_output};
use super::{CutArguments, MeshFile};

pub(super) fn cut(arguments: &CutArguments) -> Result<u8, EngineError> {
    if let Some(path) = &arguments.output {
        check_output(path)?;
    }
    let method = Method::from(arguments.method);
    let options = CutOptions {
        method,
        snap: arguments.snap,
        improve: arguments.improve.unwrap_or(method.improves()),
        relax: arguments.relax,
        quality: arguments.quality,
        operations: arguments.operations.unwrap_or(usize::MAX),
    };
    match MeshFile::read(&arguments.mesh)? {
        MeshFile::Tets(mut mesh) => cut_and_write(&mut mesh, arguments, &options),
        MeshFile::Triangles(mut mesh) => match mesh.rest_positions().iter().find(|p| p.z != 0.0) {
            None => cut_and_write(&mut mesh, arguments, &options),
            Some(p) => Err(bad(
                arguments.mesh.display().to_string(),
                format!(
                    "a surface in space (z = {}) cannot be cut yet; accepted: tetrahedra, triangles with z = 0",
                    p.z
                ),
            )),
        },
    }
}

fn cut_and_write<const N: usize>(
    mesh: &mut SimplexMesh<N>,
    arguments: &CutArguments,
    options: &CutOptions,
) -> Result<u8, EngineError> {
    let write = arguments.output.as_deref().map(output::mesh_writer).transpose();
    let write = write.map_err(|e| bad("--output", e.to_string()))?;
    let done = cut_at_rest(mesh, &arguments.sweep, options).map_err(|e| bad("--sweep", e.to_string()))?;
    if let Some(write) = write {
        write(mesh)?;
    }
    if arguments.json {
        say!("{:#}", serde_json::json!(done));
    } else {
        print(&done);
    }
    Ok(0)
}

fn print(done: &GeometryCut) {
    let (a, b) = (&done.before, &done.after);
    say!("method {}", done.method);
    say!(
        "vertices {} -> {} (+{}, -{}, {} moved)",
        a.vertices,
        b.vertices,
        done.vertices_added,
        done.vertices_removed,
        done.vertices_moved
    );
    say!(
        "cells {} -> {} (+{}, -{})",
        a.cells,
        b.cells,
        done.cells_added,
        done.cells_removed
    );
    say!("pieces {} -> {}", a.pieces, b.pieces);
    say!("volume {:e} -> {:e} m3", a.volume_m3, b.volume_m3);
    say!("area of the cut {:e} m2", done.area_m2);
    say!("largest distance to the sweep {:e} m", done.max_distance_to_sweep_m);
    let (p, q) = (&a.quality, &b.quality);
    say!(
        "radius ratio: min {:.4} -> {:.4}, mean {:.4} -> {:.4}",
        p.min_radius_ratio,
        q.min_radius_ratio,
        p.mean_radius_ratio,
        q.mean_radius_ratio
    );
    say!(
        "dihedral angle: min {:.2} -> {:.2}, max {:.2} -> {:.2} deg",
        p.min_dihedral_deg,
        q.min_dihedral_deg,
        p.max_dihedral_deg,
        q.max_dihedral_deg
    );
    say!(
        "operations to improve cells {}, cells left over {}",
        done.operations,
        done.unfinished
    );
    say!(
        "seconds: find {:.4}, remesh {:.4}, improve {:.4}",
        done.find_seconds,
        done.remesh_seconds,
        done.improve_seconds
    );
    done.refused.iter().for_each(|r| say!("refused: {r}"));
    done.warnings.iter().for_each(|w| say!("warning: {w}"));
}
