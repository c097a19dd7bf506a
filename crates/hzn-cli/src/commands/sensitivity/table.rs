//! Columns of numbers, as text and as CSV.

/// A table by columns.
#[derive(Debug, Default)]
pub(super) struct Table {
    columns: Vec<Column>,
}

#[derive(Debug)]
struct Column {
    name: String,
    head: String,
    cells: Vec<Option<f64>>,
}

impl Table {
    /// Adds a column: its name in files, its head in the text (empty: only in files), and its cells.
    pub(super) fn column(&mut self, name: &str, head: &str, cells: impl Iterator<Item = Option<f64>>) {
        self.columns.push(Column { name: name.into(), head: head.into(), cells: cells.collect() });
    }

    fn rows(&self) -> usize {
        self.columns.iter().map(|c| c.cells.len()).max().unwrap_or(0)
    }

    /// Returns every column as CSV, with an empty cell for a missing value.
    pub(super) fn csv(&self) -> Vec<u8> {
        let mut out = self.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(",") + "\n";
        for row in 0..self.rows() {
            let cell = |c: &Column| c.cells.get(row).copied().flatten().map(|x| x.to_string()).unwrap_or_default();
            out.push_str(&(self.columns.iter().map(cell).collect::<Vec<_>>().join(",") + "\n"));
        }
        out.into_bytes()
    }

    /// Returns the columns with a head as text, to about four digits, with `-` for a missing value.
    pub(super) fn text(&self) -> String {
        let shown: Vec<Vec<String>> = self
            .columns
            .iter()
            .filter(|c| !c.head.is_empty())
            .map(|c| {
                let cells = c.cells.iter().map(|x| x.map_or_else(|| "-".into(), number));
                std::iter::once(c.head.clone()).chain(cells).collect()
            })
            .collect();
        let mut out = String::new();
        for row in 0..=self.rows() {
            let cell = |column: &Vec<String>| {
                let width = column.iter().map(String::len).max().unwrap_or(0);
                format!("{:>width$}", column.get(row).map_or("", String::as_str))
            };
            out.push_str(&(shown.iter().map(cell).collect::<Vec<_>>().join("  ") + "\n"));
        }
        out
    }
}

/// Formats a number with about four digits.
fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".into(),
        _ if x.fract() == 0.0 => format!("{x:.0}"),
        a if a >= 1000.0 => format!("{x:.0}"),
        a if a >= 1e-4 => format!("{x:.*}", (3 - a.log10().floor() as i32).max(0) as usize),
        _ => format!("{x:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_csv() {
        let mut t = Table::default();
        t.column("fov_deg", "fov_deg", [60.0, 90.5].into_iter().map(Some));
        t.column("hidden", "", [1.0, 2.0].into_iter().map(Some));
        t.column("sigma_deg", "sigma", [Some(0.123456), None].into_iter());
        assert_eq!(t.text(), "fov_deg   sigma\n     60  0.1235\n  90.50       -\n");
        assert_eq!(String::from_utf8(t.csv()).unwrap(), "fov_deg,hidden,sigma_deg\n60,1,0.123456\n90.5,2,\n");
    }

    #[test]
    fn numbers_have_four_digits() {
        let shown = [0.0, 1234.5, 200.0, 75.83, 0.5506, 0.00001].map(number);
        assert_eq!(shown, ["0", "1234", "200", "75.83", "0.5506", "1.00e-5"]);
    }
}
