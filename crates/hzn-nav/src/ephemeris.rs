//! Positions of Sun and Moon in ECEF.
//!
//! Both come from short series in the equinox of date instead of an ephemeris in a file, because a flight computer has
//! neither the file nor the memory for it. They are rotated by Greenwich apparent sidereal time, which uses
//! the same equinox, so no precession matrix is needed. UTC is used as UT1, which moves both by up to 0.004°.
//!
//! | body | series | accuracy 2000–2040 |
//! |---|---|---|
//! | Sun | mean longitude and equation of the centre (1), nutation, aberration, two fitted terms | 0.01° |
//! | Moon | Brown's lunar theory in the form of (2) | direction 0.1°, distance 600 km |
//!
//! 1. Meeus, *Astronomical Algorithms*, chapter 25.
//! 2. Montenbruck & Gill, *Satellite Orbits*, section 3.3.2.

use hzn_core::body::AU_KM;

use crate::frames::{Fixed, Vector};
use crate::time::{tt_days_since_j2000, ut_days_since_j2000};

/// Position of a celestial body, from the Earth's centre or from another position.
///
/// ```
/// use hzn_nav::ephemeris;
/// use hzn_nav::frames::Vector;
///
/// let moon = ephemeris::moon(1_735_689_600.0); // 2025-01-01T00:00 UTC
/// // The Moon is so near that its direction depends on the position of the observer.
/// let seen = moon.seen_from(Vector::new(0.0, 0.0, 6.9e6));
/// let parallax_deg = seen.direction.angle_rad(&moon.direction).to_degrees();
/// assert!((parallax_deg - 0.9).abs() < 0.2, "{parallax_deg}");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Apparent direction, of unit length.
    pub direction: Vector<Fixed>,
    /// Distance in metres.
    pub distance_m: f64,
}

impl Place {
    /// Makes a place from a vector of any length; only its direction counts.
    fn from_vector(towards: Vector<Fixed>, distance_m: f64) -> Self {
        Self { direction: towards / towards.norm(), distance_m }
    }

    /// Returns the position, metres.
    pub fn position_m(&self) -> Vector<Fixed> {
        self.direction * self.distance_m
    }

    /// Returns the place of the body as seen from a position (metres).
    pub fn seen_from(&self, position_m: Vector<Fixed>) -> Self {
        let d = self.position_m() - position_m;
        Self::from_vector(d, d.norm())
    }
}

/// Returns the sine of an angle in degrees.
fn sin(deg: f64) -> f64 {
    libm::sin(deg.to_radians())
}
/// Returns the cosine of an angle in degrees.
fn cos(deg: f64) -> f64 {
    libm::cos(deg.to_radians())
}

/// The values that both series need at a time.
struct Time {
    /// Julian centuries of terrestrial time since J2000.
    t: f64,
    /// Obliquity of the ecliptic in degrees, with nutation.
    obliquity_deg: f64,
    /// Largest term of the nutation in longitude, in degrees.
    nutation_deg: f64,
    /// Greenwich apparent sidereal time in degrees.
    sidereal_deg: f64,
}

impl Time {
    fn from_unix_s(unix_s: f64) -> Self {
        let t = tt_days_since_j2000(unix_s) / 36525.0;
        let node_deg = 125.04 - 1934.136 * t;
        let nutation_deg = -0.00478 * sin(node_deg);
        let obliquity_deg = 23.4392911 - 0.0130042 * t + 0.00256 * cos(node_deg);
        let sidereal_deg = 280.46061837
            + 360.98564736629 * ut_days_since_j2000(unix_s)
            + 0.000387933 * t * t
            + nutation_deg * cos(obliquity_deg);
        Self { t, obliquity_deg, nutation_deg, sidereal_deg }
    }

