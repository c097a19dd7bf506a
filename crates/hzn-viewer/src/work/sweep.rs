//! The whole sequence with the parameters as they are, on all cores, with progress and a way to stop: for the plots, or
//! into a new file.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_core::Config;
use hzn_mcap::Row;
use hzn_run::engine::{self, End, Finished, Plan, Sink};
use hzn_run::sink::{self, Existing};

use super::Wake;
use super::walk::Walk;
use crate::model::Sequence;

/// What is to be done.
pub struct Task {
    /// All frames.
    pub sequence: Sequence,
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
        /// It was stopped: there is no file.
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
        let (total, writes) = (task.sequence.len(), task.output.is_some());
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
    /// Stops it and waits until what it had begun is removed, but not for ever.
    pub fn abandon(&self) {
        self.stop();
        let until = Instant::now() + Duration::from_secs(3);
        while let Ok(event) = self.events.recv_deadline(until) {
            if !matches!(event, Event::Frame { .. }) {
                break;
            }
        }
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
    let Task { sequence, config, changes, sensor_toml, flight, output } = task;
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
        last: Vec::new(),
    };
    let mut source = Walk::new(sequence)?;
    let mut file = match &output {
        Some(path) => {
            let opened = sink::open(Some(path), Existing::Replace, &config, &sensor_toml);
            Some(opened.map_err(|e| e.to_string())?.0)
        }
        None => None,
    };
    let mut seen = |frame: &Finished| {
        let rows = sink::rows(frame, &config);
        let _ = send.send(Event::Frame { index: frame.index as usize, changes, rows });
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
