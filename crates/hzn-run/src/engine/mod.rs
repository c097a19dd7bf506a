//! The run over a sequence: it uses all cores, returns results in order, and has a bounded number of pictures in
//! memory.
//!
//! ```text
//!   source ──► jobs ──► N threads (decode, process, draw) ──► results ──► put in order ──► sink
//!      ▲                                                                       │
//!      └───────────────────────── tickets (a fixed number) ◄───────────────────┘
//! ```
//!
//! The source is read only while a ticket is free. A ticket comes back when its picture is written. Therefore memory
//! does not grow with the sequence, even if one picture or the disk is slow.

mod sensor;
pub mod trace;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{RecvTimeoutError, bounded};
use hzn_calib::{FrameData, Frames};
use hzn_core::body::PriorError;
use hzn_core::camera::Camera;
use hzn_core::status::Status;
use hzn_core::{Config, Report};

pub use sensor::{Answered, AnySensor, Processed, prepare};
pub use trace::{Trace, Traces, Watch};

use crate::source::{Item, Source};

/// The settings of a run, for every picture.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The sensor.
    pub config: Config,
    /// Use single precision and 2048 points, as on the flight computer.
    pub flight: bool,
    /// Number of threads.
    pub threads: usize,
    /// The content of frames.csv; it replaces the priors from the source itself.
    pub frames: Option<Frames>,
    /// Frames a second, for pictures without any other time.
    pub fps: f64,
    /// Collect what is to be drawn over the picture.
    pub trace: bool,
    /// Return the traces: everything that the pipeline showed of its work.
    pub keep_traces: bool,
    /// Hand the picture to the sink.
    pub keep_picture: bool,
    /// Draw an overlay of every picture into this folder.
    pub overlay: Option<std::path::PathBuf>,
    /// The last answers of the run that this one continues, one for each body.
    pub last: Vec<Option<Answered>>,
}

/// A processed picture.
#[derive(Debug)]
pub struct Finished {
    /// Place in the sequence, from 0.
    pub index: u64,
    /// Name of the picture.
    pub name: String,
    /// Time in seconds, if it is known.
    pub time_s: Option<f64>,
    /// The prior of this picture from frames.csv or from a recording of ours.
    pub data: Option<FrameData>,
    /// The outcome of each body, in the order of the configuration.
    pub found: Vec<BodyOutcome>,
    /// The drawing over the picture, if the plan asks for it.
    pub drawing: hzn_mcap::Annotations,
    /// The picture as PNG or JPEG, if the plan asks for it.
    pub picture: Option<Vec<u8>>,
    /// What the pipeline showed of its work, one record for each body, if the plan asks for it.
    pub traces: Option<Traces>,
    /// Advice, if nothing was found and the picture itself suggests a reason.
    pub tip: Option<String>,
    /// Number of pictures in the file; only the first was processed.
    pub pages: u32,
}

/// The outcome of one body in one picture.
#[derive(Debug)]
pub struct BodyOutcome {
    /// The report, or the reason why the picture was not processed.
    pub report: Result<Report<f64>, Unprocessed>,
    /// Time of processing, without decoding.
    pub elapsed: Duration,
}

impl BodyOutcome {
    /// Returns the status.
    pub fn status(&self) -> Status {
        self.report.as_ref().map_or_else(|e| e.status, |r| r.status)
    }

    /// Returns whether the body was not searched for because the camera is not above the limb height.
    pub fn is_below_limb(&self) -> bool {
        self.report.as_ref().is_err_and(|e| e.below_limb)
    }
}

impl From<Processed> for BodyOutcome {
    fn from(p: Processed) -> Self {
        Self { report: p.report.map_err(Into::into), elapsed: p.elapsed }
    }
}

/// The reason why a picture was not processed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unprocessed {
    /// [`Status::Unreadable`] or [`Status::NoAltitude`].
    pub status: Status,
    /// The reason in words.
    pub why: String,
    /// True if the camera is not above the limb height.
    pub below_limb: bool,
}

