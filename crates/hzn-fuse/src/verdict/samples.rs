//! The times of the inertial unit.

use crate::finding::{Cause, Finding, Level, Source};
use crate::input::{Inputs, Sample};

/// Units of time that a log may have instead of seconds.
const UNITS: [(f64, &str); 3] = [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")];
/// Intervals of usual inertial units, s: 10 kHz to 1 Hz.
const USUAL_S: [f64; 2] = [1e-4, 1.0];

/// Least part of the unit's time that other inputs share if its times are in seconds as theirs are. In another unit
/// its time is a thousand times as long.
const SHARED: f64 = 0.05;

/// Finds intervals that are no intervals of an inertial unit: more than half of them count as gaps, so that the filter
/// has no sample for most of the time.
pub(super) fn test(samples: &[Sample], inputs: &Inputs, max_step_s: f64) -> Option<Finding> {
    let mut steps_s: Vec<f64> = samples.windows(2).map(step_s).collect();
    steps_s.sort_by(f64::total_cmp);
    let median_s = *steps_s.get(steps_s.len() / 2)?;
    if median_s <= max_step_s {
        return None;
    }
    let usual = |unit: f64| (USUAL_S[0]..=USUAL_S[1]).contains(&(median_s / unit));
    let unit = UNITS.iter().find(|(unit, _)| usual(*unit));
    let guess = match unit {
        _ if is_time_shared(samples, inputs) => format!(
            "its times agree with those of the other inputs, so samples are missing, or the unit is that slow. If its \
             samples are means over their intervals, set max_step_s under [imu] in fuse.toml ({max_step_s} now) above \
             {median_s:.3}"
        ),
        Some((_, name)) => format!("are its times in {name}? time_s is in seconds"),
        None => "are samples missing, or is max_step_s under [imu] in fuse.toml too small?".to_owned(),
    };
    Some(Finding {
        level: Level::Contradicts,
        cause: Cause::SampleTimes,
        source: Source::Imu,
        what: format!(
            "the samples of the inertial unit are {median_s:.3} s apart (median), so most of them count as gaps: \
             {guess}"
        ),
    })
}

/// Returns whether the other inputs have their times in a good part of the unit's time.
fn is_time_shared(samples: &[Sample], inputs: &Inputs) -> bool {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return false };
    let directions = inputs.recordings.iter().flat_map(|r| r.seen.iter().map(|seen| seen.time_s + r.clock_offset_s));
    let others = directions.chain(inputs.gnss.iter().map(|fix| fix.time_s));
    let others = others.chain(inputs.attitudes.iter().map(|a| a.time_s));
    let inside = others.filter(|t| (first.imu.time_s..=last.imu.time_s).contains(t));
    let [from_s, to_s] = inside.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t| [a.min(t), b.max(t)]);
    to_s - from_s > SHARED * (last.imu.time_s - first.imu.time_s)
}

fn step_s(pair: &[Sample]) -> f64 {
    match pair {
        [a, b] => b.imu.time_s - a.imu.time_s,
        _ => 0.0,
    }
}
