//! The truth about simulated pictures: a row of truth.csv, and the file.

mod file;
mod row;

pub use file::{TruthError, load, load_directions, parse};
pub use row::Truth;

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_table_is_read_back_and_wrong_cells_are_named() {
        let half_angle_deg = 75.25;
        let row = Truth { file: "a.png".into(), time_s: 1.5, axis_y: 1.0, half_angle_deg, qw: 1.0, ..Truth::default() };
        let mut table = csv::Writer::from_writer(Vec::new());
        table.serialize(&row).unwrap();
        let text = String::from_utf8(table.into_inner().unwrap()).unwrap();
        let path = Path::new("truth.csv");
        assert_eq!(parse(&text, path).unwrap(), [row]);
        let says = |text: &str| parse(text, path).unwrap_err().to_string();
        assert_eq!(says(&text.replace(",1.5,", ",soon,")), "truth.csv:2: time_s: invalid float literal");
        assert_eq!(says(&text.replace(",1.5,", ",nan,")), "truth.csv:2: time_s: NaN is not a finite number");
        assert_eq!(
            says(&text.replace("axis_x", "x")),
            "truth.csv:1: axis_x: this column is missing; is it a truth.csv?"
        );
        assert_eq!(says(text.lines().next().unwrap()), "truth.csv: has no rows");
        assert!(says(&text.replace("75.25", "97")).contains("half_angle_deg: 97 is not a half-angle"));
        assert!(load(Path::new("/nowhere/truth.csv")).unwrap_err().to_string().ends_with("no such file"));
    }
}
