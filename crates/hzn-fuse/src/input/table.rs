//! Tables of numbers with columns by name.

use std::path::Path;

use hzn_files::limited;

use crate::error::Error;

/// Largest table in bytes: three hours of an IMU at 1 kHz.
const MAX_BYTES: u64 = 1 << 30;

/// A table of numbers.
pub(super) struct Table {
    columns: Vec<Option<usize>>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// Reads columns by name; the first `required` ones must exist. Empty cells are NaN, and other columns are ignored.
    pub(super) fn read(path: &Path, names: &[&str], required: usize) -> Result<Self, Error> {
        let shown = path.display();
        let refuse = |e: csv::Error| match e.kind() {
            csv::ErrorKind::Io(e) => Error::unusable(format!("{shown}: {e}")),
            _ => Error::unusable(format!("{shown}: {e}")),
        };
        let file = limited::open(path, MAX_BYTES).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(file);
        let header = reader.headers().map_err(refuse)?.clone();
        let columns: Vec<Option<usize>> = names.iter().map(|name| header.iter().position(|c| c == *name)).collect();
        if let Some((name, _)) = names.iter().zip(&columns).take(required).find(|(_, place)| place.is_none()) {
            let has = header.iter().collect::<Vec<_>>().join(", ");
            return Err(Error::unusable(format!("{shown}: the column {name} is missing; the file has {has}")));
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(refuse)?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |(name, place): (&&str, &Option<usize>)| {
                let text = place.and_then(|i| record.get(i)).unwrap_or_default();
                if text.is_empty() {
                    return Ok(f64::NAN);
                }
                text.parse().map_err(|_| Error::unusable(format!("{shown}:{line}: {name}: {text:?} is not a number")))
            };
            rows.push(names.iter().zip(&columns).map(number).collect::<Result<_, _>>()?);
        }
        if rows.is_empty() {
            return Err(Error::unusable(format!("{shown}: the table has no rows")));
        }
        Ok(Self { columns, rows })
    }

    /// Returns whether the file has a column, by its place in the names.
    pub(super) fn has(&self, column: usize) -> bool {
        self.columns.get(column).is_some_and(Option::is_some)
    }

    /// Returns the rows: one number for each name.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.iter().map(Vec::as_slice)
    }
}
