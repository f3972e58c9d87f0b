//! Separation: facets between cells on different sides of the sweep open.

use std::collections::{BTreeMap, BTreeSet};

use kerfem_mesh::{CellId, FacetKey, FacetLabel, FacetSide, Point, VertexId, quality};

use crate::split;
use crate::sweep::Piece;
use crate::workspace::Workspace;

/// One lip of what a cut opened: facets seen from the cells on one side.
#[derive(Default)]
pub(crate) struct Lip {
    pub(crate) facets: Vec<FacetSide>,
}

/// Points inside cells and facets are mixed with these weights, one row an attempt, so that paths between them do not run
/// into edges of the sweep.
const MIXES: [[f64; 4]; 6] = [
    [0.2371, 0.2539, 0.2417, 0.2673],
    [0.2713, 0.2291, 0.2609, 0.2387],
    [0.2207, 0.2833, 0.2351, 0.2609],
    [0.2549, 0.2179, 0.2963, 0.2309],
    [0.2111, 0.2417, 0.2657, 0.2815],
    [0.2903, 0.2677, 0.2273, 0.2147],
];

/// How far the point that stands for a cell is drawn from a free corner towards its middle.
const INWARD: f64 = 0.1;

/// Of the local size: what is thinner comes off as a chip even where nothing snaps, at the creases of a curved sweep.
const CHIP: f64 = 0.02;

/// Of `d`: how close to the sweep the middle of a cell must be for its side to be undecided.
const UNDECIDED: f64 = 0.25;

/// Marks the facets along which the mesh will open, as [`Workspace::sheet`]; whether there are any. `None` if the paths met
/// edges of the sweep at every attempt.
pub(crate) fn mark_sheet<const N: usize>(
    ws: &mut Workspace<'_, N>,
    piece: &Piece,
    snap: f64,
    splinter: f64,
) -> Option<bool> {
    let marked = MIXES.iter().find_map(|mix| mark(ws, piece, snap, splinter, mix))?;
    ws.sheet = marked.iter().map(|&s| ws.mesh().facet_key(s)).collect();
    Some(!marked.is_empty())
}

/// Opens the mesh along the sheet.
pub(crate) fn open<const N: usize>(ws: &mut Workspace<'_, N>) -> Lip {
    let keys: BTreeSet<FacetKey> = std::mem::take(&mut ws.sheet).into_iter().collect();
    let mut marked: Vec<FacetSide> = keys.iter().filter_map(|key| side_of(ws, key)).collect();
    marked.sort_unstable();
    let vertices = marked.iter().flat_map(|&s| ws.mesh().facet_corners(s)).collect();
    double_vertices(ws, &marked, vertices)
}

/// A facet seen from the first of its cells.
fn side_of<const N: usize>(ws: &Workspace<'_, N>, key: &FacetKey) -> Option<FacetSide> {
    let cells = ws.mesh().cells_of_vertex(VertexId(key.0[0]));
    let mut sides = cells
        .iter()
        .flat_map(|&cell| (0..N as u8).map(move |local| FacetSide { cell, local }));
    sides.find(|s| ws.mesh().facet_key(*s) == *key)
}

/// Facets whose two cells lie on different sides, ascending, once no chip comes loose by them.
fn mark<const N: usize>(
    ws: &Workspace<'_, N>,
    piece: &Piece,
    snap: f64,
    splinter: f64,
    mix: &[f64; 4],
) -> Option<Vec<FacetSide>> {
    let mut stands = cells_stand_at(ws, piece, snap, mix);
    let mut marked = mark_between(ws, piece, &stands, mix)?;
    for kind in [Chip::Slice, Chip::Splinter(splinter)] {
        if join_chips(ws, piece, snap, kind, &marked, &mut stands) {
            marked = mark_between(ws, piece, &stands, mix)?;
        }
    }
    Some(marked)
}

