//! Processing of the whole sequence in the background, from the shown picture outwards.

use std::collections::{HashSet, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use hzn_mcap::Row;
use hzn_run::engine::AnySensor;

use super::frame_view::{FrameInput, checked_view, refused_rows};
use super::sequence_source::open_pictures;
use super::summary::summarise;
use super::trials::Trials;
use super::{Setup, Wake, engine, reader::Reader};
use crate::model::{Entry, Place, Processed, Sequence};

/// Shortest time between two calls that wake the window, so that many quick pictures do not draw it many times.
const WAKE_EVERY: Duration = Duration::from_millis(120);

/// A sensor of the background work.
#[derive(Debug, Clone)]
pub struct Slot {
    /// True for the session, false for the sensor that is compared with.
    pub is_session: bool,
    /// The sensor.
    pub setup: Setup,
}

/// The work to be done.
#[derive(Debug)]
pub struct Task {
    /// All pictures.
    pub sequence: Sequence,
    /// Sensors, each of which processes every picture.
    pub slots: Vec<Slot>,
    /// Picture to begin with.
    pub from: usize,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
    /// The pictures to process; `None` processes all.
    pub only: Option<Vec<usize>>,
}

/// An event of the background work.
#[derive(Debug)]
pub enum Event {
    /// The session's results of a picture.
    Session(usize, u64, Processed),
    /// The results of the sensor that is compared with.
    Other(usize, u64, Vec<Row>),
    /// All pictures are processed.
    End,
}

/// Work in progress. It stops when the handle is dropped.
#[derive(Debug)]
pub struct Background {
    stop: Arc<AtomicBool>,
    events: Receiver<Event>,
    /// Number of pictures that are processed.
    pub done: usize,
    /// Number of all pictures.
    pub total: usize,
}

impl Background {
    /// Starts the work. One core is left for the window if there are several.
    pub fn start(task: Task, wake: Wake) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let (send, events) = unbounded();
        let count = task.sequence.len();
        // A video is read forward only, and a sensor that follows earlier answers needs the pictures in order.
        let in_order = task.slots.iter().any(|s| s.setup.config.tracks())
            || task.sequence.entries.iter().any(|e| matches!(e.place, Place::Video(_)));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if in_order { 1 } else { cores.saturating_sub(1).max(1) };
        let from = if in_order { 0 } else { task.from };
        let mut order = outwards(from, count);
        if let Some(only) = &task.only {
            let only: HashSet<usize> = only.iter().copied().collect();
            order.retain(|i| only.contains(i));
        }
        let total = order.len();
        let shared = Arc::new(Shared {
            order: Mutex::new(order),
            task,
            stop: Arc::clone(&stop),
            woken: Mutex::new(Instant::now()),
            running: AtomicUsize::new(threads),
            wake,
        });
        for _ in 0..threads {
            let (shared, send) = (Arc::clone(&shared), send.clone());
            std::thread::spawn(move || {
                // If the recording cannot be opened, the shown picture says why.
                let _ = shared.run(&send);
                if shared.running.fetch_sub(1, Ordering::AcqRel) == 1 {
                    let _ = send.send(Event::End);
                }
                (shared.wake)();
            });
        }
        Self { stop, events, done: 0, total }
    }
    /// Returns the events since the last call.
    pub fn events(&mut self) -> Vec<Event> {
        let events: Vec<Event> = self.events.try_iter().collect();
        self.done += events.iter().filter(|e| matches!(e, Event::Session(..))).count();
        events
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Returns all indices below `count`, the nearest to `from` first.
fn outwards(from: usize, count: usize) -> VecDeque<usize> {
    let from = from.min(count.saturating_sub(1));
    let after = (from..count).map(|i| (2 * (i - from), i));
    let mut order: Vec<_> = after.chain((0..from).map(|i| (2 * (from - i) - 1, i))).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

struct Shared {
    order: Mutex<VecDeque<usize>>,
    task: Task,
    stop: Arc<AtomicBool>,
    woken: Mutex<Instant>,
    /// Number of threads that have not ended.
    running: AtomicUsize,
    wake: Wake,
}

/// A sensor of one thread.
struct Worker {
    slot: Slot,
    sensor: AnySensor,
    trials: Option<Trials>,
}

impl Shared {
    fn run(&self, send: &Sender<Event>) -> Result<(), String> {
        let Sequence { inputs, recording, entries, .. } = &self.task.sequence;
        let pictures = recording.as_deref().map(open_pictures).transpose()?;
        let mut reader = Reader::new(inputs.clone(), pictures);
        let mut workers = Vec::new();
        for slot in &self.task.slots {
            let sensor = AnySensor::new(&slot.setup.config, self.task.flight).map_err(|e| e.to_string())?;
            let trials = slot.is_session.then(|| Trials::new(&slot.setup.config, self.task.flight)).flatten();
            workers.push(Worker { slot: slot.clone(), sensor, trials });
        }
        while let Some((index, entry)) = self.next(entries) {
            let payload = reader.payload(&entry.place).map_err(|e| format!("{e:#}"));
            // The picture is decoded once for all sensors.
            let picture = payload.and_then(|p| p.decode(None)).map(|(picture, _)| Arc::new(picture));
            for worker in &mut workers {
                if send.send(worker.process(index, entry, &picture)).is_err() {
                    return Ok(());
                }
            }
            self.wake_sometimes();
        }
        Ok(())
    }

    fn next<'a>(&self, entries: &'a [Entry]) -> Option<(usize, &'a Entry)> {
        if self.stop.load(Ordering::Relaxed) {
            return None;
        }
        let index = self.order.lock().ok()?.pop_front()?;
        Some((index, entries.get(index)?))
    }

    fn wake_sometimes(&self) {
        let Ok(mut woken) = self.woken.lock() else { return };
        if woken.elapsed() >= WAKE_EVERY {
            *woken = Instant::now();
            (self.wake)();
        }
    }
}

impl Worker {
    fn process(&mut self, index: usize, entry: &Entry, picture: &super::store::Decoded) -> Event {
        let config = Arc::clone(&self.slot.setup.config);
        let processed = match picture {
            Ok(picture) => self.process_picture(index, entry, picture),
            Err(why) => Err(why.clone()),
        };
        let processed = processed.unwrap_or_else(|why| refused_rows(index, entry, &config, &why));
        let version = self.slot.setup.version;
        match self.slot.is_session {
            true => Event::Session(index, version, processed),
            false => Event::Other(index, version, processed.rows),
        }
    }

    fn process_picture(
        &mut self,
        index: usize,
        entry: &Entry,
        picture: &Arc<hzn_run::source::Picture>,
    ) -> Result<Processed, String> {
        let config = &self.slot.setup.config;
        let picture = engine::with_input(Arc::clone(picture), &config.input)?;
        let input = FrameInput::of_entry(index, entry, &picture);
        let view = checked_view(&picture, config)?;
        self.sensor.set_time(entry.time_s);
        Ok(summarise(&view, input, config, &mut self.sensor, self.trials.as_mut()))
    }
}

/// Returns true if there is a picture to process.
pub fn has_pictures(sequence: &Sequence) -> bool {
    sequence.entries.iter().any(|e| e.place != Place::Nowhere)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_pictures_come_first() {
        assert_eq!(outwards(2, 6), [2, 1, 3, 0, 4, 5].map(|i: usize| i));
        assert_eq!(outwards(0, 3), [0, 1, 2]);
        assert_eq!(outwards(9, 3), [2, 1, 0]);
        assert!(outwards(0, 0).is_empty());
    }
}
