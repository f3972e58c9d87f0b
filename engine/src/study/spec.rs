//! The study: what a `STUDY.toml` says, read and checked.

use std::fmt;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use toml::{Table, Value};

use super::grid::{self, Point};
use crate::scene::check::check_name;
use crate::scene::source::{Source, read_text};
use crate::{Components, EngineError, Expression, Scene};

/// Names what moves together with it.
pub(super) const LABEL: &str = "label";

/// Keys of `[vary]` that are no keys of the scene: names, and what holds for the measures that do not say it themselves, where it
/// differs from run to run.
const OWN: [&str; 4] = [LABEL, "reference", "tolerance", "rate"];

/// A grid of settings of a scene, and what is measured of each run.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Names the results.
    pub name: String,
    /// What it is about, for the page.
    #[serde(default)]
    pub about: String,
    /// The base; relative to the study.
    pub scene: PathBuf,
    /// Keys of the scene ("mesh.box.cells", "cut.0.method") and the values that each takes; "reference", "tolerance" and "rate" hold
    /// for measures that do not say them themselves, and "label" names what moves together with it.
    #[serde(default)]
    pub vary: Table,
    /// Groups of keys of `vary` whose lists move together, in place of their product.
    #[serde(default)]
    pub together: Vec<Vec<String>>,
    /// The key along whose values the points of a line run, coarse to fine; without it each run stands alone.
    pub along: Option<String>,
    /// Keys whose values are different problems: each has a picture, and a finest run, of its own.
    #[serde(default)]
    pub each: Vec<String>,
    /// What is measured.
    #[serde(deserialize_with = "one_or_more")]
    pub measure: Vec<Measure>,
    /// What is drawn (default: the error of each measure over seconds).
    #[serde(default, deserialize_with = "one_or_more")]
    pub chart: Vec<Chart>,
    #[serde(skip)]
    pub(super) source: Source,
    /// The text of the scene.
    #[serde(skip)]
    pub(super) scene_text: String,
    /// The scene as data, to be changed.
    #[serde(skip)]
    pub(super) base: Table,
}

/// A number of each run: exactly one of `quantity`, `report`, `steps`, `field`, `frequency`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Measure {
    /// Names its columns (default: what is measured).
    pub name: String,
    /// A `[[quantity]]` of the scene.
    pub quantity: Option<String>,
    /// A number in `report.json`: "mesh.final.quality.min_radius_ratio", "cuts.0.area_m2".
    pub report: Option<String>,
    /// A column of `steps.csv`, or several that are added: "kinetic_J + elastic_J".
    pub steps: Option<String>,
    /// Which number of the column.
    pub take: Take,
    /// A field of `final.vtu`: how far it is from that of the reference, by the relative L2 norm over the vertices.
    pub field: Option<String>,
    /// The natural frequency (Hz) of this number, from one.
    pub frequency: Option<usize>,
    /// Other settings of a second run: the number is then that of the second run less that of the first, over `over`.
    pub with: Table,
    /// What the difference to the second run is divided by.
    pub over: Option<f64>,
    /// What becomes of the number: a formula in `x`.
    pub value: Option<Expression>,
    /// What it should be.
    pub reference: Option<Reference>,
    /// What the error is relative to (default: the reference; where that is zero the error is absolute).
    pub scale: Option<f64>,
    /// The largest error at the end of a line that `kerfem validate` accepts.
    pub tolerance: Option<f64>,
    /// The least order of convergence along a line that `kerfem validate` accepts.
    pub rate: Option<f64>,
    /// How often each run is made, to be timed (default 1).
    pub repeats: Option<usize>,
}

/// Which number of a column.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Take {
    /// The last.
    #[default]
    Last,
    /// The first.
    First,
    /// The largest.
    Max,
    /// The smallest.
    Min,
    /// The largest less the smallest.
    Spread,
    /// The largest, of the first.
    Growth,
}

/// What a measure should be.
#[derive(Clone, Debug)]
pub enum Reference {
    /// A number, or a formula of constants.
    Number(f64),
    /// What the run with the most dofs and steps gives.
    Finest,
    /// The point array of a file, relative to the study.
    File(PathBuf, String),
    /// A field by formulas in the rest position.
    Exact([Expression; 3]),
}

