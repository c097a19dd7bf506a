//! Runs the pictures of a flight for a calibration.

use std::path::PathBuf;

use hzn_calib::noise;
use hzn_files::{Frames, Sensor};
pub(super) use hzn_run::engine::Answered;
use hzn_run::engine::{self, Finished, Measured, Plan, Turns};
use hzn_run::explain::counted;
use hzn_run::open::{self, Opened, Request, SensorChoice};
use hzn_run::source::{Source, ending};

use crate::commands::run::cores;
use crate::exit::{Exit, Stop, usage};
use crate::progress::Progress;
use crate::setup::{self, InputArgs, SensorArgs, stop_flag};
use crate::tell;

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

/// The pictures that could not be read, with the reasons.
#[derive(Debug, Default)]
pub(super) struct Unread(Vec<String>);

/// Most of them that are named.
const MAX_NAMED: usize = 5;

impl Unread {
    /// Says which pictures could not be read.
    pub(super) fn tell(&self) {
        let Some(more) = self.0.len().checked_sub(1) else { return };
        let named: Vec<&str> = self.0.iter().take(MAX_NAMED).map(String::as_str).collect();
        let end = if more >= MAX_NAMED { ", ..." } else { "" };
        tell::warning(format_args!(
            "{} could not be read and {}: {}{end}",
            counted(self.0.len() as u64, "picture"),
            if more == 0 { "does not count" } else { "do not count" },
            named.join(", ")
        ));
    }

    /// Returns the exit of a command that ends so: a result without these pictures is no full one.
    pub(super) fn exit(&self, exit: Exit) -> Exit {
        if self.0.is_empty() || exit != Exit::Done { exit } else { Exit::SomeUnreadable }
    }
}

/// Processes the flight and measures each answer: one for a body and picture. Pictures that are copies of others are
/// left out. Returns `None` if the run was interrupted.
pub(super) fn measure_answers<T>(
    plan: &Plan,
    source: &mut dyn Source,
    progress: &mut Progress,
    measure: impl FnMut(Answered<'_>) -> Option<T>,
) -> Result<Option<(Measured<T>, Unread)>, Stop> {
    let mut unread = Unread::default();
    let seen = |frame: &Finished| {
        progress.count(frame.outcomes.iter().map(engine::BodyOutcome::status));
        unread.0.extend(frame.unreadable().map(|why| format!("{} ({why})", frame.name)));
    };
    let measured = engine::measure_answers(plan, source, &stop_flag(), seen, measure)?;
    progress.finish();
    Ok(measured.map(|measured| (measured, unread)))
}

/// Says which pictures are copies, and returns the measurements.
pub(super) fn without_copies<T>(measured: Measured<T>) -> Vec<T> {
    measured.copies_in_words().iter().for_each(tell::warning);
    measured.answers
}
