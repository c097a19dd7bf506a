//! Closes and continues recordings that were cut off.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read};
use std::path::{Path, PathBuf};

use crate::container::{Chunk, ChunkFault, Container, Fields, Inflation, MAGIC, Message, Op, Record, Scanner, Schemas};
use crate::error::{Error, while_writing};
use crate::part::{open_part, part_path, publish};
use crate::reader::{Contents, Reader};
use crate::topics::Topic;
use crate::writer::{LIBRARY, Options, Writer, open_container, refuse_existing};

/// Result of [`recover`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Recovered {
    /// Number of records that are kept, one per frame and body; 0 for a recording without `/hzn/report`.
    pub frames: u64,
    /// Whether the file had been closed properly.
    pub was_complete: bool,
    /// Number of chunks that are left out because their contents are damaged.
    pub broken_chunks: u64,
    /// Number of bytes at the end of the file that are not kept: an incomplete record, or pictures without a result.
    pub dropped_bytes: u64,
    /// Bytes behind the end of the recording, which are not read; see [`crate::Reader::bytes_after_end`].
    pub bytes_after_end: u64,
    /// Number of messages that are on the topic of the reports, but have another schema. They are kept, but no reader
    /// takes them for results; see [`crate::Reader::unread_reports`].
    pub unread_reports: u64,
}

/// A recording that is continued.
#[derive(Debug)]
pub struct Resumed {
    /// Number of finished records (one per frame and body). Continue with the next one.
    pub frames: u64,
    /// Index of the last finished frame, from its row; `None` if there are no frames.
    pub last_index: Option<u64>,
    /// The writer for the further frames.
    pub writer: Writer,
}

/// Closes a broken recording: copies every finished frame (see the crate's documentation) from `input` to `output`,
/// which must not exist.
///
/// # Errors
/// `input` cannot be read, is not an MCAP, or has a compression that hzn does not read; `output` exists or cannot be
/// written.
pub fn recover(input: impl AsRef<Path>, output: impl AsRef<Path>) -> Result<Recovered, Error> {
    recover_while(input, output, |_, _| true)
}

/// Recovers a recording as [`recover`] does, until the caller stops it. `wanted` is called for every record with the
/// bytes read so far and the size of `input`; it returns `false` to stop.
///
/// # Errors
/// The errors are those of [`recover`], and [`Error::Stopped`].
pub fn recover_while(
    input: impl AsRef<Path>,
    output: impl AsRef<Path>,
    mut wanted: impl FnMut(u64, u64) -> bool,
) -> Result<Recovered, Error> {
    let (input, output) = (input.as_ref(), output.as_ref());
    refuse_existing(output)?;
    let part = part_path(output);
    let mut out = open_container(&part).map_err(|e| while_writing(&part, e))?;
    let closed = copy_frames(input, &mut out, &part, &mut wanted).and_then(|found| {
        let file = out.finish().map_err(|e| while_writing(&part, e))?;
        publish(file.get_ref(), &part, output).map_err(|e| while_writing(output, e))?;
        Ok(found)
    });
    if closed.is_err() {
        // The input is unchanged, and an incomplete copy of it is useless.
        let _ = fs::remove_file(&part);
    }
    closed
}

