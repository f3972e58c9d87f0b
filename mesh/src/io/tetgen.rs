//! TetGen's `.node` and `.ele` (and Triangle's, in the plane): lists of points and of cells in two files.

use std::path::Path;

use crate::Point;

use super::data::{DataArray, MeshData};
use super::error::Problem;
use super::text::Cursor;
use super::{IoError, parse_file};

/// The mesh of two files that differ in their extension, by the name of either.
pub(super) fn read(path: &Path) -> Result<MeshData, IoError> {
    let nodes = parse_file(&path.with_extension("node"), parse_nodes)?;
    parse_file(&path.with_extension("ele"), |bytes| parse_cells(bytes, nodes))
}

/// What a `.node` file holds.
struct Nodes {
    /// Number of the first point: 0 or 1.
    first: usize,
    data: MeshData,
}

/// count, dimension, attributes, 0 or 1 for a boundary marker; then number, coordinates, attributes, marker of each.
/// Attributes and markers become arrays `attribute_0`..., `boundary_marker`.
fn parse_nodes(bytes: &[u8]) -> Result<Nodes, Problem> {
    let mut cursor = cursor(bytes);
    let count = cursor.count("the number of points", 6)?;
    let dimension = match cursor.integer("the dimension")? {
        d @ (2 | 3) => d,
        other => return Err(cursor.problem(format!("the dimension is {other}; 2 or 3 is accepted"))),
    };
    let attributes = cursor.count("the number of attributes", 2)?;
    let marker = match cursor.integer("the number of boundary markers")? {
        m @ (0 | 1) => m as usize,
        other => return Err(cursor.problem(format!("the number of boundary markers is {other}; 0 or 1 is accepted"))),
    };
    check_columns(&cursor, count, attributes)?;
    let mut data = MeshData::default();
    let mut columns = vec![Vec::with_capacity(count); attributes + marker];
    let mut first = 0;
    for k in 0..count {
        number(&mut cursor, &mut first, k, "point")?;
        let (x, y) = (cursor.real("x")?, cursor.real("y")?);
        let z = if dimension == 3 { cursor.real("z")? } else { 0.0 };
        data.points.push(Point::new(x, y, z));
        for column in &mut columns {
            column.push(cursor.number::<f64>("an attribute or marker", "a number")?);
        }
    }
    end(&mut cursor)?;
    for (k, values) in columns.into_iter().enumerate() {
        let name = if k < attributes {
            format!("attribute_{k}")
        } else {
            "boundary_marker".into()
        };
        data.point_arrays.insert(name, DataArray { components: 1, values });
    }
    Ok(Nodes { first, data })
}

/// count, corners of a cell, attributes; then number, corners, attributes of each. The first attribute is the region: an
/// array `region`, and for each value that is not zero a group called by its number.
fn parse_cells(bytes: &[u8], nodes: Nodes) -> Result<MeshData, Problem> {
    let Nodes {
        first: base,
        data: mut mesh,
    } = nodes;
    let mut cursor = cursor(bytes);
    let count = cursor.count("the number of cells", 8)?;
    let corners = match cursor.integer("the number of corners")? {
        n @ (3 | 4) => n as usize,
        other => {
            let text = format!("cells have {other} corners; 4 (tetrahedra) or 3 (triangles) of order 1 are accepted");
            return Err(cursor.problem(text));
        }
    };
    let attributes = cursor.count("the number of attributes", 2)?;
    check_columns(&cursor, count, attributes)?;
    let (mut columns, mut first) = (vec![Vec::with_capacity(count); attributes], 0);
    for k in 0..count {
        number(&mut cursor, &mut first, k, "cell")?;
        let mut cell = [0; 4];
        for corner in &mut cell[..corners] {
            let tag: usize = cursor.number("a corner", "the number of a point")?;
            *corner = tag
                .checked_sub(base)
                .filter(|c| *c < mesh.points.len())
                .ok_or_else(|| {
                    let last = (mesh.points.len() + base).saturating_sub(1);
                    cursor.problem(format!("names point {tag}; the file of points has {base} to {last}"))
                })?;
        }
        for column in &mut columns {
            column.push(cursor.number::<f64>("an attribute", "a number")?);
        }
        let region = columns.first().and_then(|c| c.last()).filter(|r| **r != 0.0);
        mesh.push(&cell[..corners], region.map(f64::to_string).as_deref());
    }
    end(&mut cursor)?;
    for (k, values) in columns.into_iter().enumerate() {
        let name = if k == 0 {
            "region".into()
        } else {
            format!("attribute_{k}")
        };
        mesh.cell_arrays.insert(name, DataArray { components: 1, values });
    }
    mesh.sort_groups();
    Ok(mesh)
}

