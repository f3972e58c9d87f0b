//! VTK XML files: unstructured grids (`.vtu`) and surfaces (`.vtp`).

use std::collections::BTreeMap;

use crate::Point;

use super::data::DataArray;
use super::error::Problem;
use super::grid::{Grid, POLY_LINE, POLY_VERTEX, POLYGON, TRIANGLE_STRIP};
use super::text::shown;
use super::vtu_array::{self, Appended, Compressor, Encoding, Values};
use super::xml::{self, Element};

/// What a file holds, as its root element says.
#[derive(Clone, Copy, PartialEq)]
enum Content {
    UnstructuredGrid,
    PolyData,
}

impl Content {
    fn name(self) -> &'static str {
        match self {
            Content::UnstructuredGrid => "UnstructuredGrid",
            Content::PolyData => "PolyData",
        }
    }
}

/// The grid of a `.vtu` file.
pub(super) fn parse_unstructured(bytes: &[u8]) -> Result<Grid, Problem> {
    parse_grid(bytes, Content::UnstructuredGrid)
}

/// The grid of a `.vtp` file.
pub(super) fn parse_poly_data(bytes: &[u8]) -> Result<Grid, Problem> {
    parse_grid(bytes, Content::PolyData)
}

/// All pieces of a file as one grid.
fn parse_grid(bytes: &[u8], content: Content) -> Result<Grid, Problem> {
    const APPENDED: &str = "AppendedData";
    let (head, appended) = split_appended(bytes)?;
    let head = std::str::from_utf8(head).map_err(|e| {
        let line = 1 + head[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
        Problem::new(format!("line {line}"), "is not text (UTF-8)")
    })?;
    let root = xml::parse(head, appended.is_some().then_some(APPENDED))?;
    let encoding = encoding(&root, appended, content).map_err(|e| Problem::new("<VTKFile>", e))?;
    let no_grid = || Problem::new("<VTKFile>", format!("has no <{}>", content.name()));
    let grid_element = root.children_named(content.name()).next().ok_or_else(no_grid)?;
    let mut grid = Grid::default();
    for (number, piece) in grid_element.children_named("Piece").enumerate() {
        let part = read_piece(piece, number, &encoding, content)?;
        if number == 0 {
            grid = part;
        } else {
            join(&mut grid, part, number)?;
        }
    }
    Ok(grid)
}

/// The XML text up to and with the tag `<AppendedData ...>`, and what lies behind its underscore.
fn split_appended(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Problem> {
    const TAG: &[u8] = b"<AppendedData";
    let Some(start) = bytes.windows(TAG.len()).position(|w| w == TAG) else {
        return Ok((bytes, None));
    };
    let problem = |text: &str| Problem::new("<AppendedData>", text);
    if !bytes.trim_ascii_end().ends_with(b"</VTKFile>") {
        return Err(problem("the file does not end with </VTKFile>: it is not whole"));
    }
    let tag_end = bytes[start..].iter().position(|&b| b == b'>');
    let tag_end = start + 1 + tag_end.ok_or_else(|| problem("the tag does not end"))?;
    let data = bytes[tag_end..].trim_ascii_start();
    let data = data
        .strip_prefix(b"_")
        .ok_or_else(|| problem("the data do not begin with an underscore"))?;
    Ok((&bytes[..tag_end], Some(data)))
}

fn encoding<'a>(root: &Element, appended: Option<&'a [u8]>, content: Content) -> Result<Encoding<'a>, String> {
    let attribute = |name| root.attribute(name);
    let unknown = |what: &str, value: &str, accepted: &str| {
        Err(format!("{what} is '{}'; {accepted} accepted", shown(value.as_bytes())))
    };
    if root.name != "VTKFile" {
        return unknown("the root element", &root.name, "VTKFile is");
    }
    match attribute("type").unwrap_or_default() {
        known if known == content.name() => {}
        other => return unknown("type", other, &format!("{} is", content.name())),
    }
    let big_endian = match attribute("byte_order") {
        None | Some("LittleEndian") => false,
        Some("BigEndian") => true,
        Some(other) => return unknown("byte_order", other, "LittleEndian and BigEndian are"),
    };
    let header_bytes = match attribute("header_type") {
        None | Some("UInt32") => 4,
        Some("UInt64") => 8,
        Some(other) => return unknown("header_type", other, "UInt32 and UInt64 are"),
    };
    let compressor = match attribute("compressor") {
        None | Some("") => None,
        Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
        Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
        Some("vtkLZMADataCompressor") => Some(Compressor::Lzma),
        Some(other) => {
            let accepted = "vtkZLibDataCompressor, vtkLZ4DataCompressor and vtkLZMADataCompressor are";
            return unknown("compressor", other, accepted);
        }
    };
    let appended = match (appended, root.children_named("AppendedData").next()) {
        (Some(bytes), Some(element)) => Some(Appended {
            base64: match element.attribute("encoding") {
                Some("base64") => true,
                Some("raw") => false,
                other => return unknown("encoding of <AppendedData>", other.unwrap_or(""), "raw and base64 are"),
            },
            bytes,
        }),
        _ => None,
    };
    Ok(Encoding {
        big_endian,
        header_bytes,
        compressor,
        appended,
    })
}

