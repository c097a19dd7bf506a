//! A sounding rocket with two stages, for example the VSB-30: a gravity turn under thrust, then free fall.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::earth::{EARTH_RATE, from_ecef, gravity, to_ecef};
use super::point::Point;
use crate::globe::Globe;
use crate::pose::position_m;
use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M};
use hzn_nav::ephemeris;

/// The ascent. The acceleration of the stages follows from the apogee.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Rocket {
    /// Geodetic latitude of the pad, degrees.
    pub lat_deg: f64,
    /// Longitude of the pad, degrees.
    pub lon_deg: f64,
    /// Direction of the flight over ground, degrees from north to east.
    pub azimuth_deg: f64,
    /// Elevation of the rail, degrees.
    pub elevation_deg: f64,
    /// Altitude of the highest point, kilometres.
    pub apogee_km: f64,
    /// Seconds from lift-off at which the first stage burns out.
    pub first_stage_s: f64,
    /// Seconds from lift-off at which the second stage ignites and burns out.
    pub second_stage_s: [f64; 2],
    /// Acceleration of the first stage divided by the acceleration of the second stage.
    pub first_over_second: f64,
}

impl Default for Rocket {
    /// Returns MAPHEUS-8 as far as it is published: Esrange, apogee 238 km on a VSB-30 (12 s and 29 s of thrust).
    fn default() -> Self {
        Self {
            lat_deg: 67.89,
            lon_deg: 21.10,
            azimuth_deg: 350.0,
            elevation_deg: 86.5,
            apogee_km: 238.0,
            first_stage_s: 12.0,
            second_stage_s: [15.0, 44.0],
            first_over_second: 1.2,
        }
    }
}

impl Rocket {
    fn thrust(&self, time_s: f64, second: f64) -> f64 {
        if time_s < 0.0 {
            0.0
        } else if time_s < self.first_stage_s {
            second * self.first_over_second
        } else if (self.second_stage_s[0]..self.second_stage_s[1]).contains(&time_s) {
            second
        } else {
            0.0
        }
    }
}

/// A flight in steps, in an inertial frame.
#[derive(Debug, Clone)]
pub(crate) struct Ascent {
    /// (position, velocity, specific force) at every [`STEP_S`] from time 0.
    steps: Vec<[Vector3<f64>; 3]>,
    start_sidereal_rad: f64,
}

const STEP_S: f64 = 0.05;

impl Ascent {
    pub(crate) fn try_new(rocket: &Rocket, to_s: f64, start_unix_s: f64) -> Result<Self, (String, String)> {
        let key = |k: &str| format!("[trajectory] rocket.{k}");
        let [lit, out] = rocket.second_stage_s;
        if !(0.0 < rocket.first_stage_s && rocket.first_stage_s <= lit && lit < out) {
            let what = "times must rise: 0, the first stage's end, the second stage's start and end";
            return Err((key("second_stage_s"), what.into()));
        }
        if !(10.0..=2000.0).contains(&rocket.apogee_km) {
            return Err((key("apogee_km"), format!("{} is refused: must be 10 to 2000", rocket.apogee_km)));
        }
        if !(60.0..=90.0).contains(&rocket.elevation_deg) {
            return Err((key("elevation_deg"), format!("{} is refused: must be 60 to 90", rocket.elevation_deg)));
        }
        let start_sidereal_rad = ephemeris::sidereal_rad(start_unix_s);
        let (mut low, mut high) = (12.0, 400.0);
        for _ in 0..40 {
            let mid = 0.5 * (low + high);
            let apogee_m = Self::fly(rocket, mid, start_sidereal_rad, f64::INFINITY).1;
            if apogee_m < rocket.apogee_km * 1e3 { low = mid } else { high = mid }
        }
        let (steps, _) = Self::fly(rocket, high, start_sidereal_rad, to_s);
        let lasts_s = steps.len() as f64 * STEP_S;
        if lasts_s < to_s {
            let what = format!("{to_s} s is after the impact at {lasts_s:.0} s");
            return Err(("[capture] to_s".into(), what));
        }
        Ok(Self { steps, start_sidereal_rad })
    }

