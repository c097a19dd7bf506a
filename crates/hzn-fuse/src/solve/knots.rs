//! The times of the knots, and the measurements at each of them.

use crate::events::Event;

/// Measurements that are closer than this share a knot, s: the gyros carry the attitude from the knot to each of them.
/// The noise of the step from knot to knot then stays above the rounding of the equations.
pub(super) const SHARED_S: f64 = 0.05;

/// A knot.
#[derive(Debug, Clone)]
pub(super) struct Knot {
    pub(super) time_s: f64,
    pub(super) events: Vec<Event>,
}

/// Returns the knots of measurements, which are in the order of time, within a span.
pub(super) fn knots(events: &[Event], [from_s, to_s]: [f64; 2]) -> Vec<Knot> {
    let mut out: Vec<Knot> = Vec::new();
    for event in events.iter().filter(|e| (from_s..=to_s).contains(&e.time_s)) {
        match out.last_mut() {
            Some(last) if event.time_s - last.time_s < SHARED_S => last.events.push(*event),
            _ => out.push(Knot { time_s: event.time_s, events: vec![*event] }),
        }
    }
    out
}
