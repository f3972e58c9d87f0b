//! Measures of cells, tetrahedra (`N = 4`) and triangles (`N = 3`), and of whole meshes ([`report`], [`histograms`]), at
//! rest or deformed.

use crate::{CellId, Point, SimplexMesh, VertexId};

/// Ends of the six edges of a tetrahedron, in the order of [`edge_lengths`] and [`angles`].
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [0, 2], [1, 2]];

/// Ends of the edges of a cell with `N` corners.
pub fn edges<const N: usize>() -> &'static [[usize; 2]] {
    if N == 4 { &TET_EDGES } else { &TRIANGLE_EDGES }
}

/// Volume of a cell: signed, of a tetrahedron (m³); area of a triangle (m²), signed where it is parallel to the plane
/// `z = 0`.
#[inline]
pub fn cell_volume<const N: usize>(p: &[Point; N]) -> f64 {
    if N == 4 {
        return tet_volume(&[p[0], p[1], p[2], p[3]]);
    }
    let twice = (p[1] - p[0]).cross(&(p[2] - p[0]));
    let signed = twice.x == 0.0 && twice.y == 0.0;
    if signed { twice.z / 2.0 } else { twice.norm() / 2.0 }
}

/// Outward normal of a facet given by its corners in the order of [`SimplexMesh::facet_corners`], twice as long as the facet
/// is large: its area (m²) for a tetrahedron, its length (m) for a planar triangle.
#[inline]
pub fn facet_normal<const N: usize>(p: &[Point; 3]) -> Point {
    if N == 4 {
        return (p[1] - p[0]).cross(&(p[2] - p[0]));
    }
    let d = (p[1] - p[0]) * 2.0;
    Point::new(d.y, -d.x, 0.0)
}

/// Signed volume of a tetrahedron (m³).
#[inline]
pub fn tet_volume(p: &[Point; 4]) -> f64 {
    (p[1] - p[0]).cross(&(p[2] - p[0])).dot(&(p[3] - p[0])) / 6.0
}

/// Volume of a mesh at rest (m³); for triangles its area (m²).
pub fn volume<const N: usize>(mesh: &SimplexMesh<N>) -> f64 {
    let volume = |c| cell_volume(&corners(mesh, mesh.rest_positions(), c));
    mesh.cell_ids().map(volume).sum()
}

/// Radius ratio (inscribed over circumscribed sphere or circle) times `N - 1`: `3 r / R` of a tetrahedron, `2 r / R` of a
/// triangle. 1 for a regular cell, 0 for a flat one, negative for an inverted one.
pub fn radius_ratio<const N: usize>(p: &[Point; N]) -> f64 {
    if N == 3 {
        // r = 2 A / (a + b + c), R = a b c / (4 A)
        let area = cell_volume(p);
        let [a, b, c] = TRIANGLE_EDGES.map(|[i, j]| (p[j] - p[i]).norm());
        let d = (a + b + c) * a * b * c;
        return if d > 0.0 { 16.0 * area * area.abs() / d } else { 0.0 };
    }
    let (a, b, c) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let six_v = a.cross(&b).dot(&c);
    let areas2 = a.cross(&b).norm() + b.cross(&c).norm() + c.cross(&a).norm() + (b - a).cross(&(c - a)).norm();
    let q = a.norm_squared() * b.cross(&c) + b.norm_squared() * c.cross(&a) + c.norm_squared() * a.cross(&b);
    // r = six_v / areas2, R = |q| / (2 six_v)
    let d = areas2 * q.norm();
    if d > 0.0 { 6.0 * six_v * six_v.abs() / d } else { 0.0 }
}

/// Lengths (m) of the [`edges`] of a cell.
pub fn edge_lengths<const N: usize>(p: &[Point; N]) -> impl Iterator<Item = f64> + use<N> {
    let p = *p;
    edges::<N>().iter().map(move |[i, j]| (p[*j] - p[*i]).norm())
}

/// Angles (degrees, 0 to 180) inside a cell: the six [`dihedral_angles`] of a tetrahedron, the three at the corners of a
/// triangle.
pub fn angles<const N: usize>(p: &[Point; N]) -> impl Iterator<Item = f64> + use<N> {
    let (all, count) = if N == 4 {
        (dihedral_angles(&[p[0], p[1], p[2], p[3]]), 6)
    } else {
        let mut all = [0.0; 6];
        for k in 0..3 {
            let (u, v) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            all[k] = u.cross(&v).norm().atan2(u.dot(&v)).to_degrees();
        }
        (all, 3)
    };
    all.into_iter().take(count)
}

