//! Writes a recording that stays readable if the program ends at any moment.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hzn_core::camera;
use hzn_core::status::Status;

use crate::container::{ChunkBuilder, Container, MAX_RECORD_BYTES};
use crate::drawing;
use crate::early_sync::EarlySync;
use crate::error::{Error, while_writing};
use crate::frame::FrameRecord;
use crate::messages;
use crate::origin::Origin;
use crate::part::{create_part, part_path, publish, sync, sync_name};
use crate::ros;
use crate::topics::Topic;

/// Longest time from a frame until it is finished, as long as further frames come.
pub const FLUSH_INTERVAL: Duration = Duration::from_millis(250);
/// Size of the pictures, in bytes, at which a batch is written early.
const BATCH_IMAGE_BYTES: usize = 8 << 20;
/// Size of the other data, in bytes, at which a batch is written early.
const BATCH_DATA_BYTES: usize = 1 << 20;
/// The calibration is repeated after this much of the recording's time, in nanoseconds.
const CALIBRATION_EVERY_NS: u64 = 1_000_000_000;

/// Largest size in bytes of what surrounds the messages of a chunk: its head, the heads of its indexes (at most nine
/// topics of a camera), its entry in the summary.
const CHUNK_BYTES: u64 = 1280;

/// Settings of a recording.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Text of the sensor.toml, attached first.
    pub sensor_toml: String,
    /// Further versions and settings for the metadata `hzn`, for example the program's version.
    pub metadata: BTreeMap<String, String>,
    /// The calibration for `/camera/calibration`.
    pub camera: Option<camera::Config>,
    /// With a rig, names and calibrations of its heads. A record whose row names a head goes to the topics of this
    /// head, for example `/left/camera/image`.
    pub heads: Vec<(String, camera::Config)>,
    /// Further files, attached by name.
    pub files: Vec<(String, String)>,
    /// Whether the answers are also messages of ROS 2: the axis as `geometry_msgs/msg/Vector3Stamped` on
    /// `/hzn/axis_vector`, its covariance as `std_msgs/msg/Float64MultiArray` on `/hzn/axis_covariance`. The answer of
    /// a picture without a time is not there.
    pub ros: bool,
    /// Whether an existing output, or the remains of a run, may be replaced.
    pub force: bool,
    /// Whether a finished frame is on the disk, so that also a power cut cannot lose it. Otherwise the operating system
    /// may still keep it in its memory.
    pub durable: bool,
}

/// A recording that is being written. If it is dropped without [`Writer::finish`], its `.part` file stays with every
/// frame written so far, for [`resume`](crate::resume) or [`recover`](crate::recover).
///
/// ```
/// use hzn_core::status::Status;
/// use hzn_mcap::{Contents, FrameRecord, Options, Reader, Row, RowMeta, Writer};
///
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("flight.mcap");
/// let mut writer = Writer::create(&path, &Options::default())?;
/// let meta = RowMeta { file: "0001.png".into(), time_s: Some(12.5), body: "earth".into(), ..RowMeta::default() };
/// writer.write(&FrameRecord::new(Row::unprocessed(&meta, Status::NoAltitude, "no altitude is known")))?;
/// writer.finish()?;
///
/// let frames: Vec<FrameRecord> = Reader::open(&path, Contents::All)?.collect::<Result<_, _>>()?;
/// assert_eq!((frames.len(), frames[0].row.file.as_str()), (1, "0001.png"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Writer {
    /// `None` after the end or after a failure.
    container: Option<Container<BufWriter<File>>>,
    path: PathBuf,
    part: PathBuf,
    camera: Option<camera::Config>,
    heads: Vec<(String, camera::Config)>,
    images: ChunkBuilder,
    data: ChunkBuilder,
    waiting_since: Option<Instant>,
    /// Log time of the last calibration of each head; of the only camera, the first entry.
    last_calibration_ns: Vec<Option<u64>>,
    /// Log time of the last frame.
    last_ns: u64,
    frames: u64,
    ros: bool,
    durable: bool,
    early_sync: EarlySync,
}

