//! Straight lines through points, by least squares.

/// Value at zero and slope of the line that fits best; NaN for fewer than two different places.
pub(crate) fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2))
    });
    let slope = xy / xx;
    (y - slope * x, slope)
}

#[cfg(test)]
mod tests {
    use super::line;

    #[test]
    fn a_line_is_found() {
        let (at_zero, slope) = line(&[(1.0, 5.0), (2.0, 7.0), (4.0, 11.0)]);
        assert!((at_zero - 3.0).abs() < 1e-12 && (slope - 2.0).abs() < 1e-12);
        assert!(line(&[(1.0, 5.0)]).1.is_nan());
    }
}
