//! The nearest known name for a mistyped one.

/// Longer names are no mistyped ones, and would take long to compare.
const LONGEST: usize = 80;

/// The candidate most like `name`, if one is close enough to be meant.
pub(crate) fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let short = |text: &str| text.len() <= LONGEST;
    candidates
        .into_iter()
        .filter(|c| short(name) && short(c))
        .map(|c| (strsim::damerau_levenshtein(name, c), c))
        .min()
        .filter(|(distance, c)| *distance <= 1.max(name.chars().count().max(c.chars().count()) / 3))
        .map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn close_names_are_found_and_far_ones_not() {
        let known = ["young", "poisson", "density"];
        assert_eq!(nearest("youngs", known), Some("young"));
        assert_eq!(nearest("poison", known), Some("poisson"));
        assert_eq!(nearest("colour", known), None);
    }
}