/// Angles (degrees, 0 to 180) between the two facets at each of the six edges [`TET_EDGES`]: arccos(1/3) = 70.53 for a
/// regular tetrahedron, all 0 or 180 for a flat one. An inverted one has the angles of its mirror image; an edge without
/// length has 0.
pub fn dihedral_angles(p: &[Point; 4]) -> [f64; 6] {
    const OPPOSITE: [[usize; 2]; 6] = [[2, 3], [1, 3], [1, 2], [0, 3], [0, 2], [0, 1]];
    let six_v = 6.0 * tet_volume(p).abs();
    let mut angles = [0.0; 6];
    for ((angle, [i, j]), [k, l]) in angles.iter_mut().zip(TET_EDGES).zip(OPPOSITE) {
        let e = p[j] - p[i];
        let (m, n) = (e.cross(&(p[k] - p[i])), e.cross(&(p[l] - p[i])));
        *angle = (e.norm() * six_v).atan2(m.dot(&n)).to_degrees(); // |m x n| = |e| 6V
    }
    angles
}

/// Longest edge over inradius (Y6): `2 sqrt 6 = 4.899` for a regular tetrahedron, `2 sqrt 3 = 3.464` for a regular
/// triangle, more than 200 is called bad there, infinite for a flat one. An inverted one has the value of its mirror image.
pub fn edge_over_inradius<const N: usize>(p: &[Point; N]) -> f64 {
    if N == 3 {
        let area = cell_volume(p).abs();
        let (longest, around) = edge_lengths(p).fold((0.0, 0.0), |(m, s), l| (f64::max(m, l), s + l));
        return if area > 0.0 {
            longest * around / (2.0 * area)
        } else {
            f64::INFINITY
        };
    }
    let (a, b, c) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let six_v = a.cross(&b).dot(&c).abs();
    let areas2 = a.cross(&b).norm() + b.cross(&c).norm() + c.cross(&a).norm() + (b - a).cross(&(c - a)).norm();
    let longest = edge_lengths(p).fold(0.0, f64::max);
    if six_v > 0.0 {
        longest * areas2 / six_v
    } else {
        f64::INFINITY
    }
}

/// Quality of a mesh in numbers; all zero for a mesh without cells. Lengths and volumes are compared as extremes over the
/// whole mesh, volumes without their sign; a ratio is infinite where the smallest is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QualityReport {
    /// How many cells there are.
    pub cells: usize,
    /// Smallest [`radius_ratio`].
    pub min_radius_ratio: f64,
    /// Mean [`radius_ratio`].
    pub mean_radius_ratio: f64,
    /// Smallest of the [`angles`] (degrees).
    pub min_dihedral_deg: f64,
    /// Largest of the [`angles`] (degrees).
    pub max_dihedral_deg: f64,
    /// Largest [`edge_over_inradius`].
    pub max_edge_over_inradius: f64,
    /// Largest cell over smallest cell, by volume.
    pub max_over_min_volume: f64,
    /// Longest edge over shortest edge.
    pub max_over_min_edge: f64,
}

/// Quality of the cells of a mesh with its vertices at `positions` (m), indexed by [`VertexId`] over all slots: the rest
/// positions, or deformed ones.
pub fn report<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point]) -> QualityReport {
    let mut sum = 0.0;
    let (mut ratio, mut angle, mut aspect) = (Range::default(), Range::default(), Range::default());
    let (mut volume, mut edge) = (Range::default(), Range::default());
    for cell in mesh.cell_ids() {
        let p = corners(mesh, positions, cell);
        let r = radius_ratio(&p);
        sum += r;
        ratio.add(r);
        angles(&p).for_each(|a| angle.add(a));
        aspect.add(edge_over_inradius(&p));
        volume.add(cell_volume(&p).abs());
        edge_lengths(&p).for_each(|l| edge.add(l));
    }
    let cells = mesh.num_cells();
    if cells == 0 {
        return QualityReport::default();
    }
    QualityReport {
        cells,
        min_radius_ratio: ratio.min,
        mean_radius_ratio: sum / cells as f64,
        min_dihedral_deg: angle.min,
        max_dihedral_deg: angle.max,
        max_edge_over_inradius: aspect.max,
        max_over_min_volume: volume.ratio(),
        max_over_min_edge: edge.ratio(),
    }
}