    /// Returns the steps up to `to_s` or to the ground, and the highest altitude in metres. If `to_s` is infinite, the
    /// flight ends at the apogee and no steps are kept.
    fn fly(rocket: &Rocket, second: f64, sidereal: f64, to_s: f64) -> (Vec<[Vector3<f64>; 3]>, f64) {
        let globe = Globe { a_m: WGS84_A_M, b_m: WGS84_B_M };
        let pad = Vector3::from(position_m(rocket.lat_deg, rocket.lon_deg, 0.3));
        let (sl, cl) = libm::sincos(rocket.lat_deg.to_radians());
        let (so, co) = libm::sincos(rocket.lon_deg.to_radians());
        let (east, north) = (Vector3::new(-so, co, 0.0), Vector3::new(-sl * co, -sl * so, cl));
        let up = Vector3::new(cl * co, cl * so, sl);
        let (sa, ca) = libm::sincos(rocket.azimuth_deg.to_radians());
        let (se, ce) = libm::sincos(rocket.elevation_deg.to_radians());
        let rail = (east * sa + north * ca) * ce + up * se;
        let earth = Vector3::new(0.0, 0.0, EARTH_RATE);
        let mut x = from_ecef(sidereal, &pad);
        let mut v = earth.cross(&x);
        let rail = from_ecef(sidereal, &rail);
        let (mut steps, mut highest, mut t) = (Vec::new(), 0.0f64, 0.0);
        loop {
            // The thrust is along the rail until the rocket is fast, then along its velocity through the air.
            let force = |t: f64, x: &Vector3<f64>, v: &Vector3<f64>| {
                let through_air = v - earth.cross(x);
                let along = if through_air.norm() > 60.0 { through_air.normalize() } else { rail };
                along * rocket.thrust(t, second)
            };
            let altitude = globe.altitude_m(x.into());
            highest = highest.max(altitude);
            if to_s.is_finite() {
                steps.push([x, v, force(t, &x, &v)]);
            }
            // Two more seconds are kept for the interpolation.
            let is_over = if to_s.is_finite() { t > to_s + 2.0 } else { t > 60.0 && altitude < highest };
            if is_over || (t > 60.0 && altitude < 0.0) {
                return (steps, highest);
            }
            // The integration is a Runge-Kutta method of fourth order.
            let f = |t: f64, x: &Vector3<f64>, v: &Vector3<f64>| gravity(x) + force(t, x, v);
            let h = STEP_S;
            let (k1x, k1v) = (v, f(t, &x, &v));
            let (k2x, k2v) = (v + k1v * (h / 2.0), f(t + h / 2.0, &(x + k1x * (h / 2.0)), &(v + k1v * (h / 2.0))));
            let (k3x, k3v) = (v + k2v * (h / 2.0), f(t + h / 2.0, &(x + k2x * (h / 2.0)), &(v + k2v * (h / 2.0))));
            let (k4x, k4v) = (v + k3v * h, f(t + h, &(x + k3x * h), &(v + k3v * h)));
            x += (k1x + (k2x + k3x) * 2.0 + k4x) * (h / 6.0);
            v += (k1v + (k2v + k3v) * 2.0 + k4v) * (h / 6.0);
            t += h;
        }
    }

    /// Interpolates between two steps. The position follows Hermite's cubic, which matches position and velocity at
    /// both steps. Velocity and specific force are linear.
    pub(crate) fn point(&self, time_s: f64) -> Point {
        let place = (time_s / STEP_S).clamp(0.0, (self.steps.len().saturating_sub(2)) as f64);
        let i = place as usize;
        let s = place - i as f64;
        let (Some([x0, v0, f0]), Some([x1, v1, f1])) = (self.steps.get(i), self.steps.get(i + 1)) else {
            let zero = Vector3::zeros();
            return Point { position_m: zero, velocity_mps: zero, specific_force_mps2: zero };
        };
        let (h00, h10) = ((1.0 + 2.0 * s) * (1.0 - s) * (1.0 - s), s * (1.0 - s) * (1.0 - s) * STEP_S);
        let (h01, h11) = (s * s * (3.0 - 2.0 * s), s * s * (s - 1.0) * STEP_S);
        let x = x0 * h00 + v0 * h10 + x1 * h01 + v1 * h11;
        let v = v0 + (v1 - v0) * s;
        let force = f0 + (f1 - f0) * s;
        let angle = self.start_sidereal_rad + EARTH_RATE * time_s;
        let position_m = to_ecef(angle, &x);
        let earth = Vector3::new(0.0, 0.0, EARTH_RATE);
        Point {
            position_m,
            velocity_mps: to_ecef(angle, &v) - earth.cross(&position_m),
            specific_force_mps2: to_ecef(angle, &force),
        }
    }

    /// Returns the unit direction of the velocity through the air (ECEF) at a time; before 8 s, the direction at 8 s.
    pub(crate) fn forward(&self, time_s: f64) -> Vector3<f64> {
        let p = self.point(time_s.max(8.0));
        p.velocity_mps.normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_high_as_asked_for_and_free_in_between() {
        let ascent = Ascent::try_new(&Rocket::default(), 430.0, 1_560_421_800.0).unwrap();
        let globe = Globe { a_m: WGS84_A_M, b_m: WGS84_B_M };
        let altitude_km = |t: f64| globe.altitude_m(ascent.point(t).position_m.into()) / 1e3;
        let highest = (0..4300).map(|i| altitude_km(f64::from(i) * 0.1)).fold(0.0, f64::max);
        assert!((highest - 238.0).abs() < 0.05, "{highest}");
        // The published coast is T+60 s to T+430 s, above about 70 to 80 km.
        assert!((60.0..95.0).contains(&altitude_km(60.0)) && (60.0..95.0).contains(&altitude_km(430.0)));
        assert_eq!(ascent.point(100.0).specific_force_mps2.norm(), 0.0);
        assert!(ascent.point(20.0).specific_force_mps2.norm() > 20.0);
        // The velocity is the derivative of the position.
        let d = (ascent.point(200.01).position_m - ascent.point(199.99).position_m) / 0.02;
        assert!((d - ascent.point(200.0).velocity_mps).norm() < 1e-3);
    }

    #[test]
    fn beyond_the_impact_is_said() {
        let (key, what) = Ascent::try_new(&Rocket::default(), 900.0, 1.5e9).unwrap_err();
        assert!(key.contains("to_s") && what.contains("impact"), "{key} {what}");
    }
}
