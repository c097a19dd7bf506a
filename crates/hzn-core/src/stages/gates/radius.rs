//! Gate of HORACE: the radius of the circle is that of a limb at some altitude (Barf 2014, (2.31) to (2.36)).

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::body::Expected;
use crate::model::verdict::Verdict;

/// Refuses a circle that is too small or too large.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let (config, (fx, fy)) = (case.config, case.camera.focal_px());
    let Some(limits_km) = config.altitude_limits_km.filter(|_| cfg!(feature = "horace")) else { return Ok(()) };
    let margin = Margin {
        part: T::from_f64(config.radius_margin),
        focal_lengths: T::from_f64(2.0 * config.radius_margin_px) / (fx + fy),
    };
    refuse_if(!is_wide_enough(case.fit.c, case.expected, limits_km.map(T::from_f64), &margin), Verdict::Radius)
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
