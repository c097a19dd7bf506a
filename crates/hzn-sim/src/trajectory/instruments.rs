//! Signals of the vehicle's other sensors: gyroscopes, accelerometers and satellite navigation receiver.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::path::Path;
use crate::counter::{Counter, Stream};

/// An inertial measurement unit in the vehicle's axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Imu {
    /// Samples per second.
    pub rate_hz: f64,
    /// Time of the first sample, seconds; without it, that of the first picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// Standard deviation of the gyroscopes' constant errors, degrees per second.
    pub gyro_bias_deg_s: f64,
    /// Standard deviation of the gyroscopes' scale factor errors, parts per million.
    pub gyro_scale_ppm: f64,
    /// Standard deviation of the rotation of the gyroscopes' axes against the vehicle's about each axis, mrad.
    pub gyro_misalignment_mrad: f64,
    /// Standard deviation of the noise of a gyroscope sample, degrees per second.
    pub gyro_noise_deg_s: f64,
    /// Quantisation step of the gyroscopes, degrees per second; 0 means no quantisation.
    pub gyro_step_deg_s: f64,
    /// Largest rate that a gyroscope can measure, degrees per second.
    pub gyro_range_deg_s: f64,
    /// Standard deviation of the accelerometers' constant errors, m/s².
    pub accel_bias_mps2: f64,
    /// Standard deviation of the accelerometers' scale factor errors, parts per million.
    pub accel_scale_ppm: f64,
    /// Standard deviation of the rotation of the accelerometers' axes against the vehicle's about each axis, mrad.
    pub accel_misalignment_mrad: f64,
    /// Standard deviation of the noise of an accelerometer sample, m/s².
    pub accel_noise_mps2: f64,
    /// Quantisation step of the accelerometers, m/s²; 0 means no quantisation.
    pub accel_step_mps2: f64,
    /// Largest specific force that an accelerometer can measure, m/s².
    pub accel_range_mps2: f64,
}

impl Default for Imu {
    /// Returns the values of a small unit of good quality.
    fn default() -> Self {
        Self {
            rate_hz: 100.0,
            from_s: None,
            gyro_bias_deg_s: 0.05,
            gyro_scale_ppm: 0.0,
            gyro_misalignment_mrad: 0.0,
            gyro_noise_deg_s: 0.03,
            gyro_step_deg_s: 0.005,
            gyro_range_deg_s: 2000.0,
            accel_bias_mps2: 0.02,
            accel_scale_ppm: 0.0,
            accel_misalignment_mrad: 0.0,
            accel_noise_mps2: 0.02,
            accel_step_mps2: 0.005,
            accel_range_mps2: 160.0,
        }
    }
}

/// A row of imu.csv.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImuRow {
    /// Time in seconds.
    pub time_s: f64,
    /// Rate relative to inertial space about the vehicle's x axis, rad/s.
    pub gyro_x_radps: f64,
    /// Rate about the vehicle's y axis, rad/s.
    pub gyro_y_radps: f64,
    /// Rate about the vehicle's z axis, rad/s.
    pub gyro_z_radps: f64,
    /// Specific force along the vehicle's x axis, m/s².
    pub accel_x_mps2: f64,
    /// Specific force along the vehicle's y axis, m/s².
    pub accel_y_mps2: f64,
    /// Specific force along the vehicle's z axis, m/s².
    pub accel_z_mps2: f64,
    /// 1 if one of the six values is at the end of its range, else 0.
    pub saturated: u8,
}

/// A satellite navigation receiver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Gnss {
    /// Fixes per second.
    pub rate_hz: f64,
    /// Standard deviation of every component of the position, metres.
    pub position_noise_m: f64,
    /// Standard deviation of every component of the velocity, m/s.
    pub velocity_noise_mps: f64,
    /// Time of the first fix, seconds; without it, that of the first picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// Times without fixes, as [from, to] in seconds.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outages_s: Vec<[f64; 2]>,
    /// Times with wrong positions, as [from, to] in seconds. The receiver does not know that they are wrong.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jumps_s: Vec<[f64; 2]>,
    /// Error of the position during `jumps_s`, metres, in a random direction.
    pub jump_m: f64,
}

impl Default for Gnss {
    fn default() -> Self {
        Self {
            rate_hz: 1.0,
            position_noise_m: 5.0,
            velocity_noise_mps: 0.1,
            from_s: None,
            outages_s: Vec::new(),
            jumps_s: Vec::new(),
            jump_m: 1000.0,
        }
    }
}

