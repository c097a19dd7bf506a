//! Samples and measurements in the order of time.

use hzn_nav::strapdown::Imu;

use crate::error::Error;
use crate::input::{Inputs, Sample};
use crate::results::Counts;
use crate::standing;

/// A measurement, by its place in the inputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Event {
    /// Time by the clock of the inertial unit, s.
    pub(crate) time_s: f64,
    pub(crate) source: Source,
}

/// The source of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// A direction: the number of the recording, and its place there.
    Camera(usize, usize),
    /// A fix of the receiver.
    Gnss(usize),
    /// An attitude of the star tracker.
    Attitude(usize),
}

/// Returns the samples whose numbers are finite and whose times rise, and counts the others. Samples of a channel that
/// stands still are marked as saturated.
pub(crate) fn clean(samples: &[Sample], max_step_s: f64, counts: &mut Counts, notes: &mut Vec<String>) -> Vec<Sample> {
    let mut out: Vec<Sample> = Vec::with_capacity(samples.len());
    counts.samples = samples.len();
    for sample in samples {
        if !sample.imu.is_finite() {
            counts.samples_not_finite += 1;
            continue;
        }
        if let Some(last) = out.last() {
            let dt = sample.imu.time_s - last.imu.time_s;
            if !(dt > 0.0) {
                *(if dt == 0.0 { &mut counts.samples_duplicate } else { &mut counts.samples_out_of_order }) += 1;
                continue;
            }
            counts.gaps += usize::from(dt > max_step_s);
        }
        counts.saturated += usize::from(sample.saturated);
        out.push(*sample);
    }
    standing::mark(&mut out, max_step_s, counts, notes);
    out
}

/// Returns all measurements in the order of time.
pub(crate) fn events(
    inputs: &Inputs,
    [from_s, to_s]: [f64; 2],
    counts: &mut Counts,
    notes: &mut Vec<String>,
) -> Result<Vec<Event>, Error> {
    let mut all: Vec<Event> = Vec::new();
    let mut add = |name: &str, events: Vec<Event>, notes: &mut Vec<String>| {
        let (total, times) = (events.len(), events.iter().map(|e| e.time_s).filter(|t| t.is_finite()));
        let (first, last) =
            times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b): (f64, f64), t| (a.min(t), b.max(t)));
        counts.add_unusable(name, "the time is not finite", events.iter().filter(|e| !e.time_s.is_finite()).count());
        let inside: Vec<Event> = events.into_iter().filter(|e| (from_s..=to_s).contains(&e.time_s)).collect();
        counts.outside += total - inside.len();
        if inside.is_empty() && total > 0 {
            return Err(Error::unusable(format!(
                "{name}: its times {first:.3} to {last:.3} s lie outside those of the inertial unit, {from_s:.3} to \
                 {to_s:.3} s. If the clock has another epoch, give the difference: --clock {name}=SECONDS (it is added)"
            )));
        }
        if inside.len() < total {
            notes.push(format!(
                "{} of {total} measurements of {name} lie outside the time of the inertial unit and are not used",
                total - inside.len()
            ));
        }
        all.extend(inside);
        Ok(())
    };
    for (number, one) in inputs.recordings.iter().enumerate() {
        let event = |(i, seen): (usize, &crate::input::Seen)| Event {
            time_s: seen.time_s + one.clock_offset_s,
            source: Source::Camera(number, i),
        };
        add(&one.name, one.seen.iter().enumerate().map(event).collect(), notes)?;
    }
    let gnss = inputs.gnss.iter().enumerate();
    add("gnss", gnss.map(|(i, fix)| Event { time_s: fix.time_s, source: Source::Gnss(i) }).collect(), notes)?;
    let attitudes = inputs.attitudes.iter().enumerate();
    let attitudes = attitudes.map(|(i, a)| Event { time_s: a.time_s, source: Source::Attitude(i) });
    add("attitude", attitudes.collect(), notes)?;
    for one in &inputs.recordings {
        counts.add_unusable(&one.name, "the row has no time", one.without_time);
        counts.add_unusable(&one.name, "the direction from the vehicle to this body is not known", one.other_bodies);
        counts.add_unusable(&one.name, "a number of the axis, the position or a covariance is missing", one.incomplete);
        counts.add_unusable(&one.name, "an earlier row has the same body and time", one.duplicate);
        if let Some((count, first)) = &one.impossible {
            counts.add_unusable(&one.name, "no answer has such numbers", *count);
            notes.push(format!("{}: {count} rows are left out, because no answer has such numbers: {first}", one.name));
        }
    }
    all.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    Ok(all)
}

/// Returns the sample at a time between two samples.
pub(crate) fn mix(from: &Imu, to: &Imu, time_s: f64) -> Imu {
    let part = (time_s - from.time_s) / (to.time_s - from.time_s);
    Imu {
        time_s,
        gyro_rad_s: from.gyro_rad_s + (to.gyro_rad_s - from.gyro_rad_s) * part,
        accel_m_s2: from.accel_m_s2 + (to.accel_m_s2 - from.accel_m_s2) * part,
    }
}
