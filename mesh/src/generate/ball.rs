//! Balls of tetrahedra.

use std::collections::HashMap;

use super::{check_count, oriented};
use crate::{MeshError, Point, TetMesh};

/// Corners of an icosahedron (not normalised), up to the golden ratio: `(x, y, z)` in units where 2 stands for it.
const ICOSAHEDRON: [[i8; 3]; 12] = [
    [-1, 2, 0],
    [1, 2, 0],
    [-1, -2, 0],
    [1, -2, 0],
    [0, -1, 2],
    [0, 1, 2],
    [0, -1, -2],
    [0, 1, -2],
    [2, 0, -1],
    [2, 0, 1],
    [-2, 0, -1],
    [-2, 0, 1],
];

/// Faces of the icosahedron, corners ascending.
const FACES: [[usize; 3]; 20] = [
    [0, 1, 5],
    [0, 1, 7],
    [0, 5, 11],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [1, 7, 8],
    [1, 8, 9],
    [2, 3, 4],
    [2, 3, 6],
    [2, 4, 11],
    [2, 6, 10],
    [2, 10, 11],
    [3, 4, 9],
    [3, 6, 8],
    [3, 8, 9],
    [4, 5, 9],
    [4, 5, 11],
    [6, 7, 8],
    [6, 7, 10],
];

/// A ball of `20 layers^3` tetrahedra in concentric `layers`, with a vertex at `center` (m) and those of the outermost
/// layer on the sphere of `radius` (m). The polyhedron lies inside the ball, its volume converges to `4/3 pi r^3` with the
/// square of the number of layers (39% too small at one, 13% at two, 1.5% at six, 0.06% at thirty). Zero layers or a radius
/// that is not positive give an empty mesh.
///
/// Twenty tetrahedra from the centre to the faces of an icosahedron, each cut into `layers^3` along planes parallel to its
/// facets (the octahedra in between along their shortest diagonal), then moved outwards along rays. Radius ratio `3 r / R`
/// 0.70 or more, 0.86 or more in the mean; dihedral angles 36 to 119 degrees; longest over shortest edge at most 2.1 (seen
/// up to thirty layers).
///
/// # Errors
/// [`MeshError`] if there are too many cells, a coordinate is not finite, or cells have no volume because the ball is too
/// small for the rounding at its place.
pub fn ball_tets(center: [f64; 3], radius: f64, layers: usize) -> Result<TetMesh, MeshError> {
    if layers == 0 || radius.is_nan() || radius <= 0.0 {
        return TetMesh::new(Vec::new(), Vec::new());
    }
    let cells = (0..3).fold(20, |n: usize, _| n.saturating_mul(layers));
    check_count("the ball", cells)?;
    let mut ball = Ball {
        layers,
        points: Vec::new(),
        index_of_key: HashMap::new(),
        tets: Vec::with_capacity(cells),
    };
    for face in FACES {
        ball.fill(face);
    }
    let place = |p: &Point| Point::from(center) + radius * p;
    TetMesh::new(ball.points.iter().map(place).collect(), ball.tets)
}

/// A unit ball in the making.
struct Ball {
    layers: usize,
    points: Vec<Point>,
    /// Vertices by the steps from the centre towards corners of the icosahedron: `(corner, steps)`, ascending, then `(0, 0)`.
    index_of_key: HashMap<[(usize, usize); 3], usize>,
    tets: Vec<[usize; 4]>,
}

