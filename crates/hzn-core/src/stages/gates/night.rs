//! Gate: at night no part of the limb is seen in sunlight. Airglow, aurora and the lights of cities have edges, too.

use super::case::{Case, refuse_if};
use super::sun::LOWEST_SUN_DEG;
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses every limb if the Sun lights none of it: if it is more than dip + 18° below the horizon of the point below
/// the camera.
///
/// The limb is as far from this point as the dip of the horizon, 90° − α, along the surface. At the limb's part that is
/// nearest to the Sun, the Sun stands higher by the dip. At 18° below the horizon there, twilight ends.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    // With `max_unlit` at 1 no gate asks for light.
    let Some(elevation) = case.expected.sun_elevation_rad.filter(|_| case.config.max_unlit < 1.0) else {
        return Ok(());
    };
    let dip = T::from_f64(core::f64::consts::FRAC_PI_2) - case.expected.half_angle_rad();
    refuse_if(elevation + dip < T::from_f64(LOWEST_SUN_DEG.to_radians()), Verdict::Night)
}
