//! The outputs for results: `.mcap`, `.csv`, `.jsonl` by the ending, or a table on stdout.
//!
//! A file is written as `NAME.part` and gets its final name at the end, also after Ctrl-C. Therefore every file with
//! the final name is complete. A crash leaves the `.part` file. [`open`] can continue either.

mod chain;
mod outputs;
mod stored;
mod text;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use hzn_core::Config;
use hzn_mcap::{Contents, FrameRecord, Options, Reader, part_path};

pub use outputs::Outputs;
pub use stored::{StoredEpoch, StoredResults};
pub(crate) use stored::{StoredPicture, all_identities};

pub use crate::record::{altitude_km, records, rows};

use crate::disk::{advice, cannot_write, refuse_existing};
use crate::engine::{Finished, Sink};
use crate::error::{Error, Remedy, failed, unusable};
use crate::source::ending;
use text::{Damage, Form, Grouping, Text};

/// The treatment of an output that exists already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Refuse the output.
    Refuse,
    /// Replace the output.
    Replace,
    /// Continue the output after its last finished picture.
    Resume,
}

/// An output that takes the results of pictures.
pub struct Output {
    kind: Kind,
    path: Option<PathBuf>,
    config: Config,
    /// The file had its final name before it was opened.
    was_final: bool,
}

enum Kind {
    Mcap(Box<hzn_mcap::Writer>),
    Text(Text),
}

/// Kinds of output, selected by the ending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A recording.
    Mcap,
    /// A table.
    Csv,
    /// A text file with one JSON object a line.
    Jsonl,
}

/// Returns the kind of output for a file name.
///
/// # Errors
/// The ending is not known.
pub fn target(path: &Path) -> Result<Target, Error> {
    match ending(path).as_str() {
        "mcap" => Ok(Target::Mcap),
        "csv" => Ok(Target::Csv),
        "jsonl" => Ok(Target::Jsonl),
        _ => Err(unusable(format!("{}: the output's ending must be .mcap, .csv or .jsonl", path.display()))),
    }
}

/// The sensor of an output, and how the output is written.
#[derive(Debug, Clone, Copy)]
pub struct Settings<'a> {
    /// The configuration of the sensor.
    pub config: &'a Config,
    /// The sensor.toml that a recording stores.
    pub sensor_toml: &'a str,
    /// Whether every flush waits until the results are on the disk, so that a power cut cannot lose them.
    pub durable: bool,
    /// Whether a recording also has the answers as messages of ROS 2.
    pub ros: bool,
    /// With a rig, its heads: name, configuration and sensor.toml of each. `sensor_toml` is then the text of rig.toml.
    pub heads: &'a [(String, &'a Config, String)],
}

/// Begins a table on stdout.
///
/// # Errors
/// The format needs a file, or stdout is closed.
pub fn on_stdout(format: Target, config: &Config) -> Result<Output, Error> {
    let Some(form) = text_form(format) else {
        return Err(unusable("a recording (MCAP) needs a file: -o NAME.mcap"));
    };
    let kind = Kind::Text(Text::stdout(form)?);
    Ok(Output { kind, path: None, config: config.clone(), was_final: false })
}