/// A picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chart {
    /// What runs to the right: "seconds", "dofs", "cells", or a key of `[vary]`.
    #[serde(default = "seconds")]
    pub x: String,
    /// What runs upwards, for lines: "error", "value", "seconds", "iterations"; with a measure: "error.NAME". For a map, a key of
    /// `[vary]`.
    #[serde(default = "error")]
    pub y: String,
    /// What is coloured, which makes it a map: as `y` of lines.
    pub color: Option<String>,
    /// Stands above it.
    #[serde(default)]
    pub title: String,
}

fn seconds() -> String {
    "seconds".into()
}

fn error() -> String {
    "error".into()
}

impl Chart {
    pub(super) fn standard(measure: &Measure) -> Chart {
        Chart {
            x: seconds(),
            y: format!("error.{}", measure.name),
            color: None,
            title: String::new(),
        }
    }
}

/// Whether a key of `[vary]` is one of the scene.
pub(super) fn is_of_scene(key: &str) -> bool {
    !OWN.contains(&key)
}

impl<'de> Deserialize<'de> for Reference {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        const ACCEPTED: &str = "a number, a formula in quotes, \"finest\", { file = \"...\", field = \"...\" } or { exact = [3 formulas] }";
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Field {
            file: Option<PathBuf>,
            field: Option<String>,
            exact: Option<Components<Expression>>,
        }
        let formula = |text: &str| {
            let formula =
                Expression::number(text).map_err(|e| D::Error::custom(format!("{e}; accepted: {ACCEPTED}")))?;
            match formula.uses_place() || formula.uses_time() {
                true => Err(D::Error::custom(format!(
                    "\"{text}\" has no one value; accepted: {ACCEPTED}"
                ))),
                false => Ok(Reference::Number(formula.value(&nalgebra::Vector3::zeros(), 0.0))),
            }
        };
        match Value::deserialize(deserializer)? {
            Value::Integer(value) => Ok(Reference::Number(value as f64)),
            Value::Float(value) => Ok(Reference::Number(value)),
            Value::String(text) if text == "finest" => Ok(Reference::Finest),
            Value::String(text) => formula(&text),
            table @ Value::Table(_) => match table.try_into().map_err(D::Error::custom)? {
                Field {
                    file: Some(file),
                    field,
                    exact: None,
                } => Ok(Reference::File(file, field.unwrap_or_else(|| "displacement".into()))),
                Field {
                    file: None,
                    field: None,
                    exact: Some(exact),
                } => Ok(Reference::Exact(exact.in_space())),
                _ => Err(D::Error::custom(format!("accepted: {ACCEPTED}"))),
            },
            _ => Err(D::Error::custom(format!("accepted: {ACCEPTED}"))),
        }
    }
}

/// A list of tables, or one that stands alone.
fn one_or_more<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    struct OneOrMore<T>(PhantomData<T>);
    impl<'de, T: Deserialize<'de>> Visitor<'de> for OneOrMore<T> {
        type Value = Vec<T>;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a table, or several")
        }
        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Vec<T>, A::Error> {
            Ok(vec![T::deserialize(MapAccessDeserializer::new(map))?])
        }
        fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Vec<T>, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(seq))
        }
    }
    deserializer.deserialize_any(OneOrMore(PhantomData))
}

impl Study {
    /// Reads and checks a study and its scene.
    ///
    /// # Errors
    /// [`EngineError::Scene`] with file, line, key, what is wrong and what is accepted.
    pub fn read(path: impl AsRef<Path>) -> Result<Study, EngineError> {
        let path = path.as_ref();
        let source = Source {
            path: path.into(),
            text: read_text(path, "study")?,
        };
        let mut study: Study = toml::from_str(&source.text).map_err(|e| source.toml_error(&e))?;
        study.source = source;
        let scene = study.scene_path();
        study.scene_text = read_text(&scene, "scene")?;
        // says what is wrong where it stands
        let base = Scene::parse(&study.scene_text, &scene)?;
        study.base = toml::from_str(&study.scene_text).map_err(|e| base.source.toml_error(&e))?;
        for measure in &mut study.measure {
            measure.complete();
        }
        study.check(&base)?;
        Ok(study)
    }

    /// Path of the scene.
    pub(super) fn scene_path(&self) -> PathBuf {
        self.source.resolve(&self.scene)
    }

