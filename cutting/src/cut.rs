//! A cut from beginning to end.

use std::collections::BTreeSet;
use std::time::Instant;

use kerfem_mesh::{
    BoxTree, CellId, FacetLabel, FacetSide, MeshChange, Point, SimplexMesh, VertexId, predicates::orientation, quality,
};

use serde::{Deserialize, Serialize};

use crate::improve::{self, Bad, Limits, Work};
use crate::separate::Lip;
use crate::sheet::Rule;
use crate::sweep::Piece;
use crate::workspace::Workspace;
use crate::{Sweep, delete, front, region, separate, sheet, unlock};

/// What input a cut cannot use.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CutError {
    /// The sweep has a coordinate that is not finite or an index out of range.
    #[error("bad sweep: {reason}; accepted: finite points and triangles of existing points")]
    BadSweep {
        /// What is wrong.
        reason: String,
    },
    /// The sweep and the mesh are not of one kind.
    #[error("{0}")]
    WrongKind(&'static str),
    /// The snap threshold is out of range.
    #[error("snap = {value} is out of range; accepted: 0 to 0.45 of the local size of the mesh")]
    BadSnap {
        /// The value given.
        value: f64,
    },
    /// The wanted quality is out of range.
    #[error("quality = {value} is out of range; accepted: 0 to 0.7, the radius ratio below which cells are improved")]
    BadQuality {
        /// The value given.
        value: f64,
    },
    /// Positions do not belong to the mesh.
    #[error("{given} cutting-frame positions were given for {slots} vertex slots")]
    BadPositions {
        /// How many were given.
        given: usize,
        /// How many the mesh has room for.
        slots: usize,
    },
}

/// Why a cut was not made; the mesh is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A cell near the sweep is inverted in the cutting frame, so places in it have no rest place (F19).
    #[error("cell {cell} near the sweep is inverted in the deformed state")]
    InvertedCell {
        /// The cell.
        cell: u32,
    },
    /// A new cell would have no volume.
    #[error("a new cell inside cell {parent} would have no volume")]
    FlatCell {
        /// The cell that it would come from.
        parent: u32,
    },
    /// Paths between cells met edges of the sweep at every attempt, so that sides could not be told.
    #[error("the sides of the sweep could not be told apart near {x}, {y}, {z}")]
    AmbiguousSides {
        /// First coordinate of a point of the sweep.
        x: f64,
        /// Second coordinate.
        y: f64,
        /// Third coordinate.
        z: f64,
    },
    /// Ever more vertices would have to come in, as where a sweep crosses itself many times inside one cell and nothing may be
    /// snapped.
    #[error(
        "the sweep would break cells near it into more than {most}; a sweep that does not cross itself, or a larger snap, may do"
    )]
    Crumbles {
        /// So many cells may come of those near the sweep.
        most: usize,
    },
}

/// How the mesh is made to follow the sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// B1: remove the cells that the sweep crosses.
    Delete,
    /// B2: split every crossed edge where the sweep crosses it (unless an end is within 1e-5 of the local size: it takes the
    /// cut); cells may become arbitrarily bad.
    Subdivide,
    /// B3: move vertices onto the sweep and separate along existing facets; no new cells.
    Snap,
    /// S: cut-vertices near the sweep are snapped onto it, other edges are split.
    Hybrid,
    /// G: crossed edges are split, then the shortest edges of bad cells collapse, the worst cell first. Tetrahedra only.
    Collapse,
    /// Y: crossed edges are split, then the shortest edges of cells that are uneven and small compared with their neighbours
    /// merge. Tetrahedra only.
    Merge,
}

impl Method {
    /// All methods, by name.
    pub const NAMES: [(&'static str, Method); 6] = [
        ("delete", Method::Delete),
        ("subdivide", Method::Subdivide),
        ("snap", Method::Snap),
        ("hybrid", Method::Hybrid),
        ("collapse", Method::Collapse),
        ("merge", Method::Merge),
    ];

    /// Whether cells are improved after a cut if nothing is said: by all but the baselines (B1-B3).
    pub fn improves(self) -> bool {
        matches!(self, Method::Hybrid | Method::Collapse | Method::Merge)
    }
}

/// Settings of a cut.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutOptions {
    /// How the mesh follows the sweep.
    pub method: Method,
    /// Threshold `d` as a fraction of the local size of the mesh
    /// ([`SimplexMesh::local_size`], the mean rest edge before any cut; S3), 0 to 0.45. [`Method::Subdivide`],
    /// [`Method::Collapse`] and [`Method::Merge`] snap nothing; half of it bounds how far cells of the cut face that are
    /// improved may come to lie from the sweep.
    pub snap: f64,
    /// Whether cells near the cut that came out badly are improved: vertices moved, edges and facets swapped, edges collapsed,
    /// vertices inserted. Tetrahedra only.
    pub improve: bool,
    /// Whether vertices around those that were moved onto the sweep are relaxed (S10). It spreads what snapping pressed
    /// together over more cells: a few percent fewer iterations of a solver for about three times the cells touched.
    pub relax: bool,
    /// Radius ratio below which a cell counts as bad (`tau` of G2), 0 to 0.7.
    pub quality: f64,
    /// How many operations may be made to improve cells; what is left over is in [`CutReport::unfinished`].
    pub operations: usize,
}

