//! Reading of a truth.csv.

use std::path::{Path, PathBuf};

use super::row::Truth;
use crate::limited;
use crate::separator::separator_hint;

/// The reason why a truth.csv cannot be used, displayed as `truth.csv:3: axis_x: …`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TruthError {
    /// The file.
    pub path: PathBuf,
    /// Line number, from 1.
    pub line: Option<u64>,
    /// The column.
    pub column: Option<String>,
    /// Description of the error, and how to correct it.
    pub what: String,
}

impl core::fmt::Display for TruthError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(column) = &self.column {
            write!(f, ": {column}")?;
        }
        write!(f, ": {}", self.what)
    }
}

impl core::error::Error for TruthError {}

/// Reads a truth.csv. Columns are found by name. The columns of Sun and Moon may be missing; unknown columns are
/// ignored.
///
/// # Errors
/// Fails if the file cannot be read or has no rows, if a column is missing, or if a cell is not a finite number. Also
/// fails if an axis or a quaternion does not have unit length, or if a half-angle is not above 0° and below 90°.
pub fn load(path: &Path) -> Result<Vec<Truth>, TruthError> {
    parse(&read(path)?, path)
}

/// Reads a truth.csv as [`load`] does, but time, altitude and attitude may be missing, too: the directions are all that
/// a comparison of answers needs. A number whose column is missing is NaN.
///
/// # Errors
/// Fails like [`load`].
pub fn load_directions(path: &Path) -> Result<Vec<Truth>, TruthError> {
    parse_with(&read(path)?, path, &NEEDED)
}

fn read(path: &Path) -> Result<String, TruthError> {
    limited::read_text(path, limited::TABLE_BYTES).map_err(|e| {
        let what = match e.kind() {
            std::io::ErrorKind::NotFound => "no such file".to_owned(),
            _ => format!("cannot be read: {e}"),
        };
        TruthError { path: path.to_owned(), line: None, column: None, what }
    })
}

/// Columns that a comparison of answers with the truth needs.
const NEEDED: [&str; 7] = ["file", "body", "limb", "axis_x", "axis_y", "axis_z", "half_angle_deg"];
/// Columns that every truth.csv of hzn has beside them.
const FURTHER: [&str; 6] = ["time_s", "altitude_km", "qw", "qx", "qy", "qz"];

/// Parses the text of a truth.csv, like [`load`]; messages name `path`.
///
/// # Errors
/// Fails like [`load`].
pub fn parse(text: &str, path: &Path) -> Result<Vec<Truth>, TruthError> {
    parse_with(text, path, &[&NEEDED[..], &FURTHER[..]].concat())
}

fn parse_with(text: &str, path: &Path, required: &[&str]) -> Result<Vec<Truth>, TruthError> {
    let error = |line: Option<u64>, column: Option<&str>, what: String| TruthError {
        path: path.to_owned(),
        line,
        column: column.map(str::to_owned),
        what,
    };
    // Spreadsheets begin the file with a byte-order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(crate::unix_lines::UnixLines::new(text.as_bytes()));
    let header = reader.headers().map_err(|e| error(Some(1), None, format!("not valid CSV: {e}")))?.clone();
    let has = |name: &str| header.iter().any(|h| h == name);
    if let Some(missing) = required.iter().find(|name| !has(name)) {
        let what = format!("this column is missing; is it a truth.csv?{}", separator_hint(&header));
        return Err(error(Some(1), Some(missing), what));
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map(csv::Position::line);
            error(line, None, format!("not valid CSV: {e}"))
        })?;
        let line = record.position().map(csv::Position::line);
        let row: Truth = record.deserialize(Some(&header)).map_err(|e| match e.kind() {
            csv::ErrorKind::Deserialize { err, .. } => {
                let column = err.field().and_then(|i| header.get(i as usize));
                error(line, column, err.kind().to_string())
            }
            _ => error(line, None, e.to_string()),
        })?;
        check(&row, has).map_err(|(column, what)| error(line, Some(column), what))?;
        rows.push(row);
    }
    if rows.is_empty() {
        return Err(error(None, None, "has no rows".into()));
    }
    Ok(rows)
}

/// Fails for the first value that is out of its limits, with its column and a message.
fn check(row: &Truth, has: impl Fn(&str) -> bool) -> Result<(), (&'static str, String)> {
    let numbers = [
        ("time_s", row.time_s),
        ("axis_x", row.axis_x),
        ("axis_y", row.axis_y),
        ("axis_z", row.axis_z),
        ("half_angle_deg", row.half_angle_deg),
        ("altitude_km", row.altitude_km),
        ("qw", row.qw),
        ("qx", row.qx),
        ("qy", row.qy),
        ("qz", row.qz),
    ];
    if let Some((name, x)) = numbers.into_iter().find(|(name, x)| has(name) && !x.is_finite()) {
        return Err((name, format!("{x} is not a finite number")));
    }
    let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_unit = |v: &[f64]| (length(v) - 1.0).abs() < 1e-3;
    if !is_unit(&[row.axis_x, row.axis_y, row.axis_z]) {
        return Err(("axis_x, axis_y, axis_z", "must have length 1".into()));
    }
    let has_attitude = ["qw", "qx", "qy", "qz"].into_iter().all(has);
    if has_attitude && !is_unit(&[row.qw, row.qx, row.qy, row.qz]) {
        return Err(("qw, qx, qy, qz", "must have length 1".into()));
    }
    if !(row.half_angle_deg > 0.0 && row.half_angle_deg < 90.0) {
        let what = format!("{} is not a half-angle: it must be above 0 and below 90", row.half_angle_deg);
        return Err(("half_angle_deg", what));
    }
    Ok(())
}
