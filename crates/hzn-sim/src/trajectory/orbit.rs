//! Kepler's ellipse around the Earth's centre of mass, without perturbations. Over the minutes and hours of a sequence,
//! perturbations move the satellite along its path, but they do not move the limb in the picture.

use core::f64::consts::TAU;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::earth::{EARTH_RATE, MU, to_ecef};
use super::point::Point;
use hzn_core::ellipsoid::EARTH_MEAN_RADIUS_M;
use hzn_nav::ephemeris;

/// An orbit, given by its elements at time 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Orbit {
    /// Height of the perigee above the mean radius (6371 km), kilometres.
    pub perigee_km: f64,
    /// Height of the apogee above the mean radius, kilometres. Without a value the orbit is a circle at the height of
    /// the perigee.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub apogee_km: Option<f64>,
    /// Inclination in degrees.
    pub inclination_deg: f64,
    /// Right ascension of the ascending node, degrees.
    pub node_deg: f64,
    /// Argument of the perigee, degrees.
    pub perigee_arg_deg: f64,
    /// Mean anomaly at time 0, degrees.
    pub mean_anomaly_deg: f64,
}

impl Default for Orbit {
    fn default() -> Self {
        Self {
            perigee_km: 600.0,
            apogee_km: None,
            inclination_deg: 97.8,
            node_deg: 0.0,
            perigee_arg_deg: 0.0,
            mean_anomaly_deg: 0.0,
        }
    }
}

/// [`Orbit`], prepared for evaluation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ellipse {
    semi_axis_m: f64,
    eccentricity: f64,
    mean_anomaly_rad: f64,
    rate_radps: f64,
    /// Unit vectors in inertial axes: towards the perigee, and a quarter turn further along the orbit.
    axes: [Vector3<f64>; 2],
    start_sidereal_rad: f64,
}

impl Ellipse {
    pub(crate) fn try_new(orbit: &Orbit, start_unix_s: f64) -> Result<Self, (String, String)> {
        let apogee_km = orbit.apogee_km.unwrap_or(orbit.perigee_km);
        let refuse = |key: &str, value: f64, what: &str| {
            Err((format!("[trajectory] orbit.{key}"), format!("{value} is refused: {what}")))
        };
        if !(50.0..1e6).contains(&orbit.perigee_km) {
            return refuse("perigee_km", orbit.perigee_km, "must be 50 to 1000000 km above the mean radius");
        }
        if !(apogee_km >= orbit.perigee_km && apogee_km < 1e6) {
            return refuse("apogee_km", apogee_km, "must not be below perigee_km");
        }
        let (p, a) = (EARTH_MEAN_RADIUS_M + orbit.perigee_km * 1e3, EARTH_MEAN_RADIUS_M + apogee_km * 1e3);
        let semi_axis_m = 0.5 * (p + a);
        let sincos = |deg: f64| libm::sincos(deg.to_radians());
        let ((sn, cn), (si, ci), (sw, cw)) =
            (sincos(orbit.node_deg), sincos(orbit.inclination_deg), sincos(orbit.perigee_arg_deg));
        let node = Vector3::new(cn, sn, 0.0);
        let ahead = Vector3::new(-sn * ci, cn * ci, si);
        Ok(Self {
            semi_axis_m,
            eccentricity: (a - p) / (a + p),
            mean_anomaly_rad: orbit.mean_anomaly_deg.to_radians(),
            rate_radps: (MU / (semi_axis_m * semi_axis_m * semi_axis_m)).sqrt(),
            axes: [node * cw + ahead * sw, ahead * cw - node * sw],
            start_sidereal_rad: ephemeris::sidereal_rad(start_unix_s),
        })
    }

    pub(crate) fn point(&self, time_s: f64) -> Point {
        let (e, a) = (self.eccentricity, self.semi_axis_m);
        let mean = (self.mean_anomaly_rad + self.rate_radps * time_s).rem_euclid(TAU);
        // Newton's steps solve Kepler's equation. From this start they converge for every ellipse.
        let mut anomaly = if e > 0.8 { core::f64::consts::PI } else { mean };
        for _ in 0..15 {
            anomaly -= (anomaly - e * libm::sin(anomaly) - mean) / (1.0 - e * libm::cos(anomaly));
        }
        let (s, c) = libm::sincos(anomaly);
        let side = (1.0 - e * e).sqrt();
        let x = (self.axes[0] * (c - e) + self.axes[1] * (side * s)) * a;
        let v = (self.axes[1] * (side * c) - self.axes[0] * s) * (a * self.rate_radps / (1.0 - e * c));
        let angle = self.start_sidereal_rad + EARTH_RATE * time_s;
        let position_m = to_ecef(angle, &x);
        Point {
            position_m,
            velocity_mps: to_ecef(angle, &v) - Vector3::new(0.0, 0.0, EARTH_RATE).cross(&position_m),
            specific_force_mps2: Vector3::zeros(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ellipse_keeps_energy_and_its_ends() {
        let orbit = Orbit { perigee_km: 500.0, apogee_km: Some(39_000.0), inclination_deg: 63.4, ..Orbit::default() };
        let ellipse = Ellipse::try_new(&orbit, 1.6e9).unwrap();
        let period_s = TAU / ellipse.rate_radps;
        assert!((ellipse.point(0.0).position_m.norm() - 6.871_008_8e6).abs() < 1.0);
        assert!((ellipse.point(period_s / 2.0).position_m.norm() - 45.371_008_8e6).abs() < 1.0);
        for i in 0..20 {
            let p = ellipse.point(period_s * f64::from(i) / 20.0);
            let v = p.velocity_mps + Vector3::new(0.0, 0.0, EARTH_RATE).cross(&p.position_m);
            let energy = 0.5 * v.norm_squared() - MU / p.position_m.norm();
            assert!((energy / (-MU / (2.0 * ellipse.semi_axis_m)) - 1.0).abs() < 1e-9);
        }
        let d = (ellipse.point(100.01).position_m - ellipse.point(99.99).position_m) / 0.02;
        assert!((d - ellipse.point(100.0).velocity_mps).norm() < 1e-3);
    }
}
