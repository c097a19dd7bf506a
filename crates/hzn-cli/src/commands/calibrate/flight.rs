//! Runs the pictures of a flight for a calibration.

use std::path::PathBuf;

use hzn_calib::noise::{self, WeightedPoints};
use hzn_core::{Prior, Solution};
use hzn_files::{FrameData, Frames, Sensor};
use hzn_run::engine::{self, End, Finished, Plan, Sink, Turns};
use hzn_run::open::{self, Opened, Request, SensorChoice};
use hzn_run::source::{Source, ending};

use crate::commands::run::cores;
use crate::exit::{Stop, usage};
use crate::progress::Progress;
use crate::setup::{self, InputArgs, SensorArgs, stop_flag};

/// Refuses outputs of another kind.
pub(super) fn check_endings(output: &[PathBuf]) -> Result<(), Stop> {
    for path in output {
        match ending(path).as_str() {
            "toml" | "html" => {}
            _ => return Err(usage(format!("{}: a sensor ends in .toml, a report in .html", path.display()))),
        }
    }
    Ok(())
}

/// A sink that stores nothing; only the measurements of the pictures are kept.
struct NoSink;

impl Sink for NoSink {
    fn write(&mut self, _: &mut Finished) -> Result<(), hzn_run::Error> {
        Ok(())
    }
    fn flush(&mut self) -> Result<(), hzn_run::Error> {
        Ok(())
    }
}

/// Returns the sensor with a very wide prior of the limb height.
pub(super) fn with_wide_limb(sensor: &Sensor) -> Result<Sensor, Stop> {
    let Some(config) = noise::config_for_calibration(&sensor.config) else {
        return Err(usage("the sensor looks only for Sun and Moon, which have no limb height to measure"));
    };
    Ok(Sensor { config, ..sensor.clone() })
}

/// Opens the pictures with a sensor that was read before and then changed. Its warnings were printed then.
pub(super) fn reopen(inputs: &[PathBuf], input: &InputArgs, flight: bool, sensor: Sensor) -> Result<Opened, Stop> {
    let none = SensorArgs { sensor: None, altitude_km: None, flight };
    let sensor = SensorChoice::Ready(Box::new(sensor));
    let opened = open::open(&Request { sensor, ..setup::request(inputs, &none, input)? })?;
    opened.check_altitude()?;
    Ok(opened)
}

/// Returns the plan of the run.
pub(super) fn plan(input: &InputArgs, flight: bool, jobs: Option<u16>, frames: Option<Frames>, sensor: Sensor) -> Plan {
    let threads = if sensor.config.tracks() { 1 } else { jobs.map_or_else(cores, usize::from) };
    Plan {
        config: sensor.config,
        flight,
        threads,
        frames,
        fps: input.fps,
        trace: false,
        keep_traces: true,
        keep_picture: false,
        overlay: None,
        masks: None,
        last: Vec::new(),
        turns: Turns::default(),
    }
}

/// An answer of the pipeline with its edge points.
pub(super) struct Answered<'a> {
    /// Name of the picture.
    pub(super) name: &'a str,
    /// Number of the body, from 0.
    pub(super) which: usize,
    /// Edge points of the answer with their weights.
    pub(super) points: WeightedPoints,
    /// The prior of the picture, without defaults of the sensor.
    pub(super) prior: Prior<f64>,
    /// The row of the picture in frames.csv.
    pub(super) data: Option<&'a FrameData>,
    /// The answer.
    pub(super) solution: &'a Solution<f64>,
}

/// Processes the flight and measures each answer: one for a body and picture. Returns `None` if the run was
/// interrupted.
pub(super) fn measure_answers<T>(
    plan: &Plan,
    source: &mut dyn Source,
    progress: &mut Progress,
    mut measure: impl FnMut(Answered<'_>) -> Option<T>,
) -> Result<Option<Vec<T>>, Stop> {
    let mut measured = Vec::new();
    let mut seen = |frame: &Finished| {
        progress.count(frame.outcomes.iter().map(engine::BodyOutcome::status));
        measured.extend((0..frame.outcomes.len()).filter_map(|which| measure(answer(frame, which)?)));
    };
    let end = engine::run(plan, source, 0, &stop_flag(), &mut NoSink, &mut seen)?;
    progress.finish();
    Ok((end == End::Complete).then_some(measured))
}

/// Returns the answer of a picture for one body, from 0; `None` without one.
fn answer(frame: &Finished, which: usize) -> Option<Answered<'_>> {
    let report = frame.outcomes.get(which)?.report.as_ref().ok()?;
    let solution = report.solution.as_ref()?;
    let edges = frame.traces.as_ref()?.each.get(which)?.edges();
    let edge = edges.iter().find(|e| e.candidate == solution.candidate)?;
    Some(Answered {
        name: &frame.name,
        which,
        points: edge.points.iter().copied().zip(edge.weights.iter().copied()).collect(),
        data: frame.data.as_ref(),
        prior: frame.data.as_ref().map_or_else(Prior::default, |d| d.to_prior(None)),
        solution,
    })
}
