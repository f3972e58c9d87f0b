//! What can be said about a scene without its mesh.

use std::collections::BTreeSet;

use kerfem_fem::Material;

use super::source::Source;
use super::{
    Components, CylinderSpec, DampingSpec, FixedSpec, LoadSpec, MassKind, MaterialSpec, NodalForces, QuantitySpec,
    Scene, Scheme, StressIntensitySpec,
};
use crate::EngineError;

pub(super) type Checked = Result<(), EngineError>;

/// Of a scene: names of files are longer and end at 255 bytes.
const LONGEST_NAME: usize = 200;

/// Whether a name can be that of files.
pub(crate) fn check_name(source: &Source, name: &str) -> Checked {
    let plain = |c: char| c.is_alphanumeric() || "-_. ".contains(c);
    let fits = (1..=LONGEST_NAME).contains(&name.len());
    if fits && !name.starts_with('.') && name.chars().all(plain) {
        return Ok(());
    }
    let message = format!(
        "\"{name}\" is not accepted; it names files: letters, digits, '-', '_', '.' and spaces, not starting with '.', at most \
         {LONGEST_NAME} bytes"
    );
    Err(source.error("", 0, "name", message))
}

impl Scene {
    /// Checks every number and every choice that needs no mesh; the first mistake is the error.
    pub(crate) fn check(&self) -> Checked {
        check_name(&self.source, &self.name)?;
        self.check_mesh()?;
        self.check_material()?;
        self.check_model()?;
        for (i, fixed) in self.fixed.iter().enumerate() {
            self.check_fixed(i, fixed)?;
        }
        for (i, load) in self.load.iter().enumerate() {
            self.check_load(i, load)?;
        }
        self.check_initial()?;
        self.check_time()?;
        self.check_solver()?;
        self.check_cuts()?;
        self.check_probes()?;
        self.check_quantities()?;
        if let Some(every) = self.output.every {
            self.positive("output", 0, "every", every)?;
        }
        // of a file, only reading it will tell
        match self.mesh.file {
            None => self.check_dimension(if self.mesh.plate.is_some() { 2 } else { 3 }),
            Some(_) => Ok(()),
        }
    }

    pub(super) fn fail<T>(
        &self,
        section: &str,
        index: usize,
        key: &str,
        message: impl Into<String>,
    ) -> Result<T, EngineError> {
        Err(self.source.error(section, index, key, message))
    }

    fn positive(&self, section: &str, index: usize, key: &str, value: f64) -> Checked {
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        let message = format!("{value:?} is not accepted; a finite number greater than 0 is needed");
        self.fail(section, index, key, message)
    }

    fn finite(&self, section: &str, index: usize, key: &str, values: &[f64]) -> Checked {
        match values.iter().find(|v| !v.is_finite()) {
            Some(v) => self.fail(
                section,
                index,
                key,
                format!("{v:?} is not accepted; finite numbers are needed"),
            ),
            None => Ok(()),
        }
    }

    /// Exactly one of the named keys must be given.
    fn exactly_one(&self, section: &str, index: usize, given: &[(&str, bool)]) -> Checked {
        let names = |all: bool| {
            let some = given.iter().filter(|(_, g)| all || *g);
            some.map(|(n, _)| format!("\"{n}\"")).collect::<Vec<_>>().join(", ")
        };
        match given.iter().filter(|(_, g)| *g).count() {
            1 => Ok(()),
            0 => self.fail(
                section,
                index,
                "",
                format!("exactly one of {} is needed; none is given", names(true)),
            ),
            _ => self.fail(
                section,
                index,
                given.iter().find(|(_, g)| *g).map_or("", |(n, _)| n),
                format!("{} are given; exactly one of {} is accepted", names(false), names(true)),
            ),
        }
    }