/// Positions of a cell's corners, of a triangle of a surface in space so that its area is positive: which of its sides is
/// up says nothing there.
fn corners<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point], cell: CellId) -> [Point; N] {
    let mut p = mesh.cell(cell).map(|v| positions[v.index()]);
    if N == 3 && !mesh.is_planar() && cell_volume(&p) < 0.0 {
        p.swap(1, 2);
    }
    p
}

struct Range {
    min: f64,
    max: f64,
}

impl Default for Range {
    fn default() -> Self {
        Range {
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
        }
    }
}

impl Range {
    fn add(&mut self, value: f64) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
    }

    fn ratio(&self) -> f64 {
        if self.min > 0.0 {
            self.max / self.min
        } else {
            f64::INFINITY
        }
    }
}

/// How often a measure falls into each of some ranges.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// What is measured.
    pub measure: &'static str,
    /// Ends of the ranges, ascending: one more than there are counts. A range includes its lower end, the last both.
    pub edges: Vec<f64>,
    /// How many values lie in each range.
    pub counts: Vec<usize>,
    /// How many values lie below the first range (inverted cells), or are not numbers.
    pub below: usize,
    /// How many values lie above the last range.
    pub above: usize,
}

impl Histogram {
    fn new(measure: &'static str, edges: Vec<f64>, values: impl Iterator<Item = f64>) -> Self {
        let mut histogram = Histogram {
            measure,
            counts: vec![0; edges.len() - 1],
            edges,
            below: 0,
            above: 0,
        };
        let last = histogram.counts.len() - 1;
        for value in values {
            match histogram.edges.partition_point(|&e| e <= value) {
                0 => histogram.below += 1,
                n if n <= last + 1 => histogram.counts[n - 1] += 1,
                _ if value == histogram.edges[last + 1] => histogram.counts[last] += 1,
                _ => histogram.above += 1,
            }
        }
        histogram
    }
}

/// Histograms of every measure, with `bins` ranges each (at least one), for vertices at `positions` as in [`report`]:
/// `radius_ratio` from 0 to 1, `dihedral_deg` (triangles: `angle_deg`) from 0 to 180 for all [`angles`],
/// `edge_over_inradius` from that of a regular cell to the bad 200 in equal factors, `volume_over_mean` and `edge_over_mean` (every edge once) from 0 to 4.
pub fn histograms<const N: usize>(mesh: &SimplexMesh<N>, positions: &[Point], bins: usize) -> Vec<Histogram> {
    let bins = bins.max(1);
    let steps = || (0..=bins).map(|k| k as f64 / bins as f64);
    let linear = |upper: f64| steps().map(|s| s * upper).collect::<Vec<_>>();
    let regular = 0.999_999 * if N == 4 { 24.0_f64 } else { 12.0 }.sqrt(); // rounding must not put a regular cell below
    let factors = steps().map(|s| regular * (200.0 / regular).powf(s)).collect();
    let cells: Vec<[Point; N]> = mesh.cell_ids().map(|c| corners(mesh, positions, c)).collect();
    let mut edges: Vec<[VertexId; 2]> = mesh
        .cell_ids()
        .flat_map(|c| {
            edges::<N>()
                .iter()
                .map(move |[i, j]| [mesh.cell(c)[*i], mesh.cell(c)[*j]])
        })
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let lengths: Vec<f64> = edges
        .iter()
        .map(|[a, b]| (positions[a.index()] - positions[b.index()]).norm())
        .collect();
    let volumes: Vec<f64> = cells.iter().map(cell_volume).collect();
    let over_mean = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter().map(|v| v / mean).collect::<Vec<_>>()
    };
    vec![
        Histogram::new(
            "radius_ratio",
            linear(1.0),
            cells.iter().map(radius_ratio).map(at_most_one),
        ),
        Histogram::new(
            if N == 4 { "dihedral_deg" } else { "angle_deg" },
            linear(180.0),
            cells.iter().flat_map(angles),
        ),
        Histogram::new("edge_over_inradius", factors, cells.iter().map(edge_over_inradius)),
        Histogram::new("volume_over_mean", linear(4.0), over_mean(&volumes).into_iter()),
        Histogram::new("edge_over_mean", linear(4.0), over_mean(&lengths).into_iter()),
    ]
}

