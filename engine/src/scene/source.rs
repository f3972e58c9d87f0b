//! Where in the text of a scene something stands, and messages that say so.

use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use kerfem_mesh::io::IoError;
use serde::{Deserialize, Serialize};
use toml::de::{DeTable, DeValue};

use crate::EngineError;
use crate::error::beginning;
use crate::nearest::nearest;

/// Largest scene (bytes): a text that someone wrote, or a program for them, is smaller.
const LARGEST: u64 = 64 << 20;

/// Characters of a key that a place shows.
const SHOWN: usize = 60;

/// Said where a list is needed and something else is given.
const LIST_NEEDED: &str = "a list is needed";

/// Names that the format knows and this version does not run.
const NOT_YET: [&str; 2] = ["delaunay", "path"];

/// The text of a file that is a `what`: a scene, a study.
///
/// # Errors
/// [`EngineError::Scene`] if it cannot be read, is larger than 64 MiB, or is no text.
pub(crate) fn read_text(path: &Path, what: &str) -> Result<String, EngineError> {
    let fail = |line: String, message: String| EngineError::Scene {
        place: format!("{}{line}", path.display()),
        message: format!("{message}; a TOML file is needed"),
    };
    let cannot = |e: io::Error| fail(String::new(), format!("the {what} cannot be read: {e}"));
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(cannot)?;
    file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > LARGEST {
        return Err(fail(String::new(), format!("the {what} is larger than 64 MiB")));
    }
    String::from_utf8(bytes).map_err(|e| {
        let valid = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|b| **b == b'\n').count();
        fail(format!(":{line}"), format!("the {what} is not UTF-8 text"))
    })
}

/// What is said of a file that a scene names and that could not be read.
pub(crate) fn unreadable(error: &IoError) -> String {
    let hint = match error {
        IoError::Read { .. } => "; a file that can be read is needed, its path relative to the scene",
        _ => "",
    };
    format!("{error}{hint}")
}

/// The text of a scene and the file it came from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

impl Source {
    /// The path of a file that the scene names: relative to the scene.
    pub(crate) fn resolve(&self, file: &Path) -> PathBuf {
        self.path
            .parent()
            .map_or_else(|| file.to_owned(), |folder| folder.join(file))
    }

    /// An error about `key` of the section number `index` (from zero) called `section`; `""` is the top level.
    pub(crate) fn error(&self, section: &str, index: usize, key: &str, message: impl Into<String>) -> EngineError {
        let (document, _) = DeTable::parse_recoverable(&self.text);
        let (line, number) = match locate(document.get_ref(), section, index, key) {
            Some((offset, count)) => (
                format!(":{}", self.line_at(offset)),
                if count > 1 { format!("[{index}]") } else { String::new() },
            ),
            None => (String::new(), String::new()),
        };
        let dot = if section.is_empty() || key.is_empty() { "" } else { "." };
        EngineError::Scene {
            place: format!("{}{line}: {section}{number}{dot}{key}", self.path.display()),
            message: message.into(),
        }
    }

    /// The error about a file that `key` names and that could not be read.
    pub(crate) fn file_error(&self, section: &str, index: usize, key: &str, error: &IoError) -> EngineError {
        self.error(section, index, key, unreadable(error))
    }

    /// The error that the TOML reader or a deserializer reports, in one line with line, section and key.
    pub(crate) fn toml_error(&self, error: &toml::de::Error) -> EngineError {
        let mut message = explain(error.message());
        let mut place = self.path.display().to_string();
        // what is missing at the top level is missing nowhere in particular
        let nowhere = |s: &Range<usize>| s.is_empty() && error.message().starts_with("missing field ");
        if let Some(span) = error.span().filter(|s| !nowhere(s)) {
            let start = self.floor_boundary(span.start);
            place += &format!(":{}", self.line_at(start));
            let (document, _) = DeTable::parse_recoverable(&self.text);
            let path = path_at(document.get_ref(), start).or_else(|| self.path_by_lines(start));
            if let Some(path) = path {
                if message.ends_with(LIST_NEEDED) && self.text[start..].starts_with('[') {
                    message += &format!(" of sections, each under [[{path}]]");
                }
                place += &format!(": {path}");
            }
        }
        EngineError::Scene { place, message }
    }

