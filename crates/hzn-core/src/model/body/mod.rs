//! The body whose limb the sensor searches for, and its cone for a given position and altitude.

mod apparent;
mod expected;
mod shape;

use crate::base::error::{ConfigError, Limit, above, between, require};
use crate::base::keys::{Section, choices, section};
use crate::base::real::Real;
use crate::geometry::ellipsoid::EARTH_MEAN_RADIUS_M;
use crate::geometry::frames::{Cam, Ecef, Rotation, UnitVec3};
use crate::model::edge_noise;
use crate::model::threshold;

pub use expected::Expected;

/// Radius of the Sun's photosphere in kilometres (IAU 2015).
pub const SUN_RADIUS_KM: f64 = 695_700.0;
/// Mean radius of the Moon in kilometres.
pub const MOON_RADIUS_KM: f64 = 1737.4;
/// One astronomical unit in kilometres.
pub const AU_KM: f64 = 149_597_870.7;
/// Mean distance of the Moon in kilometres.
pub const MOON_DISTANCE_KM: f64 = 384_400.0;

/// Lowest altitude of a camera above its body, in metres: the lowest dry land is 0.4 km below WGS-84.
pub const LOWEST_ALTITUDE_M: f64 = -1000.0;

/// Maximum number of rows of a limb height by latitude.
pub const MAX_LATITUDES: usize = 16;
/// Number of points on one half of the limb at which a height by latitude is evaluated.
const LIMB_SAMPLES: usize = 8;

choices! {
    /// The kind of body.
    pub enum Kind {
        /// The Earth as the WGS-84 ellipsoid. Without a position it is a sphere of the mean radius, and the covariance
        /// includes the unknown latitude.
        @0 Earth = "earth";
        /// A sphere of 6371.0088 km.
        @1 EarthSphere = "earth-sphere";
        /// A disc of 0.2666° half-angle at 1 au; it blooms, so its half-angle is free.
        @2 Sun = "sun";
        /// A disc of about 0.26° half-angle; its half-angle is free.
        @3 Moon = "moon";
        /// A sphere of `radius_km`.
        @4 Sphere = "sphere";
    }
}

choices! {
    /// The surface from which an altitude without a position is measured.
    pub enum AltitudeReference {
        /// The WGS-84 ellipsoid, as in satellite navigation.
        ///
        /// If the local radius differs from the mean one, the distance of the camera from the centre differs by the
        /// same amount. The half-angle then shows only the fraction (H − d)/(R + H) of the difference.
        @0 Ellipsoid = "ellipsoid";
        /// A sphere of 6371 km, for example for an altitude computed as orbit radius minus 6371 km; the local radius is
        /// then unknown by about 17 km (1σ).
        @1 Sphere = "sphere";
    }
}