    /// How often each run is made.
    pub(super) fn repeats(&self) -> usize {
        self.measure.iter().filter_map(|m| m.repeats).max().unwrap_or(1)
    }

    /// The keys along whose values lines run.
    pub(super) fn along(&self) -> Vec<&str> {
        self.along.as_deref().map_or_else(Vec::new, |key| self.group_of(key))
    }

    /// The keys of `[vary]` that are keys of the scene.
    pub(super) fn keys(&self) -> impl Iterator<Item = &str> {
        self.vary.keys().map(String::as_str).filter(|k| is_of_scene(k))
    }

    /// A key and those that move together with it.
    pub(super) fn group_of<'a>(&'a self, key: &'a str) -> Vec<&'a str> {
        let group = self.together.iter().find(|g| g.iter().any(|k| k == key));
        group.map_or_else(
            || vec![key],
            |g| g.iter().map(String::as_str).filter(|k| is_of_scene(k)).collect(),
        )
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

    fn check(&self, base: &Scene) -> Result<(), EngineError> {
        check_name(&self.source, &self.name)?;
        if self.measure.is_empty() {
            return self.fail("", 0, "measure", "it is missing; what is measured must be said");
        }
        self.check_keys()?;
        for (i, measure) in self.measure.iter().enumerate() {
            self.check_measure(i, measure, base)?;
        }
        for (i, chart) in self.chart.iter().enumerate() {
            self.check_chart(i, chart)?;
        }
        let points = grid::points(self)?;
        // a setting that no run accepts is a mistake in the study, one that some do not accept a row with its reason
        let mut refusals = points.iter().map(|p| self.scene_of(p, &Table::new()).err());
        match refusals.next().flatten() {
            Some(first) if refusals.all(|r| r.is_some()) => Err(first),
            _ => Ok(()),
        }
    }

    fn check_keys(&self) -> Result<(), EngineError> {
        let known = |key: &String| self.vary.contains_key(key);
        let unknown = |key: &str| {
            let keys: Vec<&str> = self.vary.keys().map(String::as_str).collect();
            format!(
                "\"{key}\" is not accepted; a key of [vary] is needed: {}",
                keys.join(", ")
            )
        };
        for (key, values) in &self.vary {
            if values.as_array().is_none_or(Vec::is_empty) {
                return self.fail("vary", 0, key, "a list of values is needed");
            }
        }
        if let Some(key) = self.together.iter().flatten().find(|k| !known(k)) {
            return self.fail("", 0, "together", unknown(key));
        }
        if let Some(key) = self.each.iter().find(|k| !known(k)) {
            return self.fail("", 0, "each", unknown(key));
        }
        if let Some(key) = self.along.as_ref().filter(|k| !known(k)) {
            return self.fail("", 0, "along", unknown(key));
        }
        Ok(())
    }

    fn check_measure(&self, i: usize, m: &Measure, base: &Scene) -> Result<(), EngineError> {
        let kinds = [
            ("quantity", m.quantity.is_some()),
            ("report", m.report.is_some()),
            ("steps", m.steps.is_some()),
            ("field", m.field.is_some()),
            ("frequency", m.frequency.is_some()),
        ];
        if kinds.iter().filter(|k| k.1).count() != 1 {
            let names = kinds.map(|k| k.0).join(", ");
            return self.fail("measure", i, "", format!("exactly one of {names} is needed"));
        }
        if let Some(name) = &m.quantity
            && !base.quantity.iter().any(|q| q.name == *name)
        {
            let names: Vec<&str> = base.quantity.iter().map(|q| q.name.as_str()).collect();
            let message = format!(
                "\"{name}\" is no [[quantity]] of the scene; accepted: {}",
                names.join(", ")
            );
            return self.fail("measure", i, "quantity", message);
        }
        if m.frequency == Some(0) {
            return self.fail(
                "measure",
                i,
                "frequency",
                "0 is not accepted; frequencies are counted from one",
            );
        }
        let of_field = matches!(m.reference, Some(Reference::File(..) | Reference::Exact(_)));
        match (&m.field, &m.reference) {
            (Some(_), Some(Reference::Number(_)) | None) => {
                let message =
                    "a field needs \"finest\", { file = \"...\", field = \"...\" } or { exact = [3 formulas] }";
                return self.fail("measure", i, "reference", message);
            }
            (None, _) if of_field => {
                return self.fail(
                    "measure",
                    i,
                    "reference",
                    "it is a field, which only \"field\" is compared with",
                );
            }
            _ => {}
        }
        if !m.with.is_empty() && m.field.is_some() {
            return self.fail("measure", i, "with", "it belongs to a number, not to a field");
        }
        if m.over.is_some_and(|o| o == 0.0 || !o.is_finite()) {
            return self.fail("measure", i, "over", "a number other than zero is needed");
        }
        if m.repeats == Some(0) {
            return self.fail(
                "measure",
                i,
                "repeats",
                "0 is not accepted; a run is made once or more often",
            );
        }
        if self.measure[..i].iter().any(|other| other.name == m.name) {
            return self.fail(
                "measure",
                i,
                "name",
                format!("\"{}\" is not accepted; a name of its own is needed", m.name),
            );
        }
        Ok(())
    }

    fn check_chart(&self, i: usize, chart: &Chart) -> Result<(), EngineError> {
        let is_key = |key: &str| self.vary.contains_key(key);
        let is_figure = |figure: &str| {
            let (kind, name) = figure.split_once('.').unwrap_or((figure, ""));
            let named = name.is_empty() || self.measure.iter().any(|m| m.name == name);
            match kind {
                "error" | "value" => named,
                "seconds" | "iterations" => name.is_empty(),
                _ => false,
            }
        };
        const FIGURES: &str = "\"error\", \"value\" (with a measure: \"error.NAME\"), \"seconds\", \"iterations\"";
        if !is_key(&chart.x) && (chart.color.is_some() || !["seconds", "dofs", "cells"].contains(&chart.x.as_str())) {
            let message = format!(
                "\"{}\" is not accepted; \"seconds\", \"dofs\", \"cells\" or a key of [vary], for a map a key",
                chart.x
            );
            return self.fail("chart", i, "x", message);
        }
        match &chart.color {
            None if !is_figure(&chart.y) => {
                self.fail("chart", i, "y", format!("\"{}\" is not accepted; {FIGURES}", chart.y))
            }
            Some(_) if !is_key(&chart.y) || chart.x == chart.y => self.fail(
                "chart",
                i,
                "y",
                format!("\"{}\" is not accepted; a map needs another key of [vary]", chart.y),
            ),
            Some(color) if !is_figure(color) => {
                self.fail("chart", i, "color", format!("\"{color}\" is not accepted; {FIGURES}"))
            }
            _ => Ok(()),
        }
    }

    /// The scene of a point of the grid, with more settings over it.
    ///
    /// # Errors
    /// What the scene does not accept.
    pub(super) fn scene_of(&self, point: &Point, more: &Table) -> Result<Scene, EngineError> {
        let mut table = self.base.clone();
        let settings = point.settings.iter().filter(|(key, _)| is_of_scene(key));
        for (key, value) in settings.map(|(k, v)| (k, v)).chain(more) {
            if let Err(message) = grid::set(&mut table, key, value) {
                return self.fail("vary", 0, key, message);
            }
        }
        let text = toml::to_string(&table).map_err(|e| self.source.error("vary", 0, "", e.to_string()))?;
        Scene::parse(&text, self.scene_path()).map_err(|e| without_line(e, &self.scene_path()))
    }
}

/// The lines of a scene with other settings are nobody's.
fn without_line(error: EngineError, scene: &Path) -> EngineError {
    let EngineError::Scene { place, message } = error else {
        return error;
    };
    let file = scene.display().to_string();
    let rest = place.strip_prefix(&file).and_then(|rest| rest.strip_prefix(':'));
    let key = rest.map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':'));
    let place = key.map_or_else(|| place.clone(), |key| format!("{file}:{key}"));
    EngineError::Scene { place, message }
}

impl Measure {
    /// Gives it a name.
    fn complete(&mut self) {
        if self.name.is_empty() {
            let number = self.frequency.map(|n| format!("frequency {n}"));
            let named = [&self.quantity, &self.report, &self.steps, &self.field, &number];
            self.name = named.into_iter().flatten().next().cloned().unwrap_or_default();
        }
    }
}
