//! Writes a recording that survives the end of the program at any moment.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hzn_core::camera;
use hzn_core::status::Status;

use crate::container::{ChunkBuilder, Container, MAX_RECORD_BYTES};
use crate::drawing;
use crate::error::{Error, while_writing};
use crate::frame::FrameRecord;
use crate::messages;
use crate::part::{create_part, part_path};
use crate::topics::Topic;

/// Longest time that a frame waits to be finished while frames keep coming.
pub const FLUSH_INTERVAL: Duration = Duration::from_millis(250);
/// A batch is written early when its pictures or its other data are this large, bytes.
const BATCH_IMAGE_BYTES: usize = 8 << 20;
const BATCH_DATA_BYTES: usize = 1 << 20;
/// The calibration is repeated when this much of the recording's time has passed, nanoseconds.
const CALIBRATION_EVERY_NS: u64 = 1_000_000_000;

/// What a recording is made with.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Text of the sensor.toml, attached first.
    pub sensor_toml: String,
    /// Further versions and settings for the metadata `hzn`, such as the program's version.
    pub metadata: BTreeMap<String, String>,
    /// The calibration for `/camera/calibration`.
    pub camera: Option<camera::Config>,
    /// Replace an output, or the remains of a run, that is there already.
    pub force: bool,
}

/// A recording that is being written. Dropped without [`Writer::finish`] it leaves its `.part` file with every frame
/// written so far, for [`resume`](crate::resume) or [`recover`](crate::recover).
#[derive(Debug)]
pub struct Writer {
    /// `None` once finished or failed.
    container: Option<Container<BufWriter<File>>>,
    path: PathBuf,
    part: PathBuf,
    camera: Option<camera::Config>,
    images: ChunkBuilder,
    data: ChunkBuilder,
    waiting_since: Option<Instant>,
    last_calibration_ns: Option<u64>,
    /// Log time of the last frame.
    last_ns: u64,
    frames: u64,
}

impl Writer {
    /// Begins a recording that will be called `path`.
    ///
    /// # Errors
    /// The output or the remains of a run exist and `options.force` is not set; the folder cannot be written to.
    pub fn create(path: impl AsRef<Path>, options: &Options) -> Result<Self, Error> {
        let path = path.as_ref();
        let part = part_path(path);
        if !options.force {
            refuse_existing(path)?;
            if part.exists() {
                return Err(Error::Unfinished { path: part });
            }
        }
        let container = begin(&part, options).map_err(|e| while_writing(&part, e))?;
        Ok(Self::on(container, path, &part, options))
    }

    pub(crate) fn on(container: Container<BufWriter<File>>, path: &Path, part: &Path, options: &Options) -> Self {
        Self {
            container: Some(container),
            path: path.to_path_buf(),
            part: part.to_path_buf(),
            camera: options.camera.clone(),
            images: ChunkBuilder::default(),
            data: ChunkBuilder::default(),
            waiting_since: None,
            last_calibration_ns: None,
            last_ns: 0,
            frames: 0,
        }
    }

    /// The unfinished file.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Records written through this writer: one a frame and body.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Appends a frame. It is finished once flushed: at the latest by the first call after [`FLUSH_INTERVAL`].
    ///
    /// # Errors
    /// The disk is full or broken; after that every call fails, and the finished frames are safe in the `.part` file.
    pub fn write(&mut self, frame: &FrameRecord) -> Result<(), Error> {
        self.write_bodies(core::slice::from_ref(frame))
    }

