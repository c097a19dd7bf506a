//! Tables of numbers with columns by name.

use std::path::Path;

use csv::StringRecord;
use hzn_files::limited;
use hzn_files::nearest;
use hzn_files::unix_lines::UnixLines;
use hzn_files::{quoted, separator_hint};

use super::columns::Columns;
use super::map::Map;
use crate::error::Error;

/// Largest table in bytes: three hours of an IMU at 1 kHz.
const MAX_BYTES: u64 = 1 << 30;

/// A table of numbers.
pub(super) struct Table {
    shown: String,
    columns: &'static Columns,
    /// Whether the file has each column.
    present: Vec<bool>,
    rows: Vec<Vec<f64>>,
    /// The line of each row in the file.
    lines: Vec<u64>,
    /// The names of all columns of the file.
    header: String,
}

impl Table {
    /// Reads columns by name. Empty cells are NaN, and columns that nobody asks for are ignored.
    pub(super) fn read(path: &Path, columns: &'static Columns, map: &Map) -> Result<Self, Error> {
        let shown = path.display().to_string();
        let refuse = |e: csv::Error| Error::unusable(format!("{shown}: {e}"));
        let file = limited::open(path, MAX_BYTES).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(UnixLines::new(file));
        let header = reader.headers().map_err(refuse)?.clone();
        let places = places(&header, columns, map).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
        let (mut rows, mut lines) = (Vec::new(), Vec::new());
        for record in reader.records() {
            let record = record.map_err(refuse)?;
            let line = record.position().map_or(0, csv::Position::line);
            let number = |place: &Option<Place>| {
                let Some(Place { index, factor }) = place else { return Ok(f64::NAN) };
                let text = record.get(*index).unwrap_or_default();
                if text.is_empty() {
                    return Ok(f64::NAN);
                }
                let name = header.get(*index).unwrap_or_default();
                let value = text.parse::<f64>().map(|value| value * factor);
                value.map_err(|_| Error::unusable(format!("{shown}:{line}: {name}: {} is not a number", quoted(text))))
            };
            rows.push(places.iter().map(number).collect::<Result<_, _>>()?);
            lines.push(line);
        }
        if rows.is_empty() {
            return Err(Error::unusable(format!("{shown}: the table has no rows")));
        }
        let present = places.iter().map(Option::is_some).collect();
        Ok(Self { shown, columns, present, rows, lines, header: list(&header) })
    }

    /// Returns whether the file has a column.
    pub(super) fn has(&self, quantity: &str) -> bool {
        self.place(quantity).is_some_and(|place| self.present.get(place).copied().unwrap_or(false))
    }

    /// Refuses the table if it does not have all these columns.
    pub(super) fn require(&self, quantities: &[&str]) -> Result<(), Error> {
        let Some(missing) = quantities.iter().find(|q| !self.has(q)) else { return Ok(()) };
        let table = self.columns.table;
        let name = self.columns.columns.iter().find(|c| c.quantity == *missing).map_or(*missing, |c| c.name);
        let how = format!("--map {table}:{missing}=COLUMN says which one it is");
        let separator = separator_hint([self.header.as_str()]);
        Err(self.refused(format!("the column {name} is missing; the file has {}{separator}; {how}", self.header)))
    }

    /// Returns the names of all columns of the file.
    pub(super) fn header(&self) -> &str {
        &self.header
    }

    /// Returns an error about the whole file.
    pub(super) fn refused(&self, what: impl std::fmt::Display) -> Error {
        Error::unusable(format!("{}: {what}", self.shown))
    }

    /// Returns an error about a row.
    pub(super) fn refused_row(&self, row: usize, what: impl std::fmt::Display) -> Error {
        let line = self.lines.get(row).copied().unwrap_or_default();
        Error::unusable(format!("{}:{line}: {what}", self.shown))
    }

    fn place(&self, quantity: &str) -> Option<usize> {
        self.columns.columns.iter().position(|c| c.quantity == quantity)
    }

    /// Returns the cells of these columns of each row; NaN where there is none.
    pub(super) fn rows<const N: usize>(&self, quantities: [&str; N]) -> impl Iterator<Item = [f64; N]> {
        let places = quantities.map(|q| self.place(q));
        let cell = |row: &[f64], place: Option<usize>| place.and_then(|i| row.get(i)).copied().unwrap_or(f64::NAN);
        self.rows.iter().map(move |row| places.map(|place| cell(row, place)))
    }
}

/// Where a column is in the file, and the size of its unit.
struct Place {
    index: usize,
    factor: f64,
}

/// Finds the columns in the header of a file.
fn places(header: &StringRecord, columns: &Columns, map: &Map) -> Result<Vec<Option<Place>>, String> {
    let mut found: Vec<Option<Place>> = Vec::new();
    for column in columns.columns {
        let (theirs, factor) = map.theirs(columns, column);
        let mut here = header.iter().enumerate().filter(|(_, name)| *name == theirs).map(|(index, _)| index);
        let index = here.next();
        if here.next().is_some() {
            return Err(format!("the column {theirs} is there twice"));
        }
        if index.is_none() && theirs != column.name {
            let near = nearest(&theirs, header.iter());
            let near = near.map_or_else(|| ";".to_owned(), |near| format!("; did you mean {near}?"));
            return Err(format!(
                "there is no column {theirs} for {}{near} the file has {}",
                column.quantity,
                list(header)
            ));
        }
        let is_taken = |place: &Place| Some(place.index) == index;
        if let (Some(_), Some(other)) = (index, found.iter().position(|p| p.as_ref().is_some_and(is_taken))) {
            let other = columns.columns.get(other).map_or("", |c| c.quantity);
            return Err(format!("the column {theirs} is used twice, for {other} and {}", column.quantity));
        }
        found.push(index.map(|index| Place { index, factor }));
    }
    Ok(found)
}

fn list(header: &StringRecord) -> String {
    header.iter().collect::<Vec<_>>().join(", ")
}