/// Continues the unfinished recording of `path`. Its finished frames are copied into a new `.part` file, which then
/// replaces the old one. If there is no unfinished recording, a new one begins.
///
/// # Errors
/// The output already exists (with `options.force` it is replaced at the end), the unfinished recording has another
/// sensor.toml, or the disk fails.
pub fn resume(path: impl AsRef<Path>, options: &Options) -> Result<Resumed, Error> {
    let path = path.as_ref();
    let part = part_path(path);
    if !options.force {
        refuse_existing(path)?;
    }
    let fresh = || -> Result<Resumed, Error> {
        let options = Options { force: true, ..options.clone() };
        Ok(Resumed { frames: 0, last_index: None, writer: Writer::create(path, &options)? })
    };
    if !part.exists() {
        return fresh();
    }
    // The old file stays locked until its frames are in the new file.
    let lock = open_part(&part).map_err(|e| while_writing(&part, e))?;
    match find_origin(&lock).map_err(|source| Error::Read { path: part.clone(), source })? {
        Origin::Ours => {}
        // The file has no frames yet, so nothing is lost.
        Origin::Cut => {
            drop(lock);
            return fresh();
        }
        Origin::Other => return Err(Error::Foreign { path: part }),
    }
    let mut reader = Reader::open(&part, Contents::WithoutImages)?;
    let same = has_same_files(&reader, options);
    if same == Some(false) {
        return Err(Error::OtherSensor { path: part });
    }
    let mut last_index = None;
    for frame in &mut reader {
        last_index = Some(frame?.row.index);
    }
    match (same, last_index) {
        // The file was cut off before its sensor was written.
        (None, None) => {
            drop(lock);
            return fresh();
        }
        // It is the recording of a rig that is to be continued with one camera, or the other way round.
        (None, Some(_)) => return Err(Error::OtherSensor { path: part }),
        (Some(_), _) => {}
    }
    let mut copy_path = part.as_os_str().to_owned();
    copy_path.push(".new");
    let copy_path = PathBuf::from(copy_path);
    // Errors name the old file, because it has all frames until the new one replaces it.
    let failed = |e| while_writing(&part, e);
    let copied = open_container(&copy_path).map_err(failed).and_then(|mut out| {
        let found = copy_frames(&part, &mut out, &part, &mut |_, _| true)?;
        out.flush().map_err(failed)?;
        publish_copy(&lock, out.output().get_ref(), &copy_path, &part).map_err(failed)?;
        Ok((found, out))
    });
    if copied.is_err() {
        let _ = fs::remove_file(&copy_path);
    }
    let (found, out) = copied?;
    Ok(Resumed { frames: found.frames, last_index, writer: Writer::with_container(out, path, &part, options) })
}

/// Puts the copy of a file in its place. Its frames are as old as before, so it keeps the time of the last write.
fn publish_copy(old: &File, copy: &File, copy_path: &Path, path: &Path) -> io::Result<()> {
    if let Ok(written) = old.metadata().and_then(|data| data.modified()) {
        // A file system may be unable to change it.
        let _ = copy.set_modified(written);
    }
    publish(copy, copy_path, path)
}

/// Returns whether a recording has the sensor of `options`, or the rig and its sensors. `None` if it lacks one of the
/// files.
fn has_same_files(reader: &Reader, options: &Options) -> Option<bool> {
    if options.heads.is_empty() {
        return Some(reader.sensor_toml()? == options.sensor_toml);
    }
    let mut all = options.files.iter().map(|(name, text)| Some(reader.file(name)? == text));
    all.try_fold(true, |same, one| Some(same && one?))
}

/// The program that began a file.
enum Origin {
    Ours,
    /// The file was cut off before this is known; it has no content yet.
    Cut,
    Other,
}

/// Finds the program that began a file by its first bytes.
fn find_origin(mut file: &File) -> io::Result<Origin> {
    let mut beginning = Vec::new();
    file.by_ref().take(256).read_to_end(&mut beginning)?;
    let mut fields = Fields(&beginning);
    let magic = fields.bytes(MAGIC.len());
    Ok(match magic {
        None if MAGIC.starts_with(&beginning) => Origin::Cut,
        Some(magic) if magic == MAGIC => match (fields.u8(), fields.u64(), fields.text(), fields.text()) {
            (Some(Op::HEADER), _, _, Some(library)) if library.starts_with(LIBRARY) => Origin::Ours,
            // A header of hzn is shorter than 64 bytes, so a shorter file may be cut off within it.
            (.., None) if beginning.len() < 64 => Origin::Cut,
            _ => Origin::Other,
        },
        _ => Origin::Other,
    })
}

