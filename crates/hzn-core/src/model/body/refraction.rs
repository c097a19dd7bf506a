//! The bending of light in the air between the limb and a camera on a balloon.

use super::{Config, Kind};
use crate::base::real::Real;
use crate::geometry::ellipsoid::EARTH_MEAN_RADIUS_M;

/// Altitudes of a camera below which all of the bending counts, and from which on none does, metres.
// A camera in space sees the limb of the default height bent by 0.2 km, which the sigma includes, and one at sea level
// by 1.8 km. Its limb heights are those of straight rays, and it keeps its time. Balloons fly below 45 km. In between
// the bending fades, so that a rocket on its way up does not see the limb jump.
const WHOLE_BELOW_M: f64 = 45e3;
const NONE_FROM_M: f64 = 60e3;
/// Refractivity n − 1 of air at sea level at 550 nm (Edlén 1966; 15 °C, 1013.25 hPa).
const AT_SEA_LEVEL: f64 = 2.78e-4;
/// Fall of the logarithm of the density per metre, and per metre squared.
// The two numbers give the density of the U.S. Standard Atmosphere 1976 at 12 km (0.2546 of that at sea level) and at
// 30 km (0.01503). In between they are right to an eighth.
const FALL: [f64; 2] = [9.67e-5, 1.44e-9];

impl Config {
    /// Returns the height in kilometres by which the air in front of the limb raises it for a camera at this altitude,
    /// see [`Kind::raised_by_air_km`].
    pub fn raised_by_air_km(&self, altitude_km: f64) -> f64 {
        self.kind.raised_by_air_km(self.mean_limb_height_km(), altitude_km)
    }
}

impl Kind {
    /// Returns the height in kilometres by which the air in front of a limb at `limb_km` raises it for a camera at this
    /// altitude; it falls to 0 between 45 and 60 km. Air bends light towards the ground, so that a balloon sees a limb
    /// that straight rays would not reach.
    pub fn raised_by_air_km(self, limb_km: f64, altitude_km: f64) -> f64 {
        raised_m(self, EARTH_MEAN_RADIUS_M, limb_km * 1e3, altitude_km * 1e3) * 1e-3
    }

    /// Returns the height in kilometres of a limb that straight rays from a camera at this altitude would put at
    /// `apparent_km`, and its derivative by `apparent_km`: the inverse of adding [`Self::raised_by_air_km`]. This is
    /// the limb height to configure for a measured half-angle.
    pub fn height_below_air_km(self, apparent_km: f64, altitude_km: f64) -> (f64, f64) {
        let (height_m, slope) = lowered_m(self, EARTH_MEAN_RADIUS_M, apparent_km * 1e3, altitude_km * 1e3);
        (height_m * 1e-3, slope)
    }
}

/// Returns the height by which the limb appears raised, metres: the cone of light from the height `limb_m` has the
/// half-angle of a straight cone from this much higher.
// Along a ray in air n r sin ζ is constant, with the angle ζ from the vertical. At the limb sin ζ is 1, so that
// sin α = n(d) (R + d)/(n(H) (R + H)): the limb seems to be (R + d) (n(d)/n(H) − 1) higher.
pub(super) fn raised_m<T: Real>(kind: Kind, radius_m: T, limb_m: T, altitude_m: T) -> T {
    if !matches!(kind, Kind::Earth | Kind::EarthSphere) || !(altitude_m < T::from_f64(NONE_FROM_M)) {
        return T::ZERO;
    }
    let fading = (T::from_f64(NONE_FROM_M) - altitude_m) / T::from_f64(NONE_FROM_M - WHOLE_BELOW_M);
    // A limb far below the ground, from a negative limb height, is not bent more than one at sea level.
    let density = |height_m: T| {
        let h = height_m.max(T::ZERO);
        (-h * (T::from_f64(FALL[0]) + h * T::from_f64(FALL[1]))).exp()
    };
    let raised_m = (radius_m + limb_m) * T::from_f64(AT_SEA_LEVEL) * (density(limb_m) - density(altitude_m));
    // For a camera just above the limb the light bends nearly as the ground does: the limb stays below the camera.
    raised_m.max(T::ZERO).min((altitude_m - limb_m).max(T::ZERO) * T::from_f64(0.5)) * fading.min(T::one())
}