    /// Converts ecliptic longitude and latitude of date (degrees) to ECEF.
    fn fixed_from_ecliptic(&self, longitude_deg: f64, latitude_deg: f64) -> Vector<Fixed> {
        let (se, ce) = (sin(self.obliquity_deg), cos(self.obliquity_deg));
        let (sb, cb) = (sin(latitude_deg), cos(latitude_deg));
        let (y, z) = (cb * sin(longitude_deg), sb);
        let (x, y, z) = (cb * cos(longitude_deg), ce * y - se * z, se * y + ce * z);
        let (ss, cs) = (sin(self.sidereal_deg), cos(self.sidereal_deg));
        Vector::new(cs * x + ss * y, cs * y - ss * x, z)
    }
}

/// Returns Greenwich apparent sidereal time in radians, from 0 to 2π: the angle from the equinox to the meridian of
/// Greenwich. `unix_s` is UTC in seconds since 1970.
pub fn sidereal_rad(unix_s: f64) -> f64 {
    // Does the same as `f64::rem_euclid`, which only the standard library has.
    let rest = Time::from_unix_s(unix_s).sidereal_deg % 360.0;
    (if rest < 0.0 { rest + 360.0 } else { rest }).to_radians()
}

/// Returns the Sun as seen from the Earth's centre. `unix_s` is UTC in seconds since 1970.
///
/// ```
/// let sun = hzn_nav::ephemeris::sun(1_718_916_660.0); // 2024-06-20T20:51 UTC, the solstice of June
/// let [_, _, z] = sun.direction.xyz();
/// assert!((z.asin().to_degrees() - 23.44).abs() < 0.01);
/// ```
pub fn sun(unix_s: f64) -> Place {
    let time = Time::from_unix_s(unix_s);
    let t = time.t;
    let mean_longitude = 280.46646 + 36000.76983 * t + 0.0003032 * t * t;
    let anomaly = 357.52911 + 35999.05029 * t - 0.0001537 * t * t;
    let centre = (1.914602 - 0.004817 * t - 0.000014 * t * t) * sin(anomaly)
        + (0.019993 - 0.000101 * t) * sin(2.0 * anomaly)
        + 0.000289 * sin(3.0 * anomaly);
    let elongation = 297.85 + 445267.1115 * t;
    // Aberration, and terms that were fitted to an ephemeris for 2000 to 2040. The largest of these is the Earth's
    // motion about the common centre of mass with the Moon. Without the fitted terms the largest error is 0.0096°
    // instead of 0.0061°, and aberration is 0.0057°, so none of them is left out.
    let longitude = mean_longitude + centre - 0.00569 + time.nutation_deg - 0.0025 + 0.00179 * sin(elongation);
    let eccentricity = 0.016708634 - 0.000042037 * t;
    let distance_au = 1.000001018 * (1.0 - eccentricity * eccentricity) / (1.0 + eccentricity * cos(anomaly + centre));
    Place::from_vector(time.fixed_from_ecliptic(longitude, 0.0), distance_au * AU_KM * 1e3)
}

