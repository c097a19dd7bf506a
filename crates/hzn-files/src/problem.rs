//! An error in a file, with its place and a remedy.

use std::fmt;
use std::path::{Path, PathBuf};

/// An error and its place. It is displayed as `sensor.toml:14: [consensus] threshold_pxx: unknown key; did you mean …`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Column in characters, from 1; set only if the line alone does not show the place.
    pub column: Option<usize>,
    /// The field, for example `[consensus] threshold_px` or `altitude_km`.
    pub field: Option<String>,
    /// The error and a remedy.
    pub what: String,
}

impl Problem {
    /// Creates a problem with the file as a whole.
    pub fn new(path: &Path, what: impl Into<String>) -> Self {
        Self { path: path.to_owned(), line: None, column: None, field: None, what: what.into() }
    }
    /// Returns the same problem at this line (from 1).
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }
    /// Returns the same problem at the line of a byte offset of `text`.
    #[must_use]
    pub fn at_offset(self, text: &str, offset: usize) -> Self {
        self.at_line(line_column(text, offset).0)
    }
    /// Returns the same problem at the line and column of a byte offset of `text`.
    #[must_use]
    pub fn at_exactly(mut self, text: &str, offset: usize) -> Self {
        let (line, column) = line_column(text, offset);
        (self.line, self.column) = (Some(line), Some(column));
        self
    }
    /// Returns the same problem in this field.
    #[must_use]
    pub fn in_field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = self.column {
            write!(f, ":{column}")?;
        }
        if let Some(field) = &self.field {
            write!(f, ": {field}")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl std::error::Error for Problem {}

/// Returns line and column, both from 1, of a byte offset. Columns count characters.
fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let before: String = text.bytes().take(offset).map(char::from).collect();
    let line = before.matches('\n').count() + 1;
    let start = text.as_bytes().iter().take(offset).rposition(|&b| b == b'\n').map_or(0, |n| n + 1);
    let column = text.get(start..offset.min(text.len())).map_or(1, |s| s.chars().count() + 1);
    (line, column)
}
