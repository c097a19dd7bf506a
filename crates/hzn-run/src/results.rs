//! Reads results that an earlier run wrote.

use std::io::BufRead;
use std::path::Path;

use hzn_mcap::{Contents, Reader, Row};

use crate::checked_row::{from_csv, from_json};
use crate::error::{Error, failed, unusable};
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
}

/// Reads all rows of results.
///
/// # Errors
/// The file does not exist, is not a file of results of `hzn run`, or is broken.
pub fn read(file: &Path) -> Result<Results, Error> {
    if !file.is_file() {
        return Err(unusable(format!("{}: no such file", file.display())));
    }
    match ending(file).as_str() {
        "mcap" => {
            let mut reader = Reader::open(file, Contents::WithoutImages).map_err(failed)?;
            let rows = reader.by_ref().map(|f| f.map(|f| f.row)).collect::<Result<_, _>>().map_err(failed)?;
            let sensor_toml = reader.sensor_toml().map(str::to_owned);
            Ok(Results { rows, sensor_toml, lost: describe_recording_loss(&reader, file, "read") })
        }
        kind @ ("csv" | "jsonl") => {
            Ok(Results { rows: rows(file, kind)?.collect::<Result<_, _>>()?, ..Results::default() })
        }
        _ => Err(unusable(format!("{}: results of `hzn run` are expected: .mcap, .csv or .jsonl", file.display()))),
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
    let name = file.display().to_string();
    let refuse = move |line: u64, why: String| failed(format!("{name}:{line}: not a row of hzn results: {why}"));
    match kind {
        "csv" => {
            let mut reader = csv::Reader::from_path(file).map_err(failed)?;
            let header = reader.headers().map_err(failed)?.clone();
            let row = move |(i, record): (usize, csv::Result<csv::StringRecord>)| {
                let read = record.map_err(|e| e.to_string()).and_then(|record| from_csv(&record, &header));
                read.map_err(|why| refuse(i as u64 + 2, why))
            };
            Ok(drop_incomplete(Box::new(reader.into_records().enumerate().map(row)), file))
        }
        "jsonl" => {
            let lines = std::io::BufReader::new(std::fs::File::open(file)?).split(b'\n');
            let row = move |(i, line): (usize, std::io::Result<Vec<u8>>)| {
                from_json(&line?).map_err(|why| refuse(i as u64 + 1, why))
            };
            Ok(drop_incomplete(Box::new(lines.enumerate().map(row)), file))
        }
        _ => Err(unusable(format!("{}: .mcap, .csv or .jsonl is expected", file.display()))),
    }
}

fn drop_incomplete(rows: AllRows, file: &Path) -> AllRows {
    if ending(file) == "part" { Box::new(rows.take_while(Result::is_ok)) } else { rows }
}