fn cursor(bytes: &[u8]) -> Cursor<'_> {
    let mut cursor = Cursor::new(bytes);
    cursor.comment = Some(b'#');
    cursor
}

/// Refuses more columns than the file can hold.
fn check_columns(cursor: &Cursor, rows: usize, columns: usize) -> Result<(), Problem> {
    let numbers = rows.max(1).checked_mul(columns).and_then(|n| i64::try_from(n).ok());
    let numbers = cursor.check_count(numbers.unwrap_or(i64::MAX), "the number of all attributes", 2);
    numbers.map(|_| ())
}

/// Reads the number of an entry: they ascend from 0 or 1.
fn number(cursor: &mut Cursor, first: &mut usize, k: usize, what: &str) -> Result<(), Problem> {
    let tag: usize = cursor.number("a number", "a whole number from 0")?;
    if k == 0 && tag <= 1 {
        *first = tag;
    }
    match tag == *first + k {
        true => Ok(()),
        false => {
            let expected = *first + k;
            Err(cursor.problem(format!(
                "{what} {tag} stands where {expected} should; numbers ascend from 0 or 1"
            )))
        }
    }
}

fn end(cursor: &mut Cursor) -> Result<(), Problem> {
    match cursor.peek() {
        None => Ok(()),
        Some(_) => Err(cursor.problem("more follows than the first line announces")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODE: &str = "# made by hand\n4 3 1 1\n1 0 0 0 0.5 1\n2 1 0 0 0.5 1 # corner\n3 0 1 0 0.5 1\n4 0 0 1 0.5 0\n";
    const ELE: &str = "1 4 1\n1 1 2 3 4 12\n";

    fn both(node: &str, ele: &str) -> Result<MeshData, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.node"), node).unwrap();
        std::fs::write(folder.path().join("a.ele"), ele).unwrap();
        let by_node = read(&folder.path().join("a.node"));
        let by_ele = read(&folder.path().join("a.ele"));
        let text = |e: IoError| e.to_string().replace(&format!("{}/", folder.path().display()), "");
        let (by_node, by_ele) = (by_node.map_err(text), by_ele.map_err(text));
        assert_eq!(by_node, by_ele);
        by_node
    }

    #[test]
    fn points_cells_and_attributes_are_read() {
        let mesh = both(NODE, ELE).unwrap();
        assert_eq!(mesh.tets, [[0, 1, 2, 3]]);
        assert_eq!(mesh.point_arrays["boundary_marker"].values, [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(mesh.point_arrays["attribute_0"].values, [0.5; 4]);
        assert_eq!(mesh.groups["12"].tets, [0]);
        let zero_based = both("3 2 0 0\n0 0 0\n1 1 0\n2 0 1\n", "1 3 0\n0 0 1 2\n").unwrap();
        assert_eq!(
            (zero_based.triangles, zero_based.points[2]),
            (vec![[0, 1, 2]], Point::y())
        );
    }

    #[test]
    fn errors_name_file_line_and_what_is_accepted() {
        let error = |node: &str, ele: &str| both(node, ele).unwrap_err();
        assert_eq!(
            error(NODE, "1 4 0\n1 1 2 3 5\n"),
            "a.ele: line 2: names point 5; the file of points has 1 to 4"
        );
        assert!(error(NODE, "1 10 0\n").contains("4 (tetrahedra) or 3 (triangles) of order 1 are accepted"));
        assert!(error(NODE, "9999999999 4 0\n1 1 2 3 4").contains("bytes follow"));
        assert!(error(&NODE.replace("4 3 1 1", "4 3 999999999999 1"), ELE).contains("a.node: line 2"));
        assert!(error(&NODE.replace("3 0 1 0", "7 0 1 0"), ELE).contains("point 7 stands where 3 should"));
        assert!(error(&NODE.replace("4 0 0 1 0.5 0\n", ""), ELE).contains("a.node: line 6: the file ends"));
        assert!(error(NODE, "1 4 1\n1 1 2 3 4 12\n2 1 2 3 4 5").contains("more follows"));
        assert!(error(&NODE.replace("0 0 1 0.5", "0 0 inf 0.5"), ELE).contains("a finite number is accepted"));
        let alone = tempfile::tempdir().unwrap();
        std::fs::write(alone.path().join("b.node"), NODE).unwrap();
        assert!(
            read(&alone.path().join("b.node"))
                .unwrap_err()
                .to_string()
                .contains("b.ele: cannot be read")
        );
    }
}