section! {
    /// `[body]` of sensor.toml: the body that the sensor searches for; each of several `[[bodies]]` has the same keys.
    "body" pub struct Config {
        /// The body that the sensor searches for.
        @30 kind: Kind = Kind::Earth, [choice];
        /// Radius of a `sphere`, km; not allowed for other bodies.
        @31 radius_km: Option<f64> = None, ["above 0, for `sphere` only"] { unset: "none", example: "1188.3" };
        /// Altitude of the camera for pictures without an altitude in their prior, km; above WGS-84 for `earth`, else
        /// above the radius.
        ///
        /// `sun` and `moon` do not use it. For a camera in orbit about the Moon, use a `sphere` of 1737.4 km.
        @32 altitude_km: Option<f64> = None, [above 0.0] { unset: "none", example: "400.0" };
        /// 1σ of the altitude, km.
        @33 altitude_sigma_km: f64 = 0.5, [0.0 to 1e6];
        /// For `earth`: the surface from which an altitude without a position is measured.
        @36 altitude_reference: AltitudeReference = AltitudeReference::Ellipsoid, [choice];
        /// Height of the visible limb above the surface, km; 17 km is right for a cloudless limb in sunlight at 550 nm.
        ///
        /// At this height the limb has half of its brightness. A value that is too high makes the expected cone too
        /// wide.
        @34 limb_height_km: f64 = 17.0, [-50.0 to 500.0];
        /// 1σ of the limb height, km; 7 km spans the visible wavelengths and usual thresholds.
        ///
        /// The height is 24 km at 440 nm and 12 km at 650 nm. The range of thresholds is a quarter to three quarters of
        /// the limb's brightness. A larger sigma gives the expected half-angle less weight.
        @35 limb_height_sigma_km: f64 = 7.0, [0.0 to 1e4];
        /// Height that overexposure adds to the limb, km; it is multiplied by the fraction of the limb that is clipped
        /// at full scale.
        ///
        /// If the light exceeds full scale by the factor B, the limb in the picture, at half of full scale, lies h ln B
        /// higher than the limb at half of the light, where h = 7.5 km is the scale height of the air. The default is
        /// the mean for B from 1 to 8, with a uniform distribution of ln B.
        @37 clipped_height_km: f64 = 7.8, [0.0 to 500.0];
        /// 1σ of `clipped_height_km`, km; the height varies along the limb.
        @38 clipped_sigma_km: f64 = 4.5, [0.0 to 1e4];
        /// Limb height by latitude instead of `limb_height_km`: rows of [geodetic latitude in degrees, height in km],
        /// with rising latitudes.
        ///
        /// It applies to `earth` with a position. Heights are interpolated linearly between rows and are constant
        /// beyond the first and last row. Without an attitude, the variation along the limb widens the covariance.
        @- limb_height_by_latitude_km: heapless::Vec<[f64; 2], MAX_LATITUDES> = heapless::Vec::new(),
            ["up to 16 rows, for `earth`"] { unset: "none", example: "[[-90, 20.5], [0, 25.0], [90, 29.5]]" };
        /// Whether only the sunlit part of the limb counts as limb; this needs the direction to the Sun.
        @- sunlit: Option<bool> = None, ["true or false"] { unset: "true for `moon` and `sphere`", example: "true" };
        /// Threshold for this body, as a table with the keys of `[binarize]`.
        @- binarize: Option<threshold::Config> = None, ["the keys of `[binarize]`"]
            { unset: "`[binarize]`; `fixed` at 0.9 for a `sun` among several bodies" };
        /// Noise model of edge points for this body, as a table with the keys of `[covariance]`.
        @- covariance: Option<edge_noise::Config> = None, ["the keys of `[covariance]`"] { unset: "`[covariance]`" };
    }
}