impl CutOptions {
    /// The method with its usual settings.
    pub fn of(method: Method) -> Self {
        CutOptions {
            method,
            snap: 0.2,
            improve: method.improves(),
            relax: false,
            quality: 0.3,
            operations: usize::MAX,
        }
    }

    fn check<const N: usize>(&self) -> Result<(), CutError> {
        if !(0.0..=0.45).contains(&self.snap) {
            return Err(CutError::BadSnap { value: self.snap });
        }
        if !(0.0..=0.7).contains(&self.quality) {
            return Err(CutError::BadQuality { value: self.quality });
        }
        if N == 3 && matches!(self.method, Method::Collapse | Method::Merge) {
            return Err(CutError::WrongKind(
                "triangles cannot be cut by the methods collapse and merge; accepted: delete, subdivide, snap, hybrid",
            ));
        }
        Ok(())
    }
}

fn check_positions<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point]) -> Result<(), CutError> {
    match positions.len() == mesh.vertex_slots() {
        true => Ok(()),
        false => Err(CutError::BadPositions {
            given: positions.len(),
            slots: mesh.vertex_slots(),
        }),
    }
}

impl Default for CutOptions {
    fn default() -> Self {
        CutOptions::of(Method::Hybrid)
    }
}

/// What moving a vertex onto the sweep must not shift: borders between materials, and between parts of a flat boundary that
/// carry different conditions.
#[derive(Clone, Copy)]
pub struct Borders<'a> {
    /// Material of a cell of the mesh before the cut; cells of one material have one number.
    pub cell_group: &'a dyn Fn(CellId) -> u64,
    /// Conditions on a facet of the original boundary, by its label and its vertices; alike facets have one number.
    pub facet_group: &'a dyn Fn(FacetLabel, [VertexId; 3]) -> u64,
    /// Conditions on a vertex of the mesh before the cut; with any but zero it is neither moved nor merged to improve cells.
    pub vertex_group: &'a dyn Fn(VertexId) -> u64,
}

impl Borders<'_> {
    /// One material, the same conditions everywhere.
    pub const NONE: Borders<'static> = Borders {
        cell_group: &|_| 0,
        facet_group: &|_, _| 0,
        vertex_group: &|_| 0,
    };
}

/// What a cut did beyond the [`MeshChange`].
#[derive(Clone, Debug, Default)]
pub struct CutReport {
    /// Seconds spent finding cells near the sweep.
    pub find_seconds: f64,
    /// Seconds spent changing the mesh.
    pub remesh_seconds: f64,
    /// Seconds spent improving cells.
    pub improve_seconds: f64,
    /// Operations made to improve cells.
    pub operations: usize,
    /// Bad cells that were still to be looked at when the operations allowed were used up, ascending.
    pub unfinished: Vec<CellId>,
    /// Area of one lip at rest (m²); its length (m) in a planar mesh.
    pub area: f64,
    /// Largest distance from a corner, edge midpoint or centre of a new face to the sweep, in the cutting frame (m).
    pub max_distance_to_sweep: f64,
    /// Why nothing was changed, if the cut was refused.
    pub refused: Vec<Refusal>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Nodes of the box tree looked at.
    pub tree_nodes: usize,
}

/// The result of [`cut`].
#[derive(Clone, Debug, Default)]
pub struct CutOutcome<const N: usize = 4> {
    /// What changed.
    pub change: MeshChange<N>,
    /// Cutting-frame positions (m) of the vertices that are new or moved, ascending.
    pub positions: Vec<(VertexId, Point)>,
    /// Areas, distances, refusals, warnings.
    pub report: CutReport,
}