impl Writer {
    /// Begins a recording with the final name `path`.
    ///
    /// # Errors
    /// The output or the remains of a run exist and `options.force` is not set, or the folder cannot be written to.
    pub fn create(path: impl AsRef<Path>, options: &Options) -> Result<Self, Error> {
        let path = path.as_ref();
        let part = part_path(path);
        if !options.force {
            refuse_existing(path)?;
            if part.exists() {
                return Err(Error::Unfinished { path: part });
            }
        }
        let container = begin_recording(&part, options).map_err(|e| while_writing(&part, e))?;
        Ok(Self::with_container(container, path, &part, options))
    }

    /// Creates a writer on a container that is open already.
    pub(crate) fn with_container(
        container: Container<BufWriter<File>>,
        path: &Path,
        part: &Path,
        options: &Options,
    ) -> Self {
        Self {
            container: Some(container),
            path: path.to_path_buf(),
            part: part.to_path_buf(),
            camera: options.camera.clone(),
            heads: options.heads.clone(),
            images: ChunkBuilder::default(),
            data: ChunkBuilder::default(),
            waiting_since: None,
            last_calibration_ns: vec![None; options.heads.len().max(1)],
            last_ns: 0,
            frames: 0,
            ros: options.ros,
            durable: options.durable,
            early_sync: EarlySync::default(),
        }
    }

    /// Returns the path of the unfinished file.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Returns the number of records that this writer wrote: one per frame and body.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Returns the size in bytes that the recording has at most if it is finished now; 0 after a failure.
    pub fn finished_bytes(&self) -> u64 {
        let heads = self.heads.len().max(1) as u64;
        // Pictures are stored as they are; what cannot be compressed becomes a little longer.
        let waiting =
            [&self.images, &self.data].map(|chunk| chunk.len() as u64 + chunk.len() as u64 / 64 + CHUNK_BYTES * heads);
        let messages = self.images.messages() + self.data.messages();
        let indexes = messages * 16;
        self.container.as_ref().map_or(0, |c| c.finished_bytes() + waiting.iter().sum::<u64>() + indexes)
    }

    /// Appends a frame. The frame is finished when it is flushed: at the latest by the first call after
    /// [`FLUSH_INTERVAL`].
    ///
    /// # Errors
    /// The picture is too large for a record, or the disk is full or broken. After an error of the disk every call
    /// fails; the finished frames are safe in the `.part` file.
    pub fn write(&mut self, frame: &FrameRecord) -> Result<(), Error> {
        self.write_bodies(core::slice::from_ref(frame))
    }

    /// Appends a frame as [`Self::write`] does, with one record for each body. Either all of its records are finished
    /// or none.
    ///
    /// # Errors
    /// The errors are those of [`Self::write`].
    pub fn write_bodies(&mut self, records: &[FrameRecord]) -> Result<(), Error> {
        self.write_heads(&[records])
    }

    /// Appends an epoch of a rig: the records of the joint answer and of each head, as [`Self::write_bodies`] does for
    /// one camera. Either all of them are finished or none.
    ///
    /// # Errors
    /// The errors are those of [`Self::write`].
    pub fn write_heads(&mut self, heads: &[&[FrameRecord]]) -> Result<(), Error> {
        heads.iter().try_for_each(|records| self.push_bodies(records))?;
        self.waiting_since.get_or_insert_with(Instant::now);
        if self.images.len() >= BATCH_IMAGE_BYTES || self.data.len() >= BATCH_DATA_BYTES {
            return self.flush();
        }
        self.flush_if_due()
    }

    fn push_bodies(&mut self, records: &[FrameRecord]) -> Result<(), Error> {
        let several = records.len() > 1;
        let caption = |record: &FrameRecord| {
            let text = drawing::caption(&record.row);
            if several { format!("{}  {text}", record.row.body) } else { text }
        };
        let captions: Vec<String> = records.iter().map(caption).collect();
        for (i, record) in records.iter().enumerate() {
            // Only the first record has the picture and the drawing.
            self.push(record, if i == 0 { &captions } else { &[] })?;
        }
        Ok(())
    }

