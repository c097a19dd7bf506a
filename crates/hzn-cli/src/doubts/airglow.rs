//! Counts answers that airglow could give at night, where nothing says that it is day.

use hzn_core::body::{self, Kind};
use hzn_core::{Config, Solution};
use hzn_files::FrameData;
use hzn_run::engine::Finished;
use hzn_run::explain;

use crate::tell;

/// Heights of the peak of the airglow: its layer stands at 85 km or higher, and a camera below 105 km may be in it.
const LOWEST_KM: f64 = 85.0;
const HIGHEST_KM: f64 = 105.0;

/// Counts such answers.
#[derive(Default)]
pub(crate) struct Airglow {
    answers: u64,
}

impl Airglow {
    pub(crate) fn count(&mut self, frame: &Finished, config: &Config) {
        if frame.data.as_ref().is_some_and(says_day_or_night) {
            return;
        }
        for (outcome, body) in frame.outcomes.iter().zip(config.each_body()) {
            let solution = outcome.report.as_ref().ok().and_then(|report| report.solution.as_ref());
            let sigmas = config.gates.max_half_angle_sigma;
            self.answers += u64::from(solution.is_some_and(|found| is_possible(body, found, sigmas)));
        }
    }

    /// Returns what is missing, and what it prevents.
    fn describe(&self) -> Option<String> {
        (self.answers > 0).then(|| {
            format!(
                "the arc of {} is too short to tell the limb from the airglow of a night, which stands {LOWEST_KM} km \
                 above the ground or higher, and frames.csv does not say that it is day. The columns utc and x_km, \
                 y_km, z_km, or sun_x, sun_y, sun_z, refuse pictures of the night",
                explain::counted(self.answers, "answer")
            )
        })
    }

    /// Tells it once. Pictures of the day are right, so that this is no warning.
    pub(crate) fn tell(&self) {
        if let Some(what) = self.describe() {
            tell::line(format_args!("note: {what}"));
        }
    }
}

/// Returns whether the gates `night` or `sun` know where the Sun is.
fn says_day_or_night(data: &FrameData) -> bool {
    data.sun_camera.is_some() || data.utc_s.is_some() && data.position_km.is_some()
}

/// Returns whether the gate `half-angle` would also pass the same answer about a limb at the height of the airglow.
fn is_possible(body: &body::Config, found: &Solution<f64>, sigmas: f64) -> bool {
    let is_earth = matches!(body.kind, Kind::Earth | Kind::EarthSphere);
    let Some((altitude_m, sigma_m)) = found.altitude_m.filter(|_| is_earth && body.is_seen_in_sunlight()) else {
        return false;
    };
    // A limb that is higher by dh has the same half-angle from an altitude that is lower by dh / sin half-angle.
    let sigma_km = sigma_m * found.half_angle_rad.sin() * 1e-3;
    !found.is_airglow
        && altitude_m * 1e-3 + sigmas * sigma_m * 1e-3 > HIGHEST_KM
        && sigmas * sigma_km > LOWEST_KM - body.limb_height_km
}
