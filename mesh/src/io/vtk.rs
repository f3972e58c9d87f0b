//! Legacy VTK files (`.vtk`), ASCII and binary (big-endian), of versions up to 5.1.

use std::collections::BTreeMap;

use crate::Point;

use super::data::DataArray;
use super::error::Problem;
use super::grid::{Grid, POLY_LINE, POLY_VERTEX, POLYGON, TRIANGLE_STRIP};
use super::text::{Cursor, shown};

/// The grid of a file whose dataset is an unstructured grid or polygonal data.
pub(super) fn parse(bytes: &[u8]) -> Result<Grid, Problem> {
    let mut cursor = Cursor::new(bytes);
    const ACCEPTED: &str = "a legacy VTK file, '# vtk DataFile Version' 2.0 to 5.1, is accepted";
    let first = cursor.rest_of_line();
    let version = first.strip_prefix(b"# vtk DataFile Version").map(<[u8]>::trim_ascii);
    let version = version.ok_or_else(|| Problem::new("line 1", format!("is '{}'; {ACCEPTED}", shown(first))))?;
    if !matches!(version.first(), Some(b'1'..=b'5')) {
        return Err(Problem::new(
            "line 1",
            format!("version {}; {ACCEPTED}", shown(version)),
        ));
    }
    cursor.rest_of_line(); // title
    let form = cursor.word("ASCII or BINARY")?;
    cursor.binary = match form.to_ascii_uppercase().as_slice() {
        b"ASCII" => false,
        b"BINARY" => true,
        _ => return Err(cursor.problem(format!("found '{}'; ASCII or BINARY is accepted", shown(form)))),
    };
    let mut reader = Reader {
        cursor,
        grid: Grid::default(),
        rows: Rows::None,
        has_points: false,
    };
    while reader.cursor.peek().is_some() {
        reader.section()?;
    }
    if !reader.has_points {
        return Err(reader.cursor.problem("the file ends before its POINTS"));
    }
    let grid = reader.grid;
    if grid.kinds.len() != grid.ends.len() {
        let text = format!("{} cells, but {} CELL_TYPES", grid.ends.len(), grid.kinds.len());
        return Err(reader.cursor.problem(text));
    }
    Ok(grid)
}

/// What attributes that follow belong to.
#[derive(Clone, Copy)]
enum Rows {
    None,
    Points(usize),
    Cells(usize),
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    grid: Grid,
    rows: Rows,
    has_points: bool,
}