    fn push(&mut self, frame: &FrameRecord, captions: &[String]) -> Result<(), Error> {
        let Some(container) = &mut self.container else { return Err(Error::AfterFailure { path: self.part.clone() }) };
        let bytes = frame.image.as_ref().map_or(0, |i| i.bytes.len() as u64);
        if bytes + (BATCH_IMAGE_BYTES as u64) >= MAX_RECORD_BYTES {
            return Err(Error::TooLarge { bytes, limit: MAX_RECORD_BYTES - BATCH_IMAGE_BYTES as u64 });
        }
        let origin = Origin::find(&frame.row, &self.heads, self.camera.as_ref());
        let frame_id = origin.frame_id;
        let pen_px = drawing::pen_px(origin.camera);
        let ns = log_time_ns(frame).unwrap_or(self.last_ns);
        // The frames of Foxglove's messages belong to the transforms that hzn writes; those of ROS are the source's.
        let ros_frame_id = frame.stamp.as_ref().and_then(|stamp| stamp.frame_id.as_deref()).unwrap_or(frame_id);
        self.last_ns = ns;
        // A filter would take the time of the frame before for that of the answer.
        let ros = self.ros && frame.row.time_s.is_some();
        let sequence = frame.row.index as u32;
        let failed = |e| while_writing(&self.part, e);
        if let Some(image) = &frame.image {
            let id = origin.declare(messages::image_topic(&image.format), container).map_err(failed)?;
            self.images.push(id, sequence, ns, |buffer| messages::image(image, frame_id, ns, buffer));
        }
        let data = &mut self.data;
        let mut push = |topic: Topic, fill: &mut dyn FnMut(&mut Vec<u8>)| -> Result<(), Error> {
            let id = origin.declare(topic, container).map_err(failed)?;
            data.push(id, sequence, ns, fill);
            Ok(())
        };
        if let Some((camera, last)) = origin.camera.zip(self.last_calibration_ns.get_mut(origin.number()))
            && last.is_none_or(|last| ns.abs_diff(last) >= CALIBRATION_EVERY_NS)
        {
            *last = Some(ns);
            push(Topic::Calibration, &mut |b| messages::append(&messages::calibration(camera, frame_id, ns), b))?;
        }
        let unprocessed = matches!(frame.row.status, Status::Unreadable | Status::NoAltitude);
        if frame.image.is_some() || !frame.annotations.is_empty() || (unprocessed && !captions.is_empty()) {
            // This is written even if there is nothing to draw. Otherwise the last frame's lines would stay on this
            // frame.
            let drawing = drawing::annotations(&frame.annotations, captions, pen_px, ns);
            push(Topic::Annotations, &mut |b| messages::append(&drawing, b))?;
        }
        if let Some(axis) = frame.row.axis() {
            push(Topic::Axis, &mut |b| messages::append(&messages::axis(axis, frame_id, ns), b))?;
            if ros {
                push(Topic::AxisVector, &mut |b| ros::vector(axis, ros_frame_id, ns, b))?;
            }
        }
        if let Some(covariance) = frame.row.covariance().filter(|_| ros) {
            push(Topic::AxisCovariance, &mut |b| ros::matrix(covariance, b))?;
        }
        if let Some(attitude) = &frame.attitude {
            push(Topic::Transform, &mut |b| messages::append(&messages::transform(attitude, frame_id, ns), b))?;
        }
        for line in &frame.log {
            push(Topic::Log, &mut |b| messages::append(&messages::log(line, &frame.row.file, ns), b))?;
        }
        // The report comes last: a frame with a report is complete.
        push(Topic::Report, &mut |b| b.extend_from_slice(&messages::report(frame)))?;
        self.frames += 1;
        Ok(())
    }

    /// Finishes the waiting frames if they have waited for [`FLUSH_INTERVAL`]. It is for loops in which frames may stop
    /// coming.
    ///
    /// # Errors
    /// The errors are those of [`Self::write`].
    pub fn flush_if_due(&mut self) -> Result<(), Error> {
        match self.waiting_since {
            Some(since) if since.elapsed() >= FLUSH_INTERVAL => self.flush(),
            _ => Ok(()),
        }
    }