    fn check_mesh(&self) -> Checked {
        let m = &self.mesh;
        let given = [
            ("file", m.file.is_some()),
            ("box", m.r#box.is_some()),
            ("ball", m.ball.is_some()),
            ("cylinder", m.cylinder.is_some()),
            ("plate", m.plate.is_some()),
        ];
        self.exactly_one("mesh", 0, &given)?;
        if let Some(b) = &m.r#box {
            for s in b.size {
                self.positive("mesh", 0, "box", s)?;
            }
            self.finite("mesh", 0, "box", &b.origin)?;
            let count = b.cells.iter().try_fold(6usize, |n, c| n.checked_mul(*c));
            if b.cells.contains(&0) || count.is_none_or(|n| n >= u32::MAX as usize) {
                let message = format!(
                    "cells = {:?} is not accepted; whole numbers from 1 with a product below 7e8",
                    b.cells
                );
                return self.fail("mesh", 0, "box", message);
            }
        }
        if let Some(b) = &m.ball {
            self.positive("mesh", 0, "ball", b.radius)?;
            self.finite("mesh", 0, "ball", &b.center)?;
            if b.layers == 0 || b.layers > 500 {
                let message = format!("layers = {} is not accepted; a whole number from 1 to 500", b.layers);
                return self.fail("mesh", 0, "ball", message);
            }
        }
        if let Some(c) = &m.cylinder {
            self.check_cylinder(c)?;
        }
        if let Some(p) = &m.plate {
            for s in p.size {
                self.positive("mesh", 0, "plate", s)?;
            }
            self.finite("mesh", 0, "plate", &p.origin)?;
            let count = p.cells.iter().try_fold(2usize, |n, c| n.checked_mul(*c));
            if p.cells.contains(&0) || count.is_none_or(|n| n >= u32::MAX as usize) {
                let message = format!(
                    "cells = {:?} is not accepted; whole numbers from 1 with a product below 2e9",
                    p.cells
                );
                return self.fail("mesh", 0, "plate", message);
            }
        }
        m.scale.map_or(Ok(()), |s| self.positive("mesh", 0, "scale", s))
    }

    fn check_cylinder(&self, c: &CylinderSpec) -> Checked {
        self.positive("mesh", 0, "cylinder", c.radius)?;
        self.positive("mesh", 0, "cylinder", c.length)?;
        self.finite("mesh", 0, "cylinder", &c.axis)?;
        self.finite("mesh", 0, "cylinder", &c.origin)?;
        if c.axis == [0.0; 3] {
            let message = "axis = [0.0, 0.0, 0.0] is not accepted; a direction other than zero is needed";
            return self.fail("mesh", 0, "cylinder", message);
        }
        let count = [c.layers, c.layers, c.slices]
            .iter()
            .try_fold(18usize, |n, k| n.checked_mul(*k));
        if count.is_none_or(|n| n == 0 || n >= u32::MAX as usize) {
            let message = format!(
                "layers = {}, slices = {} are not accepted; whole numbers from 1 with layers² slices below 2e8",
                c.layers, c.slices
            );
            return self.fail("mesh", 0, "cylinder", message);
        }
        Ok(())
    }