/// Cuts a mesh of tetrahedra by a surface, or a planar mesh of triangles by line segments, in one transaction.
///
/// `positions` (m, one for each vertex slot) are those of the cutting frame: rest positions, or deformed ones; `tree` holds
/// the boxes of all cells in that frame, by cell number. New rest positions follow by the same weights (S4), so the
/// displacement field is unchanged where nothing moved. Pieces of the sweep that are not connected cut one after another. A
/// sweep that touches nothing, lies on the boundary or repeats a cut changes nothing and gives a warning. A refusal leaves
/// everything as it was.
///
/// # Errors
/// [`CutError`] for input that is out of range.
pub fn cut<const N: usize>(
    mesh: &mut SimplexMesh<N>,
    tree: &BoxTree,
    positions: &[Point],
    sweep: &Sweep,
    options: &CutOptions,
) -> Result<CutOutcome<N>, CutError> {
    cut_within(mesh, tree, positions, sweep, options, Borders::NONE)
}

/// [`cut`] for a body of several materials or with conditions on parts of a flat face: no vertex moves that would shift a
/// border between them, so mass and loads stay what they were.
///
/// # Errors
/// As [`cut`].
pub fn cut_within<const N: usize>(
    mesh: &mut SimplexMesh<N>,
    tree: &BoxTree,
    positions: &[Point],
    sweep: &Sweep,
    options: &CutOptions,
    borders: Borders<'_>,
) -> Result<CutOutcome<N>, CutError> {
    options.check::<N>()?;
    check_positions(mesh, positions)?;
    sweep.fits(mesh)?;
    let mut report = CutReport::default();
    let mut ws = Workspace::new(mesh, positions, borders);
    if let Err(refusal) = cut_by_pieces(&mut ws, tree, sweep, options, &mut report) {
        let refused = vec![refusal];
        return Ok(CutOutcome {
            report: CutReport {
                refused,
                area: 0.0,
                max_distance_to_sweep: 0.0,
                ..report
            },
            ..CutOutcome::default()
        });
    }
    // doubling gave cells at the lips new numbers
    let current = report
        .unfinished
        .iter()
        .flat_map(|c| ws.current(*c))
        .collect::<BTreeSet<_>>();
    report.unfinished = current.into_iter().filter(|c| ws.mesh().has_cell(*c)).collect();
    let changed = ws.changed_positions();
    let change = ws.edit.commit();
    if change.is_empty() {
        report
            .warnings
            .push("the sweep changes nothing: it misses the body, lies on its boundary or repeats a cut".into());
    }
    let positions = if change.is_empty() { Vec::new() } else { changed };
    Ok(CutOutcome {
        change,
        positions,
        report,
    })
}

/// Improves bad cells among some, with no cut: what a cut left over for want of operations ([`CutReport::unfinished`]).
/// `positions` as for [`cut`]; cells that are no more are passed over.
///
/// # Errors
/// As [`cut`].
pub fn improve<const N: usize>(
    mesh: &mut SimplexMesh<N>,
    positions: &[Point],
    cells: &[CellId],
    options: &CutOptions,
    borders: Borders<'_>,
) -> Result<CutOutcome<N>, CutError> {
    options.check::<N>()?;
    check_positions(mesh, positions)?;
    let mut report = CutReport::default();
    let mut ws = Workspace::new(mesh, positions, borders);
    let live: Vec<CellId> = (cells.iter().copied())
        .filter(|c| ws.mesh().has_cell(*c) && is_positive(&ws.cell_positions(*c)))
        .collect();
    improve_cells(&mut ws, At::Open, options, live, &mut report);
    let positions = ws.changed_positions();
    Ok(CutOutcome {
        change: ws.edit.commit(),
        positions,
        report,
    })
}

/// Passes until a pass opens nothing, so that the same sweep again is a no-op by construction (F31). The first pass does
/// nearly all there is to do.
const PASSES: usize = 12;

/// Cells that may come of each cell near the sweep and of each triangle of the sweep, and how many in any case, before a cut is
/// refused. Splitting a cell gives nine at most; passes and curved sweeps add to that.
const PIECES_OF_A_CELL: usize = 100;
const LEAST_MOST: usize = 1000;

/// Rounds over the pieces until none opens anything: a piece that takes vertices from an earlier one leaves that to be cut
/// again.
const ROUNDS: usize = 4;

fn cut_by_pieces<const N: usize>(
    ws: &mut Workspace<'_, N>,
    tree: &BoxTree,
    sweep: &Sweep,
    options: &CutOptions,
    report: &mut CutReport,
) -> Result<(), Refusal> {
    for _ in 0..ROUNDS {
        let mut opened = false;
        for piece in sweep.pieces() {
            opened |= cut_by_piece(ws, tree, piece, sweep, options, report)?;
        }
        if !opened || sweep.pieces().len() == 1 {
            break;
        }
    }
    Ok(())
}

