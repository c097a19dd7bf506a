//! The outputs for results: `.mcap`, `.csv`, `.jsonl` by the ending, or a CSV table on stdout.
//!
//! A file is written as `NAME.part` and gets its final name at the end, also after Ctrl-C. Therefore every file with
//! the final name is complete. A crash leaves the `.part` file. [`open`] can continue either.

mod record;
mod text;

use std::path::{Path, PathBuf};

use hzn_core::Config;
use hzn_mcap::{Contents, Options, Reader, part_path};

pub use record::{altitude_km, annotations, answer, fitted, frame_data, records, rows};

use crate::engine::{Answered, Finished, Sink};
use crate::error::{Error, Remedy, failed, unusable};
use crate::source::ending;
use text::{Form, Text};

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
}

enum Kind {
    Mcap(Box<hzn_mcap::Writer>),
    Text(Text),
}

/// The results that an output contains already.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Held {
    /// Number of pictures.
    pub frames: u64,
    /// Number of rows; a picture has one for each body.
    pub rows: u64,
    /// The last row.
    pub last: Option<hzn_mcap::Row>,
    /// The last answer of each body.
    pub answered: Vec<Option<Answered>>,
}

impl Held {
    /// Records the answers in a picture's rows, one row for each body.
    fn answers(&mut self, rows: &[hzn_mcap::Row]) {
        self.answered.resize(rows.len().max(self.answered.len()), None);
        for (answered, row) in self.answered.iter_mut().zip(rows) {
            *answered = Answered::of_row(row).or(*answered);
        }
    }
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

/// Opens an output; without a path, CSV on stdout. Also returns the results that it contains already.
///
/// # Errors
/// It exists and must not, belongs to another sensor, or cannot be written.
pub fn open(
    path: Option<&Path>,
    existing: Existing,
    config: &Config,
    sensor_toml: &str,
) -> Result<(Output, Held), Error> {
    let output = |kind, held| Ok((Output { kind, path: path.map(Path::to_owned), config: config.clone() }, held));
    let Some(path) = path else { return output(Kind::Text(Text::stdout()?), Held::default()) };
    let target = target(path)?;
    if path.is_dir() {
        return Err(unusable(format!("{}: is a folder", path.display())));
    }
    let part = part_path(path);
    match existing {
        Existing::Refuse => refuse(path, &part)?,
        Existing::Replace => {}
        Existing::Resume => {
            // An interrupted run has already given its file the final name.
            if path.exists() && !part.exists() {
                std::fs::rename(path, &part).map_err(|e| cannot(&part, &e))?;
                let back = |stop| {
                    let _ = std::fs::rename(&part, path);
                    stop
                };
                return resume(path, &part, target, config, sensor_toml)
                    .map_err(back)
                    .and_then(|(kind, held)| output(kind, held));
            }
            if path.exists() {
                // This fails if the unfinished file is still being written.
                hzn_mcap::open_part(&part).map_err(|e| cannot(&part, &e))?;
                let what = "exists together with the file of an unfinished run; remove one of them";
                return Err(unusable(format!("{}: {what} ({})", path.display(), part.display())));
            }
            let (kind, held) = resume(path, &part, target, config, sensor_toml)?;
            return output(kind, held);
        }
    }
    let kind = match form(target) {
        None => {
            let options = options(config, sensor_toml, existing == Existing::Replace);
            Kind::Mcap(Box::new(hzn_mcap::Writer::create(path, &options).map_err(failed)?))
        }
        Some(form) => Kind::Text(Text::create(path, &part, form).map_err(|e| cannot(&part, &e))?),
    };
    output(kind, Held::default())
}

fn refuse(path: &Path, part: &Path) -> Result<(), Error> {
    if path.exists() {
        return Err(unusable(format!("{}: exists already", path.display())).with(Remedy::ReplaceOrResume));
    }
    if std::fs::symlink_metadata(part).is_ok() {
        let what = format!("{}: was left by a run that did not end", part.display());
        return Err(unusable(what).with(Remedy::ResumeOrRestart));
    }
    Ok(())
}

fn form(target: Target) -> Option<Form> {
    match target {
        Target::Mcap => None,
        Target::Csv => Some(Form::Csv),
        Target::Jsonl => Some(Form::Jsonl),
    }
}

fn options(config: &Config, sensor_toml: &str, force: bool) -> Options {
    let metadata = [("program".to_owned(), format!("hzn {}", env!("CARGO_PKG_VERSION")))].into();
    Options { sensor_toml: sensor_toml.to_owned(), metadata, camera: Some(config.camera.clone()), force }
}

fn resume(path: &Path, part: &Path, target: Target, config: &Config, sensor_toml: &str) -> Result<(Kind, Held), Error> {
    match form(target) {
        Some(form) => {
            let resumed = Text::resume(path, part, form, Some(config.each_body().len())).map_err(|e| match e.kind() {
                std::io::ErrorKind::InvalidData => unusable(format!("{}: {e}", part.display())).with(Remedy::Restart),
                _ => cannot(part, &e),
            });
            let (text, held) = resumed?;
            Ok((Kind::Text(text), held))
        }
        None => {
            let before = last_frames(part);
            let resumed = hzn_mcap::resume(path, &options(config, sensor_toml, false)).map_err(|e| match e {
                hzn_mcap::Error::OtherSensor { .. } => unusable(e).with(Remedy::Restart),
                hzn_mcap::Error::Foreign { .. } => unusable(e),
                e => failed(e),
            })?;
            let frames = resumed.frames / config.each_body().len() as u64;
            let held = match resumed.frames {
                0 => Held::default(),
                rows => Held { frames, rows, ..before },
            };
            Ok((Kind::Mcap(Box::new(resumed.writer)), held))
        }
    }
}

/// Reads the last row of a recording, and the last answers of its bodies.
fn last_frames(part: &Path) -> Held {
    let mut held = Held::default();
    let Ok(reader) = Reader::open(part, Contents::WithoutImages) else { return held };
    let mut rows: Vec<hzn_mcap::Row> = Vec::new();
    for frame in reader.filter_map(Result::ok) {
        if rows.first().is_some_and(|first| first.index != frame.row.index) {
            held.answers(&rows);
            rows.clear();
        }
        rows.push(frame.row);
    }
    held.answers(&rows);
    held.last = rows.pop();
    held
}

/// Returns the text of [`advice`] for the file of a run. If the disk is full, it adds that finished pictures are kept.
pub(crate) fn advice_of_run(path: &Path, error: &std::io::Error) -> String {
    let what = advice(path, error);
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded | std::io::ErrorKind::FileTooLarge => {
            format!("{what}; finished pictures are kept; resume the run to continue after them")
        }
        _ => what,
    }
}

