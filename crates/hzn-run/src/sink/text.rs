//! Results as text: CSV and JSON Lines.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use hzn_files::rig::JOINT;
use hzn_mcap::Row;

use super::stored::StoredResults;
use crate::checked_row::{csv_line, from_csv, from_json, header, json_line};
use crate::disk::run_advice;
use crate::error::{Error, failed};
use crate::terminal::{FileOnStdout, one_line};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    Csv,
    Jsonl,
}

/// A text output with its final name.
pub(crate) struct Text {
    out: Out,
    form: Form,
    /// Whether every flush waits for the disk.
    durable: bool,
    /// Where the next row begins, in bytes, if the file is to be cut there first.
    continue_at: Option<u64>,
}

enum Out {
    Stdout(BufWriter<FileOnStdout>),
    File {
        file: BufWriter<File>,
        path: PathBuf,
        /// The name of the file until it is finished.
        part: PathBuf,
    },
}

impl Out {
    fn writer(&mut self) -> &mut dyn Write {
        match self {
            Self::Stdout(out) => out,
            Self::File { file, .. } => file,
        }
    }
}

/// The beginning of each row of JSON Lines.
const JSON_HEAD: &[u8] = b"{\"index\":";

impl Text {
    pub(crate) fn stdout(form: Form) -> io::Result<Self> {
        let mut text =
            Self { out: Out::Stdout(BufWriter::new(FileOnStdout::new())), form, durable: false, continue_at: None };
        if form == Form::Csv {
            text.out.writer().write_all(header().as_bytes())?;
        }
        Ok(text)
    }

    fn from_file(file: File, path: &Path, part: &Path, form: Form) -> Self {
        let file = BufWriter::with_capacity(1 << 16, file);
        let out = Out::File { file, path: path.to_owned(), part: part.to_owned() };
        Self { out, form, durable: false, continue_at: None }
    }

    /// Decides whether every flush waits until the rows are on the disk.
    ///
    /// # Errors
    /// The disk fails.
    pub(crate) fn with_durability(mut self, durable: bool) -> io::Result<Self> {
        self.durable = durable;
        if let (true, Out::File { part, .. }) = (durable, &self.out) {
            hzn_mcap::sync_name(part)?;
            self.flush()?;
        }
        Ok(self)
    }

    pub(crate) fn create(path: &Path, part: &Path, form: Form) -> io::Result<Self> {
        let mut text = Self::from_file(hzn_mcap::create_part(part)?, path, part, form);
        if form == Form::Csv {
            text.out.writer().write_all(header().as_bytes())?;
            text.flush()?;
        }
        Ok(text)
    }

    /// Continues after the last picture that has all of its rows, or after the last complete epoch of a rig. Without an
    /// unfinished file, begins a new one. Also returns what is known about a damaged row.
    pub(crate) fn resume(
        path: &Path,
        part: &Path,
        form: Form,
        rows: Grouping,
        damage: Damage,
    ) -> io::Result<(Self, StoredResults, Option<String>)> {
        if !part.exists() {
            return Ok((Self::create(path, part, form)?, StoredResults::default(), None));
        }
        let mut file = hzn_mcap::open_part(part)?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let found = find_complete(&bytes, form, rows)?;
        if let (Some(why), Damage::Refuse) = (&found.damage, damage) {
            return Err(io::Error::new(io::ErrorKind::InvalidData, why.clone()));
        }
        if found.end == 0 {
            drop(file);
            return Ok((Self::create(path, part, form)?, found.stored, found.damage));
        }
        let mut text = Self::from_file(file, path, part, form);
        // The rest of the file is an incomplete row or picture, or with a rig perhaps a complete epoch. It stays until
        // there is something to replace it, so that a refused run changes nothing.
        text.continue_at = Some(found.end as u64);
        Ok((text, found.stored, found.damage))
    }

