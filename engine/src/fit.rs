//! Straight lines through points, by least squares, and orders of convergence.

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

/// The order of convergence of errors over what is refined, a size or a number of cells: the slope of the line that fits best through
/// their logarithms, positive where errors shrink from the first point to the last. A run that is its own reference has no error and
/// says nothing; none for fewer than two points that do.
pub fn order(points: &[(f64, f64)]) -> Option<f64> {
    let with_error = points.iter().filter(|(_, error)| *error != 0.0);
    let points: Vec<(f64, f64)> = with_error.map(|(size, error)| (size.ln(), error.ln())).collect();
    let grows = points.last()?.0 > points.first()?.0;
    let (_, slope) = line(&points);
    slope.is_finite().then_some(if grows { -slope } else { slope })
}

#[cfg(test)]
mod tests {
    use super::{line, order};

    #[test]
    fn a_line_is_found() {
        let (at_zero, slope) = line(&[(1.0, 5.0), (2.0, 7.0), (4.0, 11.0)]);
        assert!((at_zero - 3.0).abs() < 1e-12 && (slope - 2.0).abs() < 1e-12);
        assert!(line(&[(1.0, 5.0)]).1.is_nan());
    }

    #[test]
    fn the_order_is_that_of_the_errors_there_are() {
        let error = |h: f64| (h, 3.0 * h * h);
        assert!((order(&[error(0.4), error(0.2), error(0.1)]).unwrap() - 2.0).abs() < 1e-12);
        // refined by the number of cells
        assert!((order(&[(10.0, 0.04), (20.0, 0.01)]).unwrap() - 2.0).abs() < 1e-12);
        // the finest run is the reference
        assert!((order(&[error(0.4), error(0.2), (0.1, 0.0)]).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(order(&[error(0.4), (0.2, 0.0)]), None);
        assert_eq!(order(&[]), None);
    }
}
