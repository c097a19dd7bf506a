//! Presets of HORACE (Barf 2014; Barf et al. 2015).

use super::common::{disable_gates, set_given_noise};
use crate::config::Config;
use crate::config::retry::{self, Combine};
use crate::stages::{consensus, contour, edge_points, fit, gates, threshold};

/// What the two papers print differently.
pub(super) struct Printed {
    /// Lower limit of the mean brightness, of 255.
    pub(super) min_mean: f64,
    /// Lowest altitude of the radius check, h_min, kilometres.
    pub(super) lowest_km: f64,
    /// Combination of the answers of several parts.
    pub(super) combine: Combine,
}

/// The values of Barf 2014.
pub(super) const IN_2014: Printed = Printed { min_mean: 5.0, lowest_km: 20.0, combine: Combine::Median };
/// The values of Barf et al. 2015.
pub(super) const IN_2015: Printed = Printed { min_mean: 15.0, lowest_km: 0.0, combine: Combine::Mean };

/// Upper limit of the mean brightness, of 255.
const MAX_MEAN: f64 = 235.0;
/// Number of rows of the smaller copy (Barf et al. 2015, 4.2.1).
const ROWS: u16 = 400;
/// γ, the least number of horizon points (Barf 2014, (2.6)).
const LEAST_POINTS: u16 = 5;
/// Margin of the radius, in pixels of a picture of 768 rows (Barf 2014, (2.35)).
const MARGIN_PX_OF_768: f64 = 5000.0;

/// Sets the chain of HORACE: brightness gate, dynamic threshold, a smaller copy, outer borders of the whole picture, a
/// circle through the longest, the radius check, and halves of the picture if there is no answer. All values are those
/// of the papers.
pub(super) fn preset(config: &mut Config, printed: &Printed) {
    set_given_noise(config);
    config.brightness.min_mean = printed.min_mean / 255.0;
    config.brightness.max_mean = MAX_MEAN / 255.0;
    config.threshold.method = threshold::Method::Dynamic;
    config.threshold.factor = 0.75;
    // All lengths are in pixels of the copy.
    let rows = config.camera.height.min(ROWS);
    config.input.scale_to_height = (rows < config.camera.height).then_some(rows);
    config.contour.method = contour::Method::Raster;
    config.edge_points.sub_pixel = edge_points::SubPixel::None;
    config.edge_points.min_points = LEAST_POINTS;
    config.edge_points.keep_points = 0;
    config.consensus.method = consensus::Method::None;
    config.fit.method = fit::Method::Circle;
    config.fit.half_angle = fit::HalfAngle::Free;
    config.retry.method = retry::Method::Division;
    config.retry.combine = printed.combine;
    disable_gates(config);
    config.gates.min_inliers = LEAST_POINTS;
    config.gates.choice = gates::Choice::Longest;
    config.gates.altitude_limits_km = Some([printed.lowest_km, 100.0]);
    config.gates.radius_margin = 0.0;
    config.gates.radius_margin_px = MARGIN_PX_OF_768 * f64::from(rows) / 768.0;
}
