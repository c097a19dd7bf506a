//! Rows of results as text, each with a checksum.
//!
//! MCAP has CRCs of its own. A table gets a last column `crc32`: the CRC-32 (as in PNG and zip) of the row as a line of
//! CSV, without its line end, without this column, and with an empty cell `elapsed_us`. The processing time is left out
//! because it differs from run to run, and two runs with the same answers must have the same column.
//!
//! The column belongs to the text and not to [`Row`]. It is the last, so readers that find columns by name or by place
//! are not disturbed, and the checksum stays with its row if rows are sorted, selected or joined. A second file could
//! be lost or be older than the table, and a last line would be a broken row for other readers.

use hzn_mcap::Row;

use crate::error::{Error, failed};

/// Name of the column with the checksum.
pub const COLUMN: &str = "crc32";

/// What to do with a table whose last row ends early.
pub(crate) const IF_CUT: &str = "if the file was cut off, `hzn recover FILE` keeps its complete rows";

/// Returns the first line of a CSV.
pub(crate) fn header() -> String {
    format!("{},{COLUMN}\n", Row::COLUMNS.join(","))
}

/// Characters with which a spreadsheet begins a formula. Some skip a tab or a carriage return before it.
const FORMULA: [char; 6] = ['=', '+', '-', '@', '\t', '\r'];

/// Returns whether a spreadsheet would compute a text, or whether it looks like a [`guard`]ed one.
fn needs_guard(text: &str) -> bool {
    text.trim_start_matches('\'').starts_with(FORMULA)
}

/// Makes a text a cell of CSV. The apostrophe at its beginning makes a spreadsheet take it as a text.
fn guard(text: &mut String) {
    if needs_guard(text) {
        text.insert(0, '\'');
    }
}

/// Makes a [`guard`]ed cell its text again.
fn unguard(cell: &mut String) {
    if cell.strip_prefix('\'').is_some_and(needs_guard) {
        cell.remove(0);
    }
}

/// Returns a row as a line of CSV without its checksum and line end. All its texts are guarded: in a recording, others
/// may have written any of them.
fn to_csv(row: &Row) -> Result<Vec<u8>, Error> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    let written = if row.texts().any(needs_guard) {
        let mut row = row.clone();
        row.change_texts(guard);
        writer.serialize(row)
    } else {
        writer.serialize(row)
    };
    written.map_err(Error::failed)?;
    let mut line = writer.into_inner().map_err(failed)?;
    line.truncate(line.trim_ascii_end().len());
    Ok(line)
}

/// Returns the checksum of a row, as eight hexadecimal digits.
///
/// # Errors
/// The row cannot be written as CSV.
pub fn checksum(row: &Row) -> Result<String, Error> {
    sum(row).map(|sum| format!("{sum:08x}"))
}

/// Returns the checksum of a row as a number.
///
/// # Errors
/// The row cannot be written as CSV.
pub fn sum(row: &Row) -> Result<u32, Error> {
    let line = to_csv(&Row { elapsed_us: None, ..row.clone() })?;
    Ok(crc32fast::hash(&line))
}

/// Returns one row as a line of CSV.
pub(crate) fn csv_line(row: &Row) -> Result<Vec<u8>, Error> {
    let mut line = to_csv(row)?;
    line.extend_from_slice(format!(",{}\n", checksum(row)?).as_bytes());
    Ok(line)
}

/// Returns one row as a line of JSON.
pub(crate) fn json_line(row: &Row) -> Result<Vec<u8>, Error> {
    let mut line = serde_json::to_vec(row).map_err(Error::failed)?;
    // The closing brace.
    line.pop();
    line.extend_from_slice(format!(",\"{COLUMN}\":\"{}\"}}\n", checksum(row)?).as_bytes());
    Ok(line)
}

/// Reads a line of JSON.
///
/// # Errors
/// The reason why it is not a row, or why it is not the row that was written.
pub(crate) fn from_json(line: &[u8]) -> Result<Row, String> {
    #[derive(serde::Deserialize)]
    struct Sum {
        crc32: Option<String>,
    }
    // Bytes of columns that are not known would not be looked at.
    let line = core::str::from_utf8(line).map_err(|e| e.to_string())?;
    let row: Row = serde_json::from_str(line).map_err(|e| match e.classify() {
        serde_json::error::Category::Eof => format!("it ends early; {IF_CUT}"),
        _ => e.to_string(),
    })?;
    let sum: Sum = serde_json::from_str(line).map_err(|e| e.to_string())?;
    check(row, sum.crc32.as_deref())
}

/// Reads a row of CSV, whose columns are found by their names.
///
/// # Errors
/// The reason why it is not a row, or why it is not the row that was written.
pub(crate) fn from_csv(record: &csv::StringRecord, header: &csv::StringRecord) -> Result<Row, String> {
    let why = |e: csv::Error| match e.kind() {
        // The caller knows the line.
        csv::ErrorKind::Deserialize { err, .. } => err.kind().to_string(),
        _ => e.to_string(),
    };
    let mut row = record.deserialize::<Row>(Some(header)).map_err(why)?;
    row.change_texts(unguard);
    let place = header.iter().position(|name| name == COLUMN);
    check(row, place.and_then(|i| record.get(i)))
}

/// Returns the row if its checksum is right. Results of earlier versions have none.
fn check(row: Row, sum: Option<&str>) -> Result<Row, String> {
    let Some(sum) = sum else { return Ok(row) };
    let own = checksum(&row).map_err(|e| e.to_string())?;
    if own == sum { Ok(row) } else { Err(format!("{WRONG_SUM} ({sum}, but its values give {own})")) }
}