/// Returns whether two paths lead to the same existing file or folder.
pub fn is_same(a: &Path, b: &Path) -> bool {
    let b = if b.as_os_str().is_empty() { Path::new(".") } else { b };
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Refuses a file that exists, unless it may be replaced.
///
/// # Errors
/// The file exists and `force` is false.
pub fn refuse_existing(path: &Path, force: bool) -> Result<(), Error> {
    if path.exists() && !force {
        return Err(unusable(format!("{}: exists already", path.display())).with(Remedy::Replace));
    }
    Ok(())
}

/// Returns the error for a file that cannot be written, with advice.
pub fn cannot(path: &Path, error: &std::io::Error) -> Error {
    failed(advice(path, error))
}

/// Returns the error for a picture that cannot be written, with advice.
pub fn not_saved(path: &Path, error: &image::ImageError) -> Error {
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(e) = cause {
        if let Some(e) = e.downcast_ref::<std::io::Error>() {
            return cannot(path, e);
        }
        cause = e.source();
    }
    failed(format!("{}: {error}", path.display()))
}

/// Returns the meaning of a write error, with advice.
pub fn advice(path: &Path, error: &std::io::Error) -> String {
    let name = path.display();
    match error.kind() {
        std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => {
            format!("{name}: the disk is full: free some space, or write elsewhere")
        }
        std::io::ErrorKind::PermissionDenied | std::io::ErrorKind::ReadOnlyFilesystem => {
            format!("{name}: no permission to write here; choose another folder for the output")
        }
        std::io::ErrorKind::FileTooLarge => {
            format!("{name}: the file is larger than the limit (ulimit -f): raise the limit, or write elsewhere")
        }
        std::io::ErrorKind::ResourceBusy => format!("{name}: {error}"),
        std::io::ErrorKind::NotFound => format!("{name}: the folder does not exist; create it first"),
        std::io::ErrorKind::NotADirectory => {
            format!("{name}: a part of this path is a file, not a folder; choose another folder for the output")
        }
        // This error comes from making a folder.
        std::io::ErrorKind::AlreadyExists => format!("{name}: is a file, not a folder; choose another name"),
        _ => format!("{name}: cannot be written: {error}"),
    }
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
                text.finish().map_err(|e| cannot(self.path.as_deref().unwrap_or(Path::new("stdout")), &e))
            }
        }
    }

    /// Removes the unfinished file. A file that already has the final name is not changed.
    pub fn discard(self) {
        drop(self.kind);
        if let Some(path) = self.path {
            let _ = std::fs::remove_file(part_path(&path));
        }
    }

    /// Returns whether the output at this path stores the edges and points of pictures.
    pub fn wants_trace(path: Option<&Path>) -> bool {
        path.is_some_and(|p| ending(p) == "mcap")
    }
}