    /// Finishes every frame written so far.
    ///
    /// # Errors
    /// The errors are those of [`Self::write`].
    pub fn flush(&mut self) -> Result<(), Error> {
        let Some(mut container) = self.container.take() else {
            return Err(Error::AfterFailure { path: self.part.clone() });
        };
        let (images, data, durable) = (&mut self.images, &mut self.data, self.durable);
        let bytes = images.len() + data.len();
        let mut write = || -> std::io::Result<()> {
            // Pictures come first: a frame with a report is complete.
            if !images.is_empty() {
                let chunk = images.take(false)?;
                container.chunk(&chunk)?;
                images.recycle(chunk);
            }
            if !data.is_empty() {
                container.chunk(&data.take(true)?)?;
            }
            container.flush()?;
            if durable { sync(container.output().get_ref()) } else { Ok(()) }
        };
        match write() {
            Ok(()) => {
                self.waiting_since = None;
                if !durable {
                    self.early_sync.add(bytes as u64, container.output().get_ref());
                }
                self.container = Some(container);
                Ok(())
            }
            Err(e) => Err(while_writing(&self.part, e)),
        }
    }

    /// Closes the recording and renames it to its final name.
    ///
    /// # Errors
    /// The errors are those of [`Self::write`]; the `.part` file stays.
    pub fn finish(mut self) -> Result<PathBuf, Error> {
        self.flush()?;
        let Some(container) = self.container.take() else {
            return Err(Error::AfterFailure { path: self.part.clone() });
        };
        let failed = |e| while_writing(&self.part, e);
        let file = container.finish().map_err(failed)?;
        let published = self.early_sync.finish().and_then(|()| publish(file.get_ref(), &self.part, &self.path));
        published.map_err(|e| while_writing(&self.path, e))?;
        Ok(self.path.clone())
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if self.container.is_some() {
            // No caller can receive an error here; the data flushed before are safe.
            let _ = self.flush();
        }
    }
}

/// Returns the log time of a frame in nanoseconds; `None` without a time, so that the frame gets the time of the frame
/// before it. Another time than that of the source, for example from a frames.csv, replaces its stamp.
fn log_time_ns(frame: &FrameRecord) -> Option<u64> {
    let exact = frame.stamp.as_ref().filter(|stamp| stamp.is_at(frame.row.time_s)).map(|stamp| stamp.time_ns);
    exact.or_else(|| frame.row.time_s.map(messages::time_ns))
}

pub(crate) fn refuse_existing(path: &Path) -> Result<(), Error> {
    if path.exists() { Err(Error::Exists { path: path.to_path_buf() }) } else { Ok(()) }
}

/// Name of the library in the header of recordings of hzn, before its version.
pub(crate) const LIBRARY: &str = "hzn";

/// Opens an empty file for a container.
pub(crate) fn open_container(part: &Path) -> std::io::Result<Container<BufWriter<File>>> {
    let file = create_part(part)?;
    Container::try_new(BufWriter::with_capacity(1 << 16, file), &format!("{LIBRARY} {}", env!("CARGO_PKG_VERSION")))
}

/// Opens a file and writes what comes before its first message.
fn begin_recording(part: &Path, options: &Options) -> std::io::Result<Container<BufWriter<File>>> {
    let mut container = open_container(part)?;
    // The sensors of a rig are further files.
    let own = (options.heads.is_empty()).then(|| (SENSOR_TOML.to_owned(), options.sensor_toml.clone()));
    for (name, text) in own.iter().chain(&options.files) {
        container.attach(name, "application/toml", text.as_bytes())?;
    }
    let mut metadata = options.metadata.clone();
    metadata.insert("hzn_mcap_version".into(), env!("CARGO_PKG_VERSION").into());
    container.metadata("hzn", &metadata)?;
    container.flush()?;
    if options.durable {
        sync(container.output().get_ref())?;
        sync_name(part)?;
    }
    Ok(container)
}

/// Name of the attachment with the sensor.toml.
pub(crate) const SENSOR_TOML: &str = "sensor.toml";
