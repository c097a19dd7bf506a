//! The whole sequence with the parameters as they are, on all cores, with progress and a way to stop: for the plots, or
//! into a new file.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_calib::Frames;
use hzn_cli::engine::{self, End, Finished, Plan, Sink};
use hzn_cli::input::{Item, Payload, Source};
use hzn_cli::output::{self, Existing};
use hzn_core::Config;
use hzn_mcap::{Pictures, Row};

use super::Wake;
use crate::model::{Entry, Place};

/// What is to be done.
pub struct Task {
    /// Frames, in order.
    pub entries: Vec<Entry>,
    /// What was opened: a video is decoded again.
    pub inputs: Vec<PathBuf>,
    /// How pictures of a recording are read.
    pub pictures: Option<Pictures>,
    /// The configuration.
    pub config: Arc<Config>,
    /// Its version.
    pub changes: u64,
    /// The text of the sensor.toml.
    pub sensor_toml: String,
    /// As on the flight computer.
    pub flight: bool,
    /// Where results go; without it, to the plots only. A file of that name is replaced.
    pub output: Option<PathBuf>,
}

/// What a sweep tells.
#[derive(Debug)]
pub enum Event {
    /// A frame is through.
    Frame {
        /// Its place in the sequence.
        index: usize,
        /// Which version of the configuration.
        changes: u64,
        /// Its results.
        rows: Vec<Row>,
    },
    /// It ended, or was stopped.
    End {
        /// The file that was written.
        file: Option<PathBuf>,
        /// It was stopped: the file holds the frames so far.
        stopped: bool,
    },
    /// It broke off.
    Failed(String),
}

/// A sweep under way. Dropped, it stops.
pub struct Sweep {
    stop: Arc<AtomicBool>,
    events: Receiver<Event>,
    /// Frames that are through.
    pub done: usize,
    /// Frames in all.
    pub total: usize,
    /// Writes a file.
    pub writes: bool,
}

impl Sweep {
    /// Begins.
    pub fn start(task: Task, wake: Wake) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (send, events) = unbounded();
        let (total, writes) = (task.entries.len(), task.output.is_some());
        let flag = Arc::clone(&stop);
        std::thread::spawn(move || {
            let last = run(task, &flag, &send, &wake).unwrap_or_else(Event::Failed);
            let _ = send.send(last);
            wake();
        });
        Self { stop, events, done: 0, total, writes }
    }
    /// Stops after the frames that were begun.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
    /// Is it asked to stop?
    pub fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
    /// What has happened since the last call.
    pub fn events(&mut self) -> Vec<Event> {
        let events: Vec<Event> = self.events.try_iter().collect();
        self.done += events.iter().filter(|e| matches!(e, Event::Frame { .. })).count();
        events
    }
}

impl Drop for Sweep {
    fn drop(&mut self) {
        self.stop();
    }
}

fn run(task: Task, stop: &AtomicBool, send: &Sender<Event>, wake: &Wake) -> Result<Event, String> {
    let Task { entries, inputs, pictures, config, changes, sensor_toml, flight, output } = task;
    let threads = if config.tracks() { 1 } else { std::thread::available_parallelism().map_or(1, usize::from) };
    let frames = Frames::of(entries.iter().filter_map(|e| e.data.clone()).collect());
    let plan = Plan {
        config: (*config).clone(),
        flight,
        threads,
        frames: Some(frames),
        fps: 1.0,
        trace: output.is_some(),
        keep_picture: output.is_some(),
        overlay: None,
    };
    let mut file = match &output {
        Some(path) => {
            let opened = output::open(Some(path), Existing::Replace, &config, &sensor_toml);
            Some(opened.map_err(|stop| format!("{:#}", stop.error))?.0)
        }
        None => None,
    };
    let mut source = Walk::new(entries, inputs, pictures);
    let mut seen = |frame: &Finished| {
        let rows = output::rows(frame, &config);
        let _ = send.send(Event::Frame { index: frame.index as usize, changes, rows });
        wake();
    };
    let end = match &mut file {
        Some(file) => engine::run(&plan, &mut source, 0, stop, file, &mut seen),
        None => engine::run(&plan, &mut source, 0, stop, &mut Nothing, &mut seen),
    };
    let stopped = end.map_err(|e| format!("{e:#}"))? == End::Interrupted;
    if let Some(file) = file {
        file.finish().map_err(|stop| format!("{:#}", stop.error))?;
    }
    Ok(Event::End { file: output, stopped })
}

/// For results that nobody writes.
struct Nothing;
impl Sink for Nothing {
    fn write(&mut self, _: &mut Finished) -> anyhow::Result<()> {
        Ok(())
    }
    fn flush(&mut self) -> anyhow::Result<()> {
        Ok(())
    }
}

/// The frames as the window has them, as an input.
pub(super) struct Walk {
    entries: std::vec::IntoIter<Entry>,
    inputs: Vec<PathBuf>,
    pictures: Option<Pictures>,
    video: Option<Box<dyn Source>>,
}

impl Walk {
    pub(super) fn new(entries: Vec<Entry>, inputs: Vec<PathBuf>, pictures: Option<Pictures>) -> Self {
        Self { entries: entries.into_iter(), inputs, pictures, video: None }
    }
    fn payload(&mut self, place: &Place) -> anyhow::Result<Payload> {
        Ok(match place {
            Place::File(path) => Payload::File(path.clone()),
            Place::RawFile(path, raw) => Payload::RawFile(path.clone(), *raw),
            Place::Nowhere => Payload::Broken("the recording holds no picture of this frame".into()),
            Place::Recorded(place) => match &mut self.pictures {
                Some(pictures) => match pictures.read(place)?.image {
                    Ok(image) => hzn_cli::input::recorded(image),
                    Err(why) => Payload::Broken(why),
                },
                None => Payload::Broken("the recording is not open".into()),
            },
            Place::Video(_) => {
                if self.video.is_none() {
                    let opened = hzn_cli::input::open(&self.inputs, None, None);
                    self.video = Some(opened.map_err(|stop| stop.error)?);
                }
                match self.video.as_mut().and_then(|v| v.next()).transpose()? {
                    Some(item) => item.payload,
                    None => Payload::Broken("the video ends before this frame".into()),
                }
            }
        })
    }
}

impl Source for Walk {
    fn next(&mut self) -> Option<anyhow::Result<Item>> {
        let Entry { name, time_s, place, .. } = self.entries.next()?;
        Some(self.payload(&place).map(|payload| Item { name, time_s: Some(time_s), payload }))
    }
    fn total(&self) -> Option<u64> {
        Some(self.entries.len() as u64)
    }
    fn sizes(&self) -> Box<dyn Iterator<Item = (String, (u32, u32))> + '_> {
        Box::new(std::iter::empty())
    }
    fn folder(&self) -> PathBuf {
        PathBuf::new()
    }
}
