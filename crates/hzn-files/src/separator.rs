//! Tables whose cells are not separated by commas, as spreadsheets write them where the comma is the decimal sign.

/// Returns the end of a message about the names in a header: `"; columns are separated by commas here, not by
/// semicolons"`. The text is empty if the names do not look as if they had another separator.
pub fn separator_hint<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    let other = [(';', "semicolons"), ('\t', "tabs")].iter().find(|(c, _)| names.iter().any(|name| name.contains(*c)));
    let hint = |(_, what): &(char, &str)| {
        format!("; columns are separated by commas here, not by {what}, and decimals have a point")
    };
    other.map(hint).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_separators_are_named() {
        assert!(separator_hint(["file;time_s"]).contains("not by semicolons"));
        assert!(separator_hint(["file\ttime_s"]).contains("not by tabs"));
        assert_eq!(separator_hint(["file", "time_s"]), "");
    }
}
