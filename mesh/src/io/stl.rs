//! STL, ASCII and binary: triangles as loose corners; equal corners become one point.

use std::collections::HashMap;

use crate::Point;

use super::data::{SweepData, check_finite};
use super::error::Problem;
use super::text::{Cursor, shown};

/// Bytes of a binary file before its triangles, and of each triangle.
const HEAD: usize = 84;
const EACH: usize = 50;

/// The triangles of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<SweepData, Problem> {
    let mut soup = Soup::default();
    let announced = bytes
        .get(80..HEAD)
        .and_then(|b| b.try_into().ok())
        .map(u32::from_le_bytes);
    let whole = |n: u32| (n as usize).checked_mul(EACH).and_then(|b| b.checked_add(HEAD));
    if announced.and_then(whole) == Some(bytes.len()) {
        for triangle in bytes[HEAD..].chunks_exact(EACH) {
            let number = |k: usize| f32::from_le_bytes([0, 1, 2, 3].map(|b| triangle[12 + 4 * k + b]));
            let corner =
                |c: usize| Point::new(number(3 * c).into(), number(3 * c + 1).into(), number(3 * c + 2).into());
            soup.push([0, 1, 2].map(corner));
        }
    } else if bytes.trim_ascii_start().starts_with(b"solid") {
        ascii(bytes, &mut soup)?;
    } else {
        let count = announced.map_or_else(String::new, |n| {
            format!(" (a binary one of {n} triangles has {HEAD} + {EACH} * {n})")
        });
        let text = format!(
            "{} bytes{count}; an ASCII file that begins with 'solid' or a whole binary file is accepted",
            bytes.len()
        );
        return Err(Problem::new("the file", text));
    }
    check_finite(&soup.sweep.points)?;
    Ok(soup.sweep)
}

fn ascii(bytes: &[u8], soup: &mut Soup) -> Result<(), Problem> {
    let mut cursor = Cursor::new(bytes);
    while cursor.peek().is_some() {
        cursor.expect("solid")?;
        cursor.rest_of_line(); // its name
        loop {
            match cursor.word("facet or endsolid")? {
                b"facet" => {}
                b"endsolid" => break,
                word => {
                    let text = format!("found '{}' where facet or endsolid should follow", shown(word));
                    return Err(cursor.problem(text));
                }
            }
            cursor.expect("normal")?;
            for axis in ["x", "y", "z"] {
                cursor.number::<f64>(axis, "a number")?;
            }
            cursor.expect("outer")?;
            cursor.expect("loop")?;
            let mut corners = [Point::zeros(); 3];
            for corner in &mut corners {
                cursor.expect("vertex")?;
                *corner = Point::new(cursor.real("x")?, cursor.real("y")?, cursor.real("z")?);
            }
            soup.push(corners);
            cursor.expect("endloop")?;
            cursor.expect("endfacet")?;
        }
        cursor.rest_of_line();
    }
    Ok(())
}

/// Triangles while their corners are made one.
#[derive(Default)]
struct Soup {
    sweep: SweepData,
    index: HashMap<[u64; 3], usize>,
}

impl Soup {
    fn push(&mut self, corners: [Point; 3]) {
        let triangle = corners.map(|p| {
            let points = &mut self.sweep.points;
            // adding zero turns -0 into +0
            *self
                .index
                .entry([p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits))
                .or_insert_with(|| {
                    points.push(p);
                    points.len() - 1
                })
        });
        self.sweep.triangles.push(triangle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 1 1 0\n  endloop\n endfacet\n\
        facet normal 0 0 nan\nouter loop\nvertex 0 0 0\nvertex 1 1 -0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a b\n";

    fn binary(corners: &[[f32; 9]]) -> Vec<u8> {
        let mut out = b"solid but binary".to_vec();
        out.resize(80, b' ');
        out.extend((corners.len() as u32).to_le_bytes());
        for c in corners {
            out.extend([0; 12]);
            out.extend(c.iter().flat_map(|x| x.to_le_bytes()));
            out.extend([0; 2]);
        }
        out
    }

    #[test]
    fn both_forms_give_triangles_that_share_corners() {
        let sweep = parse(TWO.as_bytes()).unwrap();
        assert_eq!((sweep.points.len(), &sweep.triangles), (4, &vec![[0, 1, 2], [0, 2, 3]]));
        let file = binary(&[
            [0., 0., 0., 1., 0., 0., 1., 1., 0.],
            [0., 0., 0., 1., 1., 0., 0., 1., 0.],
        ]);
        assert_eq!(parse(&file).unwrap(), sweep);
    }

    #[test]
    fn cut_short_or_wrong_files_are_refused() {
        let error = |bytes: &[u8]| parse(bytes).unwrap_err().in_file("a.stl".as_ref()).to_string();
        let file = binary(&[[0., 0., 0., 1., 0., 0., 1., 1., 0.]]);
        assert!(error(&file[16..]).contains("whole binary file is accepted"));
        assert!(error(&[&[0], &file[1..100]].concat()).contains("100 bytes (a binary one of 1 triangles"));
        assert!(error(b"").contains("0 bytes; an ASCII file"));
        assert!(error(&TWO.as_bytes()[..TWO.len() - 14]).contains("facet or endsolid"));
        assert!(error(TWO.replace("vertex 0 1 0", "vertex 0 1").as_bytes()).contains("line 14: z is 'endloop'"));
        assert!(error(&binary(&[[f32::NAN, 0., 0., 1., 0., 0., 1., 1., 0.]])).contains("finite"));
    }
}
