//! The rotation of the vehicle.
//!
//! The x axis of the vehicle points forward, along a rocket; y and z are lateral. The scene's `[mount]` has the
//! attitude of the camera on the vehicle.

use core::f64::consts::TAU;

use hzn_core::body::Kind;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use super::{Path, PreparedTrajectory, from_ecef};
use crate::counter::{Counter, Stream};
use crate::pose::{Look, Pose};
use hzn_nav::ephemeris;

/// The rotation of the vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Attitude {
    /// A sounding rocket: spin-up under thrust, yo-yo, then drift under rate control.
    Spin(Spin),
    /// The camera looks down at an angle that changes evenly over the pictures.
    Pointing(Pointing),
    /// The camera looks at Sun, Moon or Earth, one after the other.
    Towards(Towards),
    /// A rigid body without torque.
    Tumble(Tumble),
    /// The attitude comes from `[trajectory] table`.
    Table,
}

/// A spinning rocket and its rate control.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spin {
    /// Spin about the long axis after burn-out, turns per second.
    pub spin_hz: f64,
    /// Time at which the spin is reached, seconds; the spin grows evenly from lift-off.
    pub spun_up_s: f64,
    /// Time at which the yo-yo is released, seconds. The spin is gone one second later, and rate control begins. `inf`:
    /// the spin goes on.
    pub yoyo_s: f64,
    /// Rate about the long axis at which a thruster fires, degrees per second.
    pub limit_deg_s: f64,
    /// Rate about the other two axes at which a thruster fires, degrees per second.
    pub lateral_limit_deg_s: f64,
    /// Largest angular acceleration of the disturbance (degrees/s²) divided by the rate limit (degrees/s). Its size and
    /// sign change at random times.
    pub disturbance_per_s: f64,
    /// Angle between the long axis and the direction of flight at burn-out, degrees. It grows evenly from lift-off.
    pub cone_deg: f64,
}

impl Default for Spin {
    fn default() -> Self {
        Self {
            spin_hz: 3.0,
            spun_up_s: 44.0,
            yoyo_s: 56.0,
            limit_deg_s: 0.9,
            lateral_limit_deg_s: 0.3,
            disturbance_per_s: 0.04,
            cone_deg: 3.0,
        }
    }
}

/// A camera whose angles change evenly from the first picture to the last one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pointing {
    /// Angle between the optical axis and straight down, degrees, in the first and the last picture.
    pub off_nadir_deg: [f64; 2],
    /// Azimuth over ground, degrees from north to east, in the first and the last picture.
    pub azimuth_deg: [f64; 2],
    /// Turn about the optical axis, degrees, in the first and the last picture.
    pub roll_deg: [f64; 2],
}

impl Default for Pointing {
    fn default() -> Self {
        Self { off_nadir_deg: [0.0, 0.0], azimuth_deg: [0.0, 0.0], roll_deg: [0.0, 0.0] }
    }
}

/// A camera that looks at one body after the other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Towards {
    /// `sun`, `moon`, `earth`; each gets an equal share of the time.
    pub bodies: Vec<Kind>,
    /// Amplitude of the optical axis's motion around the body, degrees.
    pub wander_deg: f64,
}

impl Default for Towards {
    fn default() -> Self {
        Self { bodies: vec![Kind::Sun, Kind::Moon], wander_deg: 3.0 }
    }
}

/// A rigid body without torque.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tumble {
    /// Rates about the vehicle's axes at time 0, degrees per second.
    pub rates_deg_s: [f64; 3],
    /// Moments of inertia about the vehicle's axes, in any unit.
    pub inertia: [f64; 3],
}

impl Default for Tumble {
    fn default() -> Self {
        Self { rates_deg_s: [1.5, -0.8, 0.5], inertia: [1.0, 1.6, 2.1] }
    }
}

/// [`Attitude`], prepared for evaluation.
#[derive(Debug, Clone)]
pub(crate) enum PreparedAttitude {
    /// Attitudes of the vehicle relative to inertial space, every [`STEP_S`] from `from_s`.
    Steps {
        from_s: f64,
        steps: Vec<UnitQuaternion<f64>>,
    },
    Pointing {
        pointing: Pointing,
        from_s: f64,
        to_s: f64,
    },
    Towards {
        towards: Towards,
        from_s: f64,
        to_s: f64,
        phase: f64,
    },
    Table,
}

const STEP_S: f64 = 0.01;

