//! The body whose limb the sensor searches for, and its cone for a given position and altitude.

mod apparent;
mod azimuth;
mod band;
mod band_table;
mod bounds;
mod clipped;
mod expected;
mod kind;
mod limb;
mod lit;
mod low_sun;
mod measured;
mod night;
mod planets;
mod position;
mod prior;
mod refraction;
mod scaled;
mod shape;
mod tilt;
mod visible;

use crate::base::error::{ConfigError, Limit, above, between, require};
use crate::base::keys::{Section, section};
use crate::base::real::Real;
use crate::geometry::ellipsoid::{EARTH_MEAN_RADIUS_M, WGS84_A_M, WGS84_B_M};
use crate::model::edge_noise;
use crate::model::threshold;

pub(crate) use band::weather_kappa;
pub use band::year_part;
pub use expected::Expected;
pub use kind::{AltitudeReference, Kind};
pub use limb::{Limb, Night};
pub(crate) use lit::LOWEST_SUN_DEG;
pub use planets::Planet;
pub(crate) use position::Target;
pub use prior::{Last, Prior, PriorError};
pub use tilt::tilt_km;

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

/// Scale height of the Earth's air at the limb, kilometres.
// The value is that of the table of limb heights by wavelength (book/theory/methods.md), so that both follow one air.
const EARTH_SCALE_HEIGHT_KM: f64 = 7.5;

/// Maximum number of rows of a limb height by latitude.
pub const MAX_LATITUDES: usize = 16;
/// Number of points on one half of the limb at which a height by latitude is evaluated.
// Half of the limb is enough, because the height depends on the latitude and both halves pass the same latitudes.
const LIMB_SAMPLES: usize = 8;