/// A row of gnss.csv, in ECEF; the velocity is relative to the rotating Earth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GnssRow {
    /// Time in seconds.
    pub time_s: f64,
    /// First component of the position, metres.
    pub x_m: f64,
    /// Second component of the position, metres.
    pub y_m: f64,
    /// Third component of the position, metres.
    pub z_m: f64,
    /// First component of the velocity, m/s.
    pub vx_mps: f64,
    /// Second component of the velocity, m/s.
    pub vy_mps: f64,
    /// Third component of the velocity, m/s.
    pub vz_mps: f64,
    /// 1-sigma of every component of the position, metres.
    pub position_sigma_m: f64,
    /// 1-sigma of every component of the velocity, m/s.
    pub velocity_sigma_mps: f64,
}

/// Returns numbers and times of the samples from `from_s` to `to_s`. The last sample can be exactly at `to_s`.
pub(super) fn times(rate_hz: f64, [from_s, to_s]: [f64; 2]) -> impl Iterator<Item = (u64, f64)> {
    let count = ((to_s - from_s) * rate_hz + 1e-9).floor().max(0.0) as u64;
    (0..=count).map(move |i| (i, from_s + i as f64 / rate_hz))
}

/// Constant errors of an inertial measurement unit. It measures ω̃ = ω + b + S ω + m × ω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuErrors {
    /// Biases of the gyroscopes, rad/s.
    pub gyro_bias_radps: [f64; 3],
    /// Scale factor errors of the gyroscopes.
    pub gyro_scale: [f64; 3],
    /// Rotation of the gyroscopes' axes, rad.
    pub gyro_misalignment_rad: [f64; 3],
    /// Biases of the accelerometers, m/s².
    pub accel_bias_mps2: [f64; 3],
    /// Scale factor errors of the accelerometers.
    pub accel_scale: [f64; 3],
    /// Rotation of the accelerometers' axes, rad.
    pub accel_misalignment_rad: [f64; 3],
}

/// Returns a vector as an instrument with these errors measures it.
fn measured(truth: &Vector3<f64>, bias: [f64; 3], scale: [f64; 3], misalignment: [f64; 3]) -> Vector3<f64> {
    truth + Vector3::from(bias) + Vector3::from(scale).component_mul(truth) + Vector3::from(misalignment).cross(truth)
}

impl Imu {
    /// Fails for the first value that is out of its limits.
    pub(crate) fn check(&self) -> Result<(), (String, String)> {
        let rate_is_valid = self.rate_hz > 0.0 && self.rate_hz <= 10_000.0;
        let all = [
            ("rate_hz", self.rate_hz, rate_is_valid, "above 0, at most 10000"),
            ("gyro_range_deg_s", self.gyro_range_deg_s, self.gyro_range_deg_s > 0.0, "above 0"),
            ("accel_range_mps2", self.accel_range_mps2, self.accel_range_mps2 > 0.0, "above 0"),
            ("gyro_noise_deg_s", self.gyro_noise_deg_s, self.gyro_noise_deg_s >= 0.0, "0 or more"),
            ("accel_noise_mps2", self.accel_noise_mps2, self.accel_noise_mps2 >= 0.0, "0 or more"),
            ("gyro_scale_ppm", self.gyro_scale_ppm, self.gyro_scale_ppm.is_finite(), "finite"),
            ("gyro_misalignment_mrad", self.gyro_misalignment_mrad, self.gyro_misalignment_mrad.is_finite(), "finite"),
            ("accel_scale_ppm", self.accel_scale_ppm, self.accel_scale_ppm.is_finite(), "finite"),
            (
                "accel_misalignment_mrad",
                self.accel_misalignment_mrad,
                self.accel_misalignment_mrad.is_finite(),
                "finite",
            ),
            ("from_s", self.from_s.unwrap_or(0.0), self.from_s.is_none_or(f64::is_finite), "finite"),
        ];
        match all.into_iter().find(|(.., is_valid, _)| !is_valid) {
            Some((key, value, _, rule)) => Err((format!("[imu] {key}"), format!("{value} is refused: must be {rule}"))),
            None => Ok(()),
        }
    }

    /// Returns the constant errors of the unit in a flight.
    pub fn errors(&self, seed: u64) -> ImuErrors {
        let three = |draws: Counter, first: u64, sigma: f64| [0, 1, 2].map(|i| sigma * draws.normal(first + i));
        let (biases, others) = (Counter::new(seed, Stream::Imu), Counter::new(seed, Stream::ImuErrors));
        ImuErrors {
            gyro_bias_radps: three(biases, 0, self.gyro_bias_deg_s.to_radians()),
            gyro_scale: three(others, 0, self.gyro_scale_ppm * 1e-6),
            gyro_misalignment_rad: three(others, 3, self.gyro_misalignment_mrad * 1e-3),
            accel_bias_mps2: three(biases, 3, self.accel_bias_mps2),
            accel_scale: three(others, 6, self.accel_scale_ppm * 1e-6),
            accel_misalignment_rad: three(others, 9, self.accel_misalignment_mrad * 1e-3),
        }
    }