    /// Section and key by the look of the lines, where the text is no TOML.
    fn path_by_lines(&self, start: usize) -> Option<String> {
        let before = &self.text[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let line = self.text[line_start..].lines().next().unwrap_or("");
        if let Some(section) = header(line) {
            return Some(section.to_owned());
        }
        let key = line.split_once('=').map(|(k, _)| k.trim());
        let key = key
            .filter(|k| !k.is_empty() && !k.starts_with('#'))
            .map(|k| beginning(k, SHOWN));
        match (before.lines().rev().find_map(header), key) {
            (Some(s), Some(k)) => Some(format!("{s}.{k}")),
            (section, key) => key.or_else(|| section.map(str::to_owned)),
        }
    }

    fn line_at(&self, offset: usize) -> usize {
        self.text[..offset].matches('\n').count() + 1
    }

    fn floor_boundary(&self, i: usize) -> usize {
        let mut i = i.min(self.text.len());
        while !self.text.is_char_boundary(i) {
            i -= 1;
        }
        i
    }
}

/// Where `key` of the section number `index` called `section` stands, or else the section; and how many of them there are.
fn locate(document: &DeTable, section: &str, index: usize, key: &str) -> Option<(usize, usize)> {
    let start_of = |table: &DeTable, key: &str| table.get_key_value(key).map(|(k, _)| k.span().start);
    if section.is_empty() {
        return start_of(document, key).map(|start| (start, 1));
    }
    let (name, value) = document.get_key_value(section)?;
    let (start, table, count) = match value.get_ref() {
        DeValue::Array(list) => {
            let item = list.get(index)?;
            (item.span().start, item.get_ref().as_table(), list.len())
        }
        other => (name.span().start, other.as_table(), 1),
    };
    Some((table.and_then(|t| start_of(t, key)).unwrap_or(start), count))
}

/// The names that lead to what stands at `offset`, joined by dots; sections of a list with their number, if there are several.
fn path_at(table: &DeTable, offset: usize) -> Option<String> {
    let here = |span: Range<usize>| span.contains(&offset);
    table.iter().find_map(|(name, value)| {
        let own = beginning(name.get_ref(), SHOWN);
        let below = match value.get_ref() {
            DeValue::Table(inner) => path_at(inner, offset).map(|path| format!("{own}.{path}")),
            DeValue::Array(list) => list.iter().enumerate().find_map(|(i, item)| {
                let inner = item.get_ref().as_table()?;
                let number = if list.len() > 1 {
                    format!("[{i}]")
                } else {
                    String::new()
                };
                let path = path_at(inner, offset).map(|path| format!("{own}{number}.{path}"));
                path.or_else(|| here(item.span()).then(|| format!("{own}{number}")))
            }),
            _ => None,
        };
        below.or_else(|| (here(name.span()) || here(value.span())).then_some(own))
    })
}

/// The name in `[name]` or `[[name]]`.
fn header(line: &str) -> Option<&str> {
    let line = line.split('#').next()?.trim();
    let inner = line.strip_prefix('[')?.strip_suffix(']')?;
    let inner = inner
        .strip_prefix('[')
        .and_then(|s| s.strip_suffix(']'))
        .unwrap_or(inner)
        .trim();
    let name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-' || c == '.';
    (!inner.is_empty() && inner.chars().all(name)).then_some(inner)
}

/// A deserializer's message in words for a user, with the nearest name for an unknown one.
pub(super) fn explain(message: &str) -> String {
    let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
    for (what, start) in [("key", "unknown field "), ("value", "unknown variant ")] {
        let Some(rest) = message.strip_prefix(start) else {
            continue;
        };
        let mut names = rest.split('`').skip(1).step_by(2);
        let Some(wrong) = names.next() else { continue };
        let known: Vec<&str> = names.collect();
        let accepted = known.iter().map(|k| format!("\"{k}\"")).collect::<Vec<_>>().join(", ");
        if NOT_YET.contains(&wrong) {
            return format!("\"{wrong}\" is not available yet; accepted: {accepted}");
        }
        let hint =
            nearest(wrong, known.iter().copied()).map_or_else(String::new, |n| format!("did you mean \"{n}\"? "));
        return format!("unknown {what} \"{wrong}\"; {hint}accepted: {accepted}");
    }
    if message == "wanted string or table" {
        return "a text in quotes is needed".into();
    }
    if ["recursion limit", "cannot recurse further; max recursion depth met"].contains(&message.as_str()) {
        return "it is nested too deeply; at most 80 levels are accepted".into();
    }
    if message == "floating-point number overflowed" {
        return "the number is too large; a finite number is needed".into();
    }
    if message == "wanted exactly 1 element, more than 1 element" {
        return "a list of sections is not accepted; one section is needed".into();
    }
    if message.starts_with("invalid length ") && message.contains("struct ") {
        return "a list is not accepted; a table is needed".into();
    }
    if let Some(rest) = message.strip_prefix("missing field ") {
        return format!("the key {} is missing", rest.replace('`', "\""));
    }
    let invalid = ["invalid type: ", "invalid value: "]
        .iter()
        .find_map(|p| message.strip_prefix(p));
    if let Some((found, wanted)) = invalid.and_then(|r| r.split_once(", expected ")) {
        let found = match found {
            "map" => "a table",
            "sequence" => "a list",
            other => other,
        };
        let wanted = match wanted {
            "f64" => "a number is needed",
            "u32" | "usize" | "u64" => "a whole number, zero or more, is needed",
            "a string" | "path string" => "a text in quotes is needed",
            "a boolean" => "true or false is needed",
            "a sequence" => LIST_NEEDED,
            other if other.starts_with("struct ") => "a table is needed",
            other => return format!("{found} is not accepted; {other}"),
        };
        return format!("{found} is not accepted; {wanted}");
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_and_lines_are_found() {
        let source = Source {
            path: "s.toml".into(),
            text: "name = 'a'\n[material]\nyoung = 1\n[[cut]]\nat = 0\n[[cut]] # second\nat = -1\n".into(),
        };
        for (section, index, key, wanted) in [
            ("", 0, "name", "s.toml:1: name: bad"),
            ("material", 0, "young", "s.toml:3: material.young: bad"),
            ("material", 0, "poisson", "s.toml:2: material.poisson: bad"),
            ("cut", 0, "", "s.toml:4: cut[0]: bad"),
            ("cut", 1, "at", "s.toml:7: cut[1].at: bad"),
            ("time", 0, "dt", "s.toml: time.dt: bad"),
        ] {
            assert_eq!(source.error(section, index, key, "bad").to_string(), wanted);
        }
    }

    #[test]
    fn places_are_found_in_every_way_to_write_a_section() {
        let source = Source {
            path: "s.toml".into(),
            text:
                "time.dt = 1\nmesh = { box = {\n  cells = [1] } }\nfixed = [\n  { axes = 'x' },\n  { axes = 'y' },\n]\n"
                    .into(),
        };
        let place = |section, index, key| source.error(section, index, key, "bad").to_string();
        assert_eq!(place("time", 0, "dt"), "s.toml:1: time.dt: bad");
        assert_eq!(place("time", 0, "end"), "s.toml:1: time.end: bad");
        assert_eq!(place("mesh", 0, "box"), "s.toml:2: mesh.box: bad");
        assert_eq!(place("fixed", 1, "axes"), "s.toml:6: fixed[1].axes: bad");
        let (document, _) = DeTable::parse_recoverable(&source.text);
        let path = |part: &str| path_at(document.get_ref(), source.text.find(part).unwrap());
        assert_eq!(path("[1]").as_deref(), Some("mesh.box.cells"));
        assert_eq!(path("'y'").as_deref(), Some("fixed[1].axes"));
        assert_eq!(path("dt").as_deref(), Some("time.dt"));
    }
}
