//! Reads results that an earlier run wrote.

use std::io::BufRead;
use std::path::Path;

use hzn_files::separator_hint;
use hzn_files::unix_lines::UnixLines;
use hzn_mcap::{Contents, Reader, Row};

use crate::checked_row::{IF_CUT, from_csv, from_json};
use crate::error::{Error, failed, unusable};
pub use crate::possible::find_impossible;
use crate::source::{describe_recording_loss, ending};

/// Results that were read.
#[derive(Debug, Default)]
pub struct Results {
    /// All rows that can be read.
    pub rows: Vec<Row>,
    /// The text of the sensor.toml, if the file is an MCAP with one.
    pub sensor_toml: Option<String>,
    /// The damage of the file in words; `None` if it is complete.
    pub lost: Option<String>,
    /// The first row with an impossible number, see [`find_impossible`]: its place and the reason in words.
    pub impossible: Option<String>,
}

/// Reads all rows of results.
///
/// # Errors
/// The file does not exist, is not a file of results of `hzn run`, or is broken.
pub fn read(file: &Path) -> Result<Results, Error> {
    if file.is_dir() {
        let what = "is a folder; results of `hzn run` are expected: .mcap, .csv or .jsonl";
        return Err(unusable(format!("{}: {what}", file.display())));
    }
    if !file.is_file() {
        return Err(unusable(format!("{}: no such file", file.display())));
    }
    match ending(file).as_str() {
        "mcap" => {
            let mut reader = Reader::open(file, Contents::WithoutImages).map_err(failed)?;
            let rows: Vec<Row> = reader.by_ref().map(|f| f.map(|f| f.row)).collect::<Result<_, _>>().map_err(failed)?;
            let wrong = |(i, row): (usize, &Row)| {
                Some(format!("{}: row {} ({}): {}", file.display(), i + 1, row.file, find_impossible(row)?))
            };
            let impossible = rows.iter().enumerate().find_map(wrong);
            let sensor_toml = reader.sensor_toml().map(str::to_owned);
            Ok(Results { rows, sensor_toml, lost: describe_recording_loss(&reader, file, "read"), impossible })
        }
        kind @ ("csv" | "jsonl") => {
            let mut results = Results::default();
            for read in numbered_rows(file, kind)? {
                let (line, row) = read?;
                if results.impossible.is_none() {
                    let told = |what| format!("{}:{line}: {}: {what}", file.display(), row.file);
                    results.impossible = find_impossible(&row).map(told);
                }
                results.rows.push(row);
            }
            Ok(results)
        }
        _ => Err(unusable(format!("{}: results of `hzn run` are expected: .mcap, .csv or .jsonl", file.display()))),
    }
}

impl Results {
    /// Returns the results if all of their answers are possible ones.
    ///
    /// # Errors
    /// An answer has a number that no answer has, see [`find_impossible`].
    pub fn checked(self) -> Result<Self, Error> {
        let Some(what) = &self.impossible else { return Ok(self) };
        let what = format!("{what}. hzn did not write this; correct the row or remove it");
        Err(unusable(what))
    }
}

/// An iterator over the rows.
pub type AllRows = Box<dyn Iterator<Item = Result<Row, Error>>>;

/// Reads the rows of a table of results. `kind` is the file's ending, `csv` or `jsonl`. If an unfinished file (`.part`)
/// ends in the middle of a row, this incomplete row is left out.
///
/// # Errors
/// The file is of another kind or cannot be read, or a row is not a row of results.
pub fn rows(file: &Path, kind: &str) -> Result<AllRows, Error> {
    Ok(Box::new(numbered_rows(file, kind)?.map(|read| read.map(|(_, row)| row))))
}

/// An iterator over the rows with their lines.
type NumberedRows = Box<dyn Iterator<Item = Result<(u64, Row), Error>>>;

fn numbered_rows(file: &Path, kind: &str) -> Result<NumberedRows, Error> {
    let name = file.display().to_string();
    let refuse = move |line: u64, why: String| failed(format!("{name}:{line}: not a row of hzn results: {why}"));
    match kind {
        "csv" => {
            let mut reader = csv::Reader::from_reader(UnixLines::new(std::fs::File::open(file)?));
            let header = reader.headers().map_err(failed)?.clone();
            let separator = separator_hint(&header);
            if !separator.is_empty() {
                return Err(unusable(format!("{}:1: not a table of hzn results{separator}", file.display())));
            }
            if let Some(name) = ["file", "status"].into_iter().find(|name| !header.iter().any(|column| column == *name))
            {
                let what = format!("{}:1: not a table of hzn results: it has no column `{name}`", file.display());
                return Err(failed(what));
            }
            let row = move |(i, record): (usize, csv::Result<csv::StringRecord>)| {
                // A text with a line break takes several lines.
                let line = |record: &csv::StringRecord| record.position().map(csv::Position::line);
                let line = record.as_ref().ok().and_then(line).unwrap_or(i as u64 + 2);
                let read = record.map_err(|e| in_words(&e)).and_then(|record| from_csv(&record, &header));
                read.map(|row| (line, row)).map_err(|why| refuse(line, why))
            };
            Ok(drop_incomplete(Box::new(reader.into_records().enumerate().map(row)), file))
        }
        "jsonl" => {
            let lines = std::io::BufReader::new(std::fs::File::open(file)?).split(b'\n');
            let row = move |(i, line): (usize, std::io::Result<Vec<u8>>)| {
                let number = i as u64 + 1;
                from_json(&line?).map(|row| (number, row)).map_err(|why| refuse(number, why))
            };
            Ok(drop_incomplete(Box::new(lines.enumerate().map(row)), file))
        }
        _ => Err(unusable(format!("{}: .mcap, .csv or .jsonl is expected", file.display()))),
    }
}

/// Says what is wrong with a row that is no row of a table. A copy that was cut off ends with such a row.
fn in_words(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } if len < expected_len => {
            format!("it has {len} of {expected_len} cells; {IF_CUT}")
        }
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("it has {len} cells, but the header has {expected_len} columns")
        }
        csv::ErrorKind::Utf8 { .. } => "it is not UTF-8 text".to_owned(),
        _ => error.to_string(),
    }
}

fn drop_incomplete(rows: NumberedRows, file: &Path) -> NumberedRows {
    if ending(file) == "part" { Box::new(rows.take_while(Result::is_ok)) } else { rows }
}
