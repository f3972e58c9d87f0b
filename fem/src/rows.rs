//! One row of a matrix: its columns, and its sum over the cells of a vertex in ascending order.

use kerfem_mesh::{CellId, SimplexMesh, VertexId};

use crate::FemError;
use crate::corotated::CellTangent;
use crate::element::{Element, Vec3};
use crate::evaluate::Tangent;
use crate::patch::{Patch, PatchState, patches_around};
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

/// Columns of the row of a vertex, ascending: itself and its neighbours, and what it shares a patch with; none without cells.
pub(crate) fn row_pattern<'p, const N: usize>(
    mesh: &SimplexMesh<N>,
    v: u32,
    patches_of: impl Fn(u32) -> &'p [Patch<N>],
) -> Result<Vec<u32>, FemError> {
    let mut columns: Vec<u32> = cells_of_row(mesh, v as usize)
        .iter()
        .flat_map(|&c| mesh.cell(c))
        .map(|w| w.0)
        .collect();
    for own in patches_of(v) {
        let around = own.vertices.iter().flat_map(|&w| patches_of(w));
        columns.extend(around.filter(|p| p.material == own.material).flat_map(|p| &p.vertices));
    }
    each_once(v, columns)
}

/// The columns of the row of a vertex, ascending, from a list that may name one more than once.
///
/// # Errors
/// [`FemError::TooManyNeighbors`] beyond 65535.
pub(crate) fn each_once(vertex: u32, mut columns: Vec<u32>) -> Result<Vec<u32>, FemError> {
    columns.sort_unstable();
    columns.dedup();
    match columns.len() {
        count if count > usize::from(u16::MAX) => Err(FemError::TooManyNeighbors { vertex, count }),
        _ => Ok(columns),
    }
}

/// Places of the corners of a cell in the row of corner `a`.
pub(crate) fn row_slots<const N: usize>(mesh: &SimplexMesh<N>, pattern: &Pattern, c: CellId, a: usize) -> [u16; N] {
    let corners = mesh.cell(c);
    let cols = pattern.cols(corners[a].index());
    corners.map(|v| cols.partition_point(|&w| w < v.0) as u16)
}

/// `row :=` sum over the cells of the vertex, ascending, of the stiffness blocks of its corner at rest; then over the patches
/// around it.
pub(crate) fn stiffness_row<const N: usize>(
    mesh: &SimplexMesh<N>,
    elements: &[Element<N>],
    slots: &[Slots<N>],
    patches: &[Vec<Patch<N>>],
    i: usize,
    cols: &[u32],
    row: &mut [Block],
) {
    row.fill([0.0; 9]);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let blocks = elements[c.index()].rest_blocks(a);
        for (b, place) in slots[c.index()][a].into_iter().enumerate() {
            add(
                &mut row[place as usize],
                &blocks.block(&elements[c.index()].gradients[b]),
            );
        }
    }
    for (j, k, place) in patches_around(patches, i) {
        patches[j][k].add_rest_blocks(place, cols, row);
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
        let cell = &tangents[c.index()];
        let blocks = cell.warped_blocks(a);
        for b in 0..N {
            add(&mut row[places[b] as usize], &blocks.block(cell.rotated(b)));
        }
        if tangent != Tangent::Warped {
            let blocks = cell.twist_blocks(a);
            for b in 0..N {
                add(&mut row[places[b] as usize], &blocks.block(cell.rotated(b)));
            }
        }
    }
}

/// `row +=` what the patches around the vertex add to the tangent.
pub(crate) fn add_patches_to_row<const N: usize>(
    patches: &[Vec<Patch<N>>],
    states: &[Vec<PatchState>],
    tangent: Tangent,
    i: usize,
    cols: &[u32],
    row: &mut [Block],
) {
    for (j, k, place) in patches_around(patches, i) {
        patches[j][k].add_tangent_blocks(&states[j][k], tangent, place, cols, row);
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
