//! The estimates that the solve begins with: those of the filter.

use hzn_nav::strapdown::Nominal;
use nalgebra::Vector3;

use super::carried::Carrier;
use super::estimates::Shared;
use super::knots::{Knot, knots};
use super::turning::Turning;
use crate::events::Event;
use crate::track::Track;

/// Returns the filter's estimates of the shared errors.
pub(super) fn shared(track: &Track) -> Shared {
    Shared {
        corrections: track.corrections,
        mounts: track.mounts.clone(),
        clocks_s: track.clocks_s.clone(),
        // The filter does not estimate them.
        lenses: vec![Vector3::zeros(); track.mounts.len()],
    }
}

/// Replaces the attitudes before a new start that shows that they are wrong: the gyros carry that of the new start
/// back.
fn repaired(track: &Track, turning: &Turning) -> Vec<Nominal> {
    let mut states = track.states.clone();
    let mut end = states.len();
    for (number, (place, are_wrong)) in track.restarts.iter().enumerate().rev() {
        let first = number.checked_sub(1).and_then(|i| track.restarts.get(i)).map_or(0, |(place, _)| *place);
        let Some(anchor) = states.get(*place).copied().filter(|_| *place < end) else { continue };
        if *are_wrong {
            for state in states.iter_mut().take(*place).skip(first) {
                state.attitude = turning.at(&anchor, &track.corrections, state.time_s).0;
            }
        }
        end = *place;
    }
    states
}

/// Returns the earliest time back from the start up to which the inertial unit measured everything.
fn earliest_s(carrier: &Carrier, begin_s: f64, max_step_s: f64) -> f64 {
    let before = carrier.samples.partition_point(|s| s.imu.time_s < begin_s);
    let mut earliest_s = begin_s;
    for sample in carrier.samples.iter().take(before).rev() {
        if sample.saturated || earliest_s - sample.imu.time_s > max_step_s {
            break;
        }
        earliest_s = sample.imu.time_s;
    }
    earliest_s
}

/// Returns the knots and their first estimates.
pub(super) fn first_estimates(
    events: &[Event],
    track: &Track,
    carrier: &Carrier,
    turning: &Turning,
    max_step_s: f64,
) -> (Vec<Knot>, Vec<Nominal>) {
    let states = repaired(track, turning);
    let Some(begin) = states.first() else { return (Vec::new(), Vec::new()) };
    let span_s = [earliest_s(carrier, begin.time_s, max_step_s), f64::INFINITY];
    let knots = knots(events, span_s);
    let mut out: Vec<Nominal> = Vec::with_capacity(knots.len());
    for knot in knots.iter().filter(|knot| knot.time_s >= begin.time_s) {
        let next = states.partition_point(|s| s.time_s <= knot.time_s + 1e-9).max(1);
        out.extend(states.get(next - 1).map(|s| Nominal { time_s: knot.time_s, ..*s }));
    }
    let mut state = *begin;
    let mut earlier: Vec<Nominal> = Vec::new();
    for knot in knots.iter().rev().filter(|knot| knot.time_s < begin.time_s) {
        state = carrier.back(&state, &track.corrections, knot.time_s);
        earlier.push(state);
    }
    earlier.reverse();
    earlier.append(&mut out);
    (knots, earlier)
}
