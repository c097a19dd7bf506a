//! Finds the valid name that a misspelt name probably means.

/// Returns the candidate nearest to `name`; `None` if none is near enough to be a misspelling of it.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let scored = candidates.into_iter().map(|c| {
        let typo = strsim::damerau_levenshtein(&name, c);
        // `threshold` for `threshold_px`: a missing unit counts as one typing error.
        let cut = name.len() >= 3 && (c.starts_with(&name) || name.starts_with(c));
        (if cut { typo.min(1) } else { typo }, c)
    });
    scored.min_by_key(|(distance, _)| *distance).filter(|(distance, c)| *distance <= 1 + c.len() / 4).map(|(_, c)| c)
}

/// Returns `; did you mean x?`, or the list of valid names.
pub fn suggestion(name: &str, valid: &[&str]) -> String {
    match (nearest(name, valid.iter().copied()), valid) {
        (_, []) => String::new(),
        (Some(best), _) => format!("; did you mean {best}?"),
        (None, _) => format!("; valid here: {}", valid.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_and_left_out_units_are_recognised() {
        let keys = ["method", "threshold_px", "seed", "max_draws"];
        assert_eq!(nearest("threshold_pxx", keys), Some("threshold_px"));
        assert_eq!(nearest("threshold", keys), Some("threshold_px"));
        assert_eq!(nearest("Metod", keys), Some("method"));
        assert_eq!(nearest("colour", keys), None);
    }
}