impl Reader<'_> {
    fn section(&mut self) -> Result<(), Problem> {
        let keyword = self.cursor.word("a section")?.to_ascii_uppercase();
        self.cursor.section = shown(&keyword);
        match keyword.as_slice() {
            b"DATASET" => {
                let kind = self.cursor.word("the kind of dataset")?;
                match kind.to_ascii_uppercase().as_slice() {
                    b"UNSTRUCTURED_GRID" | b"POLYDATA" => Ok(()),
                    _ => Err(self.cursor.problem(format!(
                        "is {}; UNSTRUCTURED_GRID and POLYDATA are accepted",
                        shown(kind)
                    ))),
                }
            }
            b"POINTS" => self.points(),
            b"CELLS" => self.cells(None),
            b"VERTICES" => self.cells(Some(POLY_VERTEX)),
            b"LINES" => self.cells(Some(POLY_LINE)),
            b"POLYGONS" => self.cells(Some(POLYGON)),
            b"TRIANGLE_STRIPS" => self.cells(Some(TRIANGLE_STRIP)),
            b"CELL_TYPES" => {
                let count = self.cursor.count("the number of cells", 1)?;
                if count != self.grid.ends.len() {
                    let text = format!("{count} types for {} cells", self.grid.ends.len());
                    return Err(self.cursor.problem(text));
                }
                self.grid.kinds = self.integers(Number::Int, count, "a cell type")?;
                Ok(())
            }
            b"POINT_DATA" => {
                let rows = self.number_of_rows(self.grid.points.len(), "points")?;
                self.rows = Rows::Points(rows);
                Ok(())
            }
            b"CELL_DATA" => {
                let rows = self.number_of_rows(self.grid.ends.len(), "cells")?;
                self.rows = Rows::Cells(rows);
                Ok(())
            }
            b"METADATA" => {
                self.cursor.rest_of_line();
                while self.cursor.left() > 0 && !self.cursor.rest_of_line().is_empty() {}
                Ok(())
            }
            b"FIELD" => self.field(),
            attribute => self.attribute(attribute),
        }
    }

    fn points(&mut self) -> Result<(), Problem> {
        if self.has_points {
            return Err(self.cursor.problem("occurs twice; one list of points is accepted"));
        }
        self.has_points = true;
        let count = self.cursor.count("the number of points", 6)?;
        let number = self.number_type()?;
        let values = self.reals(number, times(&self.cursor, count, 3)?, "a coordinate")?;
        self.grid.points = values.as_chunks::<3>().0.iter().map(|&p| Point::from(p)).collect();
        Ok(())
    }

    /// Cells as lists `count, nodes` (before version 5), or as OFFSETS (beginning with 0) and CONNECTIVITY. `kind` is that
    /// of all of them, where the section says it.
    fn cells(&mut self, kind: Option<i64>) -> Result<(), Problem> {
        let count = self.cursor.count("the number of cells", 1)?;
        let size = self.cursor.count("the size of the list", 1)?;
        let mut cells: Vec<Vec<i64>> = Vec::new();
        if self.cursor.next_line_begins_with(b"OFFSETS") {
            self.cursor.word("OFFSETS")?;
            let number = self.number_type()?;
            let offsets = self.integers(number, count, "an offset")?;
            let word = self.cursor.word("CONNECTIVITY")?;
            if !word.eq_ignore_ascii_case(b"CONNECTIVITY") {
                let text = format!("found '{}' where CONNECTIVITY should follow", shown(word));
                return Err(self.cursor.problem(text));
            }
            let number = self.number_type()?;
            let nodes = self.integers(number, size, "a point")?;
            let from_zero = offsets.first().is_none_or(|first| *first == 0);
            if !from_zero || !offsets.is_sorted() || offsets.last().is_some_and(|last| *last != size as i64) {
                return Err(self.cursor.problem(format!("offsets must rise from 0 to {size}")));
            }
            for ends in offsets.windows(2) {
                cells.push(nodes[ends[0] as usize..ends[1] as usize].to_vec());
            }
        } else {
            let list = self.integers(Number::Int, size, "an entry of the list")?;
            let mut rest = list.as_slice();
            for k in 0..count {
                let cell = rest.split_first().and_then(|(n, after)| {
                    let n = usize::try_from(*n).ok()?;
                    Some((after.get(..n)?, &after[n..]))
                });
                let Some((nodes, after)) = cell else {
                    let text = format!("cell {k} (from zero) does not fit into the {size} entries of the list");
                    return Err(self.cursor.problem(text));
                };
                cells.push(nodes.to_vec());
                rest = after;
            }
            if !rest.is_empty() {
                let text = format!("{} entries follow the last cell", rest.len());
                return Err(self.cursor.problem(text));
            }
        }
        let points = self.grid.points.len();
        for nodes in cells {
            let inside = |n: &i64| usize::try_from(*n).ok().filter(|n| *n < points);
            if let Some(bad) = nodes.iter().find(|n| inside(n).is_none()) {
                let text = format!("a cell names point {bad}, but there are {points} (from zero)");
                return Err(self.cursor.problem(text));
            }
            self.grid.connectivity.extend(nodes.iter().filter_map(inside));
            self.grid.ends.push(self.grid.connectivity.len());
            self.grid.kinds.extend(kind);
        }
        Ok(())
    }

    fn number_of_rows(&mut self, expected: usize, of: &str) -> Result<usize, Problem> {
        let rows = self.cursor.integer("the number of rows")?;
        if usize::try_from(rows) == Ok(expected) {
            return Ok(expected);
        }
        Err(self
            .cursor
            .problem(format!("{rows} rows are announced for {expected} {of}")))
    }

    /// An attribute with a keyword of its own; what is only for display is passed.
    fn attribute(&mut self, keyword: &[u8]) -> Result<(), Problem> {
        let rows = match self.rows {
            Rows::Points(n) | Rows::Cells(n) => n,
            Rows::None => {
                let text = "found where POINTS, CELLS, POINT_DATA or another section should stand";
                return Err(self.cursor.problem(text));
            }
        };
        let components = match keyword {
            b"SCALARS" => 1,
            b"VECTORS" | b"NORMALS" => 3,
            b"TENSORS" => 9,
            b"TENSORS6" => 6,
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => 1,
            b"TEXTURE_COORDINATES" | b"COLOR_SCALARS" | b"LOOKUP_TABLE" => 0,
            _ => {
                let text = "is no attribute; SCALARS, VECTORS, NORMALS, TENSORS, FIELD and the like are accepted";
                return Err(self.cursor.problem(text));
            }
        };
        let name = self.name()?;
        let (number, components, kept) = match keyword {
            b"SCALARS" => {
                let number = self.number_type()?;
                let components = match self.cursor.rest_of_line() {
                    b"" => 1,
                    text => std::str::from_utf8(text)
                        .ok()
                        .and_then(|t| t.parse().ok())
                        .ok_or_else(|| {
                            let text = format!(
                                "the number of components is '{}'; a whole number is accepted",
                                shown(text)
                            );
                            self.cursor.problem(text)
                        })?,
                };
                if self.cursor.next_line_begins_with(b"LOOKUP_TABLE") {
                    self.cursor.word("LOOKUP_TABLE")?;
                    self.cursor.word("the name of a lookup table")?;
                }
                (number, components, true)
            }
            b"TEXTURE_COORDINATES" => {
                let components = self.cursor.count("the number of components", 1)?;
                (self.number_type()?, components, true)
            }
            b"COLOR_SCALARS" => {
                let components = self.cursor.count("the number of components", 1)?;
                let number = if self.cursor.binary {
                    Number::UnsignedChar
                } else {
                    Number::Float
                };
                (number, components, true)
            }
            b"LOOKUP_TABLE" => {
                let colours = self.cursor.count("the number of colours", 4)?;
                let number = if self.cursor.binary {
                    Number::UnsignedChar
                } else {
                    Number::Float
                };
                self.reals(number, times(&self.cursor, colours, 4)?, "a colour")?;
                return Ok(());
            }
            _ => (self.number_type()?, components, true),
        };
        let values = self.reals(number, times(&self.cursor, rows, components)?, "a value")?;
        if kept {
            self.keep(name, DataArray { components, values })?;
        }
        Ok(())
    }

    /// Arrays with a number of rows of their own: kept where they belong to points or cells, passed where they belong to the
    /// file.
    fn field(&mut self) -> Result<(), Problem> {
        self.name()?;
        for _ in 0..self.cursor.count("the number of arrays", 6)? {
            while self.cursor.peek().is_some_and(|w| w.eq_ignore_ascii_case(b"METADATA")) {
                self.section()?;
            }
            let name = self.name()?;
            let components = self.cursor.count("the number of components", 0)?;
            let rows = self.cursor.count("the number of rows", 0)?;
            let values = self.cursor.peek().map(<[u8]>::to_ascii_lowercase);
            if values.as_deref() == Some(b"string") {
                return Err(self
                    .cursor
                    .problem(format!("array '{name}' holds text; numbers are accepted")));
            }
            let number = self.number_type()?;
            let values = self.reals(number, times(&self.cursor, rows, components)?, "a value")?;
            match self.rows {
                Rows::None => {}
                Rows::Points(n) | Rows::Cells(n) if n == rows => self.keep(name, DataArray { components, values })?,
                Rows::Points(n) | Rows::Cells(n) => {
                    let text = format!("array '{name}' has {rows} rows; {n} are accepted");
                    return Err(self.cursor.problem(text));
                }
            }
        }
        Ok(())
    }

    fn keep(&mut self, name: String, array: DataArray) -> Result<(), Problem> {
        let arrays: &mut BTreeMap<String, DataArray> = match self.rows {
            Rows::Points(_) => &mut self.grid.point_arrays,
            _ => &mut self.grid.cell_arrays,
        };
        match arrays.insert(name, array) {
            None => Ok(()),
            Some(_) => Err(self
                .cursor
                .problem("a name of an array occurs twice; names must differ")),
        }
    }

    /// A name, in which `%20` stands for a space.
    fn name(&mut self) -> Result<String, Problem> {
        let word = self.cursor.word("a name")?;
        let mut out = Vec::with_capacity(word.len());
        let mut rest = word;
        while let Some((&first, after)) = rest.split_first() {
            let code = (first == b'%').then(|| after.get(..2)).flatten();
            let code = code.and_then(|c| u8::from_str_radix(std::str::from_utf8(c).ok()?, 16).ok());
            out.push(code.unwrap_or(first));
            rest = if code.is_some() { &after[2..] } else { after };
        }
        Ok(String::from_utf8_lossy(&out).into_owned())
    }

    fn number_type(&mut self) -> Result<Number, Problem> {
        let word = self.cursor.word("a type of numbers")?;
        Number::named(&word.to_ascii_lowercase()).ok_or_else(|| {
            self.cursor.problem(format!(
                "the type of numbers is '{}'; int, float, double and the like are accepted",
                shown(word)
            ))
        })
    }

    /// `count` numbers of one type: words, or bytes from the next line on.
    fn reals(&mut self, number: Number, count: usize, what: &str) -> Result<Vec<f64>, Problem> {
        self.numbers(number, count, what, |n| n.unwrap_or_else(|i| i as f64))
    }

    fn integers(&mut self, number: Number, count: usize, what: &str) -> Result<Vec<i64>, Problem> {
        // a fraction is no point of any mesh
        self.numbers(number, count, what, |n| {
            n.map_or_else(|i| i, |x| if x.fract() == 0.0 { x as i64 } else { -1 })
        })
    }

    /// Numbers as integers (`Err`) or reals (`Ok`), as their type says.
    fn numbers<T>(
        &mut self,
        number: Number,
        count: usize,
        what: &str,
        make: impl Fn(Result<f64, i64>) -> T,
    ) -> Result<Vec<T>, Problem> {
        let bytes = if self.cursor.binary { number.bytes() } else { 2 };
        let bits = self.cursor.binary && number == Number::Bit;
        let needed = if bits { count.div_ceil(8) } else { count };
        let announced = i64::try_from(needed).unwrap_or(i64::MAX);
        self.cursor.check_count(announced, "the number of values", bytes)?;
        if self.cursor.binary {
            self.cursor.end_line();
        }
        let mut out = Vec::with_capacity(count.min(self.cursor.left() * 8));
        if bits {
            for k in 0..needed {
                let [byte] = self.cursor.raw(what)?;
                let here = (count - 8 * k).min(8);
                out.extend((0..here).map(|bit| make(Err(i64::from(byte >> (7 - bit) & 1)))));
            }
            return Ok(out);
        }
        for _ in 0..count {
            out.push(make(match (self.cursor.binary, number.is_real()) {
                (true, _) => number.read(&mut self.cursor, what)?,
                (false, true) => Ok(self.cursor.number(what, "a number")?),
                (false, false) => Err(self.cursor.integer(what)?),
            }));
        }
        Ok(out)
    }
}