    /// Cuts the file where the next row begins.
    fn cut(&mut self) -> io::Result<()> {
        if let (Some(at), Out::File { file, .. }) = (self.continue_at.take(), &mut self.out) {
            // Otherwise the file would get a new time without a change.
            if file.get_ref().metadata()?.len() != at {
                file.get_ref().set_len(at)?;
            }
            file.seek(SeekFrom::End(0))?;
        }
        Ok(())
    }

    pub(crate) fn write(&mut self, row: &Row) -> io::Result<()> {
        self.cut()?;
        let line = match self.form {
            Form::Csv => csv_line(row),
            Form::Jsonl => json_line(row),
        };
        let mut line = line.map_err(io::Error::other)?;
        if let Out::Stdout(out) = &self.out
            && out.get_ref().is_terminal()
        {
            // A line break within a name would begin a line that looks like one of hzn.
            let row = String::from_utf8_lossy(line.strip_suffix(b"\n").unwrap_or(&line));
            line = (one_line(row) + "\n").into_bytes();
        }
        self.out.writer().write_all(&line)
    }

    pub(crate) fn flush(&mut self) -> io::Result<()> {
        self.out.writer().flush()?;
        match &self.out {
            Out::File { file, .. } if self.durable => hzn_mcap::sync(file.get_ref()),
            _ => Ok(()),
        }
    }

    /// Returns the error for a failed write of a run's results, with advice.
    pub(crate) fn write_error(&self, error: io::Error) -> Error {
        match &self.out {
            Out::File { part, .. } => failed(run_advice(part, &error)),
            Out::Stdout(_) if error.kind() == io::ErrorKind::BrokenPipe => error.into(),
            Out::Stdout(_) => failed(format!("results cannot be written to stdout: {error}")),
        }
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.cut()?;
        self.out.writer().flush()?;
        match &self.out {
            Out::File { file, path, part } => hzn_mcap::publish(file.get_ref(), part, path),
            Out::Stdout(_) => Ok(()),
        }
    }
}

/// The treatment of a table with a row that was changed or is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Damage {
    /// The table is refused and stays as it is.
    Refuse,
    /// The rows before the damaged one are kept.
    KeepBefore,
}

/// The rows that belong together: all of them are kept, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grouping {
    /// A picture has a row for each of these bodies.
    Bodies(usize),
    /// A picture has as many rows as the first one.
    LikeFirst,
    /// The rows of an epoch of a rig have its number. Their number varies, so the last epoch is complete for certain
    /// only if the run ended by itself (`is_whole`).
    Epochs { is_whole: bool },
}

/// The complete pictures of a table.
struct Complete {
    stored: StoredResults,
    /// Offset of their end in bytes.
    end: usize,
    /// The row that was changed or is damaged, with the reason. The complete pictures end before it.
    damage: Option<String>,
}

