//! HORACE: preset, and gate on the radius of the circle (Barf 2014, (2.31) to (2.36)).

use super::common::{disable_gates, set_given_noise};
use crate::base::real::Real;
use crate::config::Config;
use crate::config::retry;
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::model::verdict::Verdict;
use crate::stages::fit::Fit;
use crate::stages::gates;
use crate::stages::{consensus, contour, edge_points, fit, threshold};

/// Sets the chain of HORACE: brightness gate, dynamic threshold, a smaller copy, outer borders of the whole picture, a
/// circle through each, the radius check, and halves of the picture if there is no answer.
///
/// HORACE's own numbers are: a threshold of 0.75 times the mean; the limb's radius for altitudes from 100 to 20 km,
/// ± 5000 px in its picture of 768 rows; γ = 5, where a pixel is edge if at most γ of its eight neighbours are lit. γ
/// applies only to `contour.method = "erode"`. There the pixel itself counts too and the limit is exclusive, so the key
/// is 7. The copy's height, the brightness gate and the shortest edge are numbers of `hzn`.
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

/// Returns `Passed`, or `Radius` if the circle is too small or too large.
pub(super) fn verdict<T: Real>(
    fit: &Fit<T>,
    expected: &Expected<T>,
    camera: &Camera<T>,
    config: &gates::Config,
) -> Verdict {
    let (fx, fy) = camera.focal_px();
    let margin = Margin {
        part: T::from_f64(config.radius_margin),
        focal_lengths: T::from_f64(2.0 * config.radius_margin_px) / (fx + fy),
    };
    match config.altitude_limits_km {
        Some(limits_km) if !is_wide_enough(fit.c, expected, limits_km.map(T::from_f64), &margin) => Verdict::Radius,
        _ => Verdict::Passed,
    }
}

/// Tolerance of the radius beyond its limits: a fraction of the limit, and a length.
struct Margin<T> {
    part: T,
    focal_lengths: T,
}

/// Returns whether a circle of half-angle α, cos α = `c`, has a radius between those of the limb at the highest and the
/// lowest altitude (Barf 2014, (2.31) to (2.36)), within `margin`. Radii are tangents of half-angles, in focal lengths.
/// They are compared without a division, because the radius at altitude 0 is infinite.
fn is_wide_enough<T: Real>(c: T, expected: &Expected<T>, [low, high]: [T; 2], margin: &Margin<T>) -> bool {
    let (one, km) = (T::one(), T::from_f64(1000.0));
    let sin_cos = |altitude: T| {
        let limb = expected.radius_m + expected.limb_m;
        let sin = (limb / (expected.radius_m + altitude * km)).min(one);
        (sin, (one - sin * sin).max(T::ZERO).sqrt())
    };
    let ((s1, c1), (s2, c2)) = (sin_cos(high), sin_cos(low));
    let s = (one - c * c).max(T::ZERO).sqrt();
    let (part, more) = (margin.part, margin.focal_lengths * c);
    c > T::ZERO && s * c1 >= c * s1 * (one - part) - more * c1 && s * c2 <= c * s2 * (one + part) + more * c2
}
