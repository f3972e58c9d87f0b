//! Where in the text of a scene something stands, and messages that say so.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::EngineError;
use crate::nearest::nearest;

/// Names that the format knows and this version does not run.
const NOT_YET: [&str; 9] = [
    "newmark",
    "bdf2",
    "central-difference",
    "collapse",
    "merge",
    "delaunay",
    "blade",
    "path",
    "KI",
];

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
        let line = self
            .line_of(section, index, key)
            .map_or_else(String::new, |n| format!(":{n}"));
        let many = self.count(section) > 1;
        let section = match many {
            true => format!("{section}[{index}]"),
            false => section.to_owned(),
        };
        let dot = if section.is_empty() || key.is_empty() { "" } else { "." };
        EngineError::Scene {
            place: format!("{}{line}: {section}{dot}{key}", self.path.display()),
            message: message.into(),
        }
    }

    /// The error that the TOML reader or a deserializer reports, in one line with line, section and key.
    pub(crate) fn toml_error(&self, error: &toml::de::Error) -> EngineError {
        let start = error.span().map(|s| s.start.min(self.text.len()));
        let mut place = self.path.display().to_string();
        if let Some(start) = start {
            let before = &self.text[..self.floor_boundary(start)];
            place += &format!(":{}", before.matches('\n').count() + 1);
            let line_start = before.rfind('\n').map_or(0, |i| i + 1);
            let line = self.text[line_start..].lines().next().unwrap_or("");
            let section = header(line).or_else(|| before.lines().rev().find_map(header));
            let key = line
                .split_once('=')
                .map(|(k, _)| k.trim())
                .filter(|_| header(line).is_none());
            let key = key.filter(|k| !k.is_empty() && !k.starts_with('#'));
            match (section, key) {
                (Some(s), Some(k)) => place += &format!(": {s}.{k}"),
                (Some(s), None) => place += &format!(": {s}"),
                (None, Some(k)) => place += &format!(": {k}"),
                (None, None) => {}
            }
        }
        EngineError::Scene {
            place,
            message: explain(error.message()),
        }
    }

    fn floor_boundary(&self, mut i: usize) -> usize {
        while !self.text.is_char_boundary(i) {
            i -= 1;
        }
        i
    }

    fn count(&self, section: &str) -> usize {
        self.text.lines().filter(|l| header(l) == Some(section)).count()
    }

    fn line_of(&self, section: &str, index: usize, key: &str) -> Option<usize> {
        let mut seen = 0;
        let mut inside = section.is_empty();
        let mut found = None;
        for (n, line) in self.text.lines().enumerate() {
            if let Some(name) = header(line) {
                if inside && found.is_some() {
                    break;
                }
                inside = name == section && seen == index;
                seen += usize::from(name == section);
                if inside {
                    found = Some(n + 1);
                }
            } else if inside && line.split(['=', '.']).next().is_some_and(|k| k.trim() == key) {
                return Some(n + 1);
            }
        }
        found
    }
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
fn explain(message: &str) -> String {
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
    if let Some(rest) = message.strip_prefix("missing field ") {
        return format!("the key {} is missing", rest.replace('`', "\""));
    }
    if let Some((found, wanted)) = message
        .strip_prefix("invalid type: ")
        .and_then(|r| r.split_once(", expected "))
    {
        let wanted = match wanted {
            "f64" => "a number",
            "u32" | "usize" | "u64" => "a whole number, zero or more",
            "a string" => "a text in quotes",
            other => other.strip_prefix("struct ").map_or(other, |_| "a table"),
        };
        return format!("{found} is not accepted; {wanted} is needed");
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
        assert_eq!(source.line_of("", 0, "name"), Some(1));
        assert_eq!(source.line_of("material", 0, "young"), Some(3));
        assert_eq!(source.line_of("material", 0, "poisson"), Some(2));
        assert_eq!(source.line_of("cut", 1, "at"), Some(7));
        assert_eq!(source.line_of("time", 0, "dt"), None);
        assert_eq!(
            source.error("cut", 1, "at", "is bad").to_string(),
            "s.toml:7: cut[1].at: is bad"
        );
    }
}
