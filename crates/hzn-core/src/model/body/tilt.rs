//! A tilt of the limb: its height rises towards one side, which turns the axis of the fitted cone.
//!
//! A height that varies with the azimuth ψ like a cos ψ moves the edge exactly as a turn of the axis by a ∂α/∂d does,
//! whatever arc is in view. No residual shows it, so that it is known only from the physics of the limb.

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use super::{Config, Expected};
use crate::base::real::Real;

/// Change of the height of a thermal limb with latitude that is not told, km per degree.
// An infrared limb rises by 4.5 km from the equator to one pole and falls by as much to the other one: 0.05. The table
// of the band of CO₂ has an RMS of 0.04 between neighbouring latitudes, and 0.13 at most.
const TILT_KM_PER_DEG: f64 = 0.05;
/// Returns the 1σ of the tilt of a thermal limb of this half-angle in kilometres, if nothing else is known: 0.05 km for
/// each degree between the limb and the point below the camera, which is the amplitude for a height that changes by
/// 4.5 km from equator to pole. The amplitude is divided by √2, because the direction of the change may be along either
/// of the two axes.
pub fn tilt_km<T: Real>(half_angle_rad: T) -> T {
    let to_limb_deg = T::from_f64(90.0) - half_angle_rad * T::from_f64(360.0 / TAU);
    T::from_f64(TILT_KM_PER_DEG * FRAC_1_SQRT_2) * to_limb_deg.max(T::ZERO)
}

impl Config {
    /// Returns the 1σ of the tilt of the limb along each of two axes, metres. `is_placed` says whether place and season
    /// are known, so that the band says how the height changes.
    // A prior for every limb in sunlight would double the sigma of scenes whose limb has no tilt, so that it is told.
    pub(super) fn tilt_sigma_m<T: Real>(&self, is_placed: bool, half_angle_rad: T) -> T {
        let km = T::from_f64(1000.0);
        match self.limb_tilt_sigma_km {
            Some(told) => T::from_f64(told) * km,
            None if is_placed || self.limb.thermal_km().is_none() => T::ZERO,
            None => tilt_km(half_angle_rad) * km,
        }
    }
}

impl<T: Real> Expected<T> {
    /// Returns the 1σ of the axis that a tilt of the limb causes, about each of its two tangents, radians: the tilt
    /// times ∂α/∂d.
    pub(crate) fn tilt_rad(&self) -> T {
        self.tilt_sigma_m * self.cos_per_m() / self.sin.max(T::from_f64(1e-6))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::Prior;

    #[test]
    fn only_what_is_told_counts() {
        let at = |limb_tilt_sigma_km| {
            let body = Config { limb_tilt_sigma_km, altitude_km: Some(600.0), ..Config::default() };
            Expected::<f64>::new(&body, &Prior::default()).unwrap()
        };
        assert_eq!(at(None).tilt_rad(), 0.0);
        // From 600 km, 1 km of height is 0.02°.
        let told = at(Some(0.5)).tilt_rad().to_degrees();
        assert!((told - 0.0102).abs() < 5e-4, "{told}");
    }
}