    /// Returns the samples of a flight.
    pub fn rows(&self, path: &Path, [from_s, to_s]: [f64; 2], seed: u64) -> impl Iterator<Item = ImuRow> {
        let (imu, path, draws) = (*self, path.clone(), Counter::new(seed, Stream::Imu));
        let rad = f64::to_radians;
        let errors = self.errors(seed);
        let span_s = [self.from_s.unwrap_or(from_s), to_s];
        times(imu.rate_hz, span_s).map(move |(i, time_s)| {
            let state = path.state(time_s);
            let force = state.fixed_from_vehicle.inverse_transform_vector(&state.specific_force_mps2);
            let first = 6 + 6 * i;
            let mut saturated = false;
            let mut measure = |truth: Vector3<f64>, first: u64, noise: f64, step: f64, range: f64| -> [f64; 3] {
                core::array::from_fn(|a| {
                    let value = truth[a] + noise * draws.normal(first + a as u64);
                    let stepped = if step > 0.0 { (value / step).round() * step } else { value };
                    saturated |= stepped.abs() >= range;
                    stepped.clamp(-range, range)
                })
            };
            let gyro = measure(
                measured(&state.rate_radps, errors.gyro_bias_radps, errors.gyro_scale, errors.gyro_misalignment_rad),
                first,
                rad(imu.gyro_noise_deg_s),
                rad(imu.gyro_step_deg_s),
                rad(imu.gyro_range_deg_s),
            );
            let accel = measure(
                measured(&force, errors.accel_bias_mps2, errors.accel_scale, errors.accel_misalignment_rad),
                first + 3,
                imu.accel_noise_mps2,
                imu.accel_step_mps2,
                imu.accel_range_mps2,
            );
            ImuRow {
                time_s,
                gyro_x_radps: gyro[0],
                gyro_y_radps: gyro[1],
                gyro_z_radps: gyro[2],
                accel_x_mps2: accel[0],
                accel_y_mps2: accel[1],
                accel_z_mps2: accel[2],
                saturated: u8::from(saturated),
            }
        })
    }
}

impl Gnss {
    pub(crate) fn check(&self) -> Result<(), (String, String)> {
        let refuse = |key: &str, what: String| Err((format!("[gnss] {key}"), what));
        if !(self.rate_hz > 0.0 && self.rate_hz <= 1000.0) {
            return refuse("rate_hz", format!("{} is refused: must be above 0, at most 1000", self.rate_hz));
        }
        for (key, spans) in [("outages_s", &self.outages_s), ("jumps_s", &self.jumps_s)] {
            if let Some([from_s, to_s]) = spans.iter().find(|[from_s, to_s]| !(from_s < to_s)) {
                return refuse(key, format!("[{from_s}, {to_s}] is refused: the second time must be the later one"));
            }
        }
        Ok(())
    }

    /// Returns the fixes of a flight.
    pub fn rows(&self, path: &Path, [from_s, to_s]: [f64; 2], seed: u64) -> impl Iterator<Item = GnssRow> {
        let (gnss, path, draws) = (self.clone(), path.clone(), Counter::new(seed, Stream::Gnss));
        let jump = Vector3::from([0, 1, 2].map(|a| draws.normal(u64::MAX - a))).normalize() * self.jump_m;
        times(self.rate_hz, [self.from_s.unwrap_or(from_s), to_s]).filter_map(move |(i, time_s)| {
            if is_within(&gnss.outages_s, time_s) {
                return None;
            }
            let point = path.point(time_s);
            let noise =
                |first: u64, sigma: f64| Vector3::from([0, 1, 2].map(|a| sigma * draws.normal(6 * i + first + a)));
            let jump = if is_within(&gnss.jumps_s, time_s) { jump } else { Vector3::zeros() };
            let x = point.position_m + noise(0, gnss.position_noise_m) + jump;
            let v = point.velocity_mps + noise(3, gnss.velocity_noise_mps);
            Some(GnssRow {
                time_s,
                x_m: x.x,
                y_m: x.y,
                z_m: x.z,
                vx_mps: v.x,
                vy_mps: v.y,
                vz_mps: v.z,
                position_sigma_m: gnss.position_noise_m,
                velocity_sigma_mps: gnss.velocity_noise_mps,
            })
        })
    }
}