fn read_piece(piece: &Element, number: usize, encoding: &Encoding, content: Content) -> Result<Grid, Problem> {
    let piece_name = if number == 0 {
        "<Piece>".to_string()
    } else {
        format!("<Piece> {number} (from zero)")
    };
    let count = |name: &str| -> Result<usize, Problem> {
        let text = piece.attribute(name).unwrap_or_default();
        text.trim().parse().map_err(|_| {
            let text = shown(text.as_bytes());
            Problem::new(
                piece_name.clone(),
                format!("{name} is '{text}'; a whole number from 0 is accepted"),
            )
        })
    };
    // sections with cells, the kind of a cell where the section says it, and how many there are
    let sections = match content {
        Content::UnstructuredGrid => vec![("Cells", None, count("NumberOfCells")?)],
        Content::PolyData => [
            ("Verts", POLY_VERTEX, "NumberOfVerts"),
            ("Lines", POLY_LINE, "NumberOfLines"),
            ("Polys", POLYGON, "NumberOfPolys"),
            ("Strips", TRIANGLE_STRIP, "NumberOfStrips"),
        ]
        .into_iter()
        .map(|(section, kind, number)| match piece.attribute(number) {
            None => Ok((section, Some(kind), 0)),
            Some(_) => Ok((section, Some(kind), count(number)?)),
        })
        .collect::<Result<_, Problem>>()?,
    };
    let num_points = count("NumberOfPoints")?;
    let section = |name: &'static str| piece.children_named(name).next();
    let place = |section: &str, array: &str| format!("{piece_name}, <{section}>, array '{}'", shown(array.as_bytes()));

    let mut grid = Grid::default();
    let points = section("Points").and_then(|s| s.children_named("DataArray").next());
    match points {
        Some(array) => {
            let read = || -> Result<Vec<Point>, String> {
                let components = vtu_array::components(array)?;
                if components != 3 {
                    return Err(format!("has {components} components; 3 are accepted"));
                }
                let coordinates = vtu_array::read(array, times(num_points, 3)?, encoding)?.reals();
                Ok(coordinates.as_chunks::<3>().0.iter().map(|&p| Point::from(p)).collect())
            };
            let name = array.attribute("Name").unwrap_or_default();
            grid.points = read().map_err(|e| Problem::new(place("Points", name), e))?;
        }
        None if num_points == 0 => {}
        None => return Err(Problem::new(piece_name.clone(), "has no <Points> with a <DataArray>")),
    }

    for (name, kind, cells) in sections.into_iter().filter(|s| s.2 > 0) {
        let array = |array: &str, count: usize| -> Result<Vec<i64>, Problem> {
            let found = section(name).and_then(|s| {
                s.children_named("DataArray")
                    .find(|a| a.attribute("Name") == Some(array))
            });
            let found = found.ok_or_else(|| Problem::new(place(name, array), "is missing"))?;
            let values = vtu_array::read(found, count, encoding).and_then(Values::integers);
            values.map_err(|e| Problem::new(place(name, array), e))
        };
        let offsets = array("offsets", cells)?;
        let ends: Vec<usize> = offsets.iter().filter_map(|&e| usize::try_from(e).ok()).collect();
        if ends.len() != cells || !ends.is_sorted() {
            return Err(Problem::new(
                place(name, "offsets"),
                "must be zero or more and must not fall",
            ));
        }
        let (first, total) = (grid.connectivity.len(), ends.last().copied().unwrap_or(0));
        for node in array("connectivity", total)? {
            match usize::try_from(node) {
                Ok(n) if n < num_points => grid.connectivity.push(n),
                _ => {
                    let text = format!("names point {node}, but the piece has {num_points} (0 to {num_points} - 1)");
                    return Err(Problem::new(place(name, "connectivity"), text));
                }
            }
        }
        grid.ends.extend(ends.into_iter().map(|e| first + e));
        match kind {
            Some(kind) => grid.kinds.resize(grid.ends.len(), kind),
            None => grid.kinds = array("types", cells)?,
        }
    }
    let num_cells = grid.kinds.len();

    let arrays = |name: &'static str, rows: usize| -> Result<BTreeMap<String, DataArray>, Problem> {
        let mut arrays = BTreeMap::new();
        for array in section(name).into_iter().flat_map(|s| s.children_named("DataArray")) {
            if array.attribute("type") == Some("String") {
                continue; // labels, not numbers
            }
            let array_name = array.attribute("Name").unwrap_or_default();
            let read = || -> Result<DataArray, String> {
                let components = vtu_array::components(array)?;
                let values = vtu_array::read(array, times(rows, components)?, encoding)?.reals();
                Ok(DataArray { components, values })
            };
            let values = read().map_err(|e| Problem::new(place(name, array_name), e))?;
            if arrays.insert(array_name.to_string(), values).is_some() {
                return Err(Problem::new(place(name, array_name), "occurs twice; names must differ"));
            }
        }
        Ok(arrays)
    };
    grid.point_arrays = arrays("PointData", num_points)?;
    grid.cell_arrays = arrays("CellData", num_cells)?;
    Ok(grid)
}

