//! How far the two lips of a cut have come apart.
//!
//! With a normal given, the lip on its side (+) is made of the boundary facets that face against it, within 60 degrees, and
//! the lip on the other side (-) of those that face along it. On each lip the point nearest to a place is taken, at rest.
//! There is a jump if neither is farther from the place than the longest edge of its facet, and if both are one point (the
//! lips of a cut are the same surface at rest) or were both made by cuts (a cut that deletes cells leaves a gap).

use kerfem_fem::Assembler;
use kerfem_mesh::{Barycentric, FacetSide, Point, SimplexMesh, nearest};
use nalgebra::Vector3;

/// Cosine of the largest angle between a facet's normal and the one given.
const FACING: f64 = 0.5;
/// Points closer than this, relative to the facet, are one.
const SAME: f64 = 1e-9;

/// The point of a lip that is nearest to a place.
struct Foot {
    side: FacetSide,
    at: Point,
    distance: f64,
}

/// `u` on the side to which `normal` points less `u` on the other side (m), at the rest position `at`; none where there is no
/// cut.
pub(crate) fn jump<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    u: &[f64],
    at: &Point,
    normal: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let plus = foot(mesh, at, &-normal)?;
    let minus = foot(mesh, at, normal)?;
    let made_by_cuts = [&plus, &minus].iter().all(|f| is_new(mesh, f.side));
    let apart = (plus.at - minus.at).norm();
    if !made_by_cuts && apart > SAME * size(mesh, plus.side) {
        return None;
    }
    Some(value(mesh, assembler, u, &plus)? - value(mesh, assembler, u, &minus)?)
}

/// The nearest point of the boundary facets that face along a direction.
fn foot<const N: usize>(mesh: &SimplexMesh<N>, at: &Point, direction: &Vector3<f64>) -> Option<Foot> {
    let faces = |side: &FacetSide| {
        let outward = mesh.facet_normal(*side);
        outward.dot(direction) >= FACING * outward.norm() * direction.norm()
    };
    let feet = mesh.boundary_facets().filter(faces).map(|side| {
        let point = nearest_point(mesh, side, at);
        Foot {
            side,
            at: point,
            distance: (point - at).norm(),
        }
    });
    let best = feet.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
    (best.distance <= size(mesh, best.side)).then_some(best)
}

fn corners<const N: usize>(mesh: &SimplexMesh<N>, side: FacetSide) -> [Point; 3] {
    mesh.facet_corners(side).map(|v| mesh.rest_position(v))
}

fn nearest_point<const N: usize>(mesh: &SimplexMesh<N>, side: FacetSide, at: &Point) -> Point {
    let [a, b, c] = corners(mesh, side);
    match N {
        3 => nearest::on_segment(at, &[a, b]).0,
        _ => nearest::on_triangle(at, &[a, b, c]),
    }
}

/// The longest edge of a facet (m).
fn size<const N: usize>(mesh: &SimplexMesh<N>, side: FacetSide) -> f64 {
    let [a, b, c] = corners(mesh, side);
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

/// Whether a facet was made by a cut.
fn is_new<const N: usize>(mesh: &SimplexMesh<N>, side: FacetSide) -> bool {
    mesh.facet_labels(side.cell)[side.local as usize].some().is_none()
}

fn value<const N: usize>(
    mesh: &SimplexMesh<N>,
    assembler: &Assembler<N>,
    u: &[f64],
    foot: &Foot,
) -> Option<Vector3<f64>> {
    let cell = foot.side.cell;
    let weights = Barycentric::of(&mesh.cell_rest_positions(cell))?.at(&foot.at);
    Some(assembler.interpolate(mesh, cell, &weights, u).into())
}