impl PreparedAttitude {
    pub(crate) fn try_new(
        attitude: &Attitude,
        path: &Path,
        [from_s, to_s]: [f64; 2],
        seed: u64,
    ) -> Result<Self, (String, String)> {
        let refuse = |key: &str, what: &str| Err((format!("[attitude] {key}"), what.to_owned()));
        match attitude {
            Attitude::Spin(spin) => {
                let PreparedTrajectory::Rocket(ascent) = &path.way else {
                    return refuse("spin", "is allowed only with [trajectory.rocket]");
                };
                if !(spin.limit_deg_s > 0.0 && spin.lateral_limit_deg_s > 0.0) {
                    return refuse("spin.limit_deg_s", "limit_deg_s and lateral_limit_deg_s must be above 0");
                }
                if !(spin.spin_hz.abs() <= 20.0) {
                    return refuse("spin.spin_hz", "must be at most 20 turns per second");
                }
                Ok(spin.steps(path, ascent, to_s, seed))
            }
            Attitude::Tumble(tumble) => {
                if !tumble.inertia.iter().all(|&i| i > 0.0) {
                    return refuse("tumble.inertia", "all three must be above 0");
                }
                if tumble.rates_deg_s.iter().any(|r| !(r.abs() <= 3600.0)) {
                    return refuse("tumble.rates_deg_s", "must be at most 3600 degrees per second");
                }
                Ok(tumble.steps([from_s, to_s], seed))
            }
            Attitude::Pointing(pointing) => {
                if pointing.off_nadir_deg.iter().any(|d| !(0.0..=180.0).contains(d)) {
                    return refuse("pointing.off_nadir_deg", "must be 0 (straight down) to 180");
                }
                Ok(Self::Pointing { pointing: *pointing, from_s, to_s })
            }
            Attitude::Towards(towards) => {
                if towards.bodies.is_empty() || towards.bodies.iter().any(|b| matches!(b, Kind::Sphere)) {
                    return refuse("towards.bodies", "must be one or more of \"sun\", \"moon\", \"earth\"");
                }
                let phase = Counter::new(seed, Stream::Drift).uniform(0) * TAU;
                Ok(Self::Towards { towards: towards.clone(), from_s, to_s, phase })
            }
            Attitude::Table => match &path.way {
                PreparedTrajectory::Table(rows) if rows.has_attitudes() => Ok(Self::Table),
                PreparedTrajectory::Table(_) => {
                    refuse("table", "the file of [trajectory] table has no columns qw, qx, qy, qz")
                }
                _ => refuse("table", "is allowed only with [trajectory.table]"),
            },
        }
    }

    pub(crate) fn body_to_ecef(&self, path: &Path, time_s: f64) -> UnitQuaternion<f64> {
        match self {
            Self::Steps { from_s, steps } => {
                let place = ((time_s - from_s) / STEP_S).clamp(0.0, steps.len().saturating_sub(2) as f64);
                let i = place as usize;
                let q = match (steps.get(i), steps.get(i + 1)) {
                    (Some(a), Some(b)) => a.try_slerp(b, place - i as f64, 1e-12).unwrap_or(*a),
                    _ => UnitQuaternion::identity(),
                };
                let earth = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), path.sidereal_rad(time_s));
                earth.inverse() * q
            }
            Self::Pointing { pointing, from_s, to_s } => {
                let x = if to_s > from_s { (time_s - from_s) / (to_s - from_s) } else { 0.0 };
                let at = |[a, b]: [f64; 2]| (a + x * (b - a)).to_radians();
                let look = Look::off_nadir(at(pointing.off_nadir_deg), at(pointing.azimuth_deg), at(pointing.roll_deg));
                quaternion(&Pose::looking(path.point(time_s).position_m.into(), look)) * path.camera_to_body.inverse()
            }
            Self::Towards { towards, from_s, to_s, phase } => {
                let place = ((time_s - from_s) / (to_s - from_s).max(1e-9)).clamp(0.0, 1.0 - 1e-9);
                let n = towards.bodies.len();
                let kind = towards.bodies.get((place * n as f64) as usize).copied().unwrap_or(Kind::Sun);
                let here = path.point(time_s).position_m;
                let to: Vector3<f64> = match kind {
                    Kind::Sun => ephemeris::sun(path.unix_s(time_s)).seen_from(here.into()).direction.into(),
                    Kind::Moon => ephemeris::moon(path.unix_s(time_s)).seen_from(here.into()).direction.into(),
                    _ => -here.normalize(),
                };
                let helper = if to.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
                let right = to.cross(&helper).normalize();
                let pose = Pose::from_axes(here.into(), [right, to.cross(&right), to].map(Into::into));
                // The body moves slowly over the picture on a Lissajous figure.
                let angle = |cycles: f64| libm::sin(phase + TAU * cycles * place * n as f64);
                let wander = towards.wander_deg.to_radians();
                let off = [wander * angle(1.3), wander * angle(0.9 + 0.2 * phase), 0.6 * angle(0.4)];
                quaternion(&pose.disturbed(off)) * path.camera_to_body.inverse()
            }
            Self::Table => UnitQuaternion::identity(),
        }
    }
}

fn quaternion(pose: &Pose) -> UnitQuaternion<f64> {
    let [w, x, y, z] = pose.cam_to_ecef_wxyz;
    UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
}

