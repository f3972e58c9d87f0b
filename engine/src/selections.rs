//! What a scene selects, in words: for `kerfem check`, so that a wrong end shows at once.

use std::path::Path;

use kerfem_mesh::quality::cell_volume;
use kerfem_mesh::{Aabb, CellId, FacetSide, Point, SimplexMesh, VertexId};
use nalgebra::Vector3;

use crate::blades::MovingBlade;
use crate::pending::{PendingCut, method_name};
use crate::state::nodal;
use crate::{Frame, Scheme, Simulation};

/// What a load acts on.
pub(crate) struct Selected {
    pub(crate) extent: Extent,
    /// Its key in the scene.
    pub(crate) key: &'static str,
    pub(crate) uses_time: bool,
}

/// How much of a mesh is selected.
#[derive(Clone, Debug)]
pub(crate) struct Extent {
    count: usize,
    /// One and many of what is counted.
    what: [&'static str; 2],
    /// Area or volume, and its unit; vertices have none.
    size: f64,
    unit: Option<&'static str>,
    bounds: Aabb,
}

impl Extent {
    /// Of parts that are so large and have these points.
    fn of<P: IntoIterator<Item = Point>>(
        what: [&'static str; 2],
        unit: Option<&'static str>,
        parts: impl Iterator<Item = (f64, P)>,
    ) -> Self {
        let nothing = Extent {
            count: 0,
            what,
            size: 0.0,
            unit,
            bounds: Aabb::empty(),
        };
        parts.fold(nothing, |sum, (size, points)| Extent {
            count: sum.count + 1,
            size: sum.size + size,
            bounds: sum.bounds.union(&Aabb::around(points)),
            ..sum
        })
    }

    pub(crate) fn of_vertices<const N: usize>(mesh: &SimplexMesh<N>, vertices: impl Iterator<Item = VertexId>) -> Self {
        Self::of(
            ["vertex", "vertices"],
            None,
            vertices.map(|v| (0.0, [mesh.rest_position(v)])),
        )
    }

    pub(crate) fn of_facets<const N: usize>(
        mesh: &SimplexMesh<N>,
        sides: impl Iterator<Item = FacetSide>,
        thickness: f64,
    ) -> Self {
        let corners = |s| mesh.facet_corners(s).map(|v| mesh.rest_position(v));
        let part = |s| (thickness * mesh.facet_normal(s).norm(), corners(s));
        Self::of(["facet", "facets"], Some("m2"), sides.map(part))
    }

    pub(crate) fn of_cells<const N: usize>(
        mesh: &SimplexMesh<N>,
        cells: impl Iterator<Item = CellId>,
        thickness: f64,
    ) -> Self {
        let corners = |c| mesh.cell_rest_positions(c);
        let part = |c| (thickness * cell_volume(&corners(c)), corners(c));
        Self::of(["cell", "cells"], Some("m3"), cells.map(part))
    }

    /// "9 vertices", "8 facets of 1 m2".
    fn amount(&self) -> String {
        let size = self.unit.map(|unit| format!(" of {} {unit}", number(self.size)));
        format!("{}{}", counted(self.count, self.what), size.unwrap_or_default())
    }
}

impl<const N: usize> Simulation<N> {
    /// What the scene selects, one line for each section that selects something: how much it is of, its bounding box at rest,
    /// and what acts there at the start.
    pub fn selections(&self) -> Vec<String> {
        let lines = [self.region_lines(), self.fixed_lines(), self.load_lines()];
        let more = [self.initial_lines(), self.probe_lines(), self.cut_lines()];
        lines.into_iter().chain(more).flatten().collect()
    }

    /// The box around the body at rest, by its corners (m).
    pub fn extents(&self) -> String {
        let points = self.mesh.cell_ids().flat_map(|c| self.mesh.cell_rest_positions(c));
        self.place(&Aabb::around(points))
    }

    fn region_lines(&self) -> Vec<String> {
        let line = |i: usize| {
            let cells = self
                .mesh
                .cell_ids()
                .filter(|c| self.regions[c.index()] as usize == i + 1);
            let extent = Extent::of_cells(&self.mesh, cells, self.thickness());
            format!("region[{i}] has {}, in {}", extent.amount(), self.place(&extent.bounds))
        };
        (0..self.scene.region.len()).map(line).collect()
    }

    fn fixed_lines(&self) -> Vec<String> {
        if self.scene.fixed.is_empty() {
            return vec!["nothing is held".into()];
        }
        let line = |(i, (extent, axes)): (usize, (Extent, String))| {
            format!(
                "fixed[{i}] holds {}, {axes}, in {}",
                extent.amount(),
                self.place(&extent.bounds)
            )
        };
        self.fixed
            .selected(&self.mesh)
            .into_iter()
            .enumerate()
            .map(line)
            .collect()
    }

    fn load_lines(&self) -> Vec<String> {
        let total = |i, t| {
            let total = self.loads.total(i, &self.mesh, &self.assembler, t);
            // what is left of components that cancel is rounding
            let rounding = 1e-12 * total.amax();
            format!(
                "{} N",
                self.vector(&total.map(|x| if x.abs() < rounding { 0.0 } else { x }))
            )
        };
        let totals = |i, uses_time| match self.scene.time.end.filter(|_| uses_time) {
            None => format!("{} in all", total(i, 0.0)),
            Some(end) => format!(
                "{} in all at t = 0 s, {} at t = {} s",
                total(i, 0.0),
                total(i, end),
                number(end)
            ),
        };
        let line = |(i, load): (usize, Selected)| {
            let Selected { extent, key, uses_time } = load;
            let (amount, place) = (extent.amount(), self.place(&extent.bounds));
            format!(
                "load[{i}] ({key}) acts on {amount}, in {place}: {}",
                totals(i, uses_time)
            )
        };
        self.loads
            .selected(&self.mesh)
            .into_iter()
            .enumerate()
            .map(line)
            .collect()
    }

