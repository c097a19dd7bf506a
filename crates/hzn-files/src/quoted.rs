//! Cells of a table in a message.

/// Number of characters of a cell that a message shows: a damaged file may have a cell of megabytes.
const MOST: usize = 40;

/// Returns a cell in quotation marks, with its control characters escaped and its end cut off if it is long.
pub fn quoted(cell: &str) -> String {
    let shown: String = cell.chars().take(MOST).collect();
    let rest = cell.chars().count() - shown.chars().count();
    if rest == 0 { format!("{shown:?}") } else { format!("{shown:?} and {rest} more characters") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_cell_is_cut() {
        assert_eq!(quoted("1,5"), "\"1,5\"");
        let zeros = quoted(&"\0".repeat(250_000));
        assert!(zeros.len() < 150 && zeros.ends_with("and 249960 more characters"), "{zeros}");
    }
}
