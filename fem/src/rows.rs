//! One row of a matrix: its columns, and its sum over the cells of a vertex in ascending order.

use kerfem_mesh::{CellId, SimplexMesh, VertexId};

use crate::FemError;
use crate::corotated::CellTangent;
use crate::element::{Element, Vec3};
use crate::evaluate::Tangent;
use crate::pattern::Pattern;
use crate::small::{Block, add};

/// Places of the blocks of every cell, `[a][b]`: of corner `b` in the row of corner `a`.
pub(crate) type Slots<const N: usize> = [[u16; N]; N];

#[inline]
pub(crate) fn cells_of_row<const N: usize>(mesh: &SimplexMesh<N>, i: usize) -> &[CellId] {
    mesh.cells_of_vertex(VertexId(i as u32))
}

/// Which corner of the cell the vertex is; the vertex is one of them.
#[inline(always)]
pub(crate) fn corner_of<const N: usize>(mesh: &SimplexMesh<N>, c: CellId, i: usize) -> usize {
    let corners = mesh.cell(c);
    let i = i as u32;
    let mut corner = 0;
    for k in 1..N {
        corner += k * usize::from(corners[k].0 == i);
    }
    corner
}

#[inline]
pub(crate) fn corner_values<const N: usize>(mesh: &SimplexMesh<N>, c: CellId, u: &[Vec3]) -> [Vec3; N] {
    mesh.cell(c).map(|v| u[v.index()])
}

/// Columns of the row of a vertex, ascending: itself and its neighbours; none without cells.
pub(crate) fn row_pattern<const N: usize>(mesh: &SimplexMesh<N>, v: u32) -> Result<Vec<u32>, FemError> {
    let mut cols: Vec<u32> = cells_of_row(mesh, v as usize)
        .iter()
        .flat_map(|&c| mesh.cell(c))
        .map(|w| w.0)
        .collect();
    cols.sort_unstable();
    cols.dedup();
    match cols.len() <= usize::from(u16::MAX) {
        true => Ok(cols),
        false => Err(FemError::TooManyNeighbors {
            vertex: v,
            count: cols.len(),
        }),
    }
}

/// Places of the corners of a cell in the row of corner `a`.
pub(crate) fn row_slots<const N: usize>(mesh: &SimplexMesh<N>, pattern: &Pattern, c: CellId, a: usize) -> [u16; N] {
    let corners = mesh.cell(c);
    let cols = pattern.cols(corners[a].index());
    corners.map(|v| cols.partition_point(|&w| w < v.0) as u16)
}

/// `row :=` sum over the cells of the vertex, ascending, of the stiffness blocks of its corner at rest.
pub(crate) fn stiffness_row<const N: usize>(
    mesh: &SimplexMesh<N>,
    elements: &[Element<N>],
    slots: &[Slots<N>],
    i: usize,
    row: &mut [Block],
) {
    row.fill([0.0; 9]);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let blocks = elements[c.index()].rest_blocks(a);
        for (b, place) in slots[c.index()][a].into_iter().enumerate() {
            add(&mut row[place as usize], &blocks.block(b));
        }
    }
}

/// `row :=` the same sum of the tangent.
#[inline(always)]
pub(crate) fn tangent_row<const N: usize>(
    mesh: &SimplexMesh<N>,
    tangents: &[CellTangent<N>],
    slots: &[Slots<N>],
    tangent: Tangent,
    i: usize,
    row: &mut [Block],
) {
    row.fill([0.0; 9]);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let places = &slots[c.index()][a];
        let blocks = tangents[c.index()].warped_blocks(a);
        for b in 0..N {
            add(&mut row[places[b] as usize], &blocks.block(b));
        }
        if tangent != Tangent::Warped {
            let blocks = tangents[c.index()].twist_blocks(a);
            for b in 0..N {
                add(&mut row[places[b] as usize], &blocks.block(b));
            }
        }
    }
}

/// Row of the consistent mass, `mass / (N (N + 1)) (1 + delta_ab)` from each cell of `N` corners.
pub(crate) fn mass_row<const N: usize>(
    mesh: &SimplexMesh<N>,
    elements: &[Element<N>],
    slots: &[Slots<N>],
    i: usize,
    row: &mut [f64],
) {
    row.fill(0.0);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let share = elements[c.index()].mass / (N * (N + 1)) as f64;
        for b in 0..N {
            row[slots[c.index()][a][b] as usize] += if a == b { 2.0 * share } else { share };
        }
    }
}

pub(crate) fn lumped_mass<const N: usize>(mesh: &SimplexMesh<N>, elements: &[Element<N>], i: usize) -> f64 {
    cells_of_row(mesh, i)
        .iter()
        .map(|c| elements[c.index()].mass / N as f64)
        .sum()
}
