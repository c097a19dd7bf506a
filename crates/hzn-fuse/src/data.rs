//! A flight with its data in the order of time.

use hzn_nav::frames::{Cam, Rotation, Vehicle};
use hzn_nav::options::{CameraOptions, Options, StartSigmas};

use crate::events::Event;
use crate::input::{Inputs, Sample};
use crate::quantised;
use crate::settings::Settings;

/// A flight with its data in order.
#[derive(Clone, Copy)]
pub(crate) struct Flight<'a> {
    pub(crate) inputs: &'a Inputs,
    /// Names of the cameras.
    pub(crate) names: &'a [String],
    pub(crate) mounts: &'a [Rotation<Cam, Vehicle>],
    pub(crate) samples: &'a [Sample],
    pub(crate) events: &'a [Event],
}

impl Flight<'_> {
    /// Returns the options of all cameras.
    pub(crate) fn cameras(&self, settings: &Settings) -> Vec<CameraOptions> {
        let recordings = self.inputs.recordings.iter().zip(self.mounts);
        recordings.map(|(r, mount)| settings.camera_options(&r.name, *mount, r.bodies().len())).collect()
    }

    /// Returns the options of the filter. The noise of the gyros has that of their steps.
    pub(crate) fn options(&self, settings: &Settings, start: StartSigmas) -> Options {
        let limb_sigma_km = self.inputs.recordings.iter().filter_map(|r| r.limb_sigma_km).reduce(f64::max);
        let mut options = settings.options(limb_sigma_km, start);
        let [_, rest] = &mut options.imu.gyro_noise;
        *rest = rest.hypot(quantised::gyro_noise(self.samples));
        options
    }
}
