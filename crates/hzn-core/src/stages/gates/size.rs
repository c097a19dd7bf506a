//! Limits that depend on the size of the body and of the picture.

use super::config::Config;
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::model::body::Expected;
use crate::stages::covariance::Fused;

/// Smallest part of the Sun's limb in view that edge points must cover. The Sun is a whole disc; a gibbous Moon shows
/// less.
const WHOLE_SUPPORT: f64 = 0.7;
/// Smallest and largest half-angle of a Sun, as multiples of its true one. The Sun never looks smaller than it is, and
/// it blooms.
const SUN_SIZE: [f64; 2] = [0.9, 12.0];
/// Smallest and largest half-angle of a Moon, as multiples of its mean one. The saturated part of the Moon is smaller
/// than the Moon, and the Moon is sometimes nearer than on average.
const MOON_SIZE: [f64; 2] = [0.5, 1.1];
/// Largest blooming by which a Moon may exceed its size, in pixels.
const MOON_BLOOM_PX: f64 = 10.0;

/// Returns the diameter of the body's disc, 2 α f, in pixels.
pub(super) fn disc_px<T: Real>(expected: &Expected<T>, camera: &Camera<T>) -> T {
    let (fx, fy) = camera.focal_px();
    expected.half_angle_rad() * (fx + fy)
}

/// Returns the part of a limb that counts as limb at most. For a position with a known Sun, the points within 75° of
/// the Sun's azimuth count ([`Expected::is_lit`]), 150° of 360°.
pub(super) fn lit_share<T: Real>(expected: &Expected<T>) -> f64 {
    if expected.target().is_some() && expected.sun.is_some() {
        return 150.0 / 360.0;
    }
    1.0
}

/// Returns the sine of the half-angle from which the number of points of a small disc follows: the expected one. For a
/// position without a known distance it is the fitted one.
pub(super) fn sin_for_points<T: Real>(fused: &Fused<T>, expected: &Expected<T>) -> T {
    if expected.target().is_some() {
        return (T::one() - fused.c * fused.c).max(T::ZERO).sqrt();
    }
    expected.sin
}

/// Returns the smallest part of the limb in view that edge points must cover; 0 means no minimum for any body.
pub(super) fn min_support<T>(config: &Config, expected: &Expected<T>) -> f64 {
    let whole = config.min_support > 0.0 && !expected.phases;
    if whole { config.min_support.max(WHOLE_SUPPORT) } else { config.min_support }
}

/// Returns whether a body with a free half-angle can appear with the half-angle of cosine `c`. Other bodies always
/// pass, because another gate compares them with the expected half-angle.
pub(super) fn is_possible_size<T: Real>(c: &T, expected: &Expected<T>, camera: &Camera<T>) -> bool {
    let sin = (T::one() - *c * *c).max(T::ZERO).sqrt();
    let (fx, fy) = camera.focal_px();
    let px = T::one() / fx.min(fy);
    let times = |n: f64| expected.sin * T::from_f64(n);
    let (least, most) = if expected.blooms() {
        // The lower limit is reduced by one pixel, the error of the measurement, but never below half of its value.
        let [least, most] = SUN_SIZE;
        ((times(least) - px).max(times(least * 0.5)), times(most))
    } else {
        let [least, most] = MOON_SIZE;
        (times(least), times(most) + px * T::from_f64(MOON_BLOOM_PX))
    };
    !expected.free || (sin >= least && sin <= most.min(T::one()) && *c > T::ZERO)
}

/// Returns one `part`-th of the circumference of the body's disc in pixels, at least 8. A small body needs no more
/// points.
pub(crate) fn small_disc_points<T: Real>(sin: T, camera: &Camera<T>, part: i32) -> u16 {
    let (fx, fy) = camera.focal_px();
    let around = T::from_f64(core::f64::consts::PI) * (fx + fy) * sin;
    (around / T::from_i32(part)).to_i32().clamp(8, i32::from(u16::MAX)) as u16
}

/// A picture is small if its shorter side is below this length, in pixels. Its edges have fewer points than the
/// defaults require.
const SMALL_PICTURE: u16 = 80;

/// Returns one `part`-th of the shorter side of a small picture in pixels, at least 8. In a thermal array of 24 rows, a
/// limb has no more points. Other pictures have no limit.
pub(crate) fn small_picture_points<T: Real>(camera: &Camera<T>, part: u16) -> u16 {
    let side = camera.width().min(camera.height());
    if side < SMALL_PICTURE { (side / part.max(1)).max(8) } else { u16::MAX }
}

pub(super) fn min_arc<T: Real>(c: &T, camera: &Camera<T>, config: &Config) -> T {
    if let Some(arc) = config.min_arc_px {
        return T::from_f64(arc);
    }
    let (w, h) = (T::from_i32(i32::from(camera.width())), T::from_i32(i32::from(camera.height())));
    let (fx, fy) = camera.focal_px();
    let sin = (T::one() - *c * *c).max(T::ZERO).sqrt();
    let circumference = T::from_f64(core::f64::consts::PI) * (fx + fy) * sin;
    ((w * w + h * h).sqrt() * T::from_f64(0.1)).min(circumference * T::from_f64(0.33))
}