/// Whether anything was opened.
fn cut_by_piece<const N: usize>(
    ws: &mut Workspace<'_, N>,
    tree: &BoxTree,
    piece: &Piece,
    sweep: &Sweep,
    options: &CutOptions,
    report: &mut CutReport,
) -> Result<bool, Refusal> {
    for round in 0..PASSES {
        let start = Instant::now();
        ws.on.clear();
        ws.exact.clear();
        report.tree_nodes += region::find(ws, tree, piece);
        report.find_seconds += start.elapsed().as_secs_f64();
        if round == 0 {
            ws.most_cells = PIECES_OF_A_CELL * (ws.region.len() + piece.triangles().len()) + LEAST_MOST;
        }
        let start = Instant::now();
        let improving = report.improve_seconds;
        let goes_on = pass(ws, piece, sweep, options, report)?;
        report.remesh_seconds += start.elapsed().as_secs_f64() - (report.improve_seconds - improving);
        if !goes_on {
            return Ok(round > 0);
        }
    }
    Ok(true)
}

/// One pass over a piece: whether it changed anything that another pass might add to.
fn pass<const N: usize>(
    ws: &mut Workspace<'_, N>,
    piece: &Piece,
    sweep: &Sweep,
    options: &CutOptions,
    report: &mut CutReport,
) -> Result<bool, Refusal> {
    if let Some(&cell) = ws.region.iter().find(|&&c| !is_positive(&ws.cell_positions(c))) {
        return Err(Refusal::InvertedCell { cell: cell.0 });
    }
    let save = ws.savepoint();
    let snap = options.snap;
    let improves = N == 4 && (options.improve || matches!(options.method, Method::Collapse | Method::Merge));
    let present = if improves { snap.max(PRESENT) } else { snap };
    match options.method {
        Method::Delete => {
            let left = delete::remove_crossed(ws, piece);
            // what is left may hang together by edges and vertices only
            separate::open_pinched(ws, left);
            return Ok(false);
        }
        Method::Subdivide if !improves => place(ws, piece, RESOLUTION, Rule::SnapWithin(RESOLUTION), RESOLUTION),
        Method::Hybrid => place(ws, piece, snap, Rule::SnapWithin(snap), present),
        Method::Subdivide | Method::Collapse | Method::Merge => {
            place(ws, piece, snap, Rule::SplitBeyond(snap), present);
        }
        Method::Snap => {
            sheet::take_present(ws, piece, snap);
            sheet::open(ws, piece, Rule::SnapAlways, snap);
        }
    }
    if ws.crumbles() {
        return Err(Refusal::Crumbles { most: ws.most_cells });
    }
    if !mark(ws, piece, snap, sweep.splinter())? {
        ws.restore(save);
        return Ok(false);
    }
    let splits = options.method != Method::Snap;
    let least = if options.method == Method::Subdivide { 0.0 } else { snap };
    if splits {
        unlock::split_locked(ws, least);
    }
    check_new_cells(ws)?;
    // what is left of a cut that was made must not open by improving its cells (F31)
    if N == 4 && !unlock::opens_something(ws) {
        ws.restore(save);
        return Ok(false);
    }
    let near = ws.region.iter().copied().collect();
    improve_cells(ws, At::Sheet(piece), options, near, report);
    if splits && unlock::split_locked(ws, least) {
        check_new_cells(ws)?;
        improve_cells(ws, At::FixedSheet(piece), options, Vec::new(), report);
    }
    if !splits {
        unlock::leave_hinges_closed(ws);
    }
    let lip = separate::open(ws);
    if lip.facets.is_empty() {
        ws.restore(save);
        return Ok(false);
    }
    measure(ws, &lip, sweep, report);
    Ok(true)
}

/// Of the local size: how near a vertex takes the cut although nothing is to be snapped. Coordinates in files are often
/// of single precision; what is nearer is meant to be there.
const RESOLUTION: f64 = 1e-5;

/// Of the local size: how near a vertex of an earlier cut face takes a cut whose cells are improved, whatever the threshold.
/// Edges put in by then may cross a curved sweep that near beside the vertex, and must not be cut again.
const PRESENT: f64 = 0.2;