/// Opens an output file. Also returns the results that it contains already.
///
/// # Errors
/// It exists and must not, belongs to another sensor, or cannot be written.
pub fn open(path: &Path, existing: Existing, settings: Settings<'_>) -> Result<(Output, StoredResults), Error> {
    let output = |kind, stored, was_final| {
        let (path, config) = (Some(path.to_owned()), settings.config.clone());
        Ok((Output { kind, path, config, was_final }, stored))
    };
    let target = target(path)?;
    if path.is_dir() {
        return Err(unusable(format!("{}: is a folder", path.display())));
    }
    let part = part_path(path);
    match existing {
        Existing::Refuse => refuse(path, &part)?,
        Existing::Replace => {}
        Existing::Resume => {
            let written = [&part, path].iter().find_map(|p| std::fs::metadata(p).and_then(|m| m.modified()).ok());
            let output = |kind, stored, was_final| output(kind, StoredResults { written, ..stored }, was_final);
            // An interrupted run has already given its file the final name.
            if path.exists() && !part.exists() {
                std::fs::rename(path, &part).map_err(|e| cannot_write(&part, &e))?;
                let restore = |stop| {
                    let _ = std::fs::rename(&part, path);
                    stop
                };
                return resume(path, &part, target, settings, true)
                    .map_err(restore)
                    .and_then(|(kind, stored)| output(kind, stored, true));
            }
            if path.exists() {
                // This fails if the unfinished file is still being written.
                hzn_mcap::open_part(&part).map_err(|e| cannot_write(&part, &e))?;
                let what = "exists together with the file of an unfinished run; remove one of them";
                return Err(unusable(format!("{}: {what} ({})", path.display(), part.display())));
            }
            let (kind, stored) = resume(path, &part, target, settings, false)?;
            return output(kind, stored, false);
        }
    }
    let kind = match text_form(target) {
        None => {
            let options = options(settings, existing == Existing::Replace);
            Kind::Mcap(Box::new(hzn_mcap::Writer::create(path, &options).map_err(failed)?))
        }
        Some(form) => {
            let text = Text::create(path, &part, form).and_then(|text| text.with_durability(settings.durable));
            Kind::Text(text.map_err(|e| cannot_write(&part, &e))?)
        }
    };
    output(kind, StoredResults::default(), false)
}

fn refuse(path: &Path, part: &Path) -> Result<(), Error> {
    if path.exists() {
        return Err(unusable(format!("{}: exists already", path.display())).with_remedy(Remedy::ReplaceOrResume));
    }
    if hzn_mcap::is_being_written(part) {
        let what = "another run is writing it; wait until that run ends, or choose another name for the output";
        return Err(unusable(format!("{}: {what}", part.display())));
    }
    if std::fs::symlink_metadata(part).is_ok() {
        let what = format!("{}: was left by a run that did not end", part.display());
        return Err(unusable(what).with_remedy(Remedy::ResumeOrRestart));
    }
    Ok(())
}

fn text_form(target: Target) -> Option<Form> {
    match target {
        Target::Mcap => None,
        Target::Csv => Some(Form::Csv),
        Target::Jsonl => Some(Form::Jsonl),
    }
}

fn options(settings: Settings<'_>, force: bool) -> Options {
    let Settings { config, sensor_toml, durable, ros, heads } = settings;
    let metadata = [("program".to_owned(), format!("hzn {}", env!("CARGO_PKG_VERSION")))].into();
    let mut options = Options { metadata, force, durable, ros, ..Options::default() };
    if heads.is_empty() {
        (options.sensor_toml, options.camera) = (sensor_toml.to_owned(), Some(config.camera.clone()));
    } else {
        options.files.push(("rig.toml".to_owned(), sensor_toml.to_owned()));
        options.files.extend(heads.iter().map(|(name, _, text)| (format!("{name}/sensor.toml"), text.clone())));
        options.heads = heads.iter().map(|(name, config, _)| (name.clone(), config.camera.clone())).collect();
    }
    options
}

/// Continues an unfinished file; `is_whole` says that a run closed it.
fn resume(
    path: &Path,
    part: &Path,
    target: Target,
    settings: Settings<'_>,
    is_whole: bool,
) -> Result<(Kind, StoredResults), Error> {
    let bodies = settings.config.each_body().len();
    let is_rig = !settings.heads.is_empty();
    match text_form(target) {
        Some(form) => {
            let rows = if is_rig { Grouping::Epochs { is_whole } } else { Grouping::Bodies(bodies) };
            let resumed = Text::resume(path, part, form, rows, Damage::Refuse)
                .and_then(|(text, stored, _)| Ok((text.with_durability(settings.durable)?, stored)));
            let (text, stored) = resumed.map_err(|e| match e.kind() {
                std::io::ErrorKind::InvalidData => {
                    unusable(format!("{}: {e}", part.display())).with_remedy(Remedy::Restart)
                }
                _ => cannot_write(part, &e),
            })?;
            Ok((Kind::Text(text), stored))
        }
        None => {
            let before = read_stored(part, is_rig);
            let resumed = hzn_mcap::resume(path, &options(settings, false)).map_err(|e| match e {
                hzn_mcap::Error::OtherSensor { .. } => unusable(e).with_remedy(Remedy::Restart),
                hzn_mcap::Error::Foreign { .. } => unusable(e),
                e => failed(e),
            })?;
            // An epoch is in one batch, so all of them are complete.
            let frames = if is_rig { before.frames } else { resumed.frames / bodies as u64 };
            let stored = match resumed.frames {
                0 => StoredResults::default(),
                rows => StoredResults { frames, rows, ..before },
            };
            Ok((Kind::Mcap(Box::new(resumed.writer)), stored))
        }
    }
}

