//! A flight with its data in the order of time.

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::options::{CameraOptions, Options, StartSigmas};

use super::events::Event;
use crate::input::{Inputs, Sample};
use crate::settings::Settings;

/// A flight with its data in order.
#[derive(Clone, Copy)]
pub(super) struct Flight<'a> {
    pub(super) inputs: &'a Inputs,
    pub(super) mounts: &'a [Rotation<Cam, Vehicle>],
    pub(super) samples: &'a [Sample],
    pub(super) events: &'a [Event],
}

impl Flight<'_> {
    /// Returns the options of all cameras.
    pub(super) fn cameras(&self, settings: &Settings) -> Vec<CameraOptions> {
        let recordings = self.inputs.recordings.iter().zip(self.mounts);
        recordings.map(|(r, mount)| settings.camera_options(&r.name, *mount, r.bodies().len())).collect()
    }

    /// Returns the options of the filter.
    pub(super) fn options(&self, settings: &Settings, start: StartSigmas) -> Options {
        let limb_sigma_km = self.inputs.recordings.iter().filter_map(|r| r.limb_sigma_km).reduce(f64::max);
        settings.options(limb_sigma_km, start)
    }
}
