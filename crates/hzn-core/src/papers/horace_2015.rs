//! Preset of HORACE (Barf 2014).

use super::common::{disable_gates, set_given_noise};
use crate::config::Config;
use crate::config::retry;
use crate::stages::{consensus, contour, edge_points, fit, threshold};

/// Sets the chain of HORACE: brightness gate, dynamic threshold, a smaller copy, outer borders of the whole picture, a
/// circle through each, the radius check, and halves of the picture if there is no answer.
///
/// HORACE's own numbers are: a threshold of 0.75 times the mean; the limb's radius for altitudes from 100 to 20 km,
/// ± 5000 px in its picture of 768 rows. Its γ = 5 is the least number of horizon points (Barf 2014, (2.6)); `hzn` asks
/// for 100. The copy's height, the brightness gate and the shortest edge are numbers of `hzn`, too.
pub(super) fn preset(config: &mut Config) {
    set_given_noise(config);
    config.brightness.min_mean = 0.02;
    config.brightness.max_mean = 0.9;
    config.threshold.method = threshold::Method::Dynamic;
    config.threshold.factor = 0.75;
    // All lengths are in pixels of the copy.
    let rows = config.camera.height.min(HORACE_ROWS);
    config.input.scale_to_height = (rows < config.camera.height).then_some(rows);
    config.contour.method = contour::Method::Raster;
    // Only for `contour.method = "erode"`, which a user may choose instead: a pixel is edge if at most five of its
    // eight neighbours are lit. The pixel itself counts, too, and the limit is exclusive.
    config.contour.erode_threshold = 7;
    config.edge_points.sub_pixel = edge_points::SubPixel::None;
    config.edge_points.min_points = 100;
    config.edge_points.keep_points = 0;
    config.consensus.method = consensus::Method::None;
    config.fit.method = fit::Method::Circle;
    config.fit.half_angle = fit::HalfAngle::Free;
    config.retry.method = retry::Method::Division;
    disable_gates(config);
    config.gates.altitude_limits_km = Some([20.0, 100.0]);
    config.gates.radius_margin = 0.0;
    config.gates.radius_margin_px = 5000.0 * f64::from(rows) / 768.0;
}

/// Number of rows of the copy that `horace-2015` processes.
const HORACE_ROWS: u16 = 240;
