//! Differences of nodal fields, and how they shrink.

/// `max |a - b| / max |b|` over the entries; the difference itself where `b` is zero.
///
/// # Panics
/// If the lengths differ.
pub fn relative_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len(), "lengths of fields to compare");
    let largest = |x: f64, y: f64| if y.is_nan() || y > x { y } else { x };
    let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, largest);
    let size = b.iter().map(|b| b.abs()).fold(0.0, largest);
    if size == 0.0 { difference } else { difference / size }
}

/// Slope of the straight line through `(ln h, ln error)` that fits best: the order of convergence.
///
/// NaN for fewer than two different `h`.
pub fn fitted_rate(h_and_error: &[(f64, f64)]) -> f64 {
    let points: Vec<(f64, f64)> = h_and_error.iter().map(|(h, e)| (h.ln(), e.ln())).collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(xy, xx), p| {
        (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x).powi(2))
    });
    xy / xx
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_relative_to_the_second_and_see_what_is_not_a_number() {
        assert_eq!(relative_difference(&[1.0, 2.0], &[1.0, 4.0]), 0.5);
        assert_eq!(relative_difference(&[1.0, 2.0], &[0.0, 0.0]), 2.0);
        assert!(relative_difference(&[f64::NAN, 2.0], &[0.0, 2.0]).is_nan());
    }

    #[test]
    fn the_rate_of_a_square_is_two() {
        let errors = [0.1, 0.2, 0.4].map(|h: f64| (h, 3.0 * h * h));
        assert!((fitted_rate(&errors) - 2.0).abs() < 1e-12);
        assert!(fitted_rate(&errors[..1]).is_nan());
    }
}
