//! Differences of nodal fields.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_relative_to_the_second_and_see_what_is_not_a_number() {
        assert_eq!(relative_difference(&[1.0, 2.0], &[1.0, 4.0]), 0.5);
        assert_eq!(relative_difference(&[1.0, 2.0], &[0.0, 0.0]), 2.0);
        assert!(relative_difference(&[f64::NAN, 2.0], &[0.0, 2.0]).is_nan());
    }
}