/// Copies the complete records of `input` up to the last finished frame.
fn copy_frames(
    input: &Path,
    out: &mut Container<BufWriter<File>>,
    part: &Path,
    wanted: &mut dyn FnMut(u64, u64) -> bool,
) -> Result<Recovered, Error> {
    let read = |source| Error::Read { path: input.to_path_buf(), source };
    let file = File::open(input).map_err(read)?;
    let size = file.metadata().map_err(read)?.len();
    let scanner = Scanner::try_new(BufReader::with_capacity(1 << 16, file)).map_err(read)?;
    let mut scanner = scanner.ok_or_else(|| Error::NotMcap { path: input.to_path_buf() })?;
    let write = |e| while_writing(part, e);

    let mut copier = FrameCopier {
        out,
        found: Recovered::default(),
        schemas: Schemas::default(),
        report_channels: BTreeSet::new(),
        foreign_channels: BTreeSet::new(),
        waiting: Vec::new(),
        inflation: Inflation::default(),
        is_broken: false,
        unknown_compression: None,
    };
    let mut kept_to = scanner.position();
    let mut lost_bytes = 0;
    while let Some(record) = scanner.next().map_err(read)? {
        // A chunk that reaches into a gap was counted already.
        let is_gap = scanner.lost_bytes() > lost_bytes && !copier.is_broken;
        copier.found.broken_chunks += u64::from(is_gap);
        (lost_bytes, copier.is_broken) = (scanner.lost_bytes(), false);
        if !wanted(scanner.position(), size) {
            return Err(Error::Stopped { path: input.to_path_buf() });
        }
        if record.op == Op::DATA_END {
            copier.found.was_complete = true;
            copier.write_waiting().map_err(write)?;
            copier.found.bytes_after_end = scanner.bytes_after_end().map_err(read)?;
            kept_to = size;
            break;
        }
        if copier.add(record).map_err(write)? {
            kept_to = scanner.position();
        }
        if let Some(compression) = copier.unknown_compression.take() {
            return Err(Error::Compression { path: input.to_path_buf(), compression });
        }
    }
    Ok(Recovered { dropped_bytes: size.saturating_sub(kept_to) + lost_bytes, ..copier.found })
}

/// Copies a recording, record by record.
struct FrameCopier<'a> {
    out: &'a mut Container<BufWriter<File>>,
    found: Recovered,
    schemas: Schemas,
    /// Channels of the reports that are declared so far.
    report_channels: BTreeSet<u16>,
    /// Channels with the topic of the reports, but with another schema.
    foreign_channels: BTreeSet<u16>,
    /// Parts of frames, which wait for their reports.
    waiting: Vec<Part>,
    inflation: Inflation,
    /// Whether the last record was a chunk that cannot be read.
    is_broken: bool,
    unknown_compression: Option<String>,
}

/// A part of a recording that contains messages.
enum Part {
    Chunk(Chunk),
    /// A message outside of chunks.
    Message(Record),
}

impl FrameCopier<'_> {
    /// Adds a record that is not the end of the data. It returns `false` if the record waits for another.
    fn add(&mut self, record: Record) -> io::Result<bool> {
        match record.op {
            Op::CHUNK => match Chunk::parse(&record, &mut self.inflation) {
                Ok((chunk, plain)) => {
                    chunk.index.declared.iter().for_each(|(op, _, content)| self.read_declaration(*op, content));
                    return self.add_part(Part::Chunk(chunk), Chunk::messages(&plain));
                }
                Err(ChunkFault::Compression(name)) => self.unknown_compression = Some(name),
                Err(ChunkFault::Damaged(_)) => {
                    self.found.broken_chunks += 1;
                    self.is_broken = true;
                }
            },
            Op::MESSAGE => {
                let content = record.content.clone();
                return self.add_part(Part::Message(record), Message::parse(&content).into_iter());
            }
            // The message indexes are written again.
            Op::MESSAGE_INDEX => {}
            op => {
                self.read_declaration(op, &record.content);
                self.out.copy(&record)?;
            }
        }
        Ok(true)
    }

    /// Takes notice of a channel with the topic of the reports.
    fn read_declaration(&mut self, op: u8, content: &[u8]) {
        let Some((id, channel)) = self.schemas.declare(op, content) else { return };
        if Topic::of(&channel) == Some(Topic::Report) {
            self.report_channels.insert(id);
        } else if channel.topic == Topic::Report.name() {
            self.foreign_channels.insert(id);
        }
    }

    /// Writes a part and the parts that wait for it, unless it has to wait too. `messages` are those of the part.
    fn add_part<'m>(&mut self, part: Part, messages: impl Iterator<Item = Message<'m>>) -> io::Result<bool> {
        let mut reports = 0;
        for message in messages {
            reports += u64::from(self.report_channels.contains(&message.channel));
            self.found.unread_reports += u64::from(self.foreign_channels.contains(&message.channel));
        }
        self.waiting.push(part);
        if !self.report_channels.is_empty() && reports == 0 {
            return Ok(false);
        }
        self.write_waiting()?;
        self.found.frames += reports;
        Ok(true)
    }

    fn write_waiting(&mut self) -> io::Result<()> {
        self.waiting.drain(..).try_for_each(|part| match part {
            Part::Chunk(chunk) => self.out.chunk(&chunk),
            Part::Message(record) => self.out.copy(&record),
        })
    }
}
