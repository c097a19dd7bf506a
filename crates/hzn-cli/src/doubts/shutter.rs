//! Chooses pictures of a rolling shutter that say whether their rates are right.

use hzn_core::Config;
use hzn_core::status::Status;
use hzn_run::engine::Finished;

use super::spread::Spread;

/// A turn that is larger than this many sigma of an answer changes it.
const MIN_SIGMAS: f64 = 3.0;

/// A picture with a rate.
#[derive(Debug, Clone, Copy)]
struct Turned {
    index: u64,
    /// The rate, rad/s.
    rate_rad_s: f64,
    /// 1-sigma of the answer, rad.
    sigma_rad: Option<f64>,
}

/// Collects pictures with a rate.
#[derive(Debug, Default)]
pub(crate) struct Shutter {
    turned: Spread<Turned>,
}

impl Shutter {
    pub(crate) fn count(&mut self, frame: &Finished) {
        let Some(report) = frame.outcomes.first().and_then(|first| first.report.as_ref().ok()) else { return };
        if !matches!(report.status, Status::Ok | Status::Rejected) {
            return;
        }
        let Some([x, y, z]) = frame.data.as_ref().and_then(|data| data.rate_rad_s) else { return };
        let sigma_rad = report.solution.as_ref().map(|solution| solution.covariance.sigma_max_rad());
        self.turned.add(Turned { index: frame.index, rate_rad_s: x.hypot(y).hypot(z), sigma_rad });
    }

    /// Returns the numbers of the pictures that turn enough while they are read out: by half of their turn, the
    /// distance of the first row from the middle one. Without an answer, nothing says how much is enough.
    pub(crate) fn pictures(&self, config: &Config) -> Vec<u64> {
        let mut sigmas: Vec<f64> = self.turned.each().filter_map(|picture| picture.sigma_rad).collect();
        sigmas.sort_by(f64::total_cmp);
        let Some(sigma_rad) = sigmas.get(sigmas.len() / 2) else { return Vec::new() };
        let half_s = 0.5 * config.camera.readout_s.abs();
        // The limit is one for the whole run: one that depends on the answer would choose pictures by their outcome.
        self.turned.choose(|p| (p.rate_rad_s * half_s > MIN_SIGMAS * sigma_rad).then_some(p.index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera;

    #[test]
    fn pictures_that_turn_enough_are_chosen() {
        let mut config = Config::new(camera::Config::ideal(camera::Model::Pinhole, 64, 48, 60.0));
        let mut shutter = Shutter::default();
        for index in 0..60 {
            // Every third picture turns; half of the answers are refused.
            let rate_rad_s = if index % 3 == 0 { 0.4 } else { 0.1 };
            shutter.turned.add(Turned { index, rate_rad_s, sigma_rad: (index % 2 == 0).then_some(1e-3) });
        }
        assert!(shutter.pictures(&config).is_empty(), "no rolling shutter");
        config.camera.readout_s = -0.02;
        let chosen = shutter.pictures(&config);
        assert!(chosen.len() == 20 && chosen.iter().all(|index| index % 3 == 0), "{chosen:?}");
        config.camera.readout_s = 0.01;
        assert!(shutter.pictures(&config).is_empty(), "a turn of two sigma");
    }
}
