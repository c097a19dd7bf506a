//! The body as it appears from the camera: its size, its limb, and the uncertainty of both.

use crate::base::real::Real;
use crate::geometry::ellipsoid::{EARTH_MEAN_RADIUS_M, LimbCone, WGS84_A_M, WGS84_B_M, geodetic};
use crate::geometry::frames::{Fixed, UnitVec3};

use super::refraction::raised_m;
use super::{
    AU_KM, AltitudeReference, Config, Kind, LOWEST_ALTITUDE_M, MOON_DISTANCE_KM, MOON_RADIUS_KM, Prior, PriorError,
    SUN_RADIUS_KM, shape,
};

pub(super) fn below_limb_error<T: Real>(altitude: T, limb: T) -> PriorError {
    PriorError::BelowLimb { altitude_m: rounded_m(altitude), limb_m: rounded_m(limb) }
}

/// The body as it appears from the position of the camera; lengths in metres.
pub(super) struct ApparentBody<T> {
    /// Radius of the sphere with this half-angle at this altitude.
    pub(super) radius: T,
    pub(super) altitude: T,
    /// Sine of the half-angle.
    pub(super) sin: T,
    /// Mean height of the limb as the air in front of it raises it, the part of it that is from the air, and its first
    /// and second harmonic by azimuth from north.
    pub(super) limb: T,
    pub(super) raised_m: T,
    pub(super) harmonics: [T; 2],
    pub(super) ellipsoid: Option<LimbCone<T>>,
    /// 1-sigma of the local radius, and of the second harmonic, if the latitude is unknown.
    pub(super) unknown_m: T,
    pub(super) unknown_second_m: T,
}

impl<T: Real> ApparentBody<T> {
    pub(super) fn new(body: &Config, prior: &Prior<T>) -> Result<Self, PriorError> {
        match (body.kind, prior.position_m) {
            // Only the Earth has its ellipsoid here, because the shape of other bodies is fitted in scaled space.
            (Kind::Earth, Some(p)) => Self::ellipsoid(body, p, prior.year_part),
            _ => Self::sphere(body, prior),
        }
    }

    /// Describes the Earth as seen from an ECEF position in metres.
    fn ellipsoid(body: &Config, p: [T; 3], year_part: Option<T>) -> Result<Self, PriorError> {
        let km = T::from_f64(1000.0);
        let (mut limb, mut harmonics) = (T::from_f64(body.limb_height_km) * km, [T::zero(); 2]);
        // The limb height is added to the semi-axes instead of the true parallel surface, because the two differ by at
        // most 0.14 m for 100 km of height on the Earth.
        let raised = |limb: T| {
            let (a, b) = (T::from_f64(WGS84_A_M) + limb, T::from_f64(WGS84_B_M) + limb);
            LimbCone::try_new(p, a, b).ok_or(PriorError::Position)
        };
        let (h, latitude) = geodetic(p, T::from_f64(WGS84_A_M), T::from_f64(WGS84_B_M));
        if !(h > T::from_f64(LOWEST_ALTITUDE_M) && h.is_finite()) {
            return Err(PriorError::Position);
        }
        let mut cone = raised(limb);
        if body.is_limb_by_latitude() {
            // Below the limb height there is no cone. The limb then counts as being at the camera's own latitude
            // everywhere.
            let sin = cone.as_ref().map_or(T::one(), |cone| cone.mean_half_angle_rad().sin_cos().0);
            let [mean, first, second] = body.limb_harmonics_km(latitude, sin, year_part);
            (limb, harmonics) = (mean * km, [first * km, second * km]);
            cone = raised(limb);
        }
        // The cone is checked after this test, because "below the limb height" says more than "no cone".
        if !(h > limb) {
            return Err(below_limb_error(h, limb));
        }
        let raised_m = raised_m(body.kind, T::from_f64(EARTH_MEAN_RADIUS_M), limb, h);
        if raised_m > T::zero() {
            limb += raised_m;
            cone = raised(limb);
        }
        let cone = cone?;
        let (sin, _) = cone.mean_half_angle_rad().sin_cos();
        Ok(Self {
            // This is sin α = (R + d)/(R + H) solved for R, so that the equations of the sphere hold for the ellipsoid.
            radius: (sin * h - limb) / (T::one() - sin),
            altitude: h,
            sin,
            limb,
            raised_m,
            harmonics,
            ellipsoid: Some(cone),
            unknown_m: T::zero(),
            unknown_second_m: T::zero(),
        })
    }