/// Beginning of the reason for a row that was changed.
const WRONG_SUM: &str = "the checksum does not fit the row, so it was changed or is damaged";

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::status::Status;

    fn row() -> Row {
        let meta = hzn_mcap::RowMeta {
            index: 7,
            file: "a \"b\", c.png".into(),
            time_s: Some(0.1 + 0.2),
            body: "earth".into(),
            altitude_km: Some(1e-7),
        };
        let row = Row::unprocessed(&meta, Status::Unreadable, "two\nlines");
        Row { axis_x: Some(-0.0), axis_y: Some(1.0 / 3.0), elapsed_us: Some(12.5), ..row }
    }

    fn read_csv(line: &[u8]) -> Result<Row, String> {
        let text = [header().as_bytes(), line].concat();
        let mut reader = csv::Reader::from_reader(text.as_slice());
        let header = reader.headers().unwrap().clone();
        let record = reader.records().next().unwrap().map_err(|e| e.to_string())?;
        from_csv(&record, &header)
    }

    #[test]
    fn rows_come_back_and_changed_ones_do_not() {
        let row = row();
        let (csv, json) = (csv_line(&row).unwrap(), json_line(&row).unwrap());
        assert_eq!(read_csv(&csv).as_ref(), Ok(&row));
        assert_eq!(from_json(&json).as_ref(), Ok(&row));
        let other = Row { elapsed_us: Some(99.0), ..row.clone() };
        assert_eq!(checksum(&other).unwrap(), checksum(&row).unwrap());
        // Every changed digit is found, except those of the processing time, which is left out.
        for (line, read) in [(&csv, &read_csv as &dyn Fn(&[u8]) -> Result<Row, String>), (&json, &from_json)] {
            let time = line.windows(4).position(|w| w == b"12.5").unwrap();
            for at in (0..line.len()).filter(|at| line[*at].is_ascii_digit() && !(time..time + 4).contains(at)) {
                let mut changed = line.clone();
                changed[at] = if changed[at] == b'9' { b'8' } else { changed[at] + 1 };
                // The last digit of a number may stand for the same number, and a digit of a key makes an unknown key.
                // The row is then the same, or is refused.
                if let Ok(read) = read(&changed) {
                    assert_eq!(read, row, "{at}");
                }
            }
        }
    }

    #[test]
    fn a_spreadsheet_computes_no_text() {
        let begins =
            ["=1+1", "+1", "-1", "@sum", "'=1", "''-", "'", "'a", "a", "-", "a=1", "''", "\t=1", "\r=1", "'\t"];
        let texts =
            Row { head: Some("b".into()), heads_used: Some("b".into()), heads_excluded: Some("c".into()), ..row() };
        let count = texts.texts().count();
        assert_eq!(count, 6);
        let pairs: Vec<_> = begins.iter().flat_map(|a| begins.iter().map(move |b| (*a, *b))).collect();
        for (place, (first, others)) in (0..count).flat_map(|place| pairs.iter().map(move |pair| (place, *pair))) {
            let mut row = Row { axis_x: Some(-0.5), ..texts.clone() };
            let mut column = 0;
            row.change_texts(|text| {
                *text = (if column == place { first } else { others }).to_owned();
                column += 1;
            });
            let line = csv_line(&row).unwrap();
            assert_eq!(read_csv(&line).as_ref(), Ok(&row));
            let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_slice());
            let record = reader.records().next().unwrap().unwrap();
            // Numbers stay numbers, and JSON is read by no spreadsheet.
            let is_number = |cell: &str| cell.parse::<f64>().is_ok() && !begins.contains(&cell);
            let formulas = record.iter().filter(|cell| cell.starts_with(FORMULA) && !is_number(cell));
            assert_eq!(formulas.count(), 0, "{record:?}");
            let cell = |name: &str| record.get(Row::COLUMNS.iter().position(|c| *c == name).unwrap()).unwrap();
            assert_eq!(cell("axis_x"), "-0.5");
            assert_eq!(from_json(&json_line(&row).unwrap()).as_ref(), Ok(&row));
            let written = format!("\"body\":{}", serde_json::to_string(&row.body).unwrap());
            assert!(String::from_utf8(json_line(&row).unwrap()).unwrap().contains(&written));
        }
    }

    #[test]
    fn the_checksum_is_that_of_the_documented_line() {
        let csv = String::from_utf8(csv_line(&row()).unwrap()).unwrap();
        let (line, sum) = csv.trim_end().rsplit_once(',').unwrap();
        let line = line.replace(",12.5,", ",,");
        assert_eq!(format!("{:08x}", crc32fast::hash(line.as_bytes())), sum);
        // The sum is that of the guarded texts.
        let csv = String::from_utf8(csv_line(&Row { body: "=1+1".into(), ..row() }).unwrap()).unwrap();
        let (guarded, other) = csv.trim_end().rsplit_once(',').unwrap();
        assert_eq!(guarded.replace(",12.5,", ",,"), line.replace(",earth,", ",'=1+1,"));
        assert_eq!(format!("{:08x}", crc32fast::hash(guarded.replace(",12.5,", ",,").as_bytes())), other);
    }

    #[test]
    fn rows_without_a_checksum_are_read() {
        let line = serde_json::to_vec(&row()).unwrap();
        assert_eq!(from_json(&line), Ok(row()));
    }
}
