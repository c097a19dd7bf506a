//! The cone that is expected from the prior of one picture.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::ellipsoid::LimbCone;
use crate::geometry::frames::{Cam, Fixed, Rotation, UnitVec3};

use super::apparent::{ApparentBody, below_limb_error};
use super::position::Target;
use super::{Config, Kind, LOWEST_ALTITUDE_M, Last, Night, Prior, PriorError};

/// A prior attitude with this 1-sigma or more does not correct the shape of the limb, because it is no better than an
/// unknown attitude: 30 degrees (book/theory/math.md, ellipsoid).
const USELESS_ATTITUDE_RAD: f64 = core::f64::consts::FRAC_PI_6;
/// 1-sigma of an attitude without a sigma in the prior: 5 degrees.
const ATTITUDE_SIGMA_RAD: f64 = core::f64::consts::PI / 36.0;

/// Largest plausible rate of rotation of a camera, rad/s.
const MAX_RATE_RAD_S: f64 = 1000.0;

/// The cone that is expected: the cosine of its half-angle with its sigma, and the lengths that convert a half-angle to
/// an altitude.
///
/// [`Sensor::expect`](crate::Sensor::expect) makes it from a [`Prior`].
///
/// # Example
///
/// ```
/// use hzn_core::camera::{self, Model};
/// use hzn_core::{Config, Prior, Sensor};
///
/// let config = Config::new(camera::Config::ideal(Model::Pinhole, 640, 480, 500.0));
/// let sensor = Sensor::<f64>::new(&config)?;
/// let expected = sensor.expect(&Prior { altitude_m: Some(400e3), ..Prior::default() })?;
/// // The limb at a height of 17 km, seen from 400 km: sin α = (6371 + 17)/(6371 + 400).
/// assert!((expected.half_angle_rad().sin() - 6388.0 / 6771.0).abs() < 1e-4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected<T> {
    /// cos α₀ of the best single cone.
    pub(crate) cos: T,
    /// sin α₀.
    pub(crate) sin: T,
    /// 1-sigma of cos α₀ from limb height, unknown radius and, unless the half-angle is free, altitude.
    pub(crate) sigma_cos: T,
    /// Whether cos α bends so much within a sigma that `sigma_cos` must not be fused, see [`Self::update`].
    pub(crate) is_curved: bool,
    /// Contributions to `sigma_cos` as 1-sigmas of the limb height: limb, altitude, unknown radius, clipping; metres.
    pub(crate) limb_sigma_parts_m: [T; 4],
    /// Height that clipping adds to a limb that is clipped everywhere, and its 1-sigma; metres.
    pub(crate) clipped_m: [T; 2],
    /// The limb cone of the ellipsoid in the fixed frame, when the position is known.
    pub(crate) ellipsoid: Option<LimbCone<T>>,
    /// Prior attitude, from the camera to the fixed frame.
    pub(crate) fixed_from_camera: Option<Rotation<Cam, Fixed, T>>,
    /// Difference of the limb from the mean cone: first and second harmonic of cos α by azimuth from north.
    pub(crate) harmonics_cos: [T; 2],
    /// 1-sigma amplitudes of the azimuthal harmonics of cos α that the fit cannot correct, because the azimuth of north
    /// or the position is unknown.
    pub(crate) unknown_harmonics_cos: [T; 2],
    /// 1-sigma of a tilt of the limb along each of two axes, metres.
    pub(crate) tilt_sigma_m: T,
    /// 1-sigma of the weather of a thermal band along the limb, metres; the limb height has its mean.
    pub(crate) weather_m: T,
    /// Threshold that the previous picture proposes, counts.
    pub(crate) level: Option<u16>,
    /// Direction to the Sun in the camera frame, if only the sunlit limb of the body counts as limb.
    pub(crate) sun: Option<V3<T>>,
    /// Direction to the Sun in the camera frame for the gate on unlit limbs, if the body is seen in sunlight.
    pub(crate) sun_seen: Option<V3<T>>,
    /// Elevation of the Sun at the point below the camera, if the body is seen in sunlight, radians.
    pub(crate) sun_elevation_rad: Option<T>,
    /// The axis in the camera frame that the prior attitude and position predict, and its 1-sigma in radians.
    pub(crate) predicted: Option<(V3<T>, T)>,
    /// The last answer before this picture.
    pub(crate) last: Option<Last<T>>,
    /// The camera's rate of rotation in its own axes, rad/s.
    pub(crate) rate_rad_s: Option<[T; 3]>,
    /// Temperature of the camera, °C.
    pub(crate) camera_temperature_c: Option<T>,
    /// Radius of the sphere with this half-angle at this altitude, without the limb height, metres.
    pub(crate) radius_m: T,
    /// Scale height of the air in metres; 0 if it is unknown or if there is no air.
    pub(crate) scale_height_m: T,
    /// Limb height in metres as the air in front of it raises it, the part that is from this air, and its sigma.
    pub(crate) limb_m: T,
    pub(crate) raised_m: T,
    pub(crate) limb_sigma_m: T,
    /// Whether the half-angle says nothing about the distance (Sun, Moon).
    pub(crate) free: bool,
    /// Whether the body may be seen as a crescent.
    pub(crate) phases: bool,
    /// Whether the body is seen in sunlight, so that its edge may be a terminator.
    pub(crate) is_in_sunlight: bool,
    /// Whether the limb is the outer edge of the layer of airglow.
    pub(crate) is_airglow: bool,
    /// Number of the body among those of the sensor, from 0.
    pub(crate) which: u8,
    /// The body in scaled space, if its position is fitted. The cone, its harmonics and the directions above are then
    /// those of scaled space.
    pub(crate) target: Option<Target<T>>,
}