    /// Describes a sphere, as seen from a position or an altitude.
    fn sphere(body: &Config, prior: &Prior<T>) -> Result<Self, PriorError> {
        let km = T::from_f64(1000.0);
        let limb = T::from_f64(body.limb_height_km) * km;
        let given = prior.altitude_m.or(body.altitude_km.map(|h| T::from_f64(h) * km));
        let r = T::from_f64(body.mean_radius_km()) * km;
        let altitude = match (prior.position_m, given, body.kind) {
            (Some([x, y, z]), _, kind) if !matches!(kind, Kind::Earth | Kind::Sun | Kind::Moon) => {
                let h = (x * x + y * y + z * z).sqrt() - r;
                if !(h > T::from_f64(LOWEST_ALTITUDE_M) && h.is_finite()) {
                    return Err(PriorError::Position);
                }
                h
            }
            // The distances of Sun and Moon are constants, because the half-angle of both is free.
            (_, _, Kind::Sun) => T::from_f64((AU_KM - SUN_RADIUS_KM) * 1e3),
            (_, _, Kind::Moon) => T::from_f64((MOON_DISTANCE_KM - MOON_RADIUS_KM) * 1e3),
            (_, Some(h), _) => h,
            (_, None, _) => return Err(PriorError::NoAltitude),
        };
        let raised_m = raised_m(body.kind, r, limb, altitude);
        let limb = limb + raised_m;
        let sin = (r + limb) / (r + altitude);
        let (mut unknown_m, mut unknown_second_m) = (T::zero(), T::zero());
        if body.is_ellipsoid() {
            // The distance is from the centre, so that all of the difference between the axes counts.
            unknown_m = shape::radius_sigma_m(sin, k_m(body));
            unknown_second_m = shape::second_harmonic_m(sin, k_m(body));
        }
        if body.kind == Kind::Earth {
            // A height above the ellipsoid rises with the local radius, so most of the error of the radius cancels.
            let counts = match body.altitude_reference {
                AltitudeReference::Ellipsoid => (altitude - limb) / (r + altitude),
                AltitudeReference::Sphere => T::one(),
            };
            unknown_m = shape::radius_sigma_m(sin, shape::EARTH_K_M) * counts;
            unknown_second_m = shape::second_harmonic_m(sin, shape::EARTH_K_M);
        }
        let harmonics = [T::zero(); 2];
        Ok(Self { radius: r, altitude, sin, limb, raised_m, harmonics, ellipsoid: None, unknown_m, unknown_second_m })
    }

    /// Returns the limb axis in the fixed frame that follows from the position; `None` without a position.
    pub(super) fn axis_fixed(&self, body: &Config, prior: &Prior<T>) -> Option<UnitVec3<Fixed, T>> {
        match (&self.ellipsoid, prior.position_m, body.kind) {
            (Some(cone), ..) => Some(cone.axis),
            (None, Some(p), kind) if !matches!(kind, Kind::Earth | Kind::Sun | Kind::Moon) => {
                UnitVec3::try_new(p.map(|x| -x))
            }
            _ => None,
        }
    }
}

/// Returns ⅔ of the difference between the largest and the smallest semi-axis of an ellipsoid, metres.
fn k_m(body: &Config) -> f64 {
    body.figure_km().map_or(0.0, |[a, b, c]| (a.max(b).max(c) - a.min(b).min(c)) * 2e3 / 3.0)
}

/// Rounds a length to the nearest metre, for messages.
pub(super) fn rounded_m<T: Real>(m: T) -> i32 {
    (m + T::from_f64(0.5)).floor().to_i32()
}