/// Returns the Moon as seen from the Earth's centre. `unix_s` is UTC in seconds since 1970.
pub fn moon(unix_s: f64) -> Place {
    let time = Time::from_unix_s(unix_s);
    let t = time.t;
    // Mean longitude of date, anomalies of Moon and Sun, argument of latitude, elongation.
    let mean = 218.31617 + 481267.88088 * t;
    let l = 134.96292 + 477198.86753 * t;
    let s = 357.52543 + 35999.04944 * t;
    let f = 93.27283 + 483202.01873 * t;
    let d = 297.85027 + 445267.11135 * t;
    // (arcseconds, argument)
    let longitude_terms = [
        (22640.0, l),
        (769.0, 2.0 * l),
        (-4586.0, l - 2.0 * d),
        (2370.0, 2.0 * d),
        (-668.0, s),
        (-412.0, 2.0 * f),
        (-212.0, 2.0 * l - 2.0 * d),
        (-206.0, l + s - 2.0 * d),
        (192.0, l + 2.0 * d),
        (-165.0, s - 2.0 * d),
        (148.0, l - s),
        (-125.0, d),
        (-110.0, l + s),
        (-55.0, 2.0 * f - 2.0 * d),
    ];
    let sum = |terms: &[(f64, f64)]| terms.iter().map(|&(a, x)| a * sin(x)).sum::<f64>() / 3600.0;
    let longitude_correction = sum(&longitude_terms);
    let argument = f + longitude_correction + sum(&[(412.0, 2.0 * f), (541.0, s)]);
    let latitude = sum(&[
        (18520.0, argument),
        (-526.0, f - 2.0 * d),
        (44.0, l + f - 2.0 * d),
        (-31.0, -l + f - 2.0 * d),
        (-25.0, -2.0 * l + f),
        (-23.0, s + f - 2.0 * d),
        (21.0, -l + f),
        (11.0, -s + f - 2.0 * d),
    ]);
    let distance_km =
        385000.0 - 20905.0 * cos(l) - 3699.0 * cos(2.0 * d - l) - 2956.0 * cos(2.0 * d) - 570.0 * cos(2.0 * l)
            + 246.0 * cos(2.0 * l - 2.0 * d)
            - 205.0 * cos(s - 2.0 * d)
            - 171.0 * cos(l + 2.0 * d)
            - 152.0 * cos(l + s - 2.0 * d);
    Place::from_vector(
        time.fixed_from_ecliptic(mean + longitude_correction + time.nutation_deg, latitude),
        distance_km * 1e3,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn read(text: &str) -> Vec<serde_json::Value> {
        serde_json::from_str::<serde_json::Value>(text).unwrap()["cases"].as_array().unwrap().clone()
    }
    fn separation_deg(a: Vector<Fixed>, b: Vector<Fixed>) -> f64 {
        libm::atan2(a.cross(&b).norm(), a.dot(&b)).to_degrees()
    }
    fn vector(v: &serde_json::Value) -> Vector<Fixed> {
        core::array::from_fn(|i| v[i].as_f64().unwrap()).into()
    }

    #[test]
    fn sun_against_erfa() {
        for case in read(include_str!("../tests/data/sun_position.json")) {
            let utc = case["utc"].as_str().unwrap();
            let day = |i: usize| case["jd_utc"][i].as_f64().unwrap();
            let unix_s = (day(0) - 2_440_587.5 + day(1)) * 86_400.0;
            assert_eq!(crate::time::tai_minus_utc_s(unix_s), case["tai_minus_utc_s"].as_f64().unwrap(), "{utc}");
            let place = sun(unix_s);
            let error_deg = separation_deg(place.direction, vector(&case["sun_itrs_apparent_unit"]));
            assert!(error_deg <= 0.01, "{utc}: {error_deg}");
            let au = place.distance_m / (AU_KM * 1e3);
            assert!((au - case["distance_au"].as_f64().unwrap()).abs() < 1e-4, "{utc}: {au}");
        }
    }

    #[test]
    fn moon_against_erfa() {
        let (mut worst_deg, mut worst_km, mut square) = (0.0f64, 0.0f64, 0.0);
        let cases = read(include_str!("../tests/data/moon_position.json"));
        for case in &cases {
            let truth = vector(&case["moon_itrs_km"]);
            let place = moon(case["unix_s"].as_f64().unwrap());
            let error_deg = separation_deg(place.direction, truth);
            worst_deg = worst_deg.max(error_deg);
            square += error_deg * error_deg;
            worst_km = worst_km.max((place.distance_m / 1e3 - truth.norm()).abs());
        }
        println!("{worst_deg}° at worst, {}° RMS, {worst_km} km", (square / cases.len() as f64).sqrt());
        assert!(worst_deg < 0.1 && worst_km < 600.0, "{worst_deg}° {worst_km} km");
    }

    #[test]
    fn parallax_of_the_moon() {
        // From the equator below the Moon's meridian, the Moon is nearer by the Earth's radius.
        let moon = moon(1.6e9);
        let under = moon.direction * 6.378e6;
        let seen = moon.seen_from(under);
        assert!((moon.distance_m - seen.distance_m - 6.378e6).abs() < 1.0);
        assert!(separation_deg(seen.direction, moon.direction) < 1e-5);
    }
}