/// Returns the attitude whose x axis is along `x` and whose y axis is perpendicular to `up`.
fn attitude_along(x: Vector3<f64>, up: Vector3<f64>) -> UnitQuaternion<f64> {
    let x = x.normalize();
    let helper = if x.dot(&up).abs() < 0.999 * up.norm() { up } else { Vector3::new(up.y, up.z, up.x) };
    let y = helper.cross(&x).normalize();
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

impl Spin {
    fn steps(&self, path: &Path, ascent: &super::rocket::Ascent, to_s: f64, seed: u64) -> PreparedAttitude {
        let draws = Counter::new(seed, Stream::Drift);
        let mut drawn = 0u64;
        let mut next = || {
            drawn += 1;
            draws.uniform(drawn)
        };
        let count = ((to_s + 2.0) / STEP_S) as usize + 2;
        let limits = [self.limit_deg_s, self.lateral_limit_deg_s, self.lateral_limit_deg_s].map(f64::to_radians);
        let pushes = limits.map(|limit| limit * self.disturbance_per_s);
        let spin = TAU * self.spin_hz;
        let burnout_s = self.spun_up_s.max(1.0);
        let start_roll = TAU * next();
        let mut roll = start_roll;
        let mut q = UnitQuaternion::identity();
        // Under rate control, each axis has a rate and the acceleration of a disturbance.
        let mut rate: [f64; 3] = core::array::from_fn(|a| limits[a] * (1.6 * next() - 0.8));
        let mut torque: [f64; 3] = core::array::from_fn(|a| pushes[a] * (2.0 * next() - 1.0));
        let mut pulse = [0.0f64; 3];
        let mut steps = Vec::with_capacity(count);
        for i in 0..count {
            let t = i as f64 * STEP_S;
            let rolled = |t: f64| {
                let left = if t > self.yoyo_s { (1.0 - (t - self.yoyo_s)).max(0.0) } else { 1.0 };
                spin * (t / burnout_s).min(1.0) * left
            };
            let free = t > self.yoyo_s + 1.0;
            if t <= burnout_s {
                // Under thrust the long axis follows the direction of flight; after burn-out it keeps its direction in
                // space.
                let forward = from_ecef(path.sidereal_rad(t), &ascent.forward(t));
                let up = from_ecef(path.sidereal_rad(t), &ascent.point(t).position_m.normalize());
                let lean = self.cone_deg.to_radians() * (t / burnout_s);
                q = attitude_along(forward, up)
                    * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), lean)
                    * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), roll);
                roll += rolled(t) * STEP_S;
            } else {
                let mut body = Vector3::new(rolled(t), 0.0, 0.0);
                if free {
                    body = Vector3::from(rate);
                    for a in 0..3 {
                        let limit = limits[a];
                        if next() < STEP_S / 12.0 {
                            torque[a] = pushes[a] * (2.0 * next() - 1.0);
                        }
                        // A thruster brings the rate through zero within a third of a second.
                        if rate[a].abs() >= limit && pulse[a] == 0.0 {
                            pulse[a] = -rate[a] * (1.0 + 0.7 * next()) / 0.3;
                        }
                        rate[a] += (torque[a] + pulse[a]) * STEP_S;
                        if pulse[a] != 0.0 && (rate[a] * pulse[a] > 0.0) && rate[a].abs() >= 0.3 * limit {
                            pulse[a] = 0.0;
                        }
                    }
                }
                q *= UnitQuaternion::from_scaled_axis(body * STEP_S);
            }
            steps.push(q);
        }
        PreparedAttitude::Steps { from_s: 0.0, steps }
    }
}

impl Tumble {
    fn steps(&self, [from_s, to_s]: [f64; 2], seed: u64) -> PreparedAttitude {
        let draws = Counter::new(seed, Stream::Drift);
        let start = [0, 1, 2, 3].map(|i| draws.normal(i));
        let mut q = UnitQuaternion::from_quaternion(nalgebra::Quaternion::from(start));
        let [a, b, c] = self.inertia;
        let turn = |w: &Vector3<f64>| {
            // These are Euler's equations without torque.
            Vector3::new((b - c) * w.y * w.z / a, (c - a) * w.z * w.x / b, (a - b) * w.x * w.y / c)
        };
        let mut w = Vector3::from(self.rates_deg_s.map(f64::to_radians));
        let from_s = from_s - 1.0;
        let count = ((to_s - from_s + 2.0) / STEP_S) as usize + 2;
        let mut steps = Vec::with_capacity(count);
        for _ in 0..count {
            steps.push(q);
            let middle = w + turn(&w) * (STEP_S / 2.0);
            q *= UnitQuaternion::from_scaled_axis(middle * STEP_S);
            w += turn(&middle) * STEP_S;
        }
        PreparedAttitude::Steps { from_s, steps }
    }
}
