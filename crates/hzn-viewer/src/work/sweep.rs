//! Processing of the whole sequence with the current parameters, on all cores, with progress and a way to stop. The
//! results go to the plots or into a new file.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_core::Config;
use hzn_mcap::Row;
use hzn_run::engine::{self, End, Finished, Plan, Sink, Turns};
use hzn_run::sink::{self, Existing};

use super::Wake;
use super::sequence_source::SequenceSource;
use crate::model::Sequence;

/// A sweep to be done.
pub struct Task {
    /// All pictures.
    pub sequence: Sequence,
    /// The configuration.
    pub config: Arc<Config>,
    /// Version number of the configuration.
    pub version: u64,
    /// The text of the sensor.toml.
    pub sensor_toml: String,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
    /// File for the results; an existing file is replaced. Without it, the results go to the plots only.
    pub output: Option<PathBuf>,
}

/// An event of a sweep.
#[derive(Debug)]
pub enum Event {
    /// A picture was processed.
    Frame {
        /// Index of the picture in the sequence.
        index: usize,
        /// Version number of the configuration.
        version: u64,
        /// Results of the picture.
        rows: Vec<Row>,
    },
    /// The sweep ended or was stopped.
    End {
        /// The file that was written.
        file: Option<PathBuf>,
        /// True if the sweep was stopped. Then there is no file.
        stopped: bool,
    },
    /// The sweep failed, for this reason.
    Failed(String),
}

/// A sweep in progress. It stops when the handle is dropped.
pub struct Sweep {
    stop: Arc<AtomicBool>,
    events: Receiver<Event>,
    /// Number of pictures that are processed.
    pub done: usize,
    /// Number of all pictures.
    pub total: usize,
    /// The sweep writes a file.
    pub writes: bool,
}

impl Sweep {
    /// Starts a sweep.
    pub fn start(task: Task, wake: Wake) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (send, events) = unbounded();
        let (total, writes) = (task.sequence.len(), task.output.is_some());
        let flag = Arc::clone(&stop);
        std::thread::spawn(move || {
            let last = run(task, &flag, &send, &wake).unwrap_or_else(Event::Failed);
            let _ = send.send(last);
            wake();
        });
        Self { stop, events, done: 0, total, writes }
    }
    /// Stops the sweep after the pictures that were begun.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
    /// Stops the sweep and waits until its unfinished file is removed, but at most 3 s.
    pub fn abandon(&self) {
        self.stop();
        let until = Instant::now() + Duration::from_secs(3);
        while let Ok(event) = self.events.recv_deadline(until) {
            if !matches!(event, Event::Frame { .. }) {
                break;
            }
        }
    }
    /// Returns true if the sweep was asked to stop.
    pub fn is_stopping(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
    /// Returns the events since the last call.
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
    let Task { sequence, config, version, sensor_toml, flight, output } = task;
    let threads = if config.tracks() { 1 } else { std::thread::available_parallelism().map_or(1, usize::from) };
    let plan = Plan {
        config: (*config).clone(),
        flight,
        threads,
        frames: None,
        fps: 1.0,
        trace: output.is_some(),
        keep_traces: false,
        keep_picture: output.is_some(),
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    };
    let mut source = SequenceSource::new(sequence)?;
    let settings =
        sink::Settings { config: &config, sensor_toml: &sensor_toml, durable: false, ros: false, heads: &[] };
    let mut file = match &output {
        Some(path) => {
            let opened = sink::open(path, Existing::Replace, settings);
            Some(opened.map_err(|e| e.to_string())?.0)
        }
        None => None,
    };
    let mut seen = |frame: &Finished| {
        let rows = sink::rows(frame, &config);
        let _ = send.send(Event::Frame { index: frame.index as usize, version, rows });
        wake();
    };
    let end = match &mut file {
        Some(file) => engine::run(&plan, &mut source, 0, stop, file, &mut seen),
        None => engine::run(&plan, &mut source, 0, stop, &mut Nothing, &mut seen),
    };
    let stopped = end.map_err(|e| format!("{e:#}"))? == End::Interrupted;
    match file {
        Some(file) if stopped => file.discard(),
        Some(file) => file.finish().map_err(|e| e.to_string())?,
        None => {}
    }
    Ok(Event::End { file: output, stopped })
}

/// Sink for results that are not written.
struct Nothing;
impl Sink for Nothing {
    fn write(&mut self, _: &mut Finished) -> Result<(), hzn_run::Error> {
        Ok(())
    }
    fn flush(&mut self) -> Result<(), hzn_run::Error> {
        Ok(())
    }
}
