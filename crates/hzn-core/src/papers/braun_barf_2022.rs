//! Preset of Braun & Barf 2022.

use super::common::{disable_gates, set_given_noise};
use crate::config::Config;
use crate::stages::{consensus, covariance, edge_points, fit, gates, threshold};

/// Sets the chain of Braun & Barf 2022 as flown on ATEK: fixed threshold, whole pixels, RANSAC on three points, the
/// direct nadir, the overbound of its covariance, and none of the gates of `hzn`. Of several edges, the one with the
/// smallest residual is the limb.
pub(super) fn preset(config: &mut Config) {
    set_given_noise(config);
    config.threshold.method = threshold::Method::Fixed;
    config.edge_points.sub_pixel = edge_points::SubPixel::None;
    config.edge_points.keep_points = 0;
    config.consensus.method = consensus::Method::Ransac;
    config.fit.method = fit::Method::Direct;
    config.fit.half_angle = fit::HalfAngle::Free;
    config.covariance.method = covariance::Method::BraunBarf;
    config.covariance.overbound = true;
    disable_gates(config);
    config.gates.limb_in_view = true;
    config.gates.choice = gates::Choice::SectionResidual;
    // The value of section 7.3, for the Earth. This limit applies to the mean and not to the sum, in focal lengths
    // squared.
    config.gates.max_section_residual = Some(0.025);
}
