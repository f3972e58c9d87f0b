//! Rings of triangles around a centre: what round bodies and surfaces are made of.

/// A disk of `rings` rings in the pattern of the triangular lattice: ring `k` has `6 k` vertices at equal angles, so that
/// no triangle at the centre is narrower than elsewhere.
pub(super) struct Disk {
    /// The centre, then ring after ring, counter-clockwise.
    pub(super) vertices: Vec<DiskVertex>,
    /// Corners, counter-clockwise: `6 rings^2` triangles.
    pub(super) triangles: Vec<[usize; 3]>,
}

/// A vertex of a [`Disk`].
pub(super) struct DiskVertex {
    /// Its ring: 0 is the centre.
    pub(super) ring: usize,
    /// Cosine and sine of its angle.
    pub(super) direction: [f64; 2],
    /// 0, 1 or 2; the corners of every triangle have all three.
    pub(super) color: usize,
}

impl Disk {
    pub(super) fn new(rings: usize) -> Self {
        let mut disk = Disk {
            vertices: vec![DiskVertex {
                ring: 0,
                direction: [1.0, 0.0],
                color: 0,
            }],
            triangles: Vec::with_capacity(Disk::num_triangles(rings)),
        };
        for ring in 1..=rings {
            for sector in 0..6 {
                disk.add_vertices(ring, sector);
                disk.add_triangles(ring, sector);
            }
        }
        disk
    }

    /// How many triangles so many rings have, `usize::MAX` if that is too many to count.
    pub(super) fn num_triangles(rings: usize) -> usize {
        rings.saturating_mul(rings).saturating_mul(6)
    }

    fn add_vertices(&mut self, ring: usize, sector: usize) {
        let [cos, sin] = SECTORS[sector];
        for step in 0..ring {
            let (s, c) = (std::f64::consts::FRAC_PI_3 * (step as f64 / ring as f64)).sin_cos();
            // steps of the lattice change the color by one, the corners of a ring lie `ring` steps from the centre
            let color = (1 + sector % 2) * (ring + step) % 3;
            self.vertices.push(DiskVertex {
                ring,
                direction: [cos * c - sin * s, sin * c + cos * s],
                color,
            });
        }
    }

    /// The triangles of a sector between a ring and the one inside it: those with a side on the ring, and those between.
    fn add_triangles(&mut self, ring: usize, sector: usize) {
        let outer = |step| vertex(ring, sector * ring + step);
        let inner = |step| vertex(ring - 1, sector * (ring - 1) + step);
        for step in 0..ring {
            self.triangles.push([inner(step), outer(step), outer(step + 1)]);
            if step + 1 < ring {
                self.triangles.push([inner(step), outer(step + 1), inner(step + 1)]);
            }
        }
    }
}

/// Index of a vertex of a ring, counted around it.
fn vertex(ring: usize, around: usize) -> usize {
    match ring {
        0 => 0,
        _ => 1 + 3 * ring * (ring - 1) + around % (6 * ring),
    }
}

/// Half the square root of three.
const H: f64 = 0.866_025_403_784_438_6;

/// Cosine and sine of the angle where each sixth begins: exactly symmetric.
const SECTORS: [[f64; 2]; 6] = [[1.0, 0.0], [0.5, H], [-0.5, H], [-1.0, 0.0], [-0.5, -H], [0.5, -H]];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_triangle_has_all_three_colors_and_every_inner_edge_two_triangles() {
        for rings in 1..8 {
            let disk = Disk::new(rings);
            assert_eq!(disk.vertices.len(), 1 + 3 * rings * (rings + 1));
            assert_eq!(disk.triangles.len(), Disk::num_triangles(rings));
            let mut edges = std::collections::BTreeMap::new();
            for t in &disk.triangles {
                let mut colors = t.map(|v| disk.vertices[v].color);
                colors.sort_unstable();
                assert_eq!(colors, [0, 1, 2], "{rings}: {t:?}");
                for k in 0..3 {
                    let [a, b] = [t[k], t[(k + 1) % 3]];
                    *edges.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { 1 } else { -1 };
                }
            }
            // each inner edge is passed once in each direction
            let open = edges.iter().filter(|(_, passes)| **passes != 0);
            assert!(
                open.clone()
                    .all(|(e, _)| e.iter().all(|&v| disk.vertices[v].ring == rings))
            );
            assert_eq!(open.count(), 6 * rings);
        }
    }

    #[test]
    fn the_disk_is_symmetric_to_the_bit() {
        let disk = Disk::new(3);
        let has = |d: [f64; 2]| disk.vertices.iter().any(|v| v.ring == 3 && v.direction == d);
        assert!(has([1.0, 0.0]) && has([-1.0, 0.0]));
        for v in disk.vertices.iter().filter(|v| v.ring == 3) {
            assert!(has(v.direction.map(|c| -c)));
            assert!((v.direction[0].hypot(v.direction[1]) - 1.0).abs() < 1e-15);
        }
    }
}
