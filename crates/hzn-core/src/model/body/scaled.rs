//! The cone that is expected in scaled space, for a body whose position is fitted.

use super::expected::Expected;
use super::position::Target;
use super::{Config, Kind, Prior, PriorError};
use crate::base::linalg::{V3, unit};
use crate::base::real::Real;

/// 1-sigma of the cosine of a half-angle of which nothing is known.
// Cosines lie between 0 and 1, so that this sigma gives the expected half-angle hardly any weight.
const UNKNOWN_COS: f64 = 1.0;

impl<T: Real> Expected<T> {
    /// Computes the expected cone in scaled space. It is exact if attitude and position give the direction of the body;
    /// without a direction, the cone is that of the mean semi-axis, and its sigma includes the difference between the
    /// axes. `smallest_rad` counts if nothing is known of the distance.
    pub(super) fn in_scaled_space(
        body: &Config,
        prior: &Prior<T>,
        target: Target<T>,
        smallest_rad: T,
    ) -> Result<Self, PriorError> {
        let km = T::from_f64(1000.0);
        let to_direction = target.predicted_m.and_then(|r| unit(&r));
        // With a direction the size is exact and has no unknown part; only without one is the mean semi-axis used.
        let along = to_direction.and_then(|u| target.size_along(&u)).map(|(sin, _)| (sin, T::ZERO));
        let size = along.or_else(|| target.size_anywhere());
        let (sin, unknown_m) = size.unwrap_or((smallest_rad.sin_cos().0, T::ZERO));
        let range_sigma = target.range.map_or(T::ZERO, |range| range.sigma_m);
        let attitude_sigma = target.attitude_sigma_rad;
        let scaled = |v: &V3<T>| unit(&(target.scaling.to * v));
        let sun = prior.sun.as_ref().and_then(|s| scaled(s.v()));
        let mut expected = Self {
            cos: (T::one() - sin * sin).max(T::EPSILON).sqrt(),
            sin,
            sigma_cos: T::from_f64(UNKNOWN_COS),
            is_curved: false,
            limb_sigma_parts_m: [target.limb_sigma_m, sin * range_sigma, unknown_m, T::ZERO],
            clipped_m: [body.clipped_height_km, body.clipped_sigma_km].map(|h| T::from_f64(h) * km),
            ellipsoid: None,
            fixed_from_camera: None,
            harmonics_cos: [T::ZERO; 2],
            unknown_harmonics_cos: [T::ZERO; 2],
            tilt_sigma_m: T::ZERO,
            weather_m: T::from_f64(body.weather_km()) * km,
            level: prior.level,
            sun: sun.filter(|_| body.is_sunlit()),
            sun_seen: sun.filter(|_| body.is_seen_in_sunlight()),
            sun_elevation_rad: prior.sun_elevation_rad.filter(|_| body.is_seen_in_sunlight()),
            predicted: to_direction.and_then(|u| scaled(&u)).map(|e| (e, attitude_sigma)),
            last: prior.last,
            rate_rad_s: prior.rate_rad_s,
            camera_temperature_c: prior.camera_temperature_c,
            scale_height_m: T::from_f64(body.scale_height_km()) * km,
            radius_m: target.unit_m - T::from_f64(body.mean_limb_height_km()) * km,
            limb_m: T::from_f64(body.mean_limb_height_km()) * km,
            raised_m: T::ZERO,
            limb_sigma_m: target.limb_sigma_m,
            free: false,
            phases: body.kind != Kind::Sun,
            is_in_sunlight: body.is_seen_in_sunlight(),
            is_airglow: false,
            which: 0,
            target: Some(target),
        };
        // Without a distance the sigma stays at its unknown value: the limb height of a body of unknown size says
        // nothing.
        if size.is_some() {
            expected.sigma_cos = expected.sigma_cos_of_parts();
            expected.set_uneven_limb(body);
            expected.tilt_sigma_m = body.tilt_sigma_m(false, expected.half_angle_rad());
            expected.is_curved = expected.bends();
        }
        Ok(expected)
    }

    /// Returns the 1-sigma of cos α from the contributions in metres: ∂cos/∂d = −tan/(R + H).
    fn sigma_cos_of_parts(&self) -> T {
        let variance = self.limb_sigma_parts_m.iter().fold(T::ZERO, |sum, s| sum + *s * *s);
        self.cos_per_m() * variance.sqrt()
    }

    /// Returns |∂cos/∂d|, 1/m.
    pub(crate) fn cos_per_m(&self) -> T {
        self.sin * self.sin / (self.cos * (self.radius_m + self.limb_m))
    }

    /// Widens the covariance by a limb height that varies with latitude, because the fit of the position does not
    /// correct it: both harmonics have at most half of the difference between the heights.
    fn set_uneven_limb(&mut self, body: &Config) {
        let heights = || body.limb_height_by_latitude_km.iter().map(|[_, height]| *height);
        let most = heights().fold(f64::MIN, |a, b| if b > a { b } else { a });
        let least = heights().fold(f64::MAX, |a, b| if b < a { b } else { a });
        if most > least {
            // Half of the difference, in metres: 1000/2.
            let amplitude = T::from_f64((most - least) * 500.0) * self.cos_per_m();
            self.unknown_harmonics_cos = [amplitude; 2];
        }
    }

    /// Returns the expected cone for a body along the scaled axis `e`. From the direction follows how large the body
    /// appears at its distance.
    pub(crate) fn seen_along(&self, e: &V3<T>) -> Self {
        let Some(target) = self.target() else { return *self };
        let Some((sin, range_sigma_m)) = target.size_along(&target.direction(e)) else { return *self };
        let cos = (T::one() - sin * sin).max(T::EPSILON).sqrt();
        let [limb, _, _, clipped] = self.limb_sigma_parts_m;
        let mut seen = Self { sin, cos, limb_sigma_parts_m: [limb, sin * range_sigma_m, T::ZERO, clipped], ..*self };
        seen.sigma_cos = seen.sigma_cos_of_parts();
        seen.is_curved = seen.bends();
        seen
    }
}
