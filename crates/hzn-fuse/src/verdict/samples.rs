//! The times of the inertial unit.

use crate::finding::{Cause, Finding, Level, Source};
use crate::input::Sample;

/// Units of time that a log may have instead of seconds.
const UNITS: [(f64, &str); 3] = [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")];
/// Intervals of usual inertial units, s: 10 kHz to 1 Hz.
const USUAL_S: [f64; 2] = [1e-4, 1.0];

/// Finds intervals that are no intervals of an inertial unit: more than half of them count as gaps, so that the filter
/// has no sample for most of the time.
pub(super) fn test(samples: &[Sample], max_step_s: f64) -> Option<Finding> {
    let mut steps_s: Vec<f64> = samples.windows(2).map(step_s).collect();
    steps_s.sort_by(f64::total_cmp);
    let median_s = *steps_s.get(steps_s.len() / 2)?;
    if median_s <= max_step_s {
        return None;
    }
    let usual = |unit: f64| (USUAL_S[0]..=USUAL_S[1]).contains(&(median_s / unit));
    let unit = UNITS.iter().find(|(unit, _)| usual(*unit));
    let guess = unit.map_or("are samples missing, or is max_step_s in fuse.toml too small?".to_owned(), |(_, name)| {
        format!("are its times in {name}? time_s is in seconds")
    });
    Some(Finding {
        level: Level::Contradicts,
        cause: Cause::SampleTimes,
        source: Source::Imu,
        what: format!(
            "the samples of the inertial unit are {median_s:.3e} s apart (median), so most of them count as gaps: \
             {guess}"
        ),
    })
}

fn step_s(pair: &[Sample]) -> f64 {
    match pair {
        [a, b] => b.imu.time_s - a.imu.time_s,
        _ => 0.0,
    }
}