impl Ball {
    /// The tetrahedra between the centre and a face. A step of the lattice goes from the centre towards one of three
    /// corners a, b, c. At each place o: the tetrahedron `o, a, b, c`, the octahedron `a, b, c, ab, ac, bc` and the inverted
    /// tetrahedron `ab, ac, bc, abc`, as far as they lie within the layers.
    fn fill(&mut self, face: [usize; 3]) {
        for i in 0..self.layers {
            for j in 0..self.layers - i {
                for k in 0..self.layers - i - j {
                    let left = self.layers - i - j - k;
                    let mut at = |a, b, c| self.vertex(face, [i + a, j + b, k + c]);
                    let [o, a, b, c] = [at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1)];
                    self.add([o, a, b, c]);
                    if left > 1 {
                        let mut at = |a, b, c| self.vertex(face, [i + a, j + b, k + c]);
                        let [ab, ac, bc] = [at(1, 1, 0), at(1, 0, 1), at(0, 1, 1)];
                        self.add_octahedron([a, b, c], [bc, ac, ab]);
                        if left > 2 {
                            let abc = self.vertex(face, [i + 1, j + 1, k + 1]);
                            self.add([ab, ac, bc, abc]);
                        }
                    }
                }
            }
        }
    }

    fn vertex(&mut self, face: [usize; 3], steps: [usize; 3]) -> usize {
        let mut key = [(0, 0); 3];
        let taken = face.into_iter().zip(steps).filter(|&(_, steps)| steps > 0);
        for (place, entry) in key.iter_mut().zip(taken) {
            *place = entry;
        }
        let (layers, points) = (self.layers, &mut self.points);
        *self.index_of_key.entry(key).or_insert_with(|| {
            let direction: Point = key
                .into_iter()
                .map(|(corner, steps)| steps as f64 * icosahedron_corner(corner))
                .sum();
            let layer: usize = steps.iter().sum();
            points.push(match layer {
                0 => Point::zeros(),
                _ => direction.normalize() * (layer as f64 / layers as f64),
            });
            points.len() - 1
        })
    }

    /// Four tetrahedra around the shortest diagonal; `opposite[i]` lies opposite `corners[i]`.
    fn add_octahedron(&mut self, corners: [usize; 3], opposite: [usize; 3]) {
        let length = |i: usize| (self.points[corners[i]] - self.points[opposite[i]]).norm();
        // equal up to rounding counts as equal, so that the choice is the same everywhere
        let axis = (1..3).fold(0, |best, i| {
            if length(i) < (1.0 - 1e-9) * length(best) {
                i
            } else {
                best
            }
        });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let ring = [corners[u], corners[v], opposite[u], opposite[v]];
        for k in 0..4 {
            self.add([corners[axis], opposite[axis], ring[k], ring[(k + 1) % 4]]);
        }
    }

    fn add(&mut self, tet: [usize; 4]) {
        self.tets.push(oriented(&self.points, tet));
    }
}

fn icosahedron_corner(corner: usize) -> Point {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    Point::from(ICOSAHEDRON[corner].map(|c| match c {
        2 => golden,
        -2 => -golden,
        c => f64::from(c),
    }))
    .normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quality;

    #[test]
    fn a_ball_is_one_closed_piece_of_good_cells() {
        for layers in [1, 2, 3, 6] {
            let mesh = ball_tets([0.3, -1.0, 2.0], 0.1, layers).unwrap();
            assert_eq!(mesh.num_cells(), 20 * layers.pow(3));
            assert_eq!(mesh.boundary_facets().count(), 20 * layers.pow(2));
            assert_eq!(mesh.pieces().1, 1);
            mesh.check(true).unwrap();
            let report = quality::report(&mesh, mesh.rest_positions());
            assert!(
                report.min_radius_ratio > 0.7 && report.mean_radius_ratio > 0.86,
                "{layers}: {report:?}"
            );
            assert!(
                report.min_dihedral_deg > 36.0 && report.max_dihedral_deg < 119.0,
                "{layers}: {report:?}"
            );
            for side in mesh.boundary_facets() {
                for v in mesh.facet_corners(side) {
                    let distance = (mesh.rest_position(v) - Point::new(0.3, -1.0, 2.0)).norm();
                    assert!((distance - 0.1).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn the_volume_of_a_ball_converges_with_order_two() {
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        let error = |layers| exact - quality::volume(&ball_tets([0.0; 3], 2.0, layers).unwrap());
        let (coarse, fine) = (error(6), error(12));
        assert!(fine > 0.0 && fine / exact < 5e-3);
        let rate = (coarse / fine).log2();
        assert!((rate - 2.0).abs() < 0.05, "rate {rate}");
    }

    #[test]
    fn impossible_balls_are_empty_or_errors() {
        assert_eq!(ball_tets([0.0; 3], -1.0, 3).unwrap().num_cells(), 0);
        assert_eq!(ball_tets([0.0; 3], f64::NAN, 3).unwrap().num_cells(), 0);
        assert_eq!(ball_tets([0.0; 3], 1.0, 0).unwrap().num_vertices(), 0);
        assert!(matches!(
            ball_tets([0.0; 3], 1.0, 100_000),
            Err(MeshError::TooLarge { .. })
        ));
        assert!(matches!(
            ball_tets([1.0; 3], 1e-20, 2),
            Err(MeshError::ZeroVolume { .. })
        ));
        assert!(matches!(
            ball_tets([f64::NAN; 3], 1.0, 2),
            Err(MeshError::NotFinite { .. })
        ));
    }
}