/// Reads the last row of a recording, and the last answers of its bodies; with a rig, its epochs.
fn read_stored(part: &Path, is_rig: bool) -> StoredResults {
    let mut stored = StoredResults::default();
    let Ok(reader) = Reader::open(part, Contents::WithoutImages) else { return stored };
    let record = |stored: &mut StoredResults, rows: &[hzn_mcap::Row]| match is_rig {
        true if rows.is_empty() => {}
        true => stored.record_epoch(rows),
        false => stored.record(rows),
    };
    let mut rows: Vec<hzn_mcap::Row> = Vec::new();
    for frame in reader.filter_map(Result::ok) {
        if rows.first().is_some_and(|first| first.index != frame.row.index) {
            record(&mut stored, &rows);
            rows.clear();
        }
        rows.push(frame.row);
    }
    record(&mut stored, &rows);
    stored.last = rows.pop();
    stored
}

/// Sets the time of the last write of a file.
///
/// # Errors
/// The file cannot be written.
pub fn set_written(file: &Path, written: SystemTime) -> std::io::Result<()> {
    std::fs::File::options().write(true).open(file)?.set_modified(written)
}

impl Output {
    /// Closes the file and gives it its final name.
    ///
    /// # Errors
    /// The disk fails.
    pub fn finish(self) -> Result<(), Error> {
        match self.kind {
            Kind::Mcap(writer) => writer.finish().map(|_| ()).map_err(failed),
            Kind::Text(text) => {
                text.finish().map_err(|e| cannot_write(self.path.as_deref().unwrap_or(Path::new("stdout")), &e))
            }
        }
    }

    /// Closes an output that was opened to be continued, without further results. It keeps the name that it had: an
    /// unfinished file stays unfinished. It also keeps the time of its last write, because the next attempt compares
    /// the pictures with it.
    ///
    /// # Errors
    /// The disk fails.
    fn put_back(mut self, written: Option<SystemTime>) -> Result<(), Error> {
        let name = |path: &PathBuf| if self.was_final { path.clone() } else { part_path(path) };
        let file = self.path.as_ref().map(name);
        if self.was_final {
            self.finish()?;
        } else {
            self.flush()?;
            drop(self);
        }
        let Some((file, written)) = file.zip(written) else { return Ok(()) };
        set_written(&file, written).map_err(|e| cannot_write(&file, &e))
    }

    /// Removes the unfinished file. A file that already has the final name is not changed.
    pub fn discard(self) {
        drop(self.kind);
        if let Some(path) = self.path {
            let _ = std::fs::remove_file(part_path(&path));
        }
    }

    /// Appends the records of an epoch of a rig: those of the joint answer, and those of each head.
    ///
    /// # Errors
    /// The disk fails.
    pub fn write_heads(&mut self, heads: &[Vec<FrameRecord>]) -> Result<(), Error> {
        match &mut self.kind {
            Kind::Mcap(writer) => {
                let heads: Vec<&[FrameRecord]> = heads.iter().map(Vec::as_slice).collect();
                writer.write_heads(&heads).map_err(Error::failed)
            }
            Kind::Text(text) => {
                let written = heads.iter().flatten().try_for_each(|record| text.write(&record.row));
                written.map_err(|e| text.write_error(e))
            }
        }
    }

    /// Returns whether the output at this path stores the edges and points of pictures.
    pub fn wants_trace(path: Option<&Path>) -> bool {
        path.is_some_and(|p| ending(p) == "mcap")
    }
}