/// Refuses impossible numbers of a prior, and returns the 1-sigma of its attitude in radians.
fn check<T: Real>(prior: &Prior<T>) -> Result<T, PriorError> {
    // The negated comparisons refuse NaN, which is neither above nor below a limit.
    if prior.altitude_m.is_some_and(|h| !(h > T::from_f64(LOWEST_ALTITUDE_M) && h.is_finite())) {
        return Err(PriorError::Altitude);
    }
    if prior.position_m.is_some_and(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(PriorError::Position);
    }
    let attitude_sigma = prior.attitude_sigma_rad.unwrap_or(T::from_f64(ATTITUDE_SIGMA_RAD));
    if !(attitude_sigma >= T::zero() && attitude_sigma.is_finite()) {
        return Err(PriorError::AttitudeSigma);
    }
    if prior.rate_rad_s.is_some_and(|rate| !rate.iter().all(|r| r.abs() <= T::from_f64(MAX_RATE_RAD_S))) {
        return Err(PriorError::Rate);
    }
    if prior.year_part.is_some_and(|part| !(part >= T::zero() && part <= T::one())) {
        return Err(PriorError::YearPart);
    }
    Ok(attitude_sigma)
}

/// Returns the second harmonic of cos α of the limb cone of an ellipsoid.
fn second_harmonic_cos<T: Real>(cone: &LimbCone<T>) -> T {
    let (east, meridian) = cone.half_angles_rad();
    (meridian.sin_cos().1 - east.sin_cos().1) * T::from_f64(0.5)
}

/// Returns the prior attitude, if it is better than an unknown one.
fn useful_attitude<T: Real>(prior: &Prior<T>, sigma_rad: T) -> Option<Rotation<Cam, Fixed, T>> {
    // An attitude with a larger error is worse than none: it would put the shape of the limb at a wrong azimuth, and
    // the covariance would call it known.
    prior.fixed_from_camera.filter(|_| sigma_rad < T::from_f64(USELESS_ATTITUDE_RAD))
}

impl<T> Expected<T> {
    /// Returns the same as [`Config::blooms`].
    pub(crate) fn blooms(&self) -> bool {
        self.free && !self.phases
    }
}

impl<T: Real> Expected<T> {
    /// Returns whether a position without a known range is fitted, so that no half-angle is expected.
    pub(crate) fn has_any_size(&self) -> bool {
        self.target().is_some_and(|target| target.range.is_none())
    }

    /// Returns the expected half-angle in radians.
    pub fn half_angle_rad(&self) -> T {
        self.sin.atan2(self.cos)
    }