    fn initial_lines(&self) -> Vec<String> {
        let fields = [
            ("displacement", &self.scene.initial.displacement, &self.state.u, "m"),
            ("velocity", &self.scene.initial.velocity, &self.state.v, "m/s"),
        ];
        let line = |(key, _, field, unit): (_, _, &Vec<f64>, _)| {
            let all = field.as_chunks::<3>().0.iter().map(|x| Vector3::from(*x));
            let bounds = Aabb::around(all);
            format!("initial {key} is in {} {unit}", self.place(&bounds))
        };
        let given = fields.into_iter().filter(|(_, spec, ..)| spec.is_some());
        given.map(line).collect()
    }

    fn probe_lines(&self) -> Vec<String> {
        let line = |(name, rest, cell): (&str, &Point, Option<CellId>)| match cell {
            Some(c) => format!("probe {name} at {} lies in cell {}", self.vector(rest), c.0),
            None => format!("probe {name} at {} has lost its cell", self.vector(rest)),
        };
        self.probes.places().map(line).collect()
    }

    fn cut_lines(&self) -> Vec<String> {
        let blades = self.blades.iter().map(|blade| self.blade_line(blade));
        self.pending
            .iter()
            .map(|cut| self.cut_line(cut))
            .chain(blades)
            .collect()
    }

    /// What will come to nothing as far as the start can tell: cuts after the last step begins.
    pub(crate) fn late_cuts(&self) -> Vec<String> {
        let time = &self.scene.time;
        let (true, Some(dt), Some(end)) = (time.scheme.steps(), time.dt, time.end) else {
            return Vec::new();
        };
        let last = ((end / dt - 1e-9).ceil() - 1.0).max(0.0) * dt;
        let late = self.pending.iter().filter(|c| c.at - 1e-9 * dt > last);
        let late = late.map(|c| {
            format!(
                "cut[{}] at {} s will not be made: the last step begins at {} s",
                c.index,
                number(c.at),
                number(last)
            )
        });
        let unmoved = self.blades.iter().filter(|b| b.blade.end() > end + 1e-9 * dt);
        let unmoved = unmoved.map(|b| {
            format!(
                "the blade of cut[{}] moves until {} s: the run ends at {} s",
                b.index,
                number(b.blade.end()),
                number(end)
            )
        });
        late.chain(unmoved).collect()
    }

    fn cut_line(&self, cut: &PendingCut) -> String {
        let file = self.scene.cut[cut.index].sweep.as_deref().unwrap_or(Path::new(""));
        let when = match self.scene.time.scheme {
            Scheme::Static | Scheme::Evaluate => "first of all".to_owned(),
            _ => format!("at {} s", number(cut.at)),
        };
        format!(
            "cut[{}] {when} by {} with {}, {} in {}",
            cut.index,
            method_name(cut.options.method),
            file.display(),
            counted(cut.sweep.num_pieces(), ["piece", "pieces"]),
            self.cut_place(&cut.sweep.bounds(), cut.frame),
        )
    }

    fn blade_line(&self, moving: &MovingBlade) -> String {
        let blade = &moving.blade;
        let when = match self.scene.time.scheme {
            Scheme::Static | Scheme::Evaluate => "first of all".to_owned(),
            _ => format!("from {} s to {} s", number(blade.start()), number(blade.end())),
        };
        format!(
            "cut[{}] {when} by {} with a blade, {} in {}",
            moving.index,
            method_name(moving.options.method),
            counted(blade.num_samples(), ["sample", "samples"]),
            self.cut_place(&blade.bounds(), moving.frame),
        )
    }

    /// The box of a cut, and how many cells are in it.
    fn cut_place(&self, bounds: &Aabb, frame: Frame) -> String {
        let (name, moves) = match frame {
            Frame::Rest => ("rest", 0.0),
            Frame::Deformed => ("deformed", 1.0),
        };
        let position = |v: VertexId| self.mesh.rest_position(v) + moves * nodal(&self.state.u, v);
        let near = |c: &CellId| Aabb::around(self.mesh.cell(*c).map(position)).overlaps(bounds);
        let touched = self.mesh.cell_ids().filter(near).count();
        let (place, cells) = (self.place(bounds), self.mesh.num_cells());
        format!("{place} ({name} frame): its box meets {touched} of {cells} cells at the start")
    }

    /// A box by its corners, in as many dimensions as the mesh has.
    fn place(&self, bounds: &Aabb) -> String {
        format!("{} .. {}", self.vector(&bounds.min), self.vector(&bounds.max))
    }

    fn vector(&self, p: &Point) -> String {
        let all: Vec<String> = p.iter().take(N - 1).map(|x| number(*x)).collect();
        format!("[{}]", all.join(", "))
    }
}

fn counted(count: usize, [one, many]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// A number with six digits, the shorter way.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    match rounded.abs() {
        0.0 => "0".into(),
        size if (1e-4..1e7).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn numbers_are_short() {
        for (x, text) in [
            (-0.0, "0"),
            (0.1 + 0.2, "0.3"),
            (-19620.000000000004, "-19620"),
            (1e-9, "1e-9"),
            (123456789.0, "1.23457e8"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(x), text);
        }
    }
}