/// Puts vertices along the piece: at its front, where those nearer than the fraction `snap` of their local size are snapped,
/// then where it crosses edges, by a rule.
fn place<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, snap: f64, rule: Rule, present: f64) {
    sheet::take_present(ws, piece, present);
    front::place(ws, piece, snap);
    sheet::open(ws, piece, rule, present);
}

fn mark<const N: usize>(ws: &mut Workspace<'_, N>, piece: &Piece, snap: f64, splinter: f64) -> Result<bool, Refusal> {
    let p = piece.triangles()[0][0];
    separate::mark_sheet(ws, piece, snap, splinter).ok_or(Refusal::AmbiguousSides { x: p.x, y: p.y, z: p.z })
}

/// Cells that Y5 merges away: both measures are beyond what cutting regular cells in halves makes.
const UNEVEN: Bad = Bad::Uneven {
    aspect: 15.0,
    edges: 3.0,
};

/// When cells are improved.
#[derive(Clone, Copy)]
enum At<'a> {
    /// While the cut is a sheet inside the body, along this piece.
    Sheet(&'a Piece),
    /// So too, but which facets are the sheet is settled: others might not open.
    FixedSheet(&'a Piece),
    /// Afterwards.
    Open,
}

/// What the method and the maintenance of quality do to cells.
fn improve_cells<const N: usize>(
    ws: &mut Workspace<'_, N>,
    at: At<'_>,
    options: &CutOptions,
    cells: Vec<CellId>,
    report: &mut CutReport,
) {
    if N != 4 {
        return;
    }
    let own = match options.method {
        Method::Collapse => Some((Bad::Below(options.quality), Work::Collapse)),
        Method::Merge => Some((UNEVEN, Work::Collapse)),
        _ => None,
    };
    let maintain = options.improve.then_some((Bad::Below(options.quality), Work::All));
    let start = Instant::now();
    let limits = Limits {
        piece: match at {
            At::Sheet(piece) | At::FixedSheet(piece) => Some(piece),
            At::Open => None,
        },
        is_fixed: matches!(at, At::FixedSheet(_)),
        sheet: options.snap / 2.0,
        floor: options.quality,
    };
    if options.relax && matches!(at, At::Sheet(_)) {
        let moved = ws.moved_vertices();
        report.operations += improve::relax(ws, &limits, &moved);
    }
    for task in own.into_iter().chain(maintain) {
        let near: BTreeSet<CellId> = cells.iter().copied().filter(|c| ws.mesh().has_cell(*c)).collect();
        let near = near.union(&ws.cells_of_changed()).copied().collect::<Vec<_>>();
        let left = options.operations - report.operations.min(options.operations);
        let done = improve::run(ws, &limits, task, near, left);
        report.operations += done.operations;
        report.unfinished.extend(done.left);
    }
    report.unfinished.sort_unstable();
    report.unfinished.dedup();
    report.improve_seconds += start.elapsed().as_secs_f64();
}

fn is_positive<const N: usize>(p: &[Point; N]) -> bool {
    // exactly, and as the volume that mechanics will compute
    orientation(p) > 0.0 && quality::cell_volume(p) > 0.0
}

fn check_new_cells<const N: usize>(ws: &Workspace<'_, N>) -> Result<(), Refusal> {
    let flat = |c: &&CellId| !is_positive(&ws.cell_positions(**c)) || !is_positive(&ws.mesh().cell_rest_positions(**c));
    match ws.region.iter().find(flat) {
        Some(&c) => Err(Refusal::FlatCell {
            parent: ws.edit.ancestor(c).0,
        }),
        None => Ok(()),
    }
}

fn measure<const N: usize>(ws: &Workspace<'_, N>, lip: &Lip, sweep: &Sweep, report: &mut CutReport) {
    let corners = |s: FacetSide| ws.mesh().facet_corners(s);
    let mut points: Vec<Point> = Vec::new();
    let mut vertices = BTreeSet::new();
    for &side in &lip.facets {
        let v = corners(side);
        let rest = v.map(|u| ws.mesh().rest_position(u));
        report.area += quality::facet_normal::<N>(&rest).norm() / 2.0;
        let p = v.map(|u| ws.position(u));
        points.push((p[0] + p[1] + p[2]) / 3.0);
        points.extend([(0, 1), (1, 2), (2, 0)].map(|(i, j)| (p[i] + p[j]) / 2.0));
        vertices.extend(v);
    }
    points.extend(vertices.into_iter().map(|v| ws.position(v)));
    let farthest = points.iter().map(|p| sweep.distance(p)).fold(0.0, f64::max);
    report.max_distance_to_sweep = report.max_distance_to_sweep.max(farthest);
}
