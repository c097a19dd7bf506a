//! Results as text: CSV and JSON Lines.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use hzn_mcap::Row;

use super::stored::StoredResults;
use crate::disk::run_advice;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Csv,
    Jsonl,
}

/// A text output with its final name.
pub(crate) struct Text {
    out: BufWriter<Box<dyn Write>>,
    form: Form,
    /// `(path, part)`: the final and the unfinished file; `None` for stdout.
    names: Option<(PathBuf, PathBuf)>,
}

/// The beginning of each row of JSON Lines.
const JSON_HEAD: &[u8] = b"{\"index\":";

fn header() -> String {
    Row::COLUMNS.join(",") + "\n"
}

impl Text {
    pub(crate) fn stdout() -> io::Result<Self> {
        let mut text = Self { out: BufWriter::new(Box::new(io::stdout())), form: Form::Csv, names: None };
        text.out.write_all(header().as_bytes())?;
        Ok(text)
    }

    fn from_file(file: File, path: &Path, part: &Path, form: Form) -> Self {
        let out = BufWriter::with_capacity(1 << 16, Box::new(file) as Box<dyn Write>);
        Self { out, form, names: Some((path.to_owned(), part.to_owned())) }
    }

    pub(crate) fn create(path: &Path, part: &Path, form: Form) -> io::Result<Self> {
        let mut text = Self::from_file(hzn_mcap::create_part(part)?, path, part, form);
        if form == Form::Csv {
            text.out.write_all(header().as_bytes())?;
            text.out.flush()?;
        }
        Ok(text)
    }

    /// Continues after the last picture that has all of its rows. This number is `bodies`, or that of the first
    /// picture. Without an unfinished file, begins a new one.
    pub(crate) fn resume(
        path: &Path,
        part: &Path,
        form: Form,
        bodies: Option<usize>,
    ) -> io::Result<(Self, StoredResults)> {
        if !part.exists() {
            return Ok((Self::create(path, part, form)?, StoredResults::default()));
        }
        let mut file = hzn_mcap::open_part(part)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let (stored, end) = find_complete(&bytes, form, bodies)?;
        if end == 0 {
            drop(file);
            return Ok((Self::create(path, part, form)?, StoredResults::default()));
        }
        // The rest of the file is an incomplete row or picture.
        file.set_len(end as u64)?;
        file.seek(SeekFrom::End(0))?;
        Ok((Self::from_file(file, path, part, form), stored))
    }

    pub(crate) fn write(&mut self, row: &Row) -> io::Result<()> {
        let line = match self.form {
            Form::Csv => csv_line(row).map_err(io::Error::other)?,
            Form::Jsonl => {
                let mut line = serde_json::to_vec(row)?;
                line.push(b'\n');
                line
            }
        };
        self.out.write_all(&line)
    }

    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Returns the error for a failed write of a run's results, with advice.
    pub(crate) fn write_error(&self, error: io::Error) -> anyhow::Error {
        match &self.names {
            Some((_, part)) => anyhow::anyhow!(run_advice(part, &error)),
            None if error.kind() == io::ErrorKind::BrokenPipe => error.into(),
            None => anyhow::anyhow!("results cannot be written to stdout: {error}"),
        }
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.out.flush()?;
        match self.names {
            Some((path, part)) => std::fs::rename(part, path),
            None => Ok(()),
        }
    }
}

/// Returns one row as a line of CSV.
pub(crate) fn csv_line(row: &Row) -> anyhow::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(Vec::new());
    writer.serialize(row)?;
    writer.into_inner().map_err(|e| anyhow::anyhow!("{e}"))
}

/// Returns the complete pictures of `bodies` rows each, and the offset of their end. If the number of bodies is
/// unknown, it is the number of rows of the first picture.
fn find_complete(bytes: &[u8], form: Form, bodies: Option<usize>) -> io::Result<(StoredResults, usize)> {
    let bodies = match bodies {
        Some(bodies) => bodies,
        None => {
            let mut first = Vec::new();
            each_row(bytes, form, |row, _| {
                let same = first.first().is_none_or(|index| *index == row.index);
                first.extend(same.then_some(row.index));
                same
            })?;
            first.len().max(1)
        }
    };
    let (mut stored, mut end, mut frame) = (StoredResults::default(), 0, Vec::new());
    each_row(bytes, form, |row, to| {
        frame.push(row);
        if frame.len() == bodies {
            stored.record_answers(&frame);
            stored.frames += 1;
            stored.rows += bodies as u64;
            stored.last = frame.pop();
            frame.clear();
            end = to;
        }
        true
    })?;
    Ok((stored, end))
}

/// Calls `visit` with every complete row and the offset of its end. Stops if `visit` returns false or a row is
/// incomplete.
fn each_row(bytes: &[u8], form: Form, mut visit: impl FnMut(Row, usize) -> bool) -> io::Result<()> {
    let other = || {
        let what = "does not have the columns of results of this version";
        Err(io::Error::new(io::ErrorKind::InvalidData, what))
    };
    if form == Form::Jsonl {
        if !(bytes.starts_with(JSON_HEAD) || JSON_HEAD.starts_with(bytes)) {
            return other();
        }
        let mut to = 0;
        for line in bytes.split_inclusive(|&b| b == b'\n').take_while(|line| line.ends_with(b"\n")) {
            let begins = to == 0;
            to += line.len();
            let row = match serde_json::from_slice::<Row>(line) {
                Ok(row) => row,
                // This is a complete row that is not one of ours.
                Err(_) if begins => return other(),
                Err(_) => break,
            };
            if !visit(row, to) {
                break;
            }
        }
        return Ok(());
    }
    let header = header();
    if header.as_bytes().starts_with(bytes) {
        return Ok(());
    }
    let Some(rest) = bytes.strip_prefix(header.as_bytes()) else {
        return other();
    };
    // A row may contain line breaks within quotes, so only the reader knows where it ends.
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(rest);
    let mut record = csv::StringRecord::new();
    while let Ok(true) = reader.read_record(&mut record) {
        let to = header.len() + reader.position().byte() as usize;
        let Ok(row) = record.deserialize::<Row>(None) else { break };
        if bytes.get(to - 1) != Some(&b'\n') || !visit(row, to) {
            break;
        }
    }
    Ok(())
}