section! {
    /// `[body]` of sensor.toml: the body that the sensor searches for; each of several `[[bodies]]` has the same keys.
    "body" pub struct Config {
        /// The body that the sensor searches for.
        @30 kind: Kind = Kind::Earth, [choice];
        /// Radius of a `sphere`, km; not allowed for other bodies.
        @31 radius_km: Option<f64> = None, ["above 0, for `sphere` only"] { unset: "none", example: "1188.3" };
        /// Semi-axes of an `ellipsoid` along its own x, y and z axes (z to the north pole), km; not allowed for other
        /// bodies, because a planet with a name has its own.
        @- radii_km: Option<[f64; 3]> = None, ["three lengths above 0, for `ellipsoid` only"]
            { needs: "position", unset: "none", example: "[71492.0, 71492.0, 66854.0]" };
        /// 1σ of each semi-axis, km; it widens the covariance of the position (`fit.position`).
        ///
        /// Set it for a body whose shape is known only roughly, such as an asteroid.
        @- radii_sigma_km: f64 = 0.0, [0.0 to 1e5] { needs: "position" };
        /// Distance of the camera from the body's centre for pictures without one in their prior, km, with
        /// `fit.position`; it needs `range_sigma_km`.
        ///
        /// Without any distance, the position comes from the limb alone.
        @- range_km: Option<f64> = None, [above 0.0] { needs: "position", unset: "none", example: "5986000.0" };
        /// 1σ of `range_km`, and of the column `range_km` of frames.csv if that has no `range_sigma_km`, km.
        ///
        /// A smaller value gives the distance more weight against the limb.
        @- range_sigma_km: Option<f64> = None, [0.0 to 1e12] { needs: "position", unset: "none", example: "1000.0" };
        /// Altitude of the camera for pictures without an altitude in their prior, km; above WGS-84 for `earth`, else
        /// above the radius, which is the mean of the three semi-axes for an ellipsoid.
        ///
        /// `sun` and `moon` do not use it. For a camera in orbit about the Moon, use a `sphere` of 1737.4 km.
        @32 altitude_km: Option<f64> = None, [above 0.0] { unset: "none", example: "400.0" };
        /// 1σ of the altitude, km; it widens the expected half-angle.
        ///
        /// Give the sigma of the navigation that the altitude comes from. A larger value gives the expected half-angle
        /// less weight; a value that is too small makes the covariance too small, or right answers are refused.
        @33 altitude_sigma_km: f64 = 0.5, [0.0 to 1e6];
        /// For `earth`: the surface from which an altitude without a position is measured.
        @36 altitude_reference: AltitudeReference = AltitudeReference::Ellipsoid, [choice];
        /// Where the limb height comes from.
        @- limb: Limb = Limb::Visible, [choice];
        /// Height of the visible limb above the surface, km; 17 km is right for a cloudless limb in sunlight at 550 nm.
        ///
        /// At this height the limb has half of its light in the picture if `input.tone` is known, and else half of its
        /// counts. With the default value, if `limb` is `visible`, and with `edge_points.sub_pixel = "none"`, the
        /// height follows from the tone: 23.4 km for a photograph, whose half of the counts is a fifth of the light. A
        /// value that is too high makes the expected cone too wide.
        // The default was 10 ± 2 km before, with 1 px over 300 px of edge noise: the mean NEES of `rocket-clean` was 11
        // instead of 0.55.
        @34 limb_height_km: f64 = 17.0, [-50.0 to 500.0];
        /// 1σ of the limb height, km; 7 km spans the visible wavelengths and usual tones.
        ///
        /// The height is 24 km at 440 nm and 12 km at 650 nm. Where the tone is not known, half of the counts is a
        /// quarter to three quarters of the limb's light. In linear pictures the default becomes 4.6 km. A larger sigma
        /// gives the expected half-angle less weight.
        @35 limb_height_sigma_km: f64 = 7.0, [0.0 to 1e4];
        /// 1σ of a tilt of the limb, km: the amplitude of a height that varies with the azimuth like a cosine, along
        /// each of two axes.
        ///
        /// One picture cannot see such a tilt, because it looks like another attitude; it widens the covariance of the
        /// axis by this height over the distance to the limb. If it is not told, a rig, and a thermal band without time
        /// and position, have 0.05 km for each degree between the limb and the point below the camera, divided by √2;
        /// for other limbs it is 0. Half of that value is right for a limb in sunlight.
        @- limb_tilt_sigma_km: Option<f64> = None, [0.0 to 1000.0] { unset: "from the band", example: "0.8" };
        /// What the sensor does in a picture in which the Sun is known to be down, from time and position.
        ///
        /// `airglow` searches for the outer edge of the layer of airglow, and refuses every other edge. It is for the
        /// Earth in visible light and a camera above the layer. Without a time, or by day, it changes nothing.
        @39 night: Night = Night::Refuse, [choice];
        /// Height of the outer edge of the airglow above the surface, km; for `night = "airglow"`. At this height it
        /// has half of its light in the picture if `input.tone` is known, and else half of its counts.
        ///
        /// With the default value the height follows from the tone: 102 km if it is known, as it is for linear counts.
        @42 airglow_height_km: f64 = 106.0, [60.0 to 400.0];
        /// 1σ of `airglow_height_km`, km.
        ///
        /// The default covers peaks from 85 to 105 km and layers of 3 to 12 km, and follows from the tone as well. A
        /// filter that passes one line, or the mean of a flight, allows a smaller value.
        @43 airglow_height_sigma_km: f64 = 8.0, [0.0 to 1e4];
        /// 1σ of the second harmonic of the limb height along the limb, km; it limits how well the rotation about the
        /// line to the body is known (`fit.yaw_limit_deg`).
        ///
        /// The second harmonic rises and falls twice along the limb, which looks like a rotation. A smaller value gives
        /// the rotation a smaller sigma. The default is the sigma of the limb height, because the variation along the
        /// limb is usually unknown.
        @- limb_height_harmonic_sigma_km: Option<f64> = None, [0.0 to 1e4]
            { needs: "position", unset: "`limb_height_sigma_km`", example: "0.1" };
        /// Height that overexposure adds to the limb, km; it is multiplied by the fraction of the limb that is clipped
        /// at full scale.
        ///
        /// Set it to 0 if `limb_height_km` was measured on pictures that are overexposed in the same way. If the light
        /// exceeds full scale by the factor B, the limb in the picture, at half of full scale, lies h ln B higher than
        /// the limb at half of the light, where h = 7.5 km is the scale height of the air. The default is the mean for
        /// B from 1 to 8, with a uniform distribution of ln B.
        // The mean of h ln B is h ln 8/2, because ln B is evenly distributed from 0 to ln 8.
        @37 clipped_height_km: f64 = 7.8, [0.0 to 500.0];
        /// 1σ of `clipped_height_km`, km; it also stands for the variation along the limb, and a larger value widens
        /// the covariance.
        // This is the sigma of the same even distribution: its width h ln 8 over √12.
        @38 clipped_sigma_km: f64 = 4.5, [0.0 to 1e4];
        /// Limb height by latitude instead of `limb_height_km`: rows of [geodetic latitude in degrees, height in km],
        /// with rising latitudes.
        ///
        /// It applies to `earth` with a position. Heights are interpolated linearly between rows and are constant
        /// beyond the first and last row. Without an attitude, the variation along the limb widens the covariance.
        @- limb_height_by_latitude_km: heapless::Vec<[f64; 2], MAX_LATITUDES> = heapless::Vec::new(),
            ["up to 16 rows, for `earth`"] { unset: "none", example: "[[-90, 20.5], [0, 25.0], [90, 29.5]]" };
        /// Whether only the sunlit part of the limb counts as limb; this needs the direction to the Sun. In visible
        /// light, set true: near the terminator the light fades, and the edge is too low there.
        ///
        /// False says that the body shines by itself, as for a thermal camera: no gate then asks for the Sun.
        @- sunlit: Option<bool> = None, ["true or false"]
            { unset: "true for all but `earth`, `earth-sphere` and `sun`", example: "true" };
        /// Threshold for this body, as a table with the keys of `[threshold]`.
        @- threshold: Option<threshold::Config> = None, ["the keys of `[threshold]`"]
            { unset: "`[threshold]`; `fixed` at 0.9 for a `sun` among several bodies" };
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
            // A radius for a body that has its own would be ignored. An error is better than a silent choice.
            (_, Some(r)) => {
                require(false, "body.radius_km", r, Limit::Rule("only body.kind = \"sphere\" may have a radius"))?
            }
            (_, None) => {}
        }
        self.check_figure()?;
        self.check_keys()?;
        self.check_band()?;
        self.check_night()?;
        let rows = &self.limb_height_by_latitude_km;
        let field = "body.limb_height_by_latitude_km";
        for [latitude, height] in rows {
            between(field, *latitude, -90.0, 90.0)?;
            between(field, *height, -50.0, 500.0)?;
        }
        // Equal latitudes are refused, too, because the interpolation divides by their difference.
        let rising = rows.windows(2).all(|w| matches!(w, [[a, _], [b, _]] if a < b));
        require(rising, field, rows.len() as f64, Limit::Rule("latitudes must rise from row to row"))?;
        require(
            rows.is_empty() || self.kind == Kind::Earth,
            field,
            rows.len() as f64,
            Limit::Rule("only body.kind = \"earth\" may have limb heights by latitude"),
        )?;
        self.threshold.map_or(Ok(()), |b| b.check_keys())?;
        self.covariance.map_or(Ok(()), |c| c.check_keys())
    }

    /// Returns the radius of the sphere that represents the body when no position is known, kilometres.
    pub fn mean_radius_km(&self) -> f64 {
        match self.kind {
            Kind::Earth | Kind::EarthSphere => EARTH_MEAN_RADIUS_M / 1e3,
            Kind::Sun => SUN_RADIUS_KM,
            Kind::Moon => MOON_RADIUS_KM,
            Kind::Sphere => self.radius_km.unwrap_or(f64::NAN),
            _ => self.figure_km().map_or(f64::NAN, |[a, b, c]| (a + b + c) / 3.0),
        }
    }

    /// Returns the semi-axes of the body, kilometres; `None` for the Sun, whose limb blooms.
    pub fn figure_km(&self) -> Option<[f64; 3]> {
        let sphere = |r: f64| Some([r; 3]);
        match self.kind {
            Kind::Earth => Some([WGS84_A_M, WGS84_A_M, WGS84_B_M].map(|x| x / 1e3)),
            Kind::EarthSphere | Kind::Moon => sphere(self.mean_radius_km()),
            Kind::Sphere => self.radius_km.and_then(sphere),
            Kind::Sun => None,
            Kind::Ellipsoid => self.radii_km,
            // Without the feature no such body is accepted, and a flight computer keeps no table of them.
            named if cfg!(feature = "position") => named.planet().map(|planet| planet.radii_km),
            _ => None,
        }
    }

    /// Checks the keys of shape and distance.
    fn check_figure(&self) -> Result<(), ConfigError> {
        let field = "body.radii_km";
        match (self.kind, self.radii_km) {
            (Kind::Ellipsoid, Some(radii)) => radii.iter().try_for_each(|r| above(field, *r, 0.0))?,
            (Kind::Ellipsoid, None) => {
                require(false, field, f64::NAN, Limit::Rule("an ellipsoid needs its three semi-axes in km"))?
            }
            (_, Some([a, ..])) => {
                require(false, field, a, Limit::Rule("only body.kind = \"ellipsoid\" may have semi-axes"))?
            }
            (_, None) => {}
        }
        require(
            // There is no default sigma, because no value would suit both a navigation filter and an ephemeris.
            self.range_km.is_none() || self.range_sigma_km.is_some(),
            "body.range_sigma_km",
            f64::NAN,
            Limit::Rule("body.range_km needs its 1-sigma in km"),
        )
    }

    /// Returns the limb height in kilometres, or the mean over the latitudes if it is given by latitude.
    pub(crate) fn mean_limb_height_km(&self) -> f64 {
        let rows = &self.limb_height_by_latitude_km;
        if rows.is_empty() {
            return self.limb_height_km;
        }
        const LATITUDES: i32 = 18;
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in 0..LATITUDES {
            let latitude = (f64::from(i) + 0.5) * 180.0 / f64::from(LATITUDES) - 90.0;
            // The rows are weighted by the area of their belt; otherwise the poles would count as much as the equator.
            let area = libm::cos(latitude.to_radians());
            sum += area * self.limb_height_km(latitude, None);
            weight += area;
        }
        sum / weight
    }

    /// Returns a body of this kind with the values that fit it where no key says otherwise. `radii_km` is for
    /// [`Kind::Ellipsoid`].
    ///
    /// The limb height of the Earth, 17 km ± 7 km, is wrong for every other body. A planet with a name has its own
    /// ([`Planet`]); an ellipsoid without a name counts as a body without air, ± 0.3 % of its mean radius.
    pub fn of_kind(kind: Kind, radii_km: Option<[f64; 3]>) -> Self {
        let mut body = Self { kind, radii_km, ..Self::default() };
        let unnamed = || {
            let [a, b, c] = radii_km.filter(|_| kind == Kind::Ellipsoid)?;
            Some((0.0, (a + b + c) * 1e-3, 0.0))
        };
        let named = kind.planet().map(|p| (p.limb_height_km, p.limb_height_sigma_km, p.scale_height_km));
        if let Some((height, sigma, scale_height)) = named.or_else(unnamed) {
            let earth = Self::default();
            (body.limb_height_km, body.limb_height_sigma_km) = (height, sigma);
            // The height that overexposure adds is proportional to the scale height of the air, 7.5 km for the Earth.
            body.clipped_height_km = earth.clipped_height_km * scale_height / EARTH_SCALE_HEIGHT_KM;
            body.clipped_sigma_km = earth.clipped_sigma_km * scale_height / EARTH_SCALE_HEIGHT_KM;
        }
        body
    }

    /// Returns the scale height of the body's air in kilometres; 0 if it is unknown or if there is no air.
    pub(crate) fn scale_height_km(&self) -> f64 {
        match self.kind {
            Kind::Earth | Kind::EarthSphere => EARTH_SCALE_HEIGHT_KM,
            kind => kind.planet().map_or(0.0, |planet| planet.scale_height_km),
        }
    }

    /// Returns whether the body is given as an ellipsoid of its own: `ellipsoid`, or a planet with a name.
    pub fn is_ellipsoid(&self) -> bool {
        // Without the feature no such body is accepted.
        cfg!(feature = "position") && (self.kind == Kind::Ellipsoid || self.kind.planet().is_some())
    }

    /// Returns the limb height in kilometres at a geodetic latitude in degrees, in a season.
    fn limb_height_km(&self, latitude_deg: f64, year_part: Option<f64>) -> f64 {
        if let Some(height) = self.band_height_km(latitude_deg, year_part) {
            return height;
        }
        let rows = &self.limb_height_by_latitude_km;
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return self.limb_height_km };
        // Beyond the rows the height stays constant, because an extrapolated line would leave every plausible height.
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
    fn limb_harmonics_km<T: Real>(&self, latitude_rad: T, sin: T, year_part: Option<T>) -> [T; 3] {
        let (one, cos) = (T::one(), (T::one() - sin * sin).max(T::zero()).sqrt());
        let (here, across) = latitude_rad.sin_cos();
        let season = year_part.map(Real::to_f64);
        let mut sums = [T::zero(); 3];
        for k in 0..LIMB_SAMPLES {
            // The samples lie between the ends, so that each stands for an equal part of the limb and none counts half.
            let azimuth = T::from_f64((k as f64 + 0.5) * core::f64::consts::PI / LIMB_SAMPLES as f64);
            let (_, c) = azimuth.sin_cos();
            let s = here * sin + across * cos * c;
            // The arc sine would be NaN for a sine that rounding puts above 1; the root of a clamped number is not.
            let latitude = s.atan2((one - s * s).max(T::zero()).sqrt());
            let height = T::from_f64(self.limb_height_km(latitude.to_f64().to_degrees(), season));
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

    /// Returns whether the body is seen in sunlight. This is true except for the Sun, for the thermal bands of
    /// [`Self::limb`], and for `sunlit = false`, which means that the body itself emits the light.
    pub fn is_seen_in_sunlight(&self) -> bool {
        self.sunlit.unwrap_or(self.limb.thermal_km().is_none()) && self.kind != Kind::Sun
    }

    /// Returns whether only the sunlit limb counts as limb, when the Sun's direction is known.
    pub fn is_sunlit(&self) -> bool {
        // The Earth is left out: its limb is whole in the thermal infrared, and in a low Sun about a fifth of the
        // answers would be lost.
        self.sunlit.unwrap_or(matches!(self.kind, Kind::Moon | Kind::Sphere) || self.is_ellipsoid())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_by_latitude_become_a_mean_and_harmonics() {
        let rows = [[-90.0, 20.0], [0.0, 25.0], [90.0, 40.0]];
        let body = Config { limb_height_by_latitude_km: rows.into_iter().collect(), ..Config::default() };
        assert_eq!(body.check(), Ok(()));
        for (latitude, height) in [(-90.0, 20.0), (-45.0, 22.5), (0.0, 25.0), (45.0, 32.5), (90.0, 40.0)] {
            assert_eq!(body.limb_height_km(latitude, None), height);
        }
        // Where the height is linear in latitude, the limb to the north is higher by the same amount by which the limb
        // to the south is lower.
        let sin = 66f64.to_radians().sin();
        let [mean, first, second] = body.limb_harmonics_km(45f64.to_radians(), sin, None);
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
