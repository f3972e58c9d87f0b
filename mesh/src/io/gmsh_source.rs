//! Numbers of a gmsh file, as words or as bytes.

use super::error::Problem;
use super::text::Cursor;

#[derive(Clone, Copy)]
enum Form {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// Numbers of a file in either form: `int` has 4 bytes, `size` 8, `real` 8 in a binary one.
pub(super) struct Source<'a> {
    pub(super) cursor: Cursor<'a>,
    form: Form,
}

impl<'a> Source<'a> {
    /// Numbers as words.
    pub(super) fn ascii(cursor: Cursor<'a>) -> Self {
        Source {
            cursor,
            form: Form::Ascii,
        }
    }

    /// Numbers as bytes, from the number one in `$MeshFormat` that gives their order; passes the end of that section.
    pub(super) fn binary(mut cursor: Cursor<'a>) -> Result<Self, Problem> {
        cursor.rest_of_line();
        cursor.binary = true;
        let form = match i32::from_le_bytes(cursor.raw("the number one")?) {
            1 => Form::LittleEndian,
            0x0100_0000 => Form::BigEndian,
            other => {
                return Err(cursor.problem(format!("the number that gives the order of bytes is {other}, not 1")));
            }
        };
        cursor.expect("$EndMeshFormat")?;
        Ok(Source { cursor, form })
    }

    /// A node number of 4 bytes.
    pub(super) fn node_number(&mut self) -> Result<u64, Problem> {
        let number = self.int("a node number")?;
        u64::try_from(number).map_err(|_| {
            self.cursor
                .problem(format!("a node number is {number}; zero or more is accepted"))
        })
    }

    pub(super) fn int(&mut self, what: &str) -> Result<i64, Problem> {
        match self.form {
            Form::Ascii => self.cursor.integer(what),
            Form::LittleEndian => Ok(i32::from_le_bytes(self.cursor.raw(what)?).into()),
            Form::BigEndian => Ok(i32::from_be_bytes(self.cursor.raw(what)?).into()),
        }
    }

    pub(super) fn size(&mut self, what: &str) -> Result<u64, Problem> {
        match self.form {
            Form::Ascii => self.cursor.number(what, "a whole number from 0"),
            Form::LittleEndian => Ok(u64::from_le_bytes(self.cursor.raw(what)?)),
            Form::BigEndian => Ok(u64::from_be_bytes(self.cursor.raw(what)?)),
        }
    }

    pub(super) fn count(&mut self, what: &str, bytes_each: usize) -> Result<usize, Problem> {
        match self.form {
            Form::Ascii => self.cursor.count(what, bytes_each),
            _ => {
                let count = i64::try_from(self.size(what)?).unwrap_or(i64::MAX);
                self.cursor.check_count(count, what, bytes_each)
            }
        }
    }

    pub(super) fn real(&mut self, what: &str) -> Result<f64, Problem> {
        let value = match self.form {
            Form::Ascii => return self.cursor.real(what),
            Form::LittleEndian => f64::from_le_bytes(self.cursor.raw(what)?),
            Form::BigEndian => f64::from_be_bytes(self.cursor.raw(what)?),
        };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self
                .cursor
                .problem(format!("{what} is {value}; a finite number is accepted")))
        }
    }
}
