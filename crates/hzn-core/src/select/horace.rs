//! HORACE's gate: the radius of the circle (Barf 2014, (2.31) to (2.36)).

use super::Config;
use crate::body::Expected;
use crate::camera::Camera;
use crate::estimate::Fit;
use crate::pipeline::Verdict;
use crate::real::Real;

/// `Passed`, or that the circle is too small or too large.
pub(super) fn verdict<T: Real>(fit: &Fit<T>, expected: &Expected<T>, camera: &Camera<T>, config: &Config) -> Verdict {
    let (fx, fy) = camera.focal_px();
    let margin =
        Margin { part: T::of(config.radius_margin), focal_lengths: T::of(2.0 * config.radius_margin_px) / (fx + fy) };
    match config.altitude_limits_km {
        Some(limits_km) if !is_wide_enough(fit.c, expected, limits_km.map(T::of), &margin) => Verdict::Radius,
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
    let (one, km) = (T::one(), T::of(1000.0));
    let sin_cos = |altitude: T| {
        let limb = expected.radius_m + expected.limb_m;
        let sin = (limb / (expected.radius_m + altitude * km)).least(one);
        (sin, (one - sin * sin).most(T::ZERO).sqrt())
    };
    let ((s1, c1), (s2, c2)) = (sin_cos(high), sin_cos(low));
    let s = (one - c * c).most(T::ZERO).sqrt();
    let (part, more) = (margin.part, margin.focal_lengths * c);
    c > T::ZERO && s * c1 >= c * s1 * (one - part) - more * c1 && s * c2 <= c * s2 * (one + part) + more * c2
}
