//! The infrared Earth sensor of Wang et al. 2022.

use super::common::{disable_gates, set_given_noise};
use crate::config::Config;
use crate::stages::{consensus, contour, edge_points, fit};

/// Sets the chain of Wang et al. 2022 as flown on Tianping-2B: Zernike moments on every Sobel edge pixel, RANSAC with
/// pre-verification, an elliptic cone by total least squares, weighted from 90° off nadir on, and no gates.
///
/// Their threshold is 1°, which is 1.6 px with their lens (384×288, 92 px/rad). For another lens, set
/// `consensus.threshold_px` accordingly. Their Zernike moments are those of a blurred edge; its width is that of `hzn
/// simulate leo-infrared`, so set `edge_points.blur_px` for another lens, too.
pub(super) fn preset(config: &mut Config) {
    set_given_noise(config);
    config.contour.method = contour::Method::Sobel;
    config.edge_points.sub_pixel = edge_points::SubPixel::Zernike;
    config.edge_points.blur_px = 1.0;
    config.edge_points.keep_points = 0;
    config.consensus.method = consensus::Method::RansacPreverify;
    config.consensus.threshold_px = 1.6;
    config.consensus.max_draws = 20_000;
    config.fit.method = fit::Method::Wtls;
    config.fit.weigh_above_deg = 90.0;
    config.fit.half_angle = fit::HalfAngle::Free;
    disable_gates(config);
}