/// Rounding can lift the ratio of a regular cell above one.
fn at_most_one(ratio: f64) -> f64 {
    ratio.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{TetMesh, TriMesh, generate};

    fn regular() -> [Point; 4] {
        [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]].map(Point::from)
    }

    fn corner() -> [Point; 4] {
        [Point::zeros(), Point::x(), Point::y(), Point::z()]
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-13 * b.abs().max(1.0)
    }

    #[test]
    fn a_surface_in_space_has_no_sense() {
        let points = [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]].map(|p| Point::from(p.map(f64::from)));
        let report_of = |flat| {
            let cells = vec![if flat { [0, 2, 1] } else { [0, 1, 2] }, [0, 3, 2]];
            let mesh = TriMesh::new(points.to_vec(), cells).unwrap();
            assert!(!mesh.is_planar());
            assert_eq!(volume(&mesh), 2.0, "the area of each triangle counts");
            assert!(histograms(&mesh, mesh.rest_positions(), 4).iter().all(|h| h.below == 0));
            report(&mesh, mesh.rest_positions())
        };
        assert!(close(report_of(true).min_radius_ratio, 2.0 * 2.0_f64.sqrt() - 2.0));
        assert_eq!(report_of(true), report_of(false));
    }

    #[test]
    fn a_regular_tetrahedron_has_the_best_of_all_measures() {
        let p = regular();
        assert!(tet_volume(&p) > 0.0);
        assert!(close(radius_ratio(&p), 1.0));
        assert!(close(edge_over_inradius(&p), 2.0 * 6.0_f64.sqrt()));
        assert!(
            dihedral_angles(&p)
                .iter()
                .all(|&a| close(a, (1.0_f64 / 3.0).acos().to_degrees()))
        );
        assert!(edge_lengths(&p).all(|l| close(l, 8.0_f64.sqrt())));
    }

    #[test]
    fn the_corner_of_a_cube_has_known_measures() {
        let p = corner();
        // r = (3 - sqrt 3) / 6, R = sqrt 3 / 2
        let r = (3.0 - 3.0_f64.sqrt()) / 6.0;
        assert!(close(radius_ratio(&p), 3.0 * r / (3.0_f64.sqrt() / 2.0)));
        assert!(close(edge_over_inradius(&p), 2.0_f64.sqrt() / r));
        let slope = 2.0_f64.sqrt().atan().to_degrees();
        let expected = [90.0, 90.0, 90.0, slope, slope, slope];
        assert!(dihedral_angles(&p).iter().zip(expected).all(|(&a, b)| close(a, b)));
        assert_eq!(edge_lengths(&p).take(3).collect::<Vec<_>>(), [1.0; 3]);
    }

    #[test]
    fn measures_do_not_depend_on_scale_place_or_numbering() {
        let q = regular().map(|p| p.component_mul(&Point::new(1.0, 0.2, 0.7)));
        let moved = q.map(|p| 1e-4 * p + Point::new(3e-3, 1e-3, -2e-3));
        let turned = [q[1], q[2], q[0], q[3]];
        for other in [moved, turned] {
            assert!((radius_ratio(&q) - radius_ratio(&other)).abs() < 1e-12);
            assert!((edge_over_inradius(&q) - edge_over_inradius(&other)).abs() < 1e-11);
            let sum = |p: &[Point; 4]| dihedral_angles(p).iter().sum::<f64>();
            assert!((sum(&q) - sum(&other)).abs() < 1e-9);
        }
        let inverted = [q[1], q[0], q[2], q[3]];
        assert!(close(radius_ratio(&inverted), -radius_ratio(&q)));
        assert!(close(edge_over_inradius(&inverted), edge_over_inradius(&q)));
    }

    #[test]
    fn flat_and_collapsed_cells_give_no_nan() {
        let flat = [Point::zeros(), Point::x(), Point::y(), Point::new(1.0, 1.0, 0.0)];
        for p in [flat, [Point::x(); 4]] {
            assert_eq!(radius_ratio(&p), 0.0);
            assert_eq!(edge_over_inradius(&p), f64::INFINITY);
            assert!(dihedral_angles(&p).iter().all(|&a| a == 0.0 || a == 180.0));
        }
    }

    #[test]
    fn the_report_of_a_kuhn_cube_is_known() {
        let mesh = generate::box_tets([2.0, 2.0, 2.0], [2, 2, 2], [0.0; 3]);
        let r = report(&mesh, mesh.rest_positions());
        assert_eq!(r.cells, 48);
        assert!(close(r.min_radius_ratio, r.mean_radius_ratio));
        assert!(close(r.min_dihedral_deg, 45.0) && close(r.max_dihedral_deg, 90.0));
        assert!(close(r.max_over_min_volume, 1.0) && close(r.max_over_min_edge, 3.0_f64.sqrt()));
        let stretched: Vec<Point> = mesh
            .rest_positions()
            .iter()
            .map(|p| Point::new(3.0 * p.x, p.y, p.z))
            .collect();
        let s = report(&mesh, &stretched);
        assert!(s.min_radius_ratio < r.min_radius_ratio && close(s.max_over_min_edge, 11.0_f64.sqrt()));
    }

    #[test]
    fn an_empty_mesh_is_all_zeros() {
        let mesh = generate::box_tets([1.0; 3], [0; 3], [0.0; 3]);
        assert_eq!(report(&mesh, mesh.rest_positions()), QualityReport::default());
        assert!(
            histograms(&mesh, &[], 10)
                .iter()
                .all(|h| h.counts == [0; 10] && h.below + h.above == 0)
        );
    }

    #[test]
    fn histograms_count_every_value_once() {
        let mesh = generate::box_tets([1.0, 2.0, 3.0], [2, 2, 2], [0.0; 3]);
        let all = histograms(&mesh, mesh.rest_positions(), 7);
        // 2 x 2 x 2 Kuhn cells: 54 grid edges, 36 face and 8 inner diagonals
        for (histogram, values) in all.iter().zip([48, 6 * 48, 48, 48, 98]) {
            let inside: usize = histogram.counts.iter().sum();
            assert_eq!(
                (inside, histogram.below, histogram.above),
                (values, 0, 0),
                "{}",
                histogram.measure
            );
            assert!(histogram.edges.is_sorted() && histogram.edges.len() == 8);
        }
        let one = TetMesh::new(regular().to_vec(), vec![[0, 1, 2, 3]]).unwrap();
        let all = histograms(&one, one.rest_positions(), 5);
        assert_eq!(all[0].counts, [0, 0, 0, 0, 1]);
        assert_eq!(all[2].counts, [1, 0, 0, 0, 0]);
        let mirrored: Vec<Point> = one.rest_positions().iter().map(|p| -p).collect();
        assert_eq!(histograms(&one, &mirrored, 5)[0].below, 1);
    }

    #[test]
    fn triangles_have_the_measures_of_their_circles() {
        let height = 0.75_f64.sqrt();
        let regular = [Point::zeros(), Point::x(), Point::new(0.5, height, 0.0)];
        assert!(close(radius_ratio(&regular), 1.0) && close(edge_over_inradius(&regular), 2.0 * 3.0_f64.sqrt()));
        assert!(angles(&regular).all(|a| close(a, 60.0)) && angles(&regular).count() == 3);
        let corner = [Point::zeros(), Point::x(), Point::y()];
        // r = (2 - sqrt 2) / 2, R = sqrt 2 / 2
        assert!(close(
            radius_ratio(&corner),
            2.0 * (2.0 - 2.0_f64.sqrt()) / 2.0_f64.sqrt()
        ));
        assert!(close(cell_volume(&corner), 0.5));
        let turned = [corner[0], corner[2], corner[1]];
        assert!(close(radius_ratio(&turned), -radius_ratio(&corner)));
        let leaning = corner.map(|p| Point::new(p.x, p.y, p.x));
        assert!(close(cell_volume(&leaning), 0.5_f64.sqrt()));
        let flat = [Point::zeros(), Point::x(), 2.0 * Point::x()];
        assert_eq!((radius_ratio(&flat), edge_over_inradius(&flat)), (0.0, f64::INFINITY));
        let mesh = TriMesh::new(
            vec![Point::zeros(), Point::x(), Point::y(), Point::new(1.0, 1.0, 0.0)],
            vec![[0, 1, 2], [1, 3, 2]],
        )
        .unwrap();
        let r = report(&mesh, mesh.rest_positions());
        assert!(close(r.min_dihedral_deg, 45.0) && close(r.max_dihedral_deg, 90.0) && close(volume(&mesh), 1.0));
        let counted: Vec<usize> = histograms(&mesh, mesh.rest_positions(), 4)
            .iter()
            .map(|h| h.counts.iter().sum())
            .collect();
        assert_eq!(counted, [2, 6, 2, 2, 5]);
    }
}