    /// Returns whether the disc of the body is smaller than the diagonal of the picture, so that most of it can be
    /// seen.
    pub(crate) fn fits_into(&self, camera: &Camera<T>) -> bool {
        let (fx, fy) = camera.focal_px();
        let (w, h) = (T::from_i32(i32::from(camera.width())), T::from_i32(i32::from(camera.height())));
        let disc_px = self.half_angle_rad() * (fx + fy);
        disc_px * disc_px <= w * w + h * h
    }

    /// Returns how far the limb can be from its mean cone because the azimuth of its shape is unknown, in pixels; 0 if
    /// the disc is larger than the picture.
    // Of a limb that is larger than the picture, only a short arc is in view, and its axis absorbs most of the shape.
    pub(crate) fn uneven_px(&self, camera: &Camera<T>) -> T {
        if !self.fits_into(camera) {
            return T::ZERO;
        }
        let (fx, fy) = camera.focal_px();
        self.uneven_rad() * (fx + fy) * T::from_f64(0.5)
    }

    /// Returns the expected height of the limb and its 1-sigma, metres, without the bending of light.
    pub fn limb_height_and_sigma_m(&self) -> (T, T) {
        (self.limb_m - self.raised_m, self.limb_sigma_parts_m[0])
    }

    /// Returns the body whose position is fitted. Without the feature there is none, so the code for it is left out.
    pub(crate) fn target(&self) -> Option<&Target<T>> {
        if cfg!(feature = "position") { self.target.as_ref() } else { None }
    }

    /// Returns the cosine of the expected half-angle and its 1-sigma from altitude, limb height and unknown radius.
    pub fn cos_and_sigma(&self) -> (T, T) {
        (self.cos, self.sigma_cos)
    }

    /// Computes the expected cone of a body whose position is not fitted.
    #[cfg(test)]
    pub(crate) fn new(body: &Config, prior: &Prior<T>) -> Result<Self, PriorError> {
        Self::try_new(body, prior, None)
    }

    /// Computes the expected cone: sin α = (R + d)/(R + H), with σ_cos² = sin²α [(∂α/∂d)² σ_d² + (∂α/∂H)² σ_H²].
    ///
    /// With `smallest_rad`, the position of the body is fitted if it can be. The value is the half-angle of the
    /// smallest disc that the search must find; it counts if nothing is known of the distance.
    pub(crate) fn try_new(body: &Config, prior: &Prior<T>, smallest_rad: Option<T>) -> Result<Self, PriorError> {
        let attitude_sigma = check(prior)?;
        if cfg!(feature = "position")
            && let Some(smallest_rad) = smallest_rad
            && let Some(target) = Target::new(body, prior, useful_attitude(prior, attitude_sigma), attitude_sigma)?
        {
            return Self::in_scaled_space(body, prior, target, smallest_rad);
        }
        let expected = Self::of_limb(body, prior, attitude_sigma)?;
        if body.night == Night::Airglow && expected.is_night() {
            let of_layer = Self::of_limb(&body.with_airglow(), prior, attitude_sigma)?;
            return Ok(Self { is_airglow: true, ..of_layer });
        }
        Ok(expected)
    }

