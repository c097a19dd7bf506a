//! Runs the pictures of a flight for a calibration.

use std::path::PathBuf;

use hzn_calib::Sensor;
use hzn_calib::noise::{self, WeightedPoints};
use hzn_core::{Prior, Solution};
use hzn_run::disk;
use hzn_run::engine::{self, End, Finished, Plan, Sink};
use hzn_run::source::{Source, ending};

use crate::commands::run::cores;
use crate::exit::{Stop, usage};
use crate::progress::Progress;
use crate::setup::{InputArgs, check_altitude, stop_flag};

/// Refuses outputs of another kind, and files that exist.
pub(super) fn check_outputs(output: &[PathBuf], force: bool) -> Result<(), Stop> {
    for path in output {
        match ending(path).as_str() {
            "toml" | "html" => {}
            _ => return Err(usage(format!("{}: a sensor ends in .toml, a report in .html", path.display()))),
        }
        disk::refuse_existing(path, force)?;
    }
    Ok(())
}

/// A sink that stores nothing; only the measurements of the pictures are kept.
struct NoSink;

impl Sink for NoSink {
    fn write(&mut self, _: &mut Finished) -> anyhow::Result<()> {
        Ok(())
    }
    fn flush(&mut self) -> anyhow::Result<()> {
        Ok(())
    }
}

/// Returns the plan of the run. Its sensor has a very wide prior of the limb height.
pub(super) fn plan(
    input: &InputArgs,
    flight: bool,
    jobs: Option<u16>,
    source: &dyn Source,
    sensor: &Sensor,
) -> Result<Plan, Stop> {
    let Some(config) = noise::config_for_calibration(&sensor.config) else {
        return Err(usage("the sensor looks only for Sun and Moon, which have no limb height to measure"));
    };
    let sensor = Sensor { config, ..sensor.clone() };
    let frames = input.frames(source, &sensor, flight)?;
    check_altitude(&sensor, source, frames.as_ref())?;
    let threads = if sensor.config.tracks() { 1 } else { jobs.map_or_else(cores, usize::from) };
    Ok(Plan {
        config: sensor.config,
        flight,
        threads,
        frames,
        fps: input.fps,
        trace: false,
        keep_traces: true,
        keep_picture: false,
        overlay: None,
        last: Vec::new(),
    })
}

/// An answer of the pipeline with its edge points.
pub(super) struct Answered<'a> {
    /// Name of the picture.
    pub(super) name: &'a str,
    /// Edge points of the answer with their weights.
    pub(super) points: WeightedPoints,
    /// The prior of the picture, without defaults of the sensor.
    pub(super) prior: Prior<f64>,
    /// The answer.
    pub(super) solution: &'a Solution<f64>,
}

/// Processes the flight and measures each picture that is answered. Returns `None` if the run was interrupted.
pub(super) fn measure_answers<T>(
    plan: &Plan,
    source: &mut dyn Source,
    progress: &mut Progress,
    mut measure: impl FnMut(Answered<'_>) -> Option<T>,
) -> Result<Option<Vec<T>>, Stop> {
    let mut measured = Vec::new();
    let mut seen = |frame: &Finished| {
        progress.count(frame.outcomes.iter().map(engine::BodyOutcome::status));
        measured.extend(answer(frame).and_then(&mut measure));
    };
    let end = engine::run(plan, source, 0, &stop_flag(), &mut NoSink, &mut seen)?;
    progress.finish();
    Ok((end == End::Complete).then_some(measured))
}

/// Returns the answer of a picture; `None` without one.
fn answer(frame: &Finished) -> Option<Answered<'_>> {
    let report = frame.outcomes.first()?.report.as_ref().ok()?;
    let solution = report.solution.as_ref()?;
    let edges = frame.traces.as_ref()?.each.first()?.edges();
    let edge = edges.iter().find(|e| e.candidate == solution.candidate)?;
    Some(Answered {
        name: &frame.name,
        points: edge.points.iter().copied().zip(edge.weights.iter().copied()).collect(),
        prior: frame.data.as_ref().map_or_else(Prior::default, |d| d.to_prior(None)),
        solution,
    })
}