impl From<PriorError> for Unprocessed {
    fn from(error: PriorError) -> Self {
        let status = match error {
            PriorError::NoAltitude | PriorError::BelowLimb { .. } => Status::NoAltitude,
            _ => Status::Unreadable,
        };
        Self { status, why: error.to_string(), below_limb: matches!(error, PriorError::BelowLimb { .. }) }
    }
}

impl Finished {
    /// Returns the reason why the picture could not be read, if it could not.
    pub fn unreadable(&self) -> Option<&str> {
        let errors = self.found.iter().filter_map(|f| f.report.as_ref().err());
        errors.filter(|e| e.status == Status::Unreadable).map(|e| e.why.as_str()).next()
    }
    /// Returns the result of a picture that could not be read. It is unreadable for every body.
    fn not_read(self, plan: &Plan, why: &str) -> Self {
        let why = Unprocessed { status: Status::Unreadable, why: why.to_owned(), below_limb: false };
        let none = || BodyOutcome { report: Err(why.clone()), elapsed: Duration::ZERO };
        Self { found: plan.config.each_body().iter().map(|_| none()).collect(), ..self }
    }
}

/// The destination of processed pictures, in order.
pub trait Sink {
    /// Takes one picture; its pixels and its drawing may be moved out of it.
    ///
    /// # Errors
    /// It could not be written; the run ends.
    fn write(&mut self, frame: &mut Finished) -> anyhow::Result<()>;
    /// Makes everything written so far safe against a crash of this program.
    ///
    /// # Errors
    /// As for `write`.
    fn flush(&mut self) -> anyhow::Result<()>;
}

/// The way in which a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// All pictures are processed.
    Complete,
    /// The run was asked to stop; every picture that was begun is written.
    Interrupted,
}

/// Longest time until written data are flushed.
const FLUSH_EVERY: Duration = Duration::from_millis(200);

struct Job {
    index: u64,
    item: Item,
}

/// Runs the sequence from picture `first` on. The caller has skipped the pictures before it.
///
/// # Errors
/// The sink cannot be written, the source breaks off, or an overlay cannot be written. Pictures that were written
/// before remain.
pub fn run(
    plan: &Plan,
    source: &mut dyn Source,
    first: u64,
    stop: &AtomicBool,
    sink: &mut dyn Sink,
    seen: &mut dyn FnMut(&Finished),
) -> anyhow::Result<End> {
    let threads = plan.threads.max(1);
    let window = 2 * threads + 2;
    let (job_in, job_out) = bounded::<Job>(window);
    let (result_in, result_out) = bounded::<anyhow::Result<Finished>>(window);
    let (ticket_in, ticket_out) = bounded::<()>(window);
    for _ in 0..window {
        ticket_in.send(())?;
    }
    // Set when the writer stops with an error, so that the source ends too.
    let give_up = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let stopped = || stop.load(Ordering::Relaxed) || give_up.load(Ordering::Relaxed);
        let source_end = scope.spawn(move || {
            for index in first.. {
                if ticket_out.recv().is_err() || stopped() {
                    break;
                }
                match source.next() {
                    None => break,
                    Some(Err(e)) => return Err(e),
                    Some(Ok(item)) => {
                        if job_in.send(Job { index, item }).is_err() {
                            break;
                        }
                    }
                }
            }
            Ok(())
        });
        for _ in 0..threads {
            let (jobs, results) = (job_out.clone(), result_in.clone());
            scope.spawn(move || {
                let mut sensor = match AnySensor::new(&plan.config, plan.flight) {
                    Ok(sensor) => sensor,
                    Err(e) => return drop(results.send(Err(e.into()))),
                };
                sensor.remember(&plan.last);
                for job in jobs {
                    if results.send(process(plan, &mut sensor, job)).is_err() {
                        return;
                    }
                }
            });
        }
        drop((job_out, result_in));
        let written = write_in_order(first, &result_out, &ticket_in, sink, seen);
        if written.is_err() {
            give_up.store(true, Ordering::Relaxed);
        }
        // With the channels closed, the threads end.
        drop((result_out, ticket_in));
        let read = source_end.join().unwrap_or_else(|_| Err(anyhow::anyhow!("reading the input failed")));
        written?;
        if stop.load(Ordering::Relaxed) {
            // After Ctrl-C an error of the source is expected, because the same signal can reach it.
            return Ok(End::Interrupted);
        }
        read?;
        Ok(End::Complete)
    })
}