/// What must not come loose.
#[derive(Clone, Copy, PartialEq)]
enum Chip {
    /// Cells that the cut runs along on all corners, together thinner than `d`: a slice between two cuts that nearly
    /// coincide, say.
    Slice,
    /// Cells at a face of an earlier cut, together smaller than a cube of so many `d` a side: what is between an incision and
    /// another that goes on from it at an angle, say.
    Splinter(f64),
}

fn mark_between<const N: usize>(
    ws: &Workspace<'_, N>,
    piece: &Piece,
    stands: &BTreeMap<CellId, Point>,
    mix: &[f64; 4],
) -> Option<Vec<FacetSide>> {
    let mut marked = Vec::new();
    for (&cell, &here) in stands {
        for local in 0..N as u8 {
            let side = FacetSide { cell, local };
            let Some(other) = ws.mesh().neighbors(cell)[local as usize].some() else {
                continue;
            };
            if other < cell && stands.contains_key(&other) {
                continue;
            }
            let there = stands
                .get(&other)
                .copied()
                .unwrap_or_else(|| stand_in(ws, &ws.mesh().cell(other), mix));
            let via = stand_in(ws, &ws.mesh().facet_corners(side)[..N - 1], mix);
            if piece.separates(here, via, there)? {
                marked.push(side);
            }
        }
    }
    Some(marked)
}

/// Lets chips stand with the neighbour behind their largest facet, if that is not a chip itself. Whether there are any.
fn join_chips<const N: usize>(
    ws: &Workspace<'_, N>,
    piece: &Piece,
    snap: f64,
    kind: Chip,
    marked: &[FacetSide],
    stands: &mut BTreeMap<CellId, Point>,
) -> bool {
    // a vertex that came in within what had come loose before lies beside the sweep
    let beside = |v: &VertexId| piece.nearest(&ws.position(*v)).distance <= ws.reach(*v, CHIP);
    let along = |c: &CellId| (ws.mesh().cell(*c).iter()).all(|v| ws.on.contains(v) || beside(v));
    let cells: Vec<CellId> = (stands.keys().copied())
        .filter(|c| kind != Chip::Slice || along(c))
        .collect();
    let closed: BTreeSet<FacetKey> = marked.iter().map(|&s| ws.mesh().facet_key(s)).collect();
    let (group, count) = ws
        .mesh()
        .pieces_among(&cells, |s| !closed.contains(&ws.mesh().facet_key(s)));
    let is_closed = |side: FacetSide| {
        ws.mesh().neighbors(side.cell)[side.local as usize].some().is_none()
            || closed.contains(&ws.mesh().facet_key(side))
    };
    let sides = |cell: CellId| (0..N as u8).map(move |local| FacetSide { cell, local });
    let mut groups = vec![
        Loose {
            reach: f64::INFINITY,
            ..Loose::default()
        };
        count
    ];
    for (&cell, &g) in cells.iter().zip(&group) {
        let own = &mut groups[g];
        own.volume += quality::cell_volume(&ws.cell_positions(cell));
        own.reach = ws
            .mesh()
            .cell(cell)
            .iter()
            .map(|&v| ws.reach(v, snap.max(CHIP)))
            .fold(own.reach, f64::min);
        for side in sides(cell) {
            if is_closed(side) {
                own.surface += facet_area(ws, side);
                let is_boundary = ws.mesh().neighbors(cell)[side.local as usize] == CellId::NONE;
                own.has_lip |= is_boundary && ws.mesh().facet_labels(cell)[side.local as usize] == FacetLabel::NONE;
            } else {
                own.held |= cells
                    .binary_search(&ws.mesh().neighbors(cell)[side.local as usize])
                    .is_err();
            }
        }
    }
    let chips: BTreeMap<CellId, usize> = cells
        .iter()
        .copied()
        .zip(group)
        .filter(|(_, g)| groups[*g].is(kind))
        .collect();
    // not with another chip: the two would change places
    for (&cell, &g) in &chips {
        for side in sides(cell).filter(|s| is_closed(*s)) {
            let other = ws.mesh().neighbors(cell)[side.local as usize];
            let area = facet_area(ws, side);
            if let Some(stand) = stands.get(&other)
                && area > groups[g].largest
                && !chips.contains_key(&other)
            {
                (groups[g].largest, groups[g].stand) = (area, Some(*stand));
            }
        }
    }
    let mut any = false;
    for (cell, g) in chips {
        if let Some(stand) = groups[g].stand {
            stands.insert(cell, stand);
            any = true;
        }
    }
    any
}