impl Config {
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        match (self.kind, self.radius_km) {
            (Kind::Sphere, Some(r)) => above("body.radius_km", r, 0.0)?,
            (Kind::Sphere, None) => {
                require(false, "body.radius_km", f64::NAN, Limit::Rule("a sphere needs its radius in km"))?
            }
            (_, Some(r)) => {
                require(false, "body.radius_km", r, Limit::Rule("only body.kind = \"sphere\" may have a radius"))?
            }
            (_, None) => {}
        }
        self.check_keys()?;
        let rows = &self.limb_height_by_latitude_km;
        let field = "body.limb_height_by_latitude_km";
        for [latitude, height] in rows {
            between(field, *latitude, -90.0, 90.0)?;
            between(field, *height, -50.0, 500.0)?;
        }
        let rising = rows.windows(2).all(|w| matches!(w, [[a, _], [b, _]] if a < b));
        require(rising, field, rows.len() as f64, Limit::Rule("latitudes must rise from row to row"))?;
        require(
            rows.is_empty() || self.kind == Kind::Earth,
            field,
            rows.len() as f64,
            Limit::Rule("only body.kind = \"earth\" may have limb heights by latitude"),
        )?;
        self.binarize.map_or(Ok(()), |b| b.check_keys())?;
        self.covariance.map_or(Ok(()), |c| c.check_keys())
    }

    /// Returns the radius of the sphere that represents the body when no position is known, kilometres.
    pub fn mean_radius_km(&self) -> f64 {
        match self.kind {
            Kind::Earth | Kind::EarthSphere => EARTH_MEAN_RADIUS_M / 1e3,
            Kind::Sun => SUN_RADIUS_KM,
            Kind::Moon => MOON_RADIUS_KM,
            Kind::Sphere => self.radius_km.unwrap_or(f64::NAN),
        }
    }

    /// Returns the limb height in kilometres at a geodetic latitude in degrees.
    fn limb_height_km(&self, latitude_deg: f64) -> f64 {
        let rows = &self.limb_height_by_latitude_km;
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return self.limb_height_km };
        if latitude_deg <= first[0] {
            return first[1];
        }
        for w in rows.windows(2) {
            if let [[a, low], [b, high]] = w
                && latitude_deg <= *b
            {
                return low + (high - low) * (latitude_deg - a) / (b - a);
            }
        }
        last[1]
    }

    /// Returns the mean height along the limb seen from a geodetic latitude, and its first and second harmonic in
    /// azimuth from north, kilometres. `sin` is the sine of the half-angle; it equals the cosine of the angle at the
    /// body's centre between the limb and the nadir.
    fn limb_harmonics_km<T: Real>(&self, latitude_rad: T, sin: T) -> [T; 3] {
        let (one, cos) = (T::one(), (T::one() - sin * sin).max(T::zero()).sqrt());
        let (here, across) = latitude_rad.sin_cos();
        let mut sums = [T::zero(); 3];
        for k in 0..LIMB_SAMPLES {
            let azimuth = T::from_f64((k as f64 + 0.5) * core::f64::consts::PI / LIMB_SAMPLES as f64);
            let (_, c) = azimuth.sin_cos();
            let s = here * sin + across * cos * c;
            let latitude = s.atan2((one - s * s).max(T::zero()).sqrt());
            let height = T::from_f64(self.limb_height_km(latitude.to_f64().to_degrees()));
            sums = [
                sums[0] + height,
                sums[1] + height * c * T::from_f64(2.0),
                sums[2] + height * (c * c * T::from_f64(4.0) - T::from_f64(2.0)),
            ];
        }
        sums.map(|s| s / T::from_f64(LIMB_SAMPLES as f64))
    }

    /// Returns whether the half-angle is always free. This holds for Sun and Moon: they bloom or show phases, so their
    /// apparent radius cannot be a prior.
    pub fn half_angle_is_free(&self) -> bool {
        matches!(self.kind, Kind::Sun | Kind::Moon)
    }

    /// Returns whether the body is a whole disc with its own glare: the Sun.
    pub fn blooms(&self) -> bool {
        self.kind == Kind::Sun
    }

    /// Returns whether the body is seen in sunlight. This is true except for the Sun and for `sunlit = false`, which
    /// means that the body itself emits the light, as in the thermal infrared.
    pub fn is_seen_in_sunlight(&self) -> bool {
        self.sunlit != Some(false) && self.kind != Kind::Sun
    }

    /// Returns whether only the sunlit limb counts as limb, when the Sun's direction is known.
    pub fn is_sunlit(&self) -> bool {
        self.sunlit.unwrap_or(matches!(self.kind, Kind::Moon | Kind::Sphere))
    }
}

/// The data known about one picture before it is processed. Every field may be missing.
///
/// # Example
///
/// A position in ECEF determines the cone of the ellipsoid. An attitude, good to a few degrees, corrects its shape:
///
/// ```
/// use hzn_core::Prior;
/// use hzn_core::frames::Rotation;
///
/// let prior = Prior::<f64> {
///     position_m: Some([6_771e3, 0.0, 0.0]),
///     // The quaternion is scalar first, and takes coordinates from the camera to ECEF.
///     cam_to_ecef: Rotation::assume_from_quaternion([0.5, 0.5, 0.5, 0.5]),
///     attitude_sigma_rad: Some(3f64.to_radians()),
///     ..Prior::default()
/// };
/// assert!(prior.altitude_m.is_none() && prior.cam_to_ecef.is_some());
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct Prior<T> {
    /// Altitude in metres: geodetic above WGS-84 for `earth`, else above the radius. It must be above the limb height.
    pub altitude_m: Option<T>,
    /// Position of the camera in ECEF, metres. A known position replaces the altitude.
    pub position_m: Option<[T; 3]>,
    /// A prior attitude, camera to ECEF; an accuracy of a few degrees is enough. It gives the azimuth for the
    /// ellipsoid's correction. With a position it is also a gate, see `select.max_attitude_sigma`.
    pub cam_to_ecef: Option<Rotation<Cam, Ecef, T>>,
    /// Threshold that the previous picture proposes, in counts: the `next_level` of its report, for
    /// `binarize.method = "track"`. A [`Horizon`](crate::Horizon) stores this value between pictures.
    pub level: Option<u16>,
    /// Direction to the Sun in the camera frame. It is used by a gate, see `select.max_unlit`.
    pub sun: Option<UnitVec3<Cam, T>>,
    /// 1-sigma of the prior attitude about the axis in radians, 0 or more; 5 degrees if it is left out. It widens the
    /// covariance by the part of the ellipsoid's shape that then remains uncertain. From 30 degrees on, the attitude
    /// does not correct the shape at all.
    pub attitude_sigma_rad: Option<T>,
    /// The last answer, for `select.max_rate_deg_s`.
    pub last: Option<Last<T>>,
    /// The camera's rate of rotation in its own axes, rad/s, up to 1000. It is for a camera with a rolling shutter
    /// (`camera.readout_s`), whose rows are exposed at different times. The picture's time is that of its middle row.
    pub rate_rad_s: Option<[T; 3]>,
}