fn times(cursor: &Cursor, rows: usize, components: usize) -> Result<usize, Problem> {
    rows.checked_mul(components)
        .ok_or_else(|| cursor.problem(format!("{rows} rows of {components} numbers are announced")))
}

/// A type of numbers.
#[derive(Clone, Copy, PartialEq)]
enum Number {
    Bit,
    Char,
    UnsignedChar,
    Short,
    UnsignedShort,
    Int,
    UnsignedInt,
    Long,
    Float,
    Double,
}

impl Number {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"bit" => Number::Bit,
            b"char" | b"signed_char" | b"vtktypeint8" => Number::Char,
            b"unsigned_char" | b"vtktypeuint8" => Number::UnsignedChar,
            b"short" | b"vtktypeint16" => Number::Short,
            b"unsigned_short" | b"vtktypeuint16" => Number::UnsignedShort,
            // legacy files hold ids as int
            b"int" | b"vtktypeint32" | b"vtkidtype" => Number::Int,
            b"unsigned_int" | b"vtktypeuint32" => Number::UnsignedInt,
            b"long" | b"vtktypeint64" | b"unsigned_long" | b"vtktypeuint64" => Number::Long,
            b"float" => Number::Float,
            b"double" => Number::Double,
            _ => return None,
        })
    }

    fn is_real(self) -> bool {
        matches!(self, Number::Float | Number::Double)
    }

    fn bytes(self) -> usize {
        match self {
            Number::Bit | Number::Char | Number::UnsignedChar => 1,
            Number::Short | Number::UnsignedShort => 2,
            Number::Int | Number::UnsignedInt | Number::Float => 4,
            Number::Long | Number::Double => 8,
        }
    }

    fn read(self, cursor: &mut Cursor, what: &str) -> Result<Result<f64, i64>, Problem> {
        Ok(match self {
            Number::Bit | Number::UnsignedChar => Err(u8::from_be_bytes(cursor.raw(what)?).into()),
            Number::Char => Err(i8::from_be_bytes(cursor.raw(what)?).into()),
            Number::Short => Err(i16::from_be_bytes(cursor.raw(what)?).into()),
            Number::UnsignedShort => Err(u16::from_be_bytes(cursor.raw(what)?).into()),
            Number::Int => Err(i32::from_be_bytes(cursor.raw(what)?).into()),
            Number::UnsignedInt => Err(u32::from_be_bytes(cursor.raw(what)?).into()),
            Number::Long => Err(i64::from_be_bytes(cursor.raw(what)?)),
            Number::Float => Ok(f32::from_be_bytes(cursor.raw(what)?).into()),
            Number::Double => Ok(f64::from_be_bytes(cursor.raw(what)?)),
        })
    }
}
