//! HORACE's gate: the radius of the circle (Barf 2014, (2.31) to (2.36)).

use super::{told, trust_every_fit};
use crate::base::real::Real;
use crate::config::Config;
use crate::config::retry;
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::model::verdict::Verdict;
use crate::stages::fit::Fit;
use crate::stages::gates;
use crate::stages::{consensus, contour, edge_points, fit, threshold};

/// HORACE: brightness gate, dynamic threshold, a smaller copy, outer borders of the whole picture, a circle through
/// each, the radius check, and halves of the picture where that gives nothing.
///
/// Its own numbers: 0.75 times the mean; the limb's radius from 100 to 20 km, give or take 5000 px of its picture of
/// 768 rows; a pixel that at most γ = 5 of its eight neighbours light is edge, for whom chooses `erode` (counted here
/// with the pixel itself, and from 0: fewer than 7). Ours: the copy's height, the brightness gate, the shortest edge.
pub(super) fn preset(config: &mut Config) {
    told(config);
    config.gate.min_mean = 0.02;
    config.gate.max_mean = 0.9;
    config.binarize.method = threshold::Method::Dynamic;
    config.binarize.factor = 0.75;
    // Lengths are in pixels of the copy.
    let rows = config.camera.height.min(HORACE_ROWS);
    config.input.scale_to_height = (rows < config.camera.height).then_some(rows);
    config.contour.method = contour::Method::Raster;
    config.contour.erode_threshold = 7;
    config.candidates.sub_pixel = edge_points::SubPixel::None;
    config.candidates.min_points = 100;
    config.candidates.keep_points = 0;
    config.reject.method = consensus::Method::None;
    config.estimate.method = fit::Method::Circle;
    config.estimate.half_angle = fit::HalfAngle::Free;
    config.recover.method = retry::Method::Division;
    trust_every_fit(config);
    config.select.altitude_limits_km = Some([20.0, 100.0]);
    config.select.radius_margin = 0.0;
    config.select.radius_margin_px = 5000.0 * f64::from(rows) / 768.0;
}

/// Rows of the copy that `horace-2015` looks at.
const HORACE_ROWS: u16 = 240;

/// `Passed`, or that the circle is too small or too large.
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

/// By how much a radius may lie beyond its limits: a part of them, and a length.
struct Margin<T> {
    part: T,
    focal_lengths: T,
}

/// Whether a circle of half-angle α, cos α = `c`, has a radius between those of the limb at the highest and the lowest
/// altitude (Barf 2014, (2.31) to (2.36)), give or take `margin`. Radii are tangents, in focal lengths; compared
/// without a division, as that at altitude 0 is infinite.
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
