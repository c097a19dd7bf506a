//! What a measured half-angle says about the altitude and the limb height.

use crate::base::real::Real;
use crate::geometry::ellipsoid::EARTH_MEAN_RADIUS_M;

use super::refraction::lowered_m;
use super::{Expected, Kind};

impl<T: Real> Expected<T> {
    /// Returns the altitude in metres and its sigma from a measured cos α and its variance; `None` when the half-angle
    /// says nothing about the distance.
    pub fn altitude(&self, cos: T, var_cos: T) -> Option<(T, T)> {
        let sin = (T::one() - cos * cos).sqrt();
        if self.free || !(sin > T::zero() && cos > T::zero()) {
            return None;
        }
        let distance = (self.radius_m + self.limb_m) / sin;
        // dH/dcos = (R + d) cos/sin³; dH/dd = 1/sin for a shift of the limb at fixed radius.
        let by_cos = distance * cos / (sin * sin);
        let by_limb = T::one() / sin;
        let variance = by_cos * by_cos * var_cos + by_limb * by_limb * self.limb_sigma_m * self.limb_sigma_m;
        Some((distance - self.radius_m, variance.sqrt()))
    }

    /// Returns the limb height in metres that explains a measured cos α at the expected altitude, and its derivative by
    /// cos α: d = (R + H) sin α − R, ∂d/∂cos = −(R + H) cot α, m. If the body's limb height is set to d, the expected
    /// half-angle is the measured one. `None` when the half-angle says nothing about the distance.
    pub fn limb_height_m(&self, cos: T) -> Option<(T, T)> {
        let sin = (T::one() - cos * cos).sqrt();
        if self.free || !(sin > T::zero() && cos > T::zero()) {
            return None;
        }
        let distance = (self.radius_m + self.limb_m) / self.sin;
        // The difference of the sines is rewritten as a product, so that f32 keeps the metres.
        let apparent_m = self.limb_m + distance * (self.cos - cos) * (self.cos + cos) / (sin + self.sin);
        let by_cos_m = -distance * cos / sin;
        if !(self.raised_m > T::zero()) {
            return Some((apparent_m, by_cos_m));
        }
        // Only the air of the Earth raises a limb.
        let radius_m = T::from_f64(EARTH_MEAN_RADIUS_M);
        let (height_m, slope) = lowered_m(Kind::Earth, radius_m, apparent_m, distance - self.radius_m);
        Some((height_m, by_cos_m * slope))
    }

    /// Returns the limb height of [`Self::limb_height_m`] with its sigma from the variance of cos α and from the
    /// altitude, metres.
    pub fn measured_limb_height_m(&self, cos: T, var_cos: T) -> Option<(T, T)> {
        let (height_m, by_cos_m) = self.limb_height_m(cos)?;
        let [_, altitude_m, _, _] = self.limb_sigma_parts_m;
        Some((height_m, (by_cos_m * by_cos_m * var_cos + altitude_m * altitude_m).sqrt()))
    }
}