/// Processes a single picture, as [`run`] would.
///
/// # Errors
/// An overlay cannot be written.
pub fn one(plan: &Plan, sensor: &mut AnySensor, index: u64, item: Item) -> anyhow::Result<Finished> {
    process(plan, sensor, Job { index, item })
}

fn write_in_order(
    first: u64,
    results: &crossbeam_channel::Receiver<anyhow::Result<Finished>>,
    tickets: &crossbeam_channel::Sender<()>,
    sink: &mut dyn Sink,
    seen: &mut dyn FnMut(&Finished),
) -> anyhow::Result<()> {
    let mut next = first;
    let mut waiting = BTreeMap::new();
    let mut flush_at: Option<Instant> = None;
    loop {
        let received = match flush_at {
            Some(at) => results.recv_deadline(at),
            None => results.recv().map_err(|_| RecvTimeoutError::Disconnected),
        };
        match received {
            Ok(result) => {
                let frame = result.inspect_err(|_| {
                    // Data written so far must survive the error.
                    let _ = sink.flush();
                })?;
                waiting.insert(frame.index, frame);
                while let Some(mut frame) = waiting.remove(&next) {
                    sink.write(&mut frame)?;
                    seen(&frame);
                    next += 1;
                    flush_at.get_or_insert_with(|| Instant::now() + FLUSH_EVERY);
                    // The source may have ended already; it then needs no ticket.
                    let _ = tickets.try_send(());
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return sink.flush(),
        }
        if flush_at.is_some_and(|at| Instant::now() >= at) {
            sink.flush()?;
            flush_at = None;
        }
    }
}

/// Decodes and processes one picture.
fn process(plan: &Plan, sensor: &mut AnySensor, job: Job) -> anyhow::Result<Finished> {
    let Job { index, mut item } = job;
    let time = item.time_source(plan.frames.as_ref());
    let data = item.known(plan.frames.as_ref());
    let decoded = item.payload.decode(Some(&plan.config));
    let exif = || decoded.as_ref().ok().and_then(|(p, _)| p.exif_time_s);
    let time_s = time.time_s(data.as_ref(), exif, index, plan.fps);
    let mut finished = Finished {
        index,
        name: item.name,
        time_s,
        data,
        found: Vec::new(),
        drawing: hzn_mcap::Annotations::default(),
        picture: None,
        traces: None,
        tip: None,
        pages: decoded.as_ref().map_or(1, |(p, _)| p.pages),
    };
    let (picture, original) = match decoded {
        Ok(decoded) => decoded,
        Err(why) => return Ok(finished.not_read(plan, &why)),
    };
    let traces =
        (plan.trace || plan.keep_traces || plan.overlay.is_some()).then(|| Traces::new(plan.config.each_body().len()));
    let view = match picture.view(plan.config.input.channel) {
        Ok(view) => view,
        Err(why) => return Ok(finished.not_read(plan, &format!("{why} (input.channel in sensor.toml)"))),
    };
    let data = finished.data.as_ref();
    sensor.set_time(finished.time_s);
    finished.found = sensor.process(&view, data, traces.as_ref()).into_iter().map(BodyOutcome::from).collect();
    if finished.found.iter().all(|f| f.report.as_ref().is_ok_and(|r| r.status != Status::Ok)) {
        finished.tip = picture.unused_bits();
    }
    if let Some(traces) = traces.as_ref().filter(|_| plan.trace || plan.overlay.is_some()) {
        // The drawing is made here, because in the single writing thread it would delay all other threads. The camera
        // includes the rate of rotation, so that the drawing fits each row of a rolling shutter.
        let camera = sensor.camera().turning(data.and_then(|d| d.rate_rad_s));
        let drawing = draw(&finished.found, traces, &camera);
        if let Some(folder) = &plan.overlay {
            let title = statuses(&finished.found, plan);
            let image = crate::overlay::draw_annotations(picture.to_rgb(), &drawing, &title);
            crate::overlay::save(&image, &folder.join(crate::overlay::file_name(&finished.name)))?;
        }
        finished.drawing = drawing;
    }
    finished.traces = traces.filter(|_| plan.keep_traces);
    if plan.keep_picture {
        finished.picture = match original {
            Some(bytes) => Some(bytes),
            None => Some(picture.to_png().map_err(|e| anyhow::anyhow!("{}: {e}", finished.name))?),
        };
    }
    Ok(finished)
}

/// Returns the drawing over the picture for all of its bodies.
fn draw(found: &[BodyOutcome], traces: &Traces, camera: &Camera<f64>) -> hzn_mcap::Annotations {
    let mut drawing = hzn_mcap::Annotations::default();
    for (found, trace) in found.iter().zip(&traces.each) {
        let solution = found.report.as_ref().ok().and_then(|r| r.solution.as_ref());
        drawing.add(crate::sink::annotations(trace, solution, camera));
    }
    drawing
}

/// Returns the statuses of the bodies in words.
fn statuses(found: &[BodyOutcome], plan: &Plan) -> String {
    match found {
        [one] => one.status().name().to_owned(),
        several => {
            let bodies = plan.config.each_body().iter().map(|b| b.kind.name());
            let each: Vec<String> = bodies.zip(several).map(|(body, f)| format!("{body} {}", f.status())).collect();
            each.join(", ")
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use hzn_core::camera;
    use hzn_core::image::Layout;

    use super::*;
    use crate::source::{Payload, Picture, TimeSource, picture::Samples};

    /// A source that counts the pictures that were handed out but not yet written.
    struct Counted<'a> {
        left: u64,
        abroad: &'a AtomicU64,
        most: &'a AtomicU64,
    }

    impl Source for Counted<'_> {
        fn next(&mut self) -> Option<anyhow::Result<Item>> {
            self.left = self.left.checked_sub(1)?;
            let abroad = self.abroad.fetch_add(1, Ordering::SeqCst) + 1;
            self.most.fetch_max(abroad, Ordering::SeqCst);
            let layout = Layout::packed(32, 24, 1, 8);
            let picture = Picture::new(Samples::Bytes(vec![7; 32 * 24]), layout);
            Some(Ok(Item {
                name: self.left.to_string(),
                time: TimeSource::Count,
                data: None,
                payload: Payload::Decoded(picture),
            }))
        }
        fn total(&self) -> Option<u64> {
            None
        }
        fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
            Box::new(std::iter::empty())
        }
        fn folder(&self) -> std::path::PathBuf {
            Default::default()
        }
    }

    struct Slow<'a>(&'a AtomicU64);

    impl Sink for Slow<'_> {
        fn write(&mut self, _frame: &mut Finished) -> anyhow::Result<()> {
            std::thread::sleep(Duration::from_millis(1));
            self.0.fetch_sub(1, Ordering::SeqCst);
            Ok(())
        }
        fn flush(&mut self) -> anyhow::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_slow_disk_does_not_fill_the_memory() {
        let mut config = Config::new(camera::Config::ideal(camera::Model::Pinhole, 32, 24, 30.0));
        config.body.altitude_km = Some(400.0);
        let plan = Plan {
            config,
            flight: true,
            threads: 3,
            frames: None,
            fps: 1.0,
            trace: false,
            keep_traces: false,
            keep_picture: false,
            overlay: None,
            last: Vec::new(),
        };
        let (abroad, most) = (AtomicU64::new(0), AtomicU64::new(0));
        let mut source = Counted { left: 200, abroad: &abroad, most: &most };
        let mut written = 0;
        let stop = AtomicBool::new(false);
        let end = run(&plan, &mut source, 0, &stop, &mut Slow(&abroad), &mut |_| written += 1).unwrap();
        assert_eq!((end, written, abroad.into_inner()), (End::Complete, 200, 0));
        let most = most.into_inner();
        assert!((3..=2 * 3 + 3).contains(&most), "{most} frames at once");
    }
}