    /// Computes the expected cone of the limb, from the altitude or the position of the camera.
    // ∂cos/∂d = −sin·∂α/∂d = −tan/(R + H), ∂cos/∂H = sin tan/(R + H). A higher limb makes the cone wider. The shape of
    // the ellipsoid adds half the difference between the cosines of its two half-angles. A camera at the limb height is
    // refused, because cos α is 0 there and tan α, by which every term is scaled, would be infinite. The sigma of the
    // altitude is left out for a free half-angle, because this angle says nothing about the distance. The parts of the
    // sigma are kept apart, because clipping adds its own later and `hzn explain` prints each of them.
    fn of_limb(body: &Config, prior: &Prior<T>, attitude_sigma: T) -> Result<Self, PriorError> {
        let (km, is_placed) = (T::from_f64(1000.0), prior.is_placed());
        let seen = ApparentBody::new(body, prior)?;
        let ApparentBody { sin, limb, .. } = seen;
        let cos2 = T::one() - sin * sin;
        if !(sin > T::zero() && cos2 > T::EPSILON) {
            return Err(below_limb_error(seen.altitude, limb));
        }
        let (cos, free) = (cos2.sqrt(), body.half_angle_is_free());
        let [limb_sigma, weather_m] = body.limb_sigmas_m(is_placed, (seen.radius + limb) * cos);
        let altitude_sigma = if free { T::zero() } else { T::from_f64(body.altitude_sigma_km) * km };
        let (scale, known) = (sin / cos / (seen.radius + seen.altitude), useful_attitude(prior, attitude_sigma));
        let harmonics_cos = seen.harmonics.map(|h| -scale * h);
        let own = seen.ellipsoid.as_ref().map_or(T::zero(), second_harmonic_cos);
        // An attitude error ψ leaves k ψ of the k-th harmonic.
        let left = |k: f64| known.map_or(T::one(), |_| (attitude_sigma * T::from_f64(k)).min(T::one()));
        let uneven = |k: f64, amplitude: T| amplitude.abs() * left(k);
        let unknown_harmonics_cos =
            [uneven(1.0, harmonics_cos[0]), uneven(2.0, own + harmonics_cos[1]) + scale * seen.unknown_second_m];
        let limb_sigma_parts_m = [limb_sigma, sin * altitude_sigma, seen.unknown_m, T::zero()];
        let variance = limb_sigma_parts_m.iter().fold(T::zero(), |sum, s| sum + *s * *s);
        let predicted = prior.fixed_from_camera.zip(seen.axis_fixed(body, prior));
        let mut expected = Self {
            cos,
            sin,
            sigma_cos: scale * variance.sqrt(),
            is_curved: false,
            limb_sigma_parts_m,
            clipped_m: [body.clipped_height_km, body.clipped_sigma_km].map(|h| T::from_f64(h) * km),
            ellipsoid: seen.ellipsoid,
            fixed_from_camera: known,
            harmonics_cos,
            unknown_harmonics_cos,
            tilt_sigma_m: body.tilt_sigma_m(is_placed, sin.atan2(cos)),
            weather_m,
            level: prior.level,
            sun: prior.sun.filter(|_| body.is_sunlit()).map(|s| *s.v()),
            sun_seen: prior.sun.filter(|_| body.is_seen_in_sunlight()).map(|s| *s.v()),
            sun_elevation_rad: prior.sun_elevation_rad.filter(|_| body.is_seen_in_sunlight()),
            predicted: predicted.map(|(r, a)| (*r.inverse().apply(&a).v(), attitude_sigma)),
            last: prior.last,
            rate_rad_s: prior.rate_rad_s,
            camera_temperature_c: prior.camera_temperature_c,
            radius_m: seen.radius,
            scale_height_m: T::from_f64(body.scale_height_km()) * km,
            limb_m: limb,
            raised_m: seen.raised_m,
            limb_sigma_m: (limb_sigma * limb_sigma + seen.unknown_m * seen.unknown_m).sqrt(),
            free,
            phases: body.kind != Kind::Sun,
            is_in_sunlight: body.is_seen_in_sunlight(),
            is_airglow: false,
            which: 0,
            target: None,
        };
        expected.is_curved = expected.bends();
        Ok(expected)
    }

    /// Returns the 1-sigma of the half-angle from the limb height alone, radians: its sigma over the distance to the
    /// limb, (R + d)/tan α.
    pub(crate) fn limb_sigma_rad(&self) -> T {
        self.limb_sigma_parts_m[0] * self.sin / (self.cos.max(T::from_f64(1e-6)) * (self.radius_m + self.limb_m))
    }

