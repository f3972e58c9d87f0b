//! The grid of settings: every combination, and how one changes a scene.

use toml::{Table, Value};

use super::spec::{LABEL, Study, is_of_scene};
use crate::EngineError;

/// Most runs of a study.
const MOST: usize = 100_000;

/// One combination of settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Keys in the order of `[vary]`, and their values.
    pub settings: Vec<(String, Value)>,
    /// What each value is called; nothing where another one stands for it.
    names: Vec<String>,
}

impl Point {
    /// The value of a key.
    pub(super) fn value(&self, key: &str) -> Option<&Value> {
        self.settings.iter().find(|(k, _)| k == key).map(|(_, v)| v)
    }

    /// What the values of some keys are called.
    pub(super) fn labels<'a>(&'a self, keys: impl Iterator<Item = &'a str>) -> Vec<String> {
        let place = |key: &str| self.settings.iter().position(|(k, _)| k == key);
        let names = keys.filter_map(place).map(|k| self.names[k].clone());
        names.filter(|n| !n.is_empty()).collect()
    }
}

/// A value as it is shown: a text without quotes.
pub(super) fn label(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) => values.iter().map(label).collect::<Vec<_>>().join(" x "),
        Value::Table(table) => {
            let parts: Vec<String> = table.iter().map(|(k, v)| format!("{k} {}", label(v))).collect();
            parts.join(", ")
        }
        other => other.to_string(),
    }
}

/// All combinations: the product of the lists, the last key fastest; lists that move together count as one.
pub(super) fn points(study: &Study) -> Result<Vec<Point>, EngineError> {
    let mut axes: Vec<Vec<&str>> = Vec::new();
    for key in study.vary.keys() {
        let group = study.together.iter().find(|g| g.contains(key));
        match group {
            Some(group) if group.iter().any(|k| axes.iter().flatten().any(|a| a == k)) => {}
            Some(group) => axes.push(group.iter().map(String::as_str).collect()),
            None => axes.push(vec![key]),
        }
    }
    let values = |key: &str| study.vary[key].as_array().map_or(&[][..], Vec::as_slice);
    let mut points = vec![Vec::new()];
    for axis in &axes {
        let count = values(axis[0]).len();
        if let Some(other) = axis.iter().find(|k| values(k).len() != count) {
            let message = format!(
                "\"{}\" has {count} values and \"{other}\" {}; lists that move together must be of one length",
                axis[0],
                values(other).len()
            );
            return study.fail("", 0, "together", message);
        }
        if points.len().saturating_mul(count) > MOST {
            return study.fail("", 0, "vary", format!("the grid has more than {MOST} runs"));
        }
        let extended = |point: &Vec<(String, Value)>, k: usize| {
            let own = axis.iter().map(|key| ((*key).to_owned(), values(key)[k].clone()));
            point.iter().cloned().chain(own).collect::<Vec<_>>()
        };
        points = points
            .iter()
            .flat_map(|point| (0..count).map(move |k| (point, k)))
            .map(|(point, k)| extended(point, k))
            .collect();
    }
    let in_order = |mut settings: Vec<(String, Value)>| {
        settings.sort_by_key(|(key, _)| study.vary.keys().position(|k| k == key));
        let names = names(study, &settings);
        Point { settings, names }
    };
    Ok(points.into_iter().map(in_order).collect())
}

/// A "label" is the name of all that moves together with it; what has one value for all runs needs no name.
fn names(study: &Study, settings: &[(String, Value)]) -> Vec<String> {
    let labelled = study.together.iter().find(|group| group.iter().any(|k| k == LABEL));
    let group = labelled.map_or(&[][..], Vec::as_slice);
    let mut text = settings.iter().find(|(k, _)| k == LABEL).map(|(_, v)| label(v));
    let name = |(key, value): &(String, Value)| match group.contains(key) {
        true if is_of_scene(key) => text.take().unwrap_or_default(),
        true => String::new(),
        false if study.vary[key].as_array().is_some_and(|values| values.len() == 1) => String::new(),
        false => label(value),
    };
    settings.iter().map(name).collect()
}

/// Sets a key of a scene, given as "section.key" or "section.number.key"; tables on the way are made.
pub(super) fn set(table: &mut Table, key: &str, value: &Value) -> Result<(), String> {
    let (first, rest) = match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value.clone());
            return Ok(());
        }
        Some(parts) => parts,
    };
    let number = |text: &str| text.split('.').next().is_some_and(|t| t.parse::<usize>().is_ok());
    if !table.contains_key(first) && number(rest) {
        return Err(format!("[[{first}]] has none, so it cannot be changed"));
    }
    let (place, rest) = match table.entry(first).or_insert_with(|| Table::new().into()) {
        Value::Array(list) => {
            let (number, rest) = rest.split_once('.').unwrap_or((rest, ""));
            let count = list.len();
            let item = number.parse().ok().and_then(|k: usize| list.get_mut(k));
            let Some(item) = item else {
                return Err(format!(
                    "\"{number}\" is not accepted; [[{first}]] has {count}, counted from zero"
                ));
            };
            (item, rest)
        }
        other => (other, rest),
    };
    match place {
        Value::Table(inner) if !rest.is_empty() => set(inner, rest, value),
        _ if rest.is_empty() => {
            *place = value.clone();
            Ok(())
        }
        _ => Err(format!("\"{first}\" is no table, so it has no key \"{rest}\"")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_set_where_they_stand() {
        let mut table: Table = toml::from_str("a = 1\n[[cut]]\nat = 0\n[[cut]]\nat = 1").unwrap();
        set(&mut table, "a", &2.into()).unwrap();
        set(&mut table, "cut.1.method", &"snap".into()).unwrap();
        set(&mut table, "model.order", &2.into()).unwrap();
        assert_eq!(table["a"].as_integer(), Some(2));
        assert_eq!(table["cut"][1]["method"].as_str(), Some("snap"));
        assert_eq!(table["model"]["order"].as_integer(), Some(2));
        let wrong = set(&mut table, "cut.2.at", &1.into()).unwrap_err();
        assert!(wrong.contains("[[cut]] has 2"), "{wrong}");
        assert!(set(&mut table, "a.b", &1.into()).is_err());
        assert!(set(&mut table, "load.0.force", &1.into()).is_err());
    }

    #[test]
    fn labels_are_short() {
        let value: Table = toml::from_str("v = [1, 2]\nw = { size = 0.5 }").unwrap();
        assert_eq!(label(&value["v"]), "1 x 2");
        assert_eq!(label(&value["w"]), "size 0.5");
    }
}