/// Cells that the marks leave together.
#[derive(Clone, Default)]
struct Loose {
    volume: f64,
    /// Area that is marked or boundary.
    surface: f64,
    /// Least `d` at a corner.
    reach: f64,
    /// Connected to other cells.
    held: bool,
    /// Has a face of an earlier cut.
    has_lip: bool,
    /// Area of the largest marked facet, and where the cell behind it stands.
    largest: f64,
    stand: Option<Point>,
}

impl Loose {
    fn is(&self, kind: Chip) -> bool {
        let is_small = match kind {
            // a slice of thickness t has the volume t times half its surface
            Chip::Slice => 2.0 * self.volume < self.reach * self.surface,
            Chip::Splinter(side) => self.has_lip && self.volume < (side * self.reach).powi(3),
        };
        !self.held && is_small
    }
}

fn facet_area<const N: usize>(ws: &Workspace<'_, N>, side: FacetSide) -> f64 {
    let p = ws.mesh().facet_corners(side).map(|v| ws.position(v));
    quality::facet_normal::<N>(&p).norm() / 2.0
}

/// Where each cell near the sweep stands. A cell that the cut runs along on all corners and whose middle is too close to the
/// sweep to tell stands with a neighbour, the one behind its largest facet, instead of coming loose as a chip.
fn cells_stand_at<const N: usize>(
    ws: &Workspace<'_, N>,
    piece: &Piece,
    snap: f64,
    mix: &[f64; 4],
) -> BTreeMap<CellId, Point> {
    let (mut stands, mut undecided) = (BTreeMap::new(), Vec::new());
    for &c in &ws.region {
        let corners = ws.mesh().cell(c);
        let point = stand_in(ws, &corners, mix);
        let reach = corners.iter().map(|&v| ws.reach(v, snap)).fold(f64::INFINITY, f64::min);
        if corners.iter().all(|v| ws.on.contains(v)) && piece.nearest(&point).distance < UNDECIDED * reach {
            undecided.push((c, point));
        } else {
            stands.insert(c, point);
        }
    }
    while !undecided.is_empty() {
        let with_neighbor: Vec<(CellId, Point)> = undecided
            .iter()
            .filter_map(|&(c, _)| Some((c, largest_neighbor(ws, c, &stands)?)))
            .collect();
        if with_neighbor.is_empty() {
            stands.extend(undecided);
            break;
        }
        stands.extend(with_neighbor);
        undecided.retain(|(c, _)| !stands.contains_key(c));
    }
    stands
}

fn largest_neighbor<const N: usize>(
    ws: &Workspace<'_, N>,
    c: CellId,
    stands: &BTreeMap<CellId, Point>,
) -> Option<Point> {
    (0..N as u8)
        .filter_map(|local| {
            let stand = *stands.get(&ws.mesh().neighbors(c)[local as usize].some()?)?;
            Some((facet_area(ws, FacetSide { cell: c, local }), stand))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, stand)| stand)
}

