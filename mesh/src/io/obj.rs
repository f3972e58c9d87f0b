//! Wavefront `.obj`: points, polygons and lines; everything else is passed over.

use crate::Point;

use super::data::SweepData;
use super::error::Problem;
use super::text::shown;

/// Statements that say nothing about the surface.
const PASSED_OVER: [&str; 19] = [
    "vt",
    "vn",
    "vp",
    "p",
    "o",
    "g",
    "s",
    "mg",
    "usemtl",
    "mtllib",
    "usemap",
    "maplib",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "call",
];

/// The polygons of an `.obj` file as triangles that share their first corner, and its lines as segments.
pub(super) fn parse(bytes: &[u8]) -> Result<SweepData, Problem> {
    let mut sweep = SweepData::default();
    // a face may name a point of a later line, so that the range is checked at the end: largest index and its line
    let mut largest = (0, 0);
    for (number, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let number = number + 1;
        let problem = |text: String| Problem::new(format!("line {number}"), text);
        let line = match std::str::from_utf8(line) {
            Ok(line) => line,
            Err(_) if line.trim_ascii_start().starts_with(b"#") => continue,
            Err(_) => return Err(problem("is not text (UTF-8)".into())),
        };
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            None => {}
            Some(comment) if comment.starts_with('#') => {}
            Some("v") => sweep.points.push(point(words).map_err(problem)?),
            Some(keyword @ ("f" | "l")) => {
                let (least, what) = if keyword == "f" { (3, "polygon") } else { (2, "line") };
                let corners = corners(words, sweep.points.len(), least, what).map_err(problem)?;
                let last = corners.iter().copied().max().unwrap_or(0);
                if last >= largest.0 {
                    largest = (last, number);
                }
                if keyword == "f" {
                    let fan = (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]]);
                    sweep.triangles.extend(fan);
                } else {
                    sweep.segments.extend(corners.windows(2).map(|w| [w[0], w[1]]));
                }
            }
            Some(keyword) if PASSED_OVER.contains(&keyword) => {}
            Some(keyword) => {
                return Err(problem(format!(
                    "unknown statement '{}'; points 'v x y z', polygons 'f a b c' and lines 'l a b' are accepted, and {} passed over",
                    shown(keyword.as_bytes()),
                    PASSED_OVER.join(" ")
                )));
            }
        }
    }
    let (index, line) = largest;
    if line > 0 && index >= sweep.points.len() {
        return Err(Problem::new(
            format!("line {line}"),
            format!("names point {}, but the file has {}", index + 1, sweep.points.len()),
        ));
    }
    Ok(sweep)
}

fn point<'a>(mut words: impl Iterator<Item = &'a str>) -> Result<Point, String> {
    let mut point = Point::zeros();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("{name} is missing; 'v x y z' is accepted"))?;
        point[axis] = match word.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => {
                return Err(format!(
                    "{name} is '{}'; a finite number is accepted",
                    shown(word.as_bytes())
                ));
            }
        };
    }
    Ok(point)
}

/// Indices from zero of a polygon or line `a`, `a/b`, `a//c` or `a/b/c`: `a` counts from one, or back from the last of the
/// `points` so far if negative.
fn corners<'a>(
    words: impl Iterator<Item = &'a str>,
    points: usize,
    least: usize,
    what: &str,
) -> Result<Vec<usize>, String> {
    let mut corners = Vec::new();
    for word in words.take_while(|w| !w.starts_with('#')) {
        let first = word.split('/').next().unwrap_or_default();
        let index = match first.parse::<i64>() {
            Ok(i) if i > 0 => usize::try_from(i - 1).ok(),
            Ok(i) if i < 0 => usize::try_from(i.unsigned_abs())
                .ok()
                .and_then(|back| points.checked_sub(back)),
            _ => None,
        };
        corners.push(index.ok_or_else(|| {
            format!(
                "corner '{}' is no point; a number from 1, or from -1 down to -{points}, is accepted",
                shown(word.as_bytes())
            )
        })?);
    }
    if corners.len() < least {
        let count = corners.len();
        return Err(format!("a {what} has {count} corners; {least} or more are accepted"));
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        parse(text.as_bytes())
            .unwrap_err()
            .in_file("a.obj".as_ref())
            .to_string()
    }

    #[test]
    fn polygons_become_fans_and_negative_indices_count_back() {
        let text =
            "# c\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\r\nvn 0 0 1\nv 0 1 0\nf 1/2/3 2//1 3 4\nl 1 2\nf -4 -2 -1 # e\n\n";
        let sweep = parse(text.as_bytes()).unwrap();
        assert_eq!(sweep.points[2], Point::new(1.0, 1.0, 0.0));
        assert_eq!(sweep.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
        assert_eq!(sweep.segments, [[0, 1]]);
    }

    #[test]
    fn faces_before_their_points_are_read() {
        let sweep = parse(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").unwrap();
        assert_eq!(sweep.triangles, [[0, 1, 2]]);
    }

    #[test]
    fn errors_name_line_and_what_is_accepted() {
        assert_eq!(error("v 0 0\n"), "a.obj: line 1: z is missing; 'v x y z' is accepted");
        assert_eq!(
            error("v 0 0 nan"),
            "a.obj: line 1: z is 'nan'; a finite number is accepted"
        );
        assert_eq!(
            error("v 0 0 0\nf 1 2 -5"),
            "a.obj: line 2: corner '-5' is no point; a number from 1, or from -1 down to -1, is accepted"
        );
        assert_eq!(error("\nf 1 2 3\n"), "a.obj: line 2: names point 3, but the file has 0");
        assert_eq!(
            error("f 1 2"),
            "a.obj: line 1: a polygon has 2 corners; 3 or more are accepted"
        );
        assert!(error("cstype bezier").contains("line 1: unknown statement 'cstype'; points 'v x y z'"));
    }
}
