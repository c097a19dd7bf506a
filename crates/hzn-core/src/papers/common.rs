//! Settings that the presets of published systems have in common.

use crate::config::Config;
use crate::model::body;
use crate::stages::covariance;

/// Sets the noise model and limb height that the published systems' presets have always had: given values, for
/// comparison.
pub(super) fn set_given_noise(config: &mut Config) {
    config.body.limb = body::Limb::Height;
    config.body.limb_height_km = 10.0;
    config.body.limb_height_sigma_km = 2.0;
    [config.body.clipped_height_km, config.body.clipped_sigma_km] = [0.0; 2];
    config.covariance = covariance::Config::given(1.0, 300.0);
    config.consensus.noise_sigma = 0.0;
}

/// Leaves only the gates that every fit must pass, and raises the work budget: some of these methods examine every
/// pixel and every point.
pub(super) fn disable_gates(config: &mut Config) {
    config.limits.max_work = Some(200_000_000);
    // The published systems look only once.
    config.retry.levels.clear();
    config.retry.frame_px = 0;
    config.gates.min_arc_px = Some(0.0);
    config.gates.max_rms_px = 1e6;
    config.gates.max_half_angle_sigma = 1e6;
    config.gates.max_sigma_deg = 180.0;
    config.gates.min_support = 0.0;
    config.gates.max_lit_sky = 1.0;
    config.gates.trust_every_shape();
}