/// Returns whether a time lies in one of these spans.
fn is_within(spans_s: &[[f64; 2]], time_s: f64) -> bool {
    spans_s.iter().any(|[from_s, to_s]| (*from_s..=*to_s).contains(&time_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Attitude, Orbit, Rocket, Spin, Trajectory, Tumble};

    fn rocket() -> Path {
        Path::try_new(
            &Trajectory::Rocket(Rocket::default()),
            &Attitude::Spin(Spin::default()),
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 430.0],
            1_560_421_800.0,
            3,
        )
        .unwrap()
    }

    #[test]
    fn a_rocket_spins_up_and_drifts_under_its_limit() {
        let path = rocket();
        assert!((path.state(50.0).rate_radps.x / (3.0 * core::f64::consts::TAU) - 1.0).abs() < 0.01);
        let limit = 0.9f64.to_radians() * 1.1;
        let largest = (60..430).map(|t| path.state(f64::from(t)).rate_radps.amax()).fold(0.0, f64::max);
        assert!(largest < limit && largest > 0.4 * limit, "{largest}");
        // Under thrust the force is along the vehicle, except for the angle `cone_deg`.
        let state = path.state(30.0);
        let force = state.fixed_from_vehicle.inverse_transform_vector(&state.specific_force_mps2);
        assert!(force.x > 0.99 * force.norm() && force.x > 20.0);
    }

    #[test]
    fn rates_turn_the_attitude() {
        // A strap-down integration of exact gyroscopes gives the attitude.
        let path = rocket();
        let exact = Imu {
            rate_hz: 1000.0,
            gyro_bias_deg_s: 0.0,
            gyro_noise_deg_s: 0.0,
            gyro_step_deg_s: 0.0,
            ..Imu::default()
        };
        let start = 70.0005;
        let mut q = path.state(70.0).fixed_from_vehicle;
        for row in exact.rows(&path, [start, start + 9.999], 1) {
            let w = Vector3::new(row.gyro_x_radps, row.gyro_y_radps, row.gyro_z_radps);
            let earth = q.inverse_transform_vector(&Vector3::new(0.0, 0.0, crate::trajectory::earth::EARTH_RATE));
            q *= nalgebra::UnitQuaternion::from_scaled_axis((w - earth) * 1e-3);
        }
        let off = q.angle_to(&path.state(80.0).fixed_from_vehicle);
        assert!(off < 1e-4, "{off}");
    }

    #[test]
    fn range_and_steps_are_kept() {
        let imu = Imu { rate_hz: 10.0, gyro_range_deg_s: 500.0, ..Imu::default() };
        let rows: Vec<ImuRow> = imu.rows(&rocket(), [30.0, 60.0], 1).collect();
        assert_eq!(rows.len(), 301);
        assert!(rows.iter().any(|r| r.saturated == 1) && rows.iter().any(|r| r.saturated == 0));
        let step = 0.005f64.to_radians();
        assert!(rows.iter().all(|r| r.gyro_x_radps.abs() <= 500f64.to_radians() + 1e-12));
        assert!(rows.iter().all(|r| {
            let k = r.gyro_y_radps / step;
            (k - k.round()).abs() < 1e-6
        }));
    }

    #[test]
    fn free_fall_is_felt_by_nothing_and_a_tumble_keeps_its_momentum() {
        let tumble = Tumble::default();
        let path = Path::try_new(
            &Trajectory::Orbit(Orbit::default()),
            &Attitude::Tumble(tumble),
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 600.0],
            1.6e9,
            5,
        )
        .unwrap();
        let momentum = |t: f64| {
            let s = path.state(t);
            assert_eq!(s.specific_force_mps2.norm(), 0.0);
            let body = Vector3::from(tumble.inertia).component_mul(&s.rate_radps);
            crate::trajectory::earth::from_ecef(path.sidereal_rad(t), &(s.fixed_from_vehicle * body))
        };
        let (a, b) = (momentum(0.0), momentum(600.0));
        assert!((a - b).norm() < 1e-3 * a.norm(), "{a} {b}");
        let fixes: Vec<GnssRow> = Gnss::default().rows(&path, [0.0, 100.0], 2).collect();
        assert_eq!(fixes.len(), 101);
        let off = Vector3::new(fixes[7].x_m, fixes[7].y_m, fixes[7].z_m) - path.state(7.0).position_m;
        assert!(off.norm() < 40.0 && off.norm() > 0.1);
    }
}