fn times(rows: usize, components: usize) -> Result<usize, String> {
    rows.checked_mul(components)
        .ok_or_else(|| format!("{rows} rows of {components} numbers are announced"))
}

/// Appends a piece; its arrays must be those of the pieces before.
fn join(grid: &mut Grid, part: Grid, number: usize) -> Result<(), Problem> {
    let (first_point, first_node) = (grid.points.len(), grid.connectivity.len());
    grid.points.extend(part.points);
    grid.connectivity
        .extend(part.connectivity.iter().map(|n| n + first_point));
    grid.ends.extend(part.ends.iter().map(|e| e + first_node));
    grid.kinds.extend(part.kinds);
    for (all, more) in [
        (&mut grid.point_arrays, part.point_arrays),
        (&mut grid.cell_arrays, part.cell_arrays),
    ] {
        let same = all.len() == more.len()
            && all
                .iter()
                .zip(&more)
                .all(|((n, a), (m, b))| n == m && a.components == b.components);
        if !same {
            let place = format!("<Piece> {number} (from zero)");
            return Err(Problem::new(
                place,
                "has other arrays than the piece before; all pieces must have the same",
            ));
        }
        for (array, rows) in all.values_mut().zip(more.into_values()) {
            array.values.extend(rows.values);
        }
    }
    Ok(())
}
