//! One row of a matrix: its columns, and its sum over the cells of a vertex in ascending order.

use kerfem_mesh::{CellId, TetMesh, VertexId};

use crate::FemError;
use crate::corotated::CellTangent;
use crate::element::{Element, Vec3};
use crate::evaluate::Tangent;
use crate::pattern::Pattern;
use crate::small::{Block, add};

/// Places of the blocks of every cell, `[a][b]`: of corner `b` in the row of corner `a`.
pub(crate) type Slots = [[u16; 4]; 4];

#[inline]
pub(crate) fn cells_of_row(mesh: &TetMesh, i: usize) -> &[CellId] {
    mesh.cells_of_vertex(VertexId(i as u32))
}

/// Which corner of the cell the vertex is; the vertex is one of them.
#[inline(always)]
pub(crate) fn corner_of(mesh: &TetMesh, c: CellId, i: usize) -> usize {
    let corners = mesh.cell(c);
    let i = i as u32;
    usize::from(corners[1].0 == i) + 2 * usize::from(corners[2].0 == i) + 3 * usize::from(corners[3].0 == i)
}

#[inline]
pub(crate) fn corner_values(mesh: &TetMesh, c: CellId, u: &[Vec3]) -> [Vec3; 4] {
    let [a, b, c, d] = mesh.cell(c);
    [u[a.index()], u[b.index()], u[c.index()], u[d.index()]]
}

/// Columns of the row of a vertex, ascending: itself and its neighbours; none without cells.
pub(crate) fn row_pattern(mesh: &TetMesh, v: u32) -> Result<Vec<u32>, FemError> {
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

/// Places of the four corners of a cell in the row of corner `a`.
pub(crate) fn row_slots(mesh: &TetMesh, pattern: &Pattern, c: CellId, a: usize) -> [u16; 4] {
    let corners = mesh.cell(c);
    let cols = pattern.cols(corners[a].index());
    corners.map(|v| cols.partition_point(|&w| w < v.0) as u16)
}

/// `row :=` sum over the cells of the vertex, ascending, of the stiffness blocks of its corner at rest.
pub(crate) fn stiffness_row(mesh: &TetMesh, elements: &[Element], slots: &[Slots], i: usize, row: &mut [Block]) {
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
pub(crate) fn tangent_row(
    mesh: &TetMesh,
    tangents: &[CellTangent],
    slots: &[Slots],
    tangent: Tangent,
    i: usize,
    row: &mut [Block],
) {
    row.fill([0.0; 9]);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let places = &slots[c.index()][a];
        let blocks = tangents[c.index()].warped_blocks(a);
        for b in 0..4 {
            add(&mut row[places[b] as usize], &blocks.block(b));
        }
        if tangent != Tangent::Warped {
            let blocks = tangents[c.index()].twist_blocks(a);
            for b in 0..4 {
                add(&mut row[places[b] as usize], &blocks.block(b));
            }
        }
    }
}

/// Row of the consistent mass, `mass / 20 (1 + delta_ab)` from each cell.
pub(crate) fn mass_row(mesh: &TetMesh, elements: &[Element], slots: &[Slots], i: usize, row: &mut [f64]) {
    row.fill(0.0);
    for &c in cells_of_row(mesh, i) {
        let a = corner_of(mesh, c, i);
        let share = elements[c.index()].mass / 20.0;
        for b in 0..4 {
            row[slots[c.index()][a][b] as usize] += if a == b { 2.0 * share } else { share };
        }
    }
}

pub(crate) fn lumped_mass(mesh: &TetMesh, elements: &[Element], i: usize) -> f64 {
    cells_of_row(mesh, i)
        .iter()
        .map(|c| elements[c.index()].mass / 4.0)
        .sum()
}