/// A point that stands for a simplex: at a corner that the cut does not go through, drawn a little inwards. (All such corners
/// lie on one side where the sweep is resolved; in the middle there may be a sweep too small to meet any edge.)
fn stand_in<const N: usize>(ws: &Workspace<'_, N>, corners: &[VertexId], mix: &[f64; 4]) -> Point {
    let mut places: Vec<(Point, bool)> = corners.iter().map(|&v| (ws.position(v), !ws.on.contains(&v))).collect();
    places.sort_by(|(a, _), (b, _)| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    let (sum, total) = places
        .iter()
        .zip(mix)
        .fold((Point::zeros(), 0.0), |(sum, total), ((p, _), w)| {
            (sum + p * *w, total + w)
        });
    let middle = sum / total;
    let free = places.iter().find(|(_, free)| *free);
    free.map_or(middle, |(corner, _)| corner * (1.0 - INWARD) + middle * INWARD)
}

/// Gives each of these vertices whose link has fallen apart one copy for each part (Y4, F14), and splits edges between them
/// whose cells hang together by the edge only: its ends cannot be doubled, vertices in between can.
pub(crate) fn open_pinched<const N: usize>(ws: &mut Workspace<'_, N>, vertices: BTreeSet<VertexId>) {
    double_vertices(ws, &[], vertices.clone());
    if N != 4 {
        return;
    }
    for &a in &vertices {
        for b in ws.mesh().vertex_neighbors(a) {
            if a < b && vertices.contains(&b) && ws.mesh().fans_of_edge(a, b).len() > 1 {
                split::split_edge(ws, a, b, 0.5);
            }
        }
    }
}

/// Gives every vertex one copy for each group of its cells that the marks leave connected. The group with the smallest
/// corners keeps the vertex: numbers of vertices must not depend on the order of cells (F10).
fn double_vertices<const N: usize>(
    ws: &mut Workspace<'_, N>,
    marked: &[FacetSide],
    vertices: BTreeSet<VertexId>,
) -> Lip {
    let closed: BTreeSet<FacetKey> = marked.iter().map(|&s| ws.mesh().facet_key(s)).collect();
    let mut corners: BTreeMap<CellId, [VertexId; N]> = BTreeMap::new();
    for v in vertices {
        let cells = ws.mesh().cells_of_vertex(v).to_vec();
        let (group, count) = ws.mesh().pieces_among(&cells, |side| {
            ws.mesh().cell(side.cell)[side.local as usize] != v && !closed.contains(&ws.mesh().facet_key(side))
        });
        let mut smallest = vec![None; count];
        for (&c, &g) in cells.iter().zip(&group) {
            let own = ws.sorted_corners(c);
            smallest[g] = smallest[g].filter(|least| *least < own).or(Some(own));
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_unstable_by_key(|g| smallest[*g]);
        let mut copies: Vec<Option<VertexId>> = vec![None; count];
        for &g in order.iter().skip(1) {
            copies[g] = Some(ws.add_vertex(&[(v, 1.0)]));
        }
        for (&c, &g) in cells.iter().zip(&group) {
            if let Some(copy) = copies[g] {
                let own = corners.entry(c).or_insert_with(|| ws.mesh().cell(c));
                *own = own.map(|w| if w == v { copy } else { w });
            }
        }
    }
    let pairs: Vec<(FacetSide, FacetSide)> = marked
        .iter()
        .filter_map(|&s| Some((s, ws.mesh().other_side(s)?)))
        .collect();
    let after = |s: FacetSide| {
        let cell = corners.get(&s.cell).copied().unwrap_or_else(|| ws.mesh().cell(s.cell));
        let mut key: Vec<VertexId> = (0..N).filter(|&k| k != s.local as usize).map(|k| cell[k]).collect();
        key.sort_unstable();
        key
    };
    let opened: Vec<FacetSide> = pairs
        .iter()
        .filter(|(a, b)| after(*a) != after(*b))
        .map(|(a, _)| *a)
        .collect();
    replace_all(ws, &corners);
    let now = |c: CellId| ws.current(c).first().copied().unwrap_or(c);
    Lip {
        facets: opened
            .into_iter()
            .map(|s| FacetSide {
                cell: now(s.cell),
                local: s.local,
            })
            .collect(),
    }
}

/// Exchanges the corners of cells: all are taken out before any is put back, so that none finds a neighbour it had.
fn replace_all<const N: usize>(ws: &mut Workspace<'_, N>, corners: &BTreeMap<CellId, [VertexId; N]>) {
    let labels: Vec<_> = corners.keys().map(|&c| ws.mesh().facet_labels(c)).collect();
    for &c in corners.keys() {
        ws.take_out(c);
    }
    for ((&c, own), labels) in corners.iter().zip(labels) {
        ws.put_in(c, &[(*own, labels)]);
    }
}