impl Sink for Output {
    fn write(&mut self, frame: &mut Finished) -> anyhow::Result<()> {
        match &mut self.kind {
            Kind::Mcap(writer) => Ok(writer.write_bodies(&records(frame, &self.config))?),
            Kind::Text(text) => {
                let written = rows(frame, &self.config).iter().try_for_each(|row| text.write(row));
                written.map_err(|e| text.told(e))
            }
        }
    }

    fn flush(&mut self) -> anyhow::Result<()> {
        match &mut self.kind {
            Kind::Mcap(writer) => Ok(writer.flush()?),
            Kind::Text(text) => text.flush().map_err(|e| text.told(e)),
        }
    }
}

/// A table of rows that exist already, in contrast to the output of a run.
pub struct RowFile {
    text: Text,
    path: PathBuf,
}

impl RowFile {
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
        let Some(form) = form(target(path)?) else {
            return Err(unusable(format!("{}: a table ends in .csv or .jsonl", path.display())));
        };
        let text = Text::create(path, &part, form).map_err(|e| {
            let _ = std::fs::remove_file(&part);
            cannot(path, &e)
        })?;
        Ok(Self { text, path: path.to_owned() })
    }
    /// Appends a row.
    ///
    /// # Errors
    /// The disk fails.
    pub fn write(&mut self, row: &hzn_mcap::Row) -> anyhow::Result<()> {
        self.text.write(row).map_err(|e| anyhow::anyhow!(advice(&self.path, &e)))
    }
    /// Removes the unfinished file. A file that already has the final name is not changed.
    pub fn discard(self) {
        drop(self.text);
        let _ = std::fs::remove_file(part_path(&self.path));
    }
    /// Closes the file and gives it its final name.
    ///
    /// # Errors
    /// The disk fails.
    pub fn finish(self) -> Result<(), Error> {
        let Self { text, path } = self;
        text.finish().map_err(|e| cannot(&path, &e))
    }
}

/// Keeps the complete rows of a truncated table. Returns their number and the number of bytes that were dropped.
///
/// # Errors
/// The file has other columns, or the disk fails.
pub fn recover_text(file: &Path, path: &Path, target: Target) -> std::io::Result<(u64, u64)> {
    let part = part_path(path);
    let size = std::fs::metadata(file)?.len();
    let form = if target == Target::Jsonl { Form::Jsonl } else { Form::Csv };
    if file != part {
        std::fs::copy(file, &part)?;
    }
    let resumed = Text::resume(path, &part, form, None);
    if resumed.is_err() && file != part {
        // An incomplete copy is of no use.
        let _ = std::fs::remove_file(&part);
    }
    let (text, held) = resumed?;
    text.finish()?;
    Ok((held.rows, size.saturating_sub(std::fs::metadata(path)?.len())))
}