/// Returns the height of a limb that the air raises to `apparent_m`, metres, and its derivative by `apparent_m`.
pub(super) fn lowered_m<T: Real>(kind: Kind, radius_m: T, apparent_m: T, altitude_m: T) -> (T, T) {
    let raised = |limb_m: T| raised_m(kind, radius_m, limb_m, altitude_m);
    let mut limb_m = apparent_m;
    // A limb that is 1 m higher is raised by at most 0.5 m less: each turn halves the error at least.
    for _ in 0..20 {
        limb_m = apparent_m - raised(limb_m);
    }
    let step = T::from_f64(100.0);
    (limb_m, T::one() / (T::one() + (raised(limb_m + step) - raised(limb_m)) / step))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::body::{Expected, Prior};

    /// Returns the expected half-angle of a limb at sea level, in degrees, minus that of straight rays.
    fn bent_deg(altitude_m: f64, kind: Kind) -> f64 {
        let body = Config { kind, limb_height_km: 0.0, radius_km: None, ..Config::default() };
        let seen = Expected::<f64>::new(&body, &Prior { altitude_m: Some(altitude_m), ..Prior::default() }).unwrap();
        let straight = libm::asin(6371.0088e3 / (6371.0088e3 + altitude_m));
        (libm::acos(seen.cos) - straight).to_degrees()
    }

    #[test]
    fn the_horizon_of_a_balloon_is_raised() {
        // sin α = n(0) R/(n(H) (R + H)) with the densities of the standard atmosphere.
        for (altitude_m, density, want_deg) in [(12e3, 0.2546, 0.199), (30e3, 0.015_03, 0.164)] {
            let n = |density: f64| 1.0 + AT_SEA_LEVEL * density;
            let straight = 6371.0088e3 / (6371.0088e3 + altitude_m);
            let bent = libm::asin(n(1.0) / n(density) * straight) - libm::asin(straight);
            assert!((bent.to_degrees() - want_deg).abs() < 0.001, "{}", bent.to_degrees());
            assert!((bent_deg(altitude_m, Kind::EarthSphere) - want_deg).abs() < 0.003, "{altitude_m}");
            assert!((bent_deg(altitude_m, Kind::Earth) - want_deg).abs() < 0.003, "{altitude_m}");
        }
        assert_eq!(raised_m(Kind::Earth, 6371e3, 17e3, 60e3), 0.0);
        assert_eq!(raised_m(Kind::Mars, 3390e3, 0.0, 10e3), 0.0);
        // A camera just above the limb sees it through little air, so that it has a cone.
        let near = Prior { altitude_m: Some(17_001.0), ..Prior::default() };
        assert!(Expected::<f32>::new(&Config::default(), &near).is_ok());
    }

    #[test]
    fn the_bending_fades_on_the_way_to_space() {
        let at = |altitude_m: f64| raised_m(Kind::Earth, 6371e3, 0.0, altitude_m);
        assert!((at(44.9e3) - at(45.1e3)).abs() < 20.0 && at(53e3) / at(45e3) < 0.5 && at(59.9e3) < 13.0);
    }

    #[test]
    fn a_limb_is_found_below_the_air() {
        for (limb_m, altitude_m) in [(0.0, 12e3), (0.0, 30e3), (8e3, 30e3), (17e3, 18e3), (17e3, 55e3), (30e3, 400e3)] {
            let apparent = |limb_m: f64| limb_m + raised_m(Kind::Earth, 6371e3, limb_m, altitude_m);
            let (height_m, slope) = lowered_m(Kind::Earth, 6371e3, apparent(limb_m), altitude_m);
            assert!((height_m - limb_m).abs() < 0.1, "{height_m}");
            let further = lowered_m(Kind::Earth, 6371e3, apparent(limb_m) + 10.0, altitude_m).0;
            assert!(((further - height_m) / 10.0 - slope).abs() < 0.02, "{slope}");
        }
    }

    #[test]
    fn a_position_bends_as_an_altitude_does() {
        let at = |prior: Prior<f64>| Expected::<f64>::new(&Config::default(), &prior).unwrap();
        let equator = at(Prior { position_m: Some([6378.137e3 + 30e3, 0.0, 0.0]), ..Prior::default() });
        let altitude = at(Prior { altitude_m: Some(30e3), ..Prior::default() });
        let bent = libm::acos(altitude.cos) - libm::asin((6371.0088 + 17.0) / (6371.0088 + 30.0));
        assert!((bent.to_degrees() - 0.028).abs() < 0.003, "{}", bent.to_degrees());
        assert!(equator.raised_m > 150.0 && (equator.raised_m - altitude.raised_m).abs() < 1.0);
        // The height that explains a half-angle is that of the light, not the raised one.
        let (height, _) = altitude.limb_height_m(altitude.cos).unwrap();
        assert!((height - 17e3).abs() < 1e-6, "{height}");
        let (seen, _) = altitude.altitude(altitude.cos, 0.0).unwrap();
        assert!((seen - 30e3).abs() < 1e-6, "{seen}");
        // A limb at another height than the told one is bent by another angle: with the height that is returned, the
        // expected half-angle is the measured one.
        let ground = Config { limb_height_km: 0.0, ..Config::default() };
        let balloon = Prior { altitude_m: Some(30e3), ..Prior::default() };
        let measured = Expected::<f64>::new(&ground, &balloon).unwrap().cos;
        let (height, slope) = altitude.limb_height_m(measured).unwrap();
        assert!(height.abs() < 0.5, "{height}");
        let (above, _) = altitude.limb_height_m(measured - 1e-6).unwrap();
        assert!(((height - above) / 1e-6 / slope - 1.0).abs() < 0.03);
    }
}
