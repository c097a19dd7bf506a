//! The sweep of one parameter: share of answered pictures, error and sigma against the value, over the sequence.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, unbounded};
use hzn_core::Config;
use hzn_core::status::Status;
use hzn_run::engine::AnySensor;

use super::Wake;
use super::frame_view::{FrameInput, checked_view};
use super::sequence_source::open_pictures;
use super::summary::summarise;
use super::{engine, reader::Reader};
use crate::model::Sequence;
use crate::model::quantity;

/// Largest number of pictures of a sweep; of a longer sequence, every n-th picture is taken.
const MOST_PICTURES: usize = 200;

/// True axes by the name of the picture.
pub type Axes = std::collections::HashMap<String, [f64; 3]>;

/// The sweep to be done.
#[derive(Debug)]
pub struct Task {
    /// All pictures.
    pub sequence: Sequence,
    /// The values with their configurations.
    pub values: Vec<(f64, Arc<Config>)>,
    /// True axes, if they are known.
    pub truth: Axes,
    /// Body whose results count.
    pub body: usize,
    /// Single precision and at most 2048 points, as `FlightHorizon` has.
    pub flight: bool,
}

/// Results of one value so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tally {
    /// Value of the parameter.
    pub value: f64,
    /// Number of pictures.
    pub pictures: usize,
    /// Number of pictures with an answer.
    pub answered: usize,
    /// Sum of the squares of 3-sigma of the answers, degrees squared.
    sigma2: f64,
    /// Sum of the squares of the errors, degrees squared, and their number.
    error2: (f64, usize),
}

impl Tally {
    fn add(&mut self, row: &hzn_mcap::Row, truth: &Axes) {
        self.pictures += 1;
        if row.status != Status::Ok {
            return;
        }
        self.answered += 1;
        self.sigma2 += row.sigma_max_deg.map_or(0.0, |s| (3.0 * s).powi(2));
        if let (Some(a), Some(b)) = (row.axis(), truth.get(&row.file)) {
            self.error2 = (self.error2.0 + quantity::angle_deg(a, *b).powi(2), self.error2.1 + 1);
        }
    }
    /// Returns the share of answered pictures, 0 to 1.
    pub fn share(&self) -> f64 {
        self.answered as f64 / self.pictures.max(1) as f64
    }
    /// Returns the root mean square of 3-sigma, in degrees.
    pub fn sigma_deg(&self) -> Option<f64> {
        (self.answered > 0).then(|| (self.sigma2 / self.answered as f64).sqrt())
    }
    /// Returns the root mean square error, in degrees.
    pub fn error_deg(&self) -> Option<f64> {
        (self.error2.1 > 0).then(|| (self.error2.0 / self.error2.1 as f64).sqrt())
    }
}

/// A sweep in progress. It stops when the handle is dropped.
#[derive(Debug)]
pub struct Study {
    stop: Arc<AtomicBool>,
    events: Receiver<(usize, Vec<Tally>)>,
    /// Number of pictures that the sweep takes.
    pub total: usize,
}

impl Study {
    /// Starts a sweep.
    pub fn start(task: Task, wake: Wake) -> Self {
        let (send, events) = unbounded();
        let stop = Arc::new(AtomicBool::new(false));
        let step = task.sequence.len().div_ceil(MOST_PICTURES).max(1);
        let total = task.sequence.len().div_ceil(step);
        let flag = Arc::clone(&stop);
        std::thread::spawn(move || {
            let report = |done: usize, tallies: &[Tally]| {
                let _ = send.send((done, tallies.to_vec()));
                wake();
                !flag.load(Ordering::Relaxed)
            };
            // A picture that cannot be read counts as one without an answer.
            let _ = run(&task, step, report);
        });
        Self { stop, events, total }
    }
    /// Returns the newest results: the number of pictures that are done, and one tally for each value.
    pub fn newest(&self) -> Option<(usize, Vec<Tally>)> {
        self.events.try_iter().last()
    }
}

impl Drop for Study {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn run(task: &Task, step: usize, report: impl Fn(usize, &[Tally]) -> bool) -> Result<(), String> {
    let Sequence { inputs, recording, entries, .. } = &task.sequence;
    let pictures = recording.as_deref().map(open_pictures).transpose()?;
    let mut reader = Reader::new(inputs.clone(), pictures);
    let mut sensors = Vec::new();
    for (value, config) in &task.values {
        let sensor = AnySensor::new(config, task.flight).map_err(|e| e.to_string())?;
        sensors.push((Tally { value: *value, ..Tally::default() }, config, sensor));
    }
    for (done, (index, entry)) in entries.iter().enumerate().step_by(step).enumerate() {
        let payload = reader.payload(&entry.place).map_err(|e| format!("{e:#}"))?;
        let decoded = payload.decode(None).map(|(picture, _)| Arc::new(picture));
        for (tally, config, sensor) in &mut sensors {
            let result = decoded.clone().and_then(|picture| {
                let picture = engine::with_input(picture, &config.input)?;
                let view = checked_view(&picture, config)?;
                sensor.set_time(entry.time_s);
                let input = FrameInput::of_entry(index, entry, &picture);
                Ok(summarise(&view, input, config, sensor, None))
            });
            match result.ok().and_then(|p| p.rows.into_iter().nth(task.body)) {
                Some(row) => tally.add(&row, &task.truth),
                None => tally.pictures += 1,
            }
        }
        let tallies: Vec<Tally> = sensors.iter().map(|(tally, ..)| *tally).collect();
        if !report(done + 1, &tallies) {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_mcap::{Row, RowMeta};

    #[test]
    fn answers_errors_and_sigmas_are_counted() {
        let meta = RowMeta { index: 0, file: "a".into(), time_s: None, body: "earth".into(), altitude_km: None };
        let refused = Row::unprocessed(&meta, Status::NoLimb, "");
        let mut ok = refused.clone();
        (ok.status, ok.sigma_max_deg) = (Status::Ok, Some(0.1));
        (ok.axis_x, ok.axis_y, ok.axis_z) = (Some(0.0), Some(0.0), Some(1.0));
        let truth = Axes::from([("a".to_owned(), [0.0, 0.01f64.sin(), 0.01f64.cos()])]);
        let mut tally = Tally::default();
        tally.add(&refused, &truth);
        assert_eq!((tally.share(), tally.sigma_deg(), tally.error_deg()), (0.0, None, None));
        tally.add(&ok, &truth);
        assert_eq!(tally.share(), 0.5);
        assert!((tally.sigma_deg().unwrap() - 0.3).abs() < 1e-12);
        assert!((tally.error_deg().unwrap() - 0.01f64.to_degrees()).abs() < 1e-9);
    }
}
