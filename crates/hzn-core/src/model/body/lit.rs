//! Whether the Sun lights the limb at a point.

use super::Expected;
use crate::base::linalg::V3;
use crate::base::real::Real;

/// Lowest elevation of the Sun that lights a limb, in degrees: the end of twilight.
pub(crate) const LOWEST_SUN_DEG: f64 = -18.0;

/// cos 75°: the part of the largest elevation of the Sun along the limb that a point needs.
const CUSP: f64 = 0.258_819_045_102_520_76;
/// Distance between terminator and limb that does not matter, pixels.
const TERMINATOR_PX: f64 = 0.05;

impl<T: Real> Expected<T> {
    /// Returns whether the Sun lights the body where the ray `s` touches it, on the cone (e, c). The result is true if
    /// the direction of the Sun is unknown. The surface normal there is (s cos α − e)/sin α.
    ///
    /// For a position, every point matters. Near the cusps, where the terminator meets the limb, the edge fades and
    /// moves; there a point does not count ([`Self::lowest_sun`]).
    pub(crate) fn is_lit(&self, s: &V3<T>, e: &V3<T>, c: T, focal_px: T) -> bool {
        let lowest = |sun: &V3<T>| self.lowest_sun(sun, e, c, focal_px);
        // The comparison is with sin α times the elevation, so that no point needs a division.
        self.sun.as_ref().is_none_or(|sun| s.dot(sun) * c - e.dot(sun) > lowest(sun))
    }

    /// Returns sin α times the lowest sine of the Sun's elevation at which a limb point counts.
    ///
    /// With the phase angle φ, the elevation at the azimuth ψ from the Sun is asin(cos ψ sin φ). Within the last pixel
    /// of a disc of the radius ρ pixels, the surface turns by √(2/ρ). A Sun that is lower than this does not light the
    /// whole pixel. A thin crescent has no higher Sun; there the points within 75° of the Sun's azimuth count. If the
    /// terminator is nearer to the limb than a part of a pixel, ρ φ²/2, the whole limb is lit.
    #[inline(always)]
    fn lowest_sun(&self, sun: &V3<T>, e: &V3<T>, c: T, focal_px: T) -> T {
        // Only a position needs this: its range follows from the size of the disc, which the moved edge at the cusps
        // would change.
        if self.target().is_some() {
            let sin = (T::one() - c * c).max(T::ZERO).sqrt();
            let along = e.dot(sun);
            let sin_phase2 = (T::one() - along * along).max(T::ZERO);
            let radius_px = focal_px * sin;
            // The sign is tested because a new Moon, with the Sun behind it, has the same small sine.
            let is_full = along < T::ZERO && radius_px * sin_phase2 < T::from_f64(2.0 * TERMINATOR_PX);
            // The floor is there so that the quotient stays finite for a disc of no size.
            let last_pixel = (T::from_f64(2.0) / radius_px.max(T::one())).sqrt();
            let lowest = sin * last_pixel.min(sin_phase2.sqrt() * T::from_f64(CUSP));
            return if is_full { -T::one() } else { lowest };
        }
        // A build without positions does not read the arguments and would warn about them.
        let _ = (sun, e, c, focal_px);
        T::ZERO
    }
}

impl<T> Expected<T> {
    /// Returns whether the limb is the outer edge of the layer of airglow.
    pub fn is_airglow(&self) -> bool {
        self.is_airglow
    }
}

impl<T: Real> Expected<T> {
    /// Returns whether the light of the ground may rise below the limb, so that the edge is not the limb: in sunlight,
    /// over a body with air, where the Sun may be below the horizon at a part of the limb. Its elevation at the point
    /// below the camera is unknown, or less than the dip. The position of a body has its own term for the light.
    pub(crate) fn may_have_low_sun(&self) -> bool {
        let has_lit_air = self.is_in_sunlight && !self.is_airglow && self.scale_height_m > T::ZERO;
        if !has_lit_air || self.target().is_some() {
            return false;
        }
        let dip = T::from_f64(core::f64::consts::FRAC_PI_2) - self.half_angle_rad();
        self.sun_elevation_rad.is_none_or(|elevation| elevation < dip)
    }

    /// Returns whether the Sun is known to light no part of the limb: it is more than dip + 18° below the horizon of
    /// the point below the camera.
    ///
    /// The limb is as far from this point as the dip of the horizon, 90° − α, along the surface. At the limb's part
    /// that is nearest to the Sun, the Sun stands higher by the dip. At 18° below the horizon there, twilight ends.
    pub(crate) fn is_night(&self) -> bool {
        let dip = T::from_f64(core::f64::consts::FRAC_PI_2) - self.half_angle_rad();
        self.sun_elevation_rad.is_some_and(|elevation| elevation + dip < T::from_f64(LOWEST_SUN_DEG.to_radians()))
    }
}