/// Finds the complete pictures of `bodies` rows each, in the results of a run. A run writes its pictures in their
/// order, without a gap; otherwise rows were removed or moved. If the number of bodies is unknown, it is the number of
/// rows of the first picture, and the table may be a part of the results.
fn find_complete(bytes: &[u8], form: Form, rows: Grouping) -> io::Result<Complete> {
    let is_run = rows != Grouping::LikeFirst;
    let bodies = match rows {
        Grouping::Epochs { is_whole } => return find_epochs(bytes, form, is_whole),
        Grouping::Bodies(bodies) => bodies,
        Grouping::LikeFirst => {
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
    let mut misplaced = None;
    let damage = each_row(bytes, form, |row, to| {
        if is_run && row.index != stored.frames {
            misplaced = Some(misplacement(row.index, stored.frames));
            return false;
        }
        frame.push(row);
        if frame.len() == bodies {
            stored.record(&frame);
            stored.frames += 1;
            stored.rows += bodies as u64;
            stored.last = frame.pop();
            frame.clear();
            end = to;
        }
        true
    })?;
    Ok(Complete { stored, end, damage: damage.or(misplaced) })
}

fn misplacement(index: u64, place: u64) -> String {
    format!("picture {index} is at the place of picture {place}, so rows were removed or moved")
}

/// Finds the complete epochs of a rig. Each begins with the row of its joint answer.
fn find_epochs(bytes: &[u8], form: Form, is_whole: bool) -> io::Result<Complete> {
    let (mut stored, mut end, mut epoch, mut epoch_end) = (StoredResults::default(), 0, Vec::<Row>::new(), 0);
    let mut misplaced = None;
    let damage = each_row(bytes, form, |row, to| {
        let is_joint = row.head.as_deref() == Some(JOINT);
        if is_joint && !epoch.is_empty() {
            stored.record_epoch(&epoch);
            epoch.clear();
            end = epoch_end;
        }
        if row.index != stored.frames || is_joint != epoch.is_empty() {
            misplaced = Some(match is_joint || !epoch.is_empty() {
                true => misplacement(row.index, stored.frames),
                false => format!("picture {} has no row of the {JOINT}: it is not the table of a rig", row.index),
            });
            return false;
        }
        epoch.push(row);
        epoch_end = to;
        true
    })?;
    let damage = damage.or(misplaced);
    if is_whole && damage.is_none() && !epoch.is_empty() {
        stored.record_epoch(&epoch);
        end = epoch_end;
    }
    Ok(Complete { stored, end, damage })
}

/// Calls `visit` with every complete row and the offset of its end. Stops if `visit` returns false or a row is
/// incomplete. A row that is complete but is not a row of results is returned with the reason.
fn each_row(bytes: &[u8], form: Form, visit: impl FnMut(Row, usize) -> bool) -> io::Result<Option<String>> {
    match form {
        Form::Csv => each_csv_row(bytes, visit),
        Form::Jsonl => each_json_row(bytes, visit),
    }
}

fn other_table() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, "does not have the columns of results of this version")
}

fn each_json_row(bytes: &[u8], mut visit: impl FnMut(Row, usize) -> bool) -> io::Result<Option<String>> {
    if !(bytes.starts_with(JSON_HEAD) || JSON_HEAD.starts_with(bytes)) {
        return Err(other_table());
    }
    let lines = bytes.split_inclusive(|&b| b == b'\n').take_while(|line| line.ends_with(b"\n"));
    let mut to = 0;
    for (i, line) in lines.enumerate() {
        to += line.len();
        match from_json(line) {
            Ok(row) => {
                if !visit(row, to) {
                    break;
                }
            }
            Err(_) if i == 0 && serde_json::from_slice::<Row>(line).is_err() => return Err(other_table()),
            Err(why) => return Ok(Some(format!("row {}: {why}", i + 1))),
        }
    }
    Ok(None)
}

fn each_csv_row(bytes: &[u8], mut visit: impl FnMut(Row, usize) -> bool) -> io::Result<Option<String>> {
    let header = header();
    if header.as_bytes().starts_with(bytes) {
        return Ok(None);
    }
    if !bytes.starts_with(header.as_bytes()) {
        return Err(other_table());
    }
    // A row may contain line breaks within quotes, so only the reader knows where it ends.
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let columns = reader.headers().map_err(io::Error::other)?.clone();
    let mut record = csv::StringRecord::new();
    for i in 1.. {
        let read = reader.read_record(&mut record);
        let to = reader.position().byte() as usize;
        // The last row may be incomplete.
        if matches!(read, Ok(false)) || to.checked_sub(1).and_then(|last| bytes.get(last)) != Some(&b'\n') {
            break;
        }
        match read.map_err(|e| e.to_string()).and_then(|_| from_csv(&record, &columns)) {
            Ok(row) => {
                if !visit(row, to) {
                    break;
                }
            }
            // The file ends in a cell with line breaks.
            Err(_) if to == bytes.len() && record.len() < columns.len() => break,
            Err(why) => return Ok(Some(format!("row {i}: {why}"))),
        }
    }
    Ok(None)
}