    /// As [`Self::write`], a frame with a record for each of several bodies: either all of them are finished or none.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_bodies(&mut self, records: &[FrameRecord]) -> Result<(), Error> {
        let several = records.len() > 1;
        let caption = |record: &FrameRecord| {
            let text = drawing::caption(&record.row);
            if several { format!("{}  {text}", record.row.body) } else { text }
        };
        let captions: Vec<String> = records.iter().map(caption).collect();
        for (i, record) in records.iter().enumerate() {
            // Picture and drawing stand in the first.
            self.push(record, if i == 0 { &captions } else { &[] })?;
        }
        self.waiting_since.get_or_insert_with(Instant::now);
        if self.images.len() >= BATCH_IMAGE_BYTES || self.data.len() >= BATCH_DATA_BYTES {
            return self.flush();
        }
        self.flush_if_due()
    }

    fn push(&mut self, frame: &FrameRecord, captions: &[String]) -> Result<(), Error> {
        let Some(container) = &mut self.container else { return Err(Error::AfterFailure { path: self.part.clone() }) };
        let bytes = frame.image.as_ref().map_or(0, |i| i.bytes.len() as u64);
        if bytes + (BATCH_IMAGE_BYTES as u64) >= MAX_RECORD_BYTES {
            return Err(Error::TooLarge { bytes, limit: MAX_RECORD_BYTES - BATCH_IMAGE_BYTES as u64 });
        }
        let pen_px = drawing::pen_px(self.camera.as_ref());
        // A frame without a time stays where it is in the sequence.
        let ns = frame.row.time_s.map_or(self.last_ns, messages::time_ns);
        self.last_ns = ns;
        let sequence = frame.row.index as u32;
        let declare = |topic: Topic, container: &mut Container<_>| -> std::io::Result<u16> {
            let id = topic.id();
            if !container.has_channel(id) {
                let (name, encoding, data, message_encoding) = topic.schema();
                container.schema(id, &name, &encoding, &data)?;
                container.channel(id, id, topic.name(), message_encoding)?;
            }
            Ok(id)
        };
        let failed = |e| while_writing(&self.part, e);
        if let Some(image) = &frame.image {
            let id = declare(messages::image_topic(&image.format), container).map_err(failed)?;
            self.images.push(id, sequence, ns, |buffer| messages::image(image, ns, buffer));
        }
        let data = &mut self.data;
        let mut push = |topic: Topic, fill: &mut dyn FnMut(&mut Vec<u8>)| -> Result<(), Error> {
            let id = declare(topic, container).map_err(failed)?;
            data.push(id, sequence, ns, fill);
            Ok(())
        };
        if let Some(camera) = &self.camera {
            let due = self.last_calibration_ns.is_none_or(|last| ns.abs_diff(last) >= CALIBRATION_EVERY_NS);
            if due {
                self.last_calibration_ns = Some(ns);
                push(Topic::Calibration, &mut |b| messages::append(&messages::calibration(camera, ns), b))?;
            }
        }
        let unprocessed = matches!(frame.row.status, Status::Unreadable | Status::NoAltitude);
        if frame.image.is_some() || !frame.annotations.is_empty() || (unprocessed && !captions.is_empty()) {
            // Also without anything to draw: the last frame's picture and lines would stay as if they were this one's.
            let drawing = drawing::annotations(&frame.annotations, captions, pen_px, ns);
            push(Topic::Annotations, &mut |b| messages::append(&drawing, b))?;
        }
        if let Some(axis) = frame.row.axis() {
            push(Topic::Axis, &mut |b| messages::append(&messages::axis(axis, ns), b))?;
        }
        if let Some(attitude) = &frame.attitude {
            push(Topic::Transform, &mut |b| messages::append(&messages::transform(attitude, ns), b))?;
        }
        for line in &frame.log {
            push(Topic::Log, &mut |b| messages::append(&messages::log(line, &frame.row.file, ns), b))?;
        }
        // The report comes last: where it is, the frame is whole.
        push(Topic::Report, &mut |b| b.extend_from_slice(&messages::report(frame)))?;
        self.frames += 1;
        Ok(())
    }

    /// Finishes the waiting frames when they have waited for [`FLUSH_INTERVAL`]; for loops in which frames may fail
    /// to come.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn flush_if_due(&mut self) -> Result<(), Error> {
        match self.waiting_since {
            Some(since) if since.elapsed() >= FLUSH_INTERVAL => self.flush(),
            _ => Ok(()),
        }
    }

    /// Finishes every frame written so far.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn flush(&mut self) -> Result<(), Error> {
        let Some(mut container) = self.container.take() else {
            return Err(Error::AfterFailure { path: self.part.clone() });
        };
        let (images, data) = (&mut self.images, &mut self.data);
        let mut write = || -> std::io::Result<()> {
            // Pictures first: a frame with a report is a whole frame.
            if !images.is_empty() {
                let chunk = images.take(false)?;
                container.chunk(&chunk)?;
                images.recycle(chunk);
            }
            if !data.is_empty() {
                container.chunk(&data.take(true)?)?;
            }
            container.flush()
        };
        match write() {
            Ok(()) => {
                self.waiting_since = None;
                self.container = Some(container);
                Ok(())
            }
            Err(e) => Err(while_writing(&self.part, e)),
        }
    }

    /// Closes the recording and gives it its name.
    ///
    /// # Errors
    /// As [`Self::write`]; the `.part` file stays.
    pub fn finish(mut self) -> Result<PathBuf, Error> {
        self.flush()?;
        let Some(container) = self.container.take() else {
            return Err(Error::AfterFailure { path: self.part.clone() });
        };
        let failed = |e| while_writing(&self.part, e);
        container.finish().map_err(failed)?;
        fs::rename(&self.part, &self.path).map_err(|e| while_writing(&self.path, e))?;
        Ok(self.path.clone())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if self.container.is_some() {
            // Nobody is left to hear of an error; what was flushed before is safe.
            let _ = self.flush();
        }
    }
}

pub(crate) fn refuse_existing(path: &Path) -> Result<(), Error> {
    if path.exists() { Err(Error::Exists { path: path.to_path_buf() }) } else { Ok(()) }
}

/// What our recordings name as the library that wrote them, before its version.
pub(crate) const LIBRARY: &str = "hzn";

/// Opens a file for a container, empty.
pub(crate) fn open(part: &Path) -> std::io::Result<Container<BufWriter<File>>> {
    let file = create_part(part)?;
    Container::try_new(BufWriter::with_capacity(1 << 16, file), &format!("{LIBRARY} {}", env!("CARGO_PKG_VERSION")))
}

fn begin(part: &Path, options: &Options) -> std::io::Result<Container<BufWriter<File>>> {
    let mut container = open(part)?;
    container.attach(SENSOR_TOML, "application/toml", options.sensor_toml.as_bytes())?;
    let mut metadata = options.metadata.clone();
    metadata.insert("hzn_mcap_version".into(), env!("CARGO_PKG_VERSION").into());
    container.metadata("hzn", &metadata)?;
    container.flush()?;
    Ok(container)
}

/// Name of the attachment.
pub(crate) const SENSOR_TOML: &str = "sensor.toml";