    fn check_material(&self) -> Checked {
        let key_of = |message: &str| message.split(' ').next().unwrap_or("").to_owned();
        let MaterialSpec {
            young,
            poisson,
            density,
            damping,
            thickness,
            ..
        } = &self.material;
        if let Err(e) = Material::new(*young, *poisson, *density) {
            let message = e.to_string();
            return self.fail("material", 0, &key_of(&message), message);
        }
        if let Some(thickness) = thickness {
            self.positive("material", 0, "thickness", *thickness)?;
        }
        let DampingSpec { mass, stiffness } = *damping;
        for (key, factor) in [("mass", mass), ("stiffness", stiffness)] {
            if !(factor.is_finite() && factor >= 0.0) {
                let message = format!("{key} = {factor:?} is not accepted; a finite number from 0 is needed");
                return self.fail("material", 0, "damping", message);
            }
        }
        for (i, r) in self.region.iter().enumerate() {
            self.exactly_one(
                "region",
                i,
                &[("group", r.group.is_some()), ("where", r.r#where.is_some())],
            )?;
            let or = |own: Option<f64>, common: f64| own.unwrap_or(common);
            if let Err(e) = Material::new(or(r.young, *young), or(r.poisson, *poisson), or(r.density, *density)) {
                let message = e.to_string();
                return self.fail("region", i, &key_of(&message), message);
            }
        }
        Ok(())
    }

    fn check_model(&self) -> Checked {
        let m = &self.model;
        if ![1, 2].contains(&m.order) {
            let message = format!("{} is not accepted; accepted: 1, 2", m.order);
            return self.fail("model", 0, "order", message);
        }
        if m.order == 2 && m.locking == "nodal" {
            let message = "\"nodal\" is a cure of order 1; with order = 2 are accepted: \"none\", \"auto\"";
            return self.fail("model", 0, "locking", message);
        }
        if !["none", "auto", "nodal"].contains(&m.locking.as_str()) {
            let message = format!(
                "\"{}\" is not accepted; accepted: \"none\", \"auto\", \"nodal\"",
                m.locking
            );
            return self.fail("model", 0, "locking", message);
        }
        self.positive("model", 0, "accuracy", m.accuracy)
    }

    fn check_fixed(&self, i: usize, f: &FixedSpec) -> Checked {
        let given = [
            ("where", f.r#where.is_some()),
            ("vertices", f.vertices.is_some()),
            ("group", f.group.is_some()),
        ];
        self.exactly_one("fixed", i, &given)?;
        let axes = f.axes.as_deref().unwrap_or("xyz");
        let repeated = "xyz".chars().any(|c| axes.matches(c).count() > 1);
        if axes.is_empty() || repeated || !axes.chars().all(|c| "xyz".contains(c)) {
            let message = format!("\"{axes}\" is not accepted; letters x, y, z, each at most once");
            return self.fail("fixed", i, "axes", message);
        }
        match &f.displacement {
            Some(d) if !(2..=3).contains(&d.len()) && d.len() != axes.len() => {
                let message = format!(
                    "{} components are given; 3 or one for each of \"{axes}\" are needed",
                    d.len()
                );
                self.fail("fixed", i, "displacement", message)
            }
            _ => Ok(()),
        }
    }

    fn check_load(&self, i: usize, l: &LoadSpec) -> Checked {
        let kinds = [
            ("gravity", l.gravity.is_some()),
            ("traction", l.traction.is_some()),
            ("pressure", l.pressure.is_some()),
            ("force", l.force.is_some()),
            ("nodal", l.nodal.is_some()),
        ];
        self.exactly_one("load", i, &kinds)?;
        let places = [
            ("where", l.r#where.is_some()),
            ("facets", l.facets.is_some()),
            ("vertices", l.vertices.is_some()),
            ("group", l.group.is_some()),
        ];
        let given = places.iter().find(|(_, given)| *given);
        match (&l.nodal, given) {
            (Some(NodalForces::Here(forces)), _) => self.check_nodal(i, forces, l, &places)?,
            (Some(NodalForces::File { .. }), Some((key, _))) => {
                let message = "the array has a force for every vertex; no selection is accepted";
                return self.fail("load", i, key, message);
            }
            (None, Some((key, _))) if l.gravity.is_some() => {
                let message = "gravity acts on the whole body; no selection is accepted";
                return self.fail("load", i, key, message);
            }
            (None, _) if l.gravity.is_none() => self.exactly_one("load", i, &places)?,
            _ => {}
        }
        if l.force.is_some() && l.facets.is_some() {
            return self.fail(
                "load",
                i,
                "facets",
                "a force acts on vertices; accepted: \"where\", \"vertices\", \"group\"",
            );
        }
        for (key, components) in [("gravity", &l.gravity), ("force", &l.force)] {
            if let Some(e) = components.iter().flat_map(|c| &c.0).find(|e| e.uses_place()) {
                let message = format!("\"{}\" depends on the place; only t is accepted", e.shown());
                return self.fail("load", i, key, message);
            }
        }
        Ok(())
    }

    /// Forces one by one need vertices one by one, and nothing else.
    fn check_nodal(&self, i: usize, forces: &[Components<f64>], l: &LoadSpec, places: &[(&str, bool)]) -> Checked {
        if let Some((key, _)) = places.iter().find(|(key, given)| *given && *key != "vertices") {
            let message = "forces one by one act on vertices one by one; accepted: \"vertices\"";
            return self.fail("load", i, key, message);
        }
        let vertices = l.vertices.as_ref().map_or(0, Vec::len);
        if forces.is_empty() || forces.len() != vertices {
            let message = format!(
                "{} forces and {vertices} vertices are given; as many of each are needed, at least one",
                forces.len()
            );
            return self.fail("load", i, "nodal", message);
        }
        forces.iter().try_for_each(|f| self.finite("load", i, "nodal", &f.0))
    }

    fn check_initial(&self) -> Checked {
        let fields = [
            ("displacement", &self.initial.displacement),
            ("velocity", &self.initial.velocity),
        ];
        for (key, field) in fields {
            if let Some(super::InitialField::Here(all)) = field
                && let Some(e) = all.0.iter().find(|e| e.uses_time())
            {
                let message = format!("\"{}\" depends on t; the state at the start is in x, y, z", e.shown());
                return self.fail("initial", 0, key, message);
            }
        }
        Ok(())
    }

    fn check_time(&self) -> Checked {
        let t = &self.time;
        for (key, value) in [("dt", t.dt), ("end", t.end)] {
            match value {
                Some(v) => self.positive("time", 0, key, v)?,
                None if t.scheme.steps() => {
                    return self.fail(
                        "time",
                        0,
                        key,
                        "it is missing; a scheme that steps needs \"dt\" and \"end\"",
                    );
                }
                None => {}
            }
        }
        if t.scheme == Scheme::CentralDifference && self.model.mass == MassKind::Consistent {
            let message = "\"consistent\" is not accepted with scheme = \"central-difference\", which solves no system; accepted: \
                           \"lumped\"";
            return self.fail("model", 0, "mass", message);
        }
        match (t.dt, t.end) {
            (Some(dt), Some(end)) if end / dt > 1e9 => {
                let message = format!("{dt:?} s up to end = {end:?} s is more than 1e9 steps; a larger dt is needed");
                self.fail("time", 0, "dt", message)
            }
            _ => Ok(()),
        }
    }

    fn check_solver(&self) -> Checked {
        let s = &self.solver;
        if !(s.tolerance > 0.0 && s.tolerance < 1.0) {
            let message = format!(
                "{:?} is not accepted; a number greater than 0 and less than 1 is needed",
                s.tolerance
            );
            return self.fail("solver", 0, "tolerance", message);
        }
        if s.max_iterations == 0 {
            return self.fail(
                "solver",
                0,
                "max_iterations",
                "0 is not accepted; a whole number from 1 is needed",
            );
        }
        Ok(())
    }

    fn check_cuts(&self) -> Checked {
        for (i, c) in self.cut.iter().enumerate() {
            self.exactly_one("cut", i, &[("sweep", c.sweep.is_some()), ("blade", c.blade.is_some())])?;
            if let Some(at) = c.at.filter(|at| !(at.is_finite() && *at >= 0.0)) {
                let message = format!("{at:?} is not accepted; a finite time from 0 is needed");
                return self.fail("cut", i, "at", message);
            }
            if let Some(path) = &c.blade {
                if c.at.is_some() {
                    let message = "a blade cuts at the times of its samples; \"at\" is accepted with \"sweep\"";
                    return self.fail("cut", i, "at", message);
                }
                if let Err(e) = path.blade() {
                    return self.fail("cut", i, "blade", e.to_string());
                }
            }
            if let Some(snap) = c.snap
                && !(0.0..=0.45).contains(&snap)
            {
                let message = format!("{snap:?} is not accepted; a fraction from 0 to 0.45 is needed");
                return self.fail("cut", i, "snap", message);
            }
            if !(c.quality >= 0.0 && c.quality <= 0.7) {
                let message = format!(
                    "{:?} is not accepted; a radius ratio from 0 to 0.7 is needed",
                    c.quality
                );
                return self.fail("cut", i, "quality", message);
            }
        }
        Ok(())
    }

    fn check_probes(&self) -> Checked {
        let mut names = BTreeSet::new();
        for (i, p) in self.probe.iter().enumerate() {
            self.finite("probe", i, "point", &p.point.0)?;
            let bad = p.name.is_empty() || p.name.contains([',', '"', '\n', '\r']);
            if bad || !names.insert(&p.name) {
                let message = format!(
                    "\"{}\" is not accepted; a name of its own without commas or quotes",
                    p.name
                );
                return self.fail("probe", i, "name", message);
            }
        }
        Ok(())
    }

    fn check_quantities(&self) -> Checked {
        let mut names = BTreeSet::new();
        for (i, q) in self.quantity.iter().enumerate() {
            let kinds = [
                ("mean", q.mean.is_some()),
                ("max", q.max.is_some()),
                ("min", q.min.is_some()),
                ("point", q.point.is_some()),
                ("jump", q.jump.is_some()),
                ("energy", q.energy.is_some()),
                ("momentum", q.momentum.is_some()),
                ("angular_momentum", q.angular_momentum.is_some()),
                ("reaction", q.reaction.is_some()),
                ("KI", q.stress_intensity.is_some()),
            ];
            self.exactly_one("quantity", i, &kinds)?;
            if q.name.is_empty() || !names.insert(&q.name) {
                return self.fail(
                    "quantity",
                    i,
                    "name",
                    format!("\"{}\" is not accepted; a name of its own is needed", q.name),
                );
            }
            let needs_where = q.mean.is_some() || q.reaction.is_some();
            if needs_where && q.r#where.is_none() {
                return self.fail(
                    "quantity",
                    i,
                    "where",
                    "it is missing; it says where the quantity is taken",
                );
            }
            if let Some(p) = &q.point {
                self.finite("quantity", i, "point", &p.0)?;
            }
            if let Some(jump) = &q.jump {
                self.finite("quantity", i, "jump", &jump.at.0)?;
                self.finite("quantity", i, "jump", &jump.normal.0)?;
                if jump.normal.0.iter().all(|n| *n == 0.0) {
                    let message = "normal = 0 has no direction; a vector across the cut is needed";
                    return self.fail("quantity", i, "jump", message);
                }
            }
            if let Some(crack) = &q.stress_intensity {
                self.check_crack(i, crack)?;
            }
            self.check_other_keys(i, q)?;
        }
        Ok(())
    }

    fn check_crack(&self, i: usize, crack: &StressIntensitySpec) -> Checked {
        self.finite("quantity", i, "KI", &crack.front.0)?;
        self.finite("quantity", i, "KI", &crack.normal.0)?;
        if crack.normal.0.iter().all(|n| *n == 0.0) {
            let message = "normal = 0 has no direction; a vector across the crack is needed";
            return self.fail("quantity", i, "KI", message);
        }
        match crack.radii {
            Some([inner, outer]) if !(0.0 < inner && inner < outer && outer.is_finite()) => {
                let message = format!("radii = [{inner}, {outer}] is not accepted; 0 < inner < outer is needed");
                self.fail("quantity", i, "KI", message)
            }
            _ => Ok(()),
        }
    }

    /// Keys that say nothing about the kind of a quantity.
    fn check_other_keys(&self, i: usize, q: &QuantitySpec) -> Checked {
        if q.energy == Some(false) {
            return self.fail(
                "quantity",
                i,
                "energy",
                "false is not accepted; true, or another quantity",
            );
        }
        if q.component.is_some() && q.point.is_none() && q.jump.is_none() {
            return self.fail(
                "quantity",
                i,
                "component",
                "it belongs to \"point\" and \"jump\", none of which is given",
            );
        }
        let by_vertices = q.mean.is_some() || q.max.is_some() || q.min.is_some() || q.reaction.is_some();
        if q.r#where.is_some() && !by_vertices {
            let message = "it belongs to \"mean\", \"max\", \"min\", \"reaction\", none of which is given";
            return self.fail("quantity", i, "where", message);
        }
        Ok(())
    }
}
