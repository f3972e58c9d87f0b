//! A cursor over the words, lines and binary numbers of a file.

use std::str::FromStr;

use super::error::Problem;

/// A place in the bytes of a file, with its line number and the section it belongs to.
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Number of the line, from one.
    pub(super) line: usize,
    /// Name of the section, for messages.
    pub(super) section: String,
    /// Whether places are named by byte rather than by line.
    pub(super) binary: bool,
    /// What begins a comment that lasts to the end of the line.
    pub(super) comment: Option<u8>,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Cursor {
            bytes,
            at: 0,
            line: 1,
            section: String::new(),
            binary: false,
            comment: None,
        }
    }

    /// A problem at the current place.
    pub(super) fn problem(&self, problem: impl Into<String>) -> Problem {
        let place = match self.binary {
            true => format!("byte {}", self.at),
            false => format!("line {}", self.line),
        };
        match self.section.as_str() {
            "" => Problem::new(place, problem),
            section => Problem::new(format!("{place}, {section}"), problem),
        }
    }

    /// Bytes that have not been read.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next word, without passing it.
    pub(super) fn peek(&mut self) -> Option<&'a [u8]> {
        let mut commented = false;
        while let Some(&b) = self.bytes.get(self.at) {
            commented = b != b'\n' && (commented || Some(b) == self.comment);
            if !commented && !b.is_ascii_whitespace() {
                break;
            }
            self.line += usize::from(b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let ends = |b: &u8| b.is_ascii_whitespace() || Some(*b) == self.comment;
        let end = rest.iter().position(ends).unwrap_or(rest.len());
        (end > 0).then(|| &rest[..end])
    }

    /// The next word, which should be `what`.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a [u8], Problem> {
        let word = self
            .peek()
            .ok_or_else(|| self.problem(format!("the file ends where {what} should follow")))?;
        self.at += word.len();
        Ok(word)
    }

    /// The next word as a number; `accepted` says which.
    pub(super) fn number<T: FromStr>(&mut self, what: &str, accepted: &str) -> Result<T, Problem> {
        let word = self.word(what)?;
        std::str::from_utf8(word)
            .ok()
            .and_then(|w| w.parse().ok())
            .ok_or_else(|| self.problem(format!("{what} is '{}'; {accepted} is accepted", shown(word))))
    }

    /// A finite number.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, Problem> {
        let value: f64 = self.number(what, "a finite number")?;
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.problem(format!("{what} is {value}; a finite number is accepted")))
        }
    }

    /// A whole number.
    pub(super) fn integer(&mut self, what: &str) -> Result<i64, Problem> {
        self.number(what, "a whole number")
    }

    /// How many entries follow, each of at least `bytes_each` bytes: no more than the rest of the file can hold.
    pub(super) fn count(&mut self, what: &str, bytes_each: usize) -> Result<usize, Problem> {
        let count = self.integer(what)?;
        self.check_count(count, what, bytes_each)
    }

    /// `count` if the rest of the file can hold as many entries of at least `bytes_each` bytes.
    pub(super) fn check_count(&self, count: i64, what: &str, bytes_each: usize) -> Result<usize, Problem> {
        let most = self.left() / bytes_each.max(1) + 1; // the last entry may end without a separator
        match usize::try_from(count) {
            Ok(n) if n <= most => Ok(n),
            Ok(n) => Err(self.problem(format!("{what} is {n}, but only {} bytes follow", self.left()))),
            Err(_) => Err(self.problem(format!("{what} is {count}; zero or more is accepted"))),
        }
    }

    /// What is left of the line, and passes its end.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|&b| b == b'\n');
        self.at += end.map_or(rest.len(), |e| e + 1);
        self.line += usize::from(end.is_some());
        rest[..end.unwrap_or(rest.len())].trim_ascii()
    }

    /// Passes the end of a line, unless the next line has begun already.
    pub(super) fn end_line(&mut self) {
        if self.at > 0 && self.bytes[self.at - 1] != b'\n' {
            self.rest_of_line();
        }
    }

    /// Whether the next line begins with `word`; nothing is passed.
    pub(super) fn next_line_begins_with(&self, word: &[u8]) -> bool {
        let rest = &self.bytes[self.at..];
        let begun = self.at > 0 && self.bytes[self.at - 1] == b'\n';
        let start = if begun {
            Some(0)
        } else {
            rest.iter().position(|&b| b == b'\n').map(|n| n + 1)
        };
        let line = start.and_then(|s| rest[s..].get(..word.len()));
        line.is_some_and(|line| line.eq_ignore_ascii_case(word))
    }

    /// The next `N` bytes as they are.
    pub(super) fn raw<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Problem> {
        let bytes = self.bytes[self.at..].first_chunk::<N>().copied();
        let bytes = bytes.ok_or_else(|| self.problem(format!("the file ends where {what} should follow")))?;
        self.at += N;
        Ok(bytes)
    }

    /// Passes the bytes up to and including the next occurrence of `mark`, or says that there is none.
    pub(super) fn skip_past(&mut self, mark: &str) -> Result<(), Problem> {
        let rest = &self.bytes[self.at..];
        let found = rest.windows(mark.len()).position(|w| w == mark.as_bytes());
        let found = found.ok_or_else(|| self.problem(format!("the file ends before {mark}")))?;
        self.line += rest[..found].iter().filter(|&&b| b == b'\n').count();
        self.at += found + mark.len();
        Ok(())
    }

    /// Requires `mark` as the next word.
    pub(super) fn expect(&mut self, mark: &str) -> Result<(), Problem> {
        let word = self.word(mark)?;
        if word == mark.as_bytes() {
            Ok(())
        } else {
            Err(self.problem(format!("found '{}' where {mark} should follow", shown(word))))
        }
    }
}

/// A word of a file, short and printable.
pub(super) fn shown(word: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(word)
        .chars()
        .filter(|c| !c.is_control())
        .take(40)
        .collect();
    if word.len() > 40 { text + "..." } else { text }
}
