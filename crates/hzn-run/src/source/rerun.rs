//! A recording of `hzn run` that is processed again: its pictures with everything that was known about them.

use std::path::{Path, PathBuf};

use hzn_files::FrameData;
use hzn_mcap::{Contents, FrameRecord, Index, IndexEntry, Reader, Row};

use super::item::{Item, TimeSource};
use super::payload::Payload;
use super::recording::{SAMPLE_EVERY, known_size};
use super::sequence::{MAX_SIZES_READ, Source};
use crate::error::{Error, unusable};
use crate::explain;

/// Pictures as they were recorded: with their names, times, priors, and the sensor.
pub(super) struct Rerun {
    reader: Reader,
    path: PathBuf,
    /// Number of the last picture. A picture of several bodies has one record for each body.
    last: Option<u64>,
}

impl Rerun {
    /// Opens a recording. Returns `None` for a recording of another program.
    pub(super) fn open(path: &Path) -> Result<Option<Self>, Error> {
        let reader = open(path).map_err(unusable)?;
        if reader.sensor_toml().is_none() {
            return Ok(None);
        }
        match find_pictures(path).map_err(unusable)? {
            RecordedPictures::Present => {}
            RecordedPictures::LeftOut => {
                let what = "contains results without their pictures; give the pictures themselves";
                return Err(unusable(format!("{}: {what}", path.display())));
            }
            RecordedPictures::Damaged(why) => {
                let what = format!("no picture is left: {why}; give the pictures themselves");
                return Err(unusable(format!("{}: {what}", path.display())));
            }
            RecordedPictures::Lost => {
                let what = "ends before its first picture is complete; give the pictures themselves";
                return Err(unusable(format!("{}: {what}", path.display())));
            }
        }
        Ok(Some(Self { reader, path: path.to_owned(), last: None }))
    }
}

fn open(path: &Path) -> Result<Reader, hzn_mcap::Error> {
    Reader::open(path, Contents::All)
}

enum RecordedPictures {
    Present,
    /// The file has only results.
    LeftOut,
    /// The file has parts that cannot be read, and no picture outside of them. The text says why.
    Damaged(String),
    /// The file contains nothing that is complete.
    Lost,
}

/// Returns whether a recording contains pictures. Pictures come before the results, so only little of a recording with
/// pictures is read.
fn find_pictures(path: &Path) -> Result<RecordedPictures, hzn_mcap::Error> {
    let mut index = Index::open(path)?;
    let mut any = false;
    while let Some(part) = index.next_part()? {
        if part.iter().any(|found| matches!(found, IndexEntry::Picture(_))) {
            return Ok(RecordedPictures::Present);
        }
        any |= !part.is_empty();
    }
    if index.broken_chunks() > 0 {
        let parts = explain::counted(index.broken_chunks(), "damaged part");
        let why = index.unknown_compression().map_or_else(|| format!("the file has {parts}"), unknown_compression);
        return Ok(RecordedPictures::Damaged(why));
    }
    Ok(if any || index.is_complete() { RecordedPictures::LeftOut } else { RecordedPictures::Lost })
}

fn item(record: FrameRecord) -> Item {
    let data = recorded_prior(&record.row, record.prior);
    let picture = record
        .image
        .map_or_else(|| Payload::Broken("the recording does not contain this picture".into()), Payload::from_recorded);
    Item { name: record.row.file, time: TimeSource::Table, stamp: record.stamp, data: Some(data), payload: picture }
}

impl Source for Rerun {
    fn next(&mut self) -> Option<Result<Item, Error>> {
        loop {
            match self.reader.next()? {
                Ok(record) if self.last.replace(record.row.index) == Some(record.row.index) => {}
                Ok(record) => return Some(Ok(item(record))),
                Err(e) => return Some(Err(Error::failed(e))),
            }
        }
    }
    fn total(&self) -> Option<u64> {
        None
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        let Ok(reader) = open(&self.path) else { return Box::new(std::iter::empty()) };
        let records = reader.map_while(Result::ok).take(MAX_SIZES_READ);
        Box::new(records.filter_map(|r| Some((r.row.file, known_size(r.image.as_ref()?)?))))
    }
    fn samples(&self) -> Box<dyn Iterator<Item = Payload> + '_> {
        let Ok(reader) = open(&self.path) else { return Box::new(std::iter::empty()) };
        let pictures = reader.map_while(Result::ok).filter_map(|record| record.image);
        Box::new(pictures.step_by(SAMPLE_EVERY).map(Payload::from_recorded))
    }
    fn folder(&self) -> PathBuf {
        self.path.parent().map(Path::to_owned).unwrap_or_default()
    }
    fn files(&self) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }
    fn sensor_toml(&self) -> Option<&str> {
        self.reader.sensor_toml()
    }
    fn describe_loss(&self) -> Option<String> {
        describe_loss(&self.reader, &self.path, "processed")
    }
}

/// Says that hzn does not know how a recording is compressed.
fn unknown_compression(name: &str) -> String {
    format!("its data are compressed with {name:?}; write it again with zstd, with lz4 or without compression")
}

/// Says that a recording has bytes behind its end, which are not read.
pub fn describe_rest(path: &Path, bytes: u64) -> String {
    let name = path.display();
    format!(
        "{name}: the last {bytes} bytes were not read: they come after the end of the recording, as a second one that \
         was appended; `tail -c {bytes} {name}` gives them alone"
    )
}

/// Says that a recording has messages where results are expected, but none that hzn can read.
pub fn describe_unread(path: &Path, reports: u64) -> String {
    let messages = explain::counted(reports, "message");
    let what = "cannot be read as results, because the channel has another schema than hzn.Report";
    format!("{}: {messages} on /hzn/report {what}; keep the schema when the file is written again", path.display())
}

/// Describes what is missing in a recording that was read to its end. `done` says what was done with the rest.
pub fn describe_loss(reader: &Reader, path: &Path, done: &str) -> Option<String> {
    let name = path.display();
    if let Some(compression) = reader.unknown_compression() {
        return Some(format!("{name}: cannot be read: {}", unknown_compression(compression)));
    }
    if reader.unread_reports() > 0 {
        return Some(describe_unread(path, reader.unread_reports()));
    }
    if reader.bytes_after_end() > 0 {
        return Some(describe_rest(path, reader.bytes_after_end()));
    }
    match reader.broken_chunks() {
        0 if reader.is_complete() => None,
        0 => Some(format!("{name}: was cut off; its finished pictures were {done} (`hzn recover` closes it)")),
        1 => Some(format!("{name}: 1 damaged part was left out; its content is missing")),
        n => Some(format!("{name}: {n} damaged parts were left out; their content is missing")),
    }
}

/// Returns the row of frames.csv for a picture, from its result and the prior that a recording stores.
pub fn recorded_prior(row: &Row, given: FrameData) -> FrameData {
    FrameData { file: row.file.clone(), time_s: row.time_s, ..given }
}