impl Sink for Output {
    fn write(&mut self, frame: &mut Finished) -> Result<(), Error> {
        match &mut self.kind {
            Kind::Mcap(writer) => writer.write_bodies(&records(frame, &self.config)).map_err(Error::failed),
            Kind::Text(text) => {
                let written = rows(frame, &self.config).iter().try_for_each(|row| text.write(row));
                written.map_err(|e| text.write_error(e))
            }
        }
    }

    fn flush(&mut self) -> Result<(), Error> {
        match &mut self.kind {
            Kind::Mcap(writer) => writer.flush().map_err(Error::failed),
            Kind::Text(text) => text.flush().map_err(|e| text.write_error(e)),
        }
    }
}

/// A table of rows that exist already, in contrast to the output of a run.
pub struct RowFile {
    text: Text,
    /// The file; `stdout` for the table on standard output.
    path: PathBuf,
    is_stdout: bool,
}

impl RowFile {
    /// Begins a table on stdout.
    ///
    /// # Errors
    /// The format needs a file, or stdout is closed.
    pub fn on_stdout(format: Target) -> Result<Self, Error> {
        let Some(form) = text_form(format) else { return Err(unusable("a table is CSV or JSON Lines")) };
        Ok(Self { text: Text::stdout(form)?, path: PathBuf::from("stdout"), is_stdout: true })
    }
    /// Begins a CSV or JSON Lines file.
    ///
    /// # Errors
    /// It exists and must not, has another ending, or cannot be written.
    pub fn create(path: &Path, existing: Existing) -> Result<Self, Error> {
        let part = part_path(path);
        if existing == Existing::Refuse {
            // --resume cannot continue this table, so the error offers only to replace it.
            refuse_existing(path, false)?;
            refuse(path, &part)?;
        }
        let Some(form) = text_form(target(path)?) else {
            return Err(unusable(format!("{}: a table ends in .csv or .jsonl", path.display())));
        };
        let text = Text::create(path, &part, form).map_err(|e| {
            let _ = std::fs::remove_file(&part);
            cannot_write(path, &e)
        })?;
        Ok(Self { text, path: path.to_owned(), is_stdout: false })
    }
    /// Appends a row.
    ///
    /// # Errors
    /// The disk fails.
    pub fn write(&mut self, row: &hzn_mcap::Row) -> Result<(), Error> {
        self.text.write(row).map_err(|e| if self.is_stdout { e.into() } else { failed(advice(&self.path, &e)) })
    }
    /// Removes the unfinished file. A file that already has the final name is not changed.
    pub fn discard(self) {
        drop(self.text);
        if !self.is_stdout {
            let _ = std::fs::remove_file(part_path(&self.path));
        }
    }
    /// Closes the file and gives it its final name.
    ///
    /// # Errors
    /// The disk fails.
    pub fn finish(self) -> Result<(), Error> {
        let Self { text, path, is_stdout } = self;
        text.finish().map_err(|e| if is_stdout { e.into() } else { cannot_write(&path, &e) })
    }
}

/// What [`recover_text`] did with a table.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecoveredTable {
    /// Number of rows that are kept.
    pub rows: u64,
    /// Number of bytes at the end that are not kept.
    pub dropped_bytes: u64,
    /// The first row that was changed or is damaged, with the reason. Only the rows before it are kept.
    pub damage: Option<String>,
}

/// Keeps the complete rows of a truncated table, up to the first damaged one.
///
/// # Errors
/// The file has other columns, or the disk fails.
pub fn recover_text(file: &Path, path: &Path, target: Target) -> std::io::Result<RecoveredTable> {
    let part = part_path(path);
    let size = std::fs::metadata(file)?.len();
    let form = if target == Target::Jsonl { Form::Jsonl } else { Form::Csv };
    if file != part {
        std::fs::copy(file, &part)?;
    }
    let resumed = Text::resume(path, &part, form, Grouping::LikeFirst, Damage::KeepBefore);
    if resumed.is_err() && file != part {
        // An incomplete copy is of no use.
        let _ = std::fs::remove_file(&part);
    }
    let (text, stored, damage) = resumed?;
    text.finish()?;
    let dropped_bytes = size.saturating_sub(std::fs::metadata(path)?.len());
    Ok(RecoveredTable { rows: stored.rows, dropped_bytes, damage })
}
