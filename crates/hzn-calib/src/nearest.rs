//! The name that was probably meant.

/// The candidate nearest to `name`, when one is near enough to be what was meant.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    let scored = candidates.into_iter().map(|c| {
        let typo = strsim::damerau_levenshtein(&name, c);
        // `threshold` for `threshold_px`: the unit left out is as near as a slip of the finger.
        let cut = name.len() >= 3 && (c.starts_with(&name) || name.starts_with(c));
        (if cut { typo.min(1) } else { typo }, c)
    });
    scored.min_by_key(|(distance, _)| *distance).filter(|(distance, c)| *distance <= 1 + c.len() / 4).map(|(_, c)| c)
}

/// `; did you mean x?`, or the list of what is valid.
pub(crate) fn suggestion(name: &str, valid: &[&str]) -> String {
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