    /// Returns the limb axis in the fixed frame, when the position is known.
    pub(crate) fn axis_fixed(&self) -> Option<UnitVec3<Fixed, T>> {
        if let Some(target) = self.target() {
            let (axis, _) = target.limb_cone(target.predicted_m.as_ref()?)?;
            return Some(UnitVec3::assume_unit(target.camera_from_fixed.transpose() * axis));
        }
        self.ellipsoid.as_ref().map(|c| c.axis)
    }
}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use super::*;

    #[test]
    fn a_cone_of_a_raised_limb_asks_for_its_height() {
        let frame = Prior { altitude_m: Some(400e3), ..Prior::default() };
        let at = |km: f64| {
            Expected::<f64>::new(&Config { limb_height_km: km, kind: Kind::EarthSphere, ..Config::default() }, &frame)
                .unwrap()
        };
        let (told, raised) = (at(10.0), at(25.0));
        let (height, slope) = told.limb_height_m(raised.cos).unwrap();
        assert!((height - 25e3).abs() < 1e-6, "{height}");
        let (higher, _) = told.limb_height_m(raised.cos - 1e-6).unwrap();
        assert!(((higher - height) / -1e-6 / slope - 1.0).abs() < 1e-4);
        let single = Expected::<f32>::new(
            &Config { kind: Kind::EarthSphere, ..Config::default() },
            &Prior { altitude_m: Some(400e3), ..Prior::default() },
        );
        assert!((single.unwrap().limb_height_m(raised.cos as f32).unwrap().0 - 25e3).abs() < 10.0);
    }

    #[test]
    fn a_better_attitude_leaves_less_of_the_shape_open() {
        let body = Config::default();
        let frame = Prior {
            position_m: Some([4.9e6, 0.0, 4.9e6]),
            fixed_from_camera: Rotation::assume_from_quaternion([1.0, 0.0, 0.0, 0.0]),
            ..Prior::default()
        };
        let sigma = |deg: f64| {
            let frame = Prior { attitude_sigma_rad: Some(deg.to_radians()), ..frame };
            Expected::<f64>::new(&body, &frame).unwrap().unknown_harmonics_cos[1]
        };
        let [_, none] =
            Expected::new(&body, &Prior { fixed_from_camera: None, ..frame }).unwrap().unknown_harmonics_cos;
        assert!(none > 1e-5);
        assert_eq!(sigma(0.0), 0.0);
        assert!((sigma(10.0) / none - 2.0 * 10f64.to_radians()).abs() < 1e-12);
        // From 30 degrees on, the attitude is no better than none and does not correct the shape.
        assert_eq!(sigma(40.0), none);
        assert_eq!(Expected::new(&body, &frame).unwrap().unknown_harmonics_cos[1], sigma(5.0));
        for deg in [f64::NAN, -1.0, f64::INFINITY] {
            let frame = Prior { attitude_sigma_rad: Some(deg), ..frame };
            assert_eq!(Expected::new(&body, &frame).unwrap_err(), PriorError::AttitudeSigma);
        }
    }

    #[test]
    fn a_camera_below_the_limb_height_is_told_apart_from_impossible_ones() {
        let with = |kind| Config { kind, limb_height_km: 17.0, radius_km: None, ..Config::default() };
        let body = with(Kind::Earth);
        let at = |body: &Config, frame: Prior<f64>| Expected::<f64>::new(body, &frame).unwrap_err();
        let altitude = |h: f64| Prior { altitude_m: Some(h), ..Prior::default() };
        let told = PriorError::BelowLimb { altitude_m: 3200, limb_m: 17_000 };
        assert_eq!(at(&body, altitude(3200.0)), told);
        assert_eq!(told.to_string(), "altitude 3.2 km is below the limb height 17 km");
        use crate::geometry::ellipsoid::{WGS84_A_M, WGS84_B_M, from_geodetic};
        let pad = from_geodetic(1.18, 0.37, 3200.0, WGS84_A_M, WGS84_B_M);
        assert_eq!(at(&body, Prior { position_m: Some(pad), ..Prior::default() }), told);
        let rows = [[-90.0, 16.0], [0.0, 18.0], [90.0, 16.0]].into_iter().collect();
        let by_latitude = Config { limb_height_by_latitude_km: rows, ..body.clone() };
        let PriorError::BelowLimb { altitude_m: 3200, limb_m: 16_000..17_000 } =
            at(&by_latitude, Prior { position_m: Some(pad), ..Prior::default() })
        else {
            panic!()
        };
        let sphere = with(Kind::EarthSphere);
        let near = Prior { position_m: Some([0.0, 6371.0088e3 + 3200.0, 0.0]), ..Prior::default() };
        assert_eq!(at(&sphere, near), told);
        // The launch pad may be below the ellipsoid. At the limb height itself there is no limb either.
        assert!(matches!(at(&body, altitude(-20.0)), PriorError::BelowLimb { altitude_m: -20, .. }));
        assert!(at(&body, altitude(17_000.0)).to_string().contains("is not above the limb height"));
        assert_eq!(at(&body, altitude(-1000.0)), PriorError::Altitude);
        assert!(Expected::<f64>::new(&body, &altitude(17_500.0)).is_ok());
    }
}
