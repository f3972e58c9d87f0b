//! How the values of a scene are read: numbers or expressions, conditions, fields.

use std::fmt;
use std::marker::PhantomData;
use std::path::PathBuf;
use std::str::FromStr;

use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};

use kerfem_cutting::{Blade, BladeError};
use kerfem_mesh::Point;

use super::MethodName;
use super::source::explain;
use crate::Expression;

impl<'de> Deserialize<'de> for Expression {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NumberVisitor)
    }
}

impl Serialize for Expression {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.text())
    }
}

struct NumberVisitor;

impl Visitor<'_> for NumberVisitor {
    type Value = Expression;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or an expression in quotes")
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Expression, E> {
        if value.is_finite() {
            Ok(Expression::constant(value))
        } else {
            Err(E::custom(format!("{value} is not accepted; a finite number is needed")))
        }
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Expression, E> {
        self.visit_f64(value as f64)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Expression, E> {
        Expression::number(text).map_err(E::custom)
    }
}

/// A list of so many entries. (An array of serde takes no notice of what follows.)
pub(super) fn exactly<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
    deserializer: D,
) -> Result<[T; N], D::Error> {
    let all = Vec::<T>::deserialize(deserializer)?;
    let count = all.len();
    let fail = |_| de::Error::custom(format!("{count} entries are given; a list of {N} is needed"));
    all.try_into().map_err(fail)
}

impl FromStr for MethodName {
    type Err = String;

    /// Reads the name as a scene does.
    fn from_str(name: &str) -> Result<Self, String> {
        let read = Self::deserialize(de::value::StrDeserializer::<de::value::Error>::new(name));
        read.map_err(|e| explain(&e.to_string()))
    }
}

/// A condition on rest positions, such as `"x < 1e-6 && abs(y) < 0.5"`.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition(pub Expression);

impl<'de> Deserialize<'de> for Condition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let condition = Expression::condition(&text).map_err(de::Error::custom)?;
        if condition.uses_time() {
            return Err(de::Error::custom(format!(
                "\"{}\" depends on t; sets do not change with time, only x, y, z are accepted",
                condition.shown()
            )));
        }
        Ok(Condition(condition))
    }
}

impl Serialize for Condition {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0.text())
    }
}

/// A vector by its components, two (in the plane) or three.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Components<T>(pub Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Components<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let all = Vec::<T>::deserialize(deserializer)?;
        match all.len() {
            2 | 3 => Ok(Components(all)),
            count => Err(de::Error::custom(format!(
                "{count} components are given; 3 are needed, 2 in the plane"
            ))),
        }
    }
}

impl Components<Expression> {
    /// All three, with zero for one that is not given.
    pub fn in_space(&self) -> [Expression; 3] {
        std::array::from_fn(|k| self.0.get(k).cloned().unwrap_or_else(|| Expression::constant(0.0)))
    }
}

impl Components<f64> {
    /// All three, with zero for one that is not given.
    pub fn in_space(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.0.get(k).copied().unwrap_or(0.0))
    }
}

/// A nodal field: given in the scene, or the point array of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Field<T> {
    /// Given in the scene.
    Here(T),
    /// The array called `array` of the points of `file`, in the order of the mesh file.
    File {
        /// The file, relative to the scene.
        file: PathBuf,
        /// Name of the array.
        array: String,
    },
}

/// A vector field at the start: expressions in `x, y, z`, or a point array of a file.
pub type InitialField = Field<Components<Expression>>;

/// Forces (N) on vertices: one for each vertex that is listed beside them, or a point array of a file.
pub type NodalForces = Field<Vec<Components<f64>>>;

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Field<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(FieldVisitor(PhantomData))
    }
}

impl<T: Serialize> Serialize for Field<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Field::Here(value) => value.serialize(serializer),
            Field::File { file, array } => {
                let mut map = serializer.serialize_map(Some(2))?;
                map.serialize_entry("file", file)?;
                map.serialize_entry("array", array)?;
                map.end()
            }
        }
    }
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct FileArray {
    file: PathBuf,
    array: String,
}

struct FieldVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for FieldVisitor<T> {
    type Value = Field<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list in brackets, or { file = \"...\", array = \"...\" }")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Field<T>, A::Error> {
        T::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Field::Here)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Field<T>, A::Error> {
        let FileArray { file, array } = FileArray::deserialize(de::value::MapAccessDeserializer::new(map))?;
        Ok(Field::File { file, array })
    }
}

/// A blade's samples: time (s) and two end points (m).
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct BladePath(pub Vec<BladeSample>);

impl BladePath {
    /// The blade.
    ///
    /// # Errors
    /// [`BladeError`] for the first thing that is not accepted.
    pub fn blade(&self) -> Result<Blade, BladeError> {
        let samples = self.0.iter().map(|s| (s.time, s.ends.map(Point::from)));
        Blade::new(samples.collect())
    }
}

/// A blade at one time, written `[t, [x, y, z], [x, y, z]]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BladeSample {
    /// When (s).
    pub time: f64,
    /// Its end points (m).
    pub ends: [[f64; 3]; 2],
}

impl Serialize for BladeSample {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (self.time, self.ends[0], self.ends[1]).serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for BladeSample {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(BladeSampleVisitor)
    }
}

struct BladeSampleVisitor;

impl<'de> Visitor<'de> for BladeSampleVisitor {
    type Value = BladeSample;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a sample [t, [x, y, z], [x, y, z]]")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<BladeSample, A::Error> {
        const WANTED: &str = "a sample of a blade is [t, [x, y, z], [x, y, z]]";
        let short = || de::Error::custom(WANTED);
        let time = seq.next_element()?.ok_or_else(short)?;
        let mut end = || -> Result<[f64; 3], A::Error> {
            let all: Vec<f64> = seq.next_element()?.ok_or_else(short)?;
            all.try_into().map_err(|_| de::Error::custom(WANTED))
        };
        let ends = [end()?, end()?];
        match seq.next_element::<de::IgnoredAny>()? {
            None => Ok(BladeSample { time, ends }),
            Some(_) => Err(de::Error::custom(WANTED)),
        }
    }
}
