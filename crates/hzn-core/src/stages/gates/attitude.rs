//! Attitude gates: compare the axis with a prior attitude and with the last answer.

use super::config::Config;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::model::body::Expected;
use crate::model::verdict::Verdict;

/// Returns `Attitude` if the axis is farther from the axis that the prior attitude and the position predict than both
/// sigmas allow. Returns `Rate` if the axis is farther from the last answer than the vehicle can have turned. Otherwise
/// returns `Passed`.
pub(super) fn verdict<T: Real>(e: &V3<T>, sigma_max_rad: T, expected: &Expected<T>, config: &Config) -> Verdict {
    let off = |other: &V3<T>| UnitVec3::<Cam, T>::assume_unit(*e).angle_rad(&UnitVec3::assume_unit(*other));
    let within = |limit: T, sigma: T| (sigma * sigma + sigma_max_rad * sigma_max_rad).sqrt() * limit;
    let sigmas = T::from_f64(config.max_attitude_sigma);
    if let Some((axis, sigma)) = &expected.predicted
        && config.max_attitude_sigma > 0.0
        && !(off(axis) <= within(sigmas, *sigma))
    {
        return Verdict::Attitude;
    }
    if let (Some(rate), Some(last)) = (config.max_rate_deg_s, &expected.last) {
        let turned = T::from_f64(rate.to_radians()) * last.age_s.abs();
        if !(off(last.axis.v()) <= turned + within(T::from_f64(LAST_SIGMAS), last.sigma_rad)) {
            return Verdict::Rate;
        }
    }
    Verdict::Passed
}

/// Allowed distance between two answers in sigmas, in addition to the turn. `gates.max_rate_deg_s` limits the turn
/// itself.
const LAST_SIGMAS: f64 = 4.0;