/// The answer to an earlier picture.
#[derive(Debug, Clone, Copy)]
pub struct Last<T> {
    /// The axis in the camera frame.
    pub axis: UnitVec3<Cam, T>,
    /// The 1-sigma of the axis in radians, 0 or more.
    pub sigma_rad: T,
    /// Time since the earlier picture was exposed, seconds.
    pub age_s: T,
}

/// Reason why the prior of a picture is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PriorError {
    /// The altitude is not a finite number, or is too low for any camera.
    Altitude,
    /// The position is not finite, or inside the body.
    Position,
    /// The camera is not above the limb height, so that the limb surrounds it and there is no cone. A rocket flight
    /// begins below the limb height.
    BelowLimb {
        /// Altitude of the camera in metres.
        altitude_m: i32,
        /// Limb height in metres.
        limb_m: i32,
    },
    /// Neither the prior nor the configuration has an altitude.
    NoAltitude,
    /// The sigma of the attitude is not a finite number, or is negative.
    AttitudeSigma,
    /// The rate of rotation is not finite, or is too large.
    Rate,
    /// The sensor has no body with that number.
    NoBody,
}

impl core::fmt::Display for PriorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Altitude => "altitude_km must be a finite number above -1 (kilometres)",
            Self::Position => "x_km, y_km, z_km must be finite and outside the body (ECEF, kilometres)",
            Self::BelowLimb { altitude_m, limb_m } => {
                let [altitude, limb] = [altitude_m, limb_m].map(|m| f64::from(*m) / 1e3);
                let place = if altitude < limb { "below" } else { "not above" };
                return write!(f, "altitude {altitude} km is {place} the limb height {limb} km");
            }
            Self::AttitudeSigma => "attitude_sigma_deg must be a finite number, 0 or more",
            Self::Rate => "rate_x, rate_y, rate_z must be finite and at most 1000 (rad/s)",
            Self::NoAltitude => {
                "no altitude: set body.altitude_km, or give altitude_km or x_km, y_km, z_km with the frame"
            }
            Self::NoBody => "the sensor has no body with this number",
        })
    }
}
impl core::error::Error for PriorError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_by_latitude_become_a_mean_and_harmonics() {
        let rows = [[-90.0, 20.0], [0.0, 25.0], [90.0, 40.0]];
        let body = Config { limb_height_by_latitude_km: rows.into_iter().collect(), ..Config::default() };
        assert_eq!(body.check(), Ok(()));
        for (latitude, height) in [(-90.0, 20.0), (-45.0, 22.5), (0.0, 25.0), (45.0, 32.5), (90.0, 40.0)] {
            assert_eq!(body.limb_height_km(latitude), height);
        }
        // Where the height is linear in latitude, the limb to the north is higher by the same amount by which the limb
        // to the south is lower.
        let sin = 66f64.to_radians().sin();
        let [mean, first, second] = body.limb_harmonics_km(45f64.to_radians(), sin);
        assert!(
            (mean - 32.2).abs() < 0.4 && (first - 24.0 / 6.0).abs() < 0.3 && second.abs() < 0.4,
            "{mean} {first} {second}"
        );
        let wrong = |rows: &[[f64; 2]], kind| {
            Config { limb_height_by_latitude_km: rows.iter().copied().collect(), kind, ..Config::default() }
                .check()
                .is_err()
        };
        assert!(wrong(&[[10.0, 5.0], [10.0, 6.0]], Kind::Earth));
        assert!(wrong(&[[91.0, 5.0]], Kind::Earth) && wrong(&[[0.0, 900.0]], Kind::Earth));
        assert!(wrong(&[[0.0, 5.0]], Kind::EarthSphere));
    }
}
