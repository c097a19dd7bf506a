//! A tilt of the limb: its height rises towards one side, which turns the axis of the fitted cone.
//!
//! A height that varies with the azimuth ψ like a cos ψ moves the edge exactly as a turn of the axis by a ∂α/∂d does,
//! whatever arc is in view. No residual shows it, so that it is known only from the physics of the limb.

use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use super::{Config, Expected, Kind, Limb};
use crate::base::real::Real;

/// Change of the height of a thermal limb with latitude that is not told, km per degree.
// An infrared limb rises by 4.5 km from the equator to one pole and falls by as much to the other one: 0.05. The table
// of the band of CO₂ has an RMS of 0.04 between neighbouring latitudes, and 0.13 at most.
const TILT_KM_PER_DEG: f64 = 0.05;
/// The same for a limb in sunlight, as a part of it.
// The density of clear air at 17 km falls by 1 to 2 km of height from the equator to a pole: in NRLMSIS 2.1 the RMS
// between latitudes 15° apart, over the months, is 0.024 km per degree, and 0.046 at most. The residuals show clouds.
const PART_IN_SUNLIGHT: f64 = 0.5;

/// Returns the 1σ of the tilt of a thermal limb of this half-angle in kilometres, if nothing else is known: 0.05 km for
/// each degree between the limb and the point below the camera, which is the amplitude for a height that changes by 4.5 km
/// from equator to pole. The amplitude is divided by √2, because the direction of the change may be along either of the
/// two axes.
pub fn tilt_km<T: Real>(half_angle_rad: T) -> T {
    let to_limb_deg = T::from_f64(90.0) - half_angle_rad * T::from_f64(360.0 / TAU);
    T::from_f64(TILT_KM_PER_DEG * FRAC_1_SQRT_2) * to_limb_deg.max(T::ZERO)
}

impl Config {
    /// Returns the 1σ of the tilt of the limb along each of two axes, metres. `is_placed` says whether place and season
    /// are known.
    pub(super) fn tilt_sigma_m<T: Real>(&self, is_placed: bool, half_angle_rad: T) -> T {
        let km = T::from_f64(1000.0);
        if let Some(told) = self.limb_tilt_sigma_km {
            return T::from_f64(told) * km;
        }
        // What the height does with latitude is told by a table; without an attitude it is an unknown harmonic.
        let is_told = !self.limb_height_by_latitude_km.is_empty() || (self.limb == Limb::Co2 && is_placed);
        let is_earth = matches!(self.kind, Kind::Earth | Kind::EarthSphere);
        if !is_earth || is_told {
            return T::ZERO;
        }
        let part = if self.is_seen_in_sunlight() { PART_IN_SUNLIGHT } else { 1.0 };
        tilt_km(half_angle_rad) * T::from_f64(part) * km
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
    fn what_is_told_takes_the_place_of_the_prior() {
        let place = [0.0, 0.0, 6_956.752e3];
        let at = |body: &Config, year_part| {
            let prior = Prior { position_m: Some(place), year_part, ..Prior::default() };
            Expected::<f64>::new(body, &prior).unwrap()
        };
        // From 600 km the limb is 23.6° away: 0.025 · 23.6/√2 = 0.42 km, and 1 km of height is 0.02°.
        let usual = at(&Config::default(), None);
        assert!((usual.tilt_sigma_m - 416.4).abs() < 2.0, "{}", usual.tilt_sigma_m);
        assert!((usual.tilt_rad().to_degrees() - 0.00853).abs() < 1e-4, "{}", usual.tilt_rad().to_degrees());
        let told = Config { limb_tilt_sigma_km: Some(2.0), ..Config::default() };
        assert_eq!(at(&told, None).tilt_sigma_m, 2000.0);
        let rows = [[-90.0, 12.0], [90.0, 21.0]].into_iter().collect();
        assert_eq!(at(&Config { limb_height_by_latitude_km: rows, ..Config::default() }, None).tilt_sigma_m, 0.0);
        let mut band = Config { limb: Limb::Co2, ..Config::default() };
        band.follow_band();
        assert_eq!(at(&band, Some(0.5)).tilt_sigma_m, 0.0);
        assert!(at(&band, None).tilt_sigma_m > 800.0);
        // Another body has a tilt only if it is told.
        let moon = |km| {
            let body = Config { kind: Kind::Moon, limb_tilt_sigma_km: km, limb_height_km: 0.0, ..Config::default() };
            Expected::<f64>::new(&body, &Prior::default()).unwrap().tilt_sigma_m
        };
        assert_eq!([moon(None), moon(Some(1.5))], [0.0, 1500.0]);
    }
}
