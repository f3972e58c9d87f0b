//! Medit `.mesh`, ASCII: sections of vertices, edges, triangles and tetrahedra, each entry with a reference.

use crate::Point;

use super::data::MeshData;
use super::error::Problem;
use super::text::{Cursor, shown};

/// The content of a file; cells with the reference `k`, not zero, belong to the group called "k".
pub(super) fn parse(bytes: &[u8]) -> Result<MeshData, Problem> {
    const ACCEPTED: &str = "an ASCII file that begins with MeshVersionFormatted is accepted";
    let mut cursor = Cursor::new(bytes);
    cursor.comment = Some(b'#');
    match cursor.peek() {
        Some(b"MeshVersionFormatted") => cursor.word("MeshVersionFormatted")?,
        Some(word) => return Err(cursor.problem(format!("begins with '{}'; {ACCEPTED}", shown(word)))),
        None => return Err(cursor.problem(format!("the file is empty; {ACCEPTED}"))),
    };
    cursor.integer("the version")?;
    let mut mesh = MeshData::default();
    let mut dimension = None;
    // cells may stand before the vertices they name
    let mut largest: Option<(usize, usize, String)> = None;
    loop {
        let section = cursor.word("a section or End")?;
        cursor.section = shown(section);
        let corners = match section {
            b"Dimension" => {
                dimension = Some(match cursor.integer("the dimension")? {
                    d @ (2 | 3) => d,
                    other => return Err(cursor.problem(format!("the dimension is {other}; 2 or 3 is accepted"))),
                });
                continue;
            }
            b"Vertices" => {
                let axes = dimension.ok_or_else(|| cursor.problem("stands before Dimension"))?;
                if !mesh.points.is_empty() {
                    return Err(cursor.problem("occurs twice; one list of vertices is accepted"));
                }
                for _ in 0..cursor.count("the number of vertices", 6)? {
                    let (x, y) = (cursor.real("x")?, cursor.real("y")?);
                    let z = if axes == 3 { cursor.real("z")? } else { 0.0 };
                    cursor.number::<f64>("a reference", "a number")?;
                    mesh.points.push(Point::new(x, y, z));
                }
                continue;
            }
            b"Edges" => 2,
            b"Triangles" => 3,
            b"Tetrahedra" => 4,
            b"End" => break,
            b"Quadrilaterals" | b"Hexahedra" | b"Hexaedra" | b"Prisms" | b"Pyramids" | b"TetrahedraP2"
            | b"TrianglesP2" => {
                let count = cursor.count("the number of cells", 6)?;
                if count > 0 {
                    let text = format!(
                        "{count} cells; tetrahedra and triangles of order 1 are accepted, and edges beside them"
                    );
                    return Err(cursor.problem(text));
                }
                continue;
            }
            // lists of numbers that say nothing about cells: corners, ridges, normals
            name if name.first().is_some_and(u8::is_ascii_alphabetic) => {
                while cursor.peek().is_some_and(|w| !w[0].is_ascii_alphabetic()) {
                    cursor.word("a number")?;
                }
                continue;
            }
            _ => return Err(cursor.problem("found where the name of a section should stand")),
        };
        for _ in 0..cursor.count("the number of cells", 2 * corners)? {
            let mut cell = [0; 4];
            for corner in &mut cell[..corners] {
                let index: usize = cursor.number("a vertex", "a whole number from 1")?;
                *corner = index
                    .checked_sub(1)
                    .ok_or_else(|| cursor.problem("a vertex is 0; they count from 1"))?;
                if largest.as_ref().is_none_or(|(most, ..)| *corner > *most) {
                    largest = Some((*corner, cursor.line, cursor.section.clone()));
                }
            }
            let reference = cursor.integer("a reference")?;
            let name = (reference != 0).then(|| reference.to_string());
            mesh.push(&cell[..corners], name.as_deref());
        }
    }
    if let Some((index, line, section)) = largest.filter(|(index, ..)| *index >= mesh.points.len()) {
        let text = format!("names vertex {}, but the file has {}", index + 1, mesh.points.len());
        return Err(Problem::new(format!("line {line}, {section}"), text));
    }
    if dimension.is_none() {
        return Err(cursor.problem("the file ends before its Dimension"));
    }
    mesh.sort_groups();
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TET: &str = "MeshVersionFormatted 2 # c\nDimension\n3\nVertices\n4\n0 0 0 1\n1 0 0 1\n0 1 0 0\n0 0 1 0\nCorners\n2\n1\n2\n\
        Triangles\n1\n1 2 3 7\nEdges 1\n1 2 0\nTetrahedra\n1\n1 2 3 4 5\nEnd\n";

    #[test]
    fn cells_and_references_are_read() {
        let mesh = parse(TET.as_bytes()).unwrap();
        assert_eq!(
            (mesh.points.len(), &mesh.tets, &mesh.triangles),
            (4, &vec![[0, 1, 2, 3]], &vec![[0, 1, 2]])
        );
        assert_eq!(mesh.segments, [[0, 1]]);
        assert_eq!(mesh.groups["7"].triangles, [0]);
        assert_eq!(mesh.groups["5"].vertices, [0, 1, 2, 3]);
        assert_eq!(mesh.groups.len(), 2);
    }

    #[test]
    fn planar_meshes_have_two_coordinates() {
        let text = "MeshVersionFormatted 1\nDimension 2\nVertices 3\n0 0 0\n1 0 0\n0 1 0\nTriangles 1\n1 2 3 0\nEnd";
        assert_eq!(parse(text.as_bytes()).unwrap().points[2], Point::y());
    }

    #[test]
    fn errors_name_place_and_what_is_accepted() {
        let error = |from: &str, to: &str| {
            assert!(TET.contains(from));
            let text = TET.replace(from, to);
            parse(text.as_bytes())
                .unwrap_err()
                .in_file("a.mesh".as_ref())
                .to_string()
        };
        assert_eq!(
            error("1 2 3 4 5", "1 2 3 9 5"),
            "a.mesh: line 21, Tetrahedra: names vertex 9, but the file has 4"
        );
        assert!(error("1 2 3 4 5", "1 2 3").contains("Tetrahedra"));
        assert!(error("1 2 3 4 5", "0 2 3 4 5").contains("count from 1"));
        assert!(error("Tetrahedra\n1", "Tetrahedra\n99999999999").contains("bytes follow"));
        assert!(error("Tetrahedra", "Hexahedra").contains("tetrahedra and triangles of order 1 are accepted"));
        assert!(error("1 0 0 1", "1 nan 0 1").contains("a finite number is accepted"));
        assert!(error("MeshVersionFormatted 2", "\u{1}\u{0}").contains("ASCII"));
    }
}
