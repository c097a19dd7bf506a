//! A flight with its data in the order of time.

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::strapdown::Nominal;

use super::events::Event;
use crate::input::{Inputs, Sample};
use crate::results::Fused;

/// A flight with its data in order.
#[derive(Clone, Copy)]
pub(super) struct Flight<'a> {
    pub(super) inputs: &'a Inputs,
    pub(super) mounts: &'a [Rotation<Cam, Vehicle>],
    pub(super) samples: &'a [Sample],
    pub(super) events: &'a [Event],
}

impl Flight<'_> {
    /// Returns the strapdown solution from the first sample to the start, integrated back from the start with the
    /// instruments' errors as they are estimated at the end.
    pub(super) fn back(&self, fused: &Fused) -> Vec<Nominal> {
        let (Some(begin), Some(last)) = (fused.epochs.first(), fused.epochs.last()) else { return Vec::new() };
        let mut state = begin.state;
        let mut out = vec![state];
        let before = self.samples.partition_point(|s| s.imu.time_s < state.time_s);
        let mut later = None;
        for sample in self.samples.iter().take(before).rev() {
            let earlier = last.corrections.correct(&sample.imu);
            state = state.step(&later.unwrap_or(earlier), &earlier);
            later = Some(earlier);
            out.push(state);
        }
        out.reverse();
        out
    }
}
