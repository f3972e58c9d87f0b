//! Bodies, states and edits that several tests use.

use kerfem_fem::{Assembler, BlockMatrix, Material};
use kerfem_mesh::{CellId, Edit, FacetLabel, MeshChange, Point, SimplexMesh, TetMesh, VertexId, generate};
use nalgebra::Matrix3;

pub(crate) fn rubber() -> Material {
    Material::new(1e5, 0.3, 1000.0).unwrap()
}

/// A box whose inner vertices are moved off the grid.
pub(crate) fn body(cells: [usize; 3]) -> TetMesh {
    let size = cells.map(|n| 0.5 * n as f64);
    let plain = generate::box_tets(size, cells, [0.0; 3]);
    let inside = |p: &Point| (0..3).all(|k| p[k] > 1e-9 && p[k] < size[k] - 1e-9);
    let mut next = random(7);
    let points = plain
        .rest_positions()
        .iter()
        .map(|p| {
            if inside(p) {
                p + Point::new(next(), next(), next()) * 0.05
            } else {
                *p
            }
        })
        .collect();
    let cells = plain.cell_ids().map(|c| plain.cell(c).map(|v| v.index())).collect();
    TetMesh::new(points, cells).unwrap()
}

pub(crate) fn assemble(mesh: &TetMesh) -> Assembler {
    Assembler::new(mesh, |_| rubber()).unwrap()
}

/// Numbers between -1 and 1, the same each time.
pub(crate) fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Displacements `X -> A X - X + t`.
pub(crate) fn affine<const N: usize>(mesh: &SimplexMesh<N>, a: &Matrix3<f64>, t: Point) -> Vec<f64> {
    mesh.rest_positions()
        .iter()
        .flat_map(|x| <[f64; 3]>::from(a * x - x + t))
        .collect()
}

pub(crate) fn largest(f: &[f64]) -> f64 {
    f.iter().fold(0.0, |m, x| m.max(x.abs()))
}

pub(crate) fn product(a: &BlockMatrix, x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; x.len()];
    a.multiply(x, &mut y);
    y
}

/// Entry of a block matrix, zero outside the pattern.
pub(crate) fn entry(a: &BlockMatrix, d: usize, e: usize) -> f64 {
    let (cols, blocks) = a.row(d / 3);
    cols.binary_search(&(e as u32 / 3))
        .map_or(0.0, |k| blocks[k][3 * (d % 3) + e % 3])
}

/// Splits an edge at the fraction `t` from `a` to `b`.
pub(crate) fn split_edge(edit: &mut Edit<'_, 4>, a: VertexId, b: VertexId, t: f64) -> VertexId {
    let m = edit.mesh();
    let rest = m.rest_position(a) * (1.0 - t) + m.rest_position(b) * t;
    let ring: Vec<CellId> = m.cells_of_edge(a, b).collect();
    let p = edit.add_vertex(rest, &vec![(a, 1.0 - t), (b, t)]);
    for c in ring {
        let corners = edit.mesh().cell(c);
        edit.remove_cell(c);
        for gone in [a, b] {
            edit.add_cell(corners.map(|v| if v == gone { p } else { v }), c, [FacetLabel::NONE; 4]);
        }
    }
    p
}

/// Doubles a vertex: the cells on the far side of the plane through it with normal `n` get the copy.
pub(crate) fn separate(edit: &mut Edit<'_, 4>, v: VertexId, n: Point) -> VertexId {
    let at = edit.mesh().rest_position(v);
    let far: Vec<CellId> = edit
        .mesh()
        .cells_of_vertex(v)
        .iter()
        .copied()
        .filter(|&c| {
            let p = edit.mesh().cell_rest_positions(c);
            (p.iter().sum::<Point>() / 4.0 - at).dot(&n) > 0.0
        })
        .collect();
    let copy = edit.add_vertex(at, &vec![(v, 1.0)]);
    for c in far {
        let corners = edit.mesh().cell(c);
        edit.remove_cell(c);
        edit.add_cell(corners.map(|w| if w == v { copy } else { w }), c, [FacetLabel::NONE; 4]);
    }
    copy
}

/// An edge of a live cell, chosen by numbers between -1 and 1.
fn some_edge(mesh: &TetMesh, next: &mut impl FnMut() -> f64) -> (VertexId, VertexId) {
    let cells: Vec<CellId> = mesh.cell_ids().collect();
    let mut pick = |n: usize| ((next() + 1.0) / 2.0 * n as f64) as usize % n;
    let corners = mesh.cell(cells[pick(cells.len())]);
    let (a, shift) = (pick(4), 1 + pick(3));
    (corners[a], corners[(a + shift) % 4])
}

/// Splits an edge, doubles a vertex or moves one, by numbers between -1 and 1.
pub(crate) fn random_edit(mesh: &mut TetMesh, next: &mut impl FnMut() -> f64) -> MeshChange<4> {
    let (a, b) = some_edge(mesh, next);
    let kind = next();
    let mut edit = Edit::new(mesh);
    if kind < 0.0 {
        split_edge(&mut edit, a, b, 0.5 + 0.2 * next());
    } else if kind < 0.5 {
        let n = Point::new(next(), next(), next());
        separate(&mut edit, a, n);
    } else {
        let m = edit.mesh();
        let rest = m.rest_position(a) * 0.98 + m.rest_position(b) * 0.02;
        edit.move_vertex(a, rest, &vec![(a, 0.98), (b, 0.02)]);
    }
    edit.commit()
}
