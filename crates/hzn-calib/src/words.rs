//! Numbers in words.

/// Formats a value that is above its limit, and the limit, with as many decimals as show which one is larger.
pub(crate) fn above(value: f64, limit: f64) -> [String; 2] {
    let text = |decimals: usize| [value, limit].map(|x| format!("{x:.decimals$}"));
    (2..12).map(text).find(|[value, limit]| value != limit).unwrap_or_else(|| text(12))
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_value_just_above_its_limit_is_told_from_it() {
        assert_eq!(super::above(2.0503, 2.0), ["2.05", "2.00"]);
        assert_eq!(super::above(2.0004, 2.0), ["2.0004", "2.0000"]);
        assert_eq!(super::above(2.0, 2.0)[0].len(), 14);
    }
}
