//! One record for each solution and each innovation, the same in every kind of file.

use hzn_core::ellipsoid::{WGS84_A_M, WGS84_B_M, geodetic};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::results::{CameraState, Epoch, Fused, Innovation};

/// The origin of a solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Integrated back from the start.
    Back,
    /// The filter, in real time.
    Filter,
    /// The smoother.
    Smoothed,
}

/// A solution.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StateRecord {
    /// Time, s.
    pub time_s: f64,
    /// The origin of the solution.
    pub phase: Phase,
    /// Attitude as a quaternion from the vehicle's axes to ECEF, scalar part.
    pub qw: f64,
    /// First vector component of the attitude.
    pub qx: f64,
    /// Second vector component of the attitude.
    pub qy: f64,
    /// Third vector component of the attitude.
    pub qz: f64,
    /// 1-sigma of the attitude about the vehicle's x axis, degrees.
    pub sigma_x_deg: f64,
    /// 1-sigma about the y axis.
    pub sigma_y_deg: f64,
    /// 1-sigma about the z axis.
    pub sigma_z_deg: f64,
    /// Yaw, pitch and roll of the vehicle against north, east and down at its position, degrees.
    pub yaw_deg: f64,
    /// Pitch, degrees.
    pub pitch_deg: f64,
    /// Roll, degrees.
    pub roll_deg: f64,
    /// First component of the position in ECEF, m.
    pub x_m: f64,
    /// Second component of the position.
    pub y_m: f64,
    /// Third component of the position.
    pub z_m: f64,
    /// First component of the velocity in ECEF, m/s.
    pub vx_mps: f64,
    /// Second component of the velocity.
    pub vy_mps: f64,
    /// Third component of the velocity.
    pub vz_mps: f64,
    /// Largest 1-sigma of a component of the position, m.
    pub position_sigma_m: f64,
    /// Largest 1-sigma of a component of the velocity, m/s.
    pub velocity_sigma_mps: f64,
    /// Covariance of the attitude, a rotation vector in the vehicle's axes: xx, xy, xz, yy, yz, zz, deg².
    pub attitude_cov_deg2: [f64; 6],
    /// Covariance of the velocity in ECEF: xx, xy, xz, yy, yz, zz, m²/s².
    pub velocity_cov_m2ps2: [f64; 6],
    /// Covariance of the position in ECEF: xx, xy, xz, yy, yz, zz, m².
    pub position_cov_m2: [f64; 6],
    /// Bias of the gyros, degrees per hour: x, y, z.
    pub gyro_bias_deg_h: [f64; 3],
    /// Its 1-sigma.
    pub gyro_bias_sigma_deg_h: [f64; 3],
    /// Bias of the accelerometers, m/s²: x, y, z.
    pub accel_bias_mps2: [f64; 3],
    /// Its 1-sigma.
    pub accel_bias_sigma_mps2: [f64; 3],
    /// Error of the limb height, km.
    pub limb_height_km: f64,
    /// Its 1-sigma.
    pub limb_height_sigma_km: f64,
    /// Coefficients of its change with the latitude φ of the limb, km: of sin φ, and of (3 sin² φ − 1)/2.
    pub limb_latitude_km: [f64; 2],
    /// Their 1-sigma.
    pub limb_latitude_sigma_km: [f64; 2],
    /// The cameras, in the order of the recordings.
    pub cameras: Vec<CameraRecord>,
    /// The verdict over the flight: `consistent`, `doubtful` or `contradicts`. It is the same in every record, so that
    /// a program that takes the results sees it.
    pub verdict: &'static str,
    /// Attitude of the strapdown solution from the start on without any aid, as a quaternion from the vehicle's axes to
    /// ECEF, scalar first; only of the filter's solutions and the smoother's.
    pub unaided_q_wxyz: Option<[f64; 4]>,
    /// Its covariance, a rotation vector in the vehicle's axes: xx, xy, xz, yy, yz, zz, deg².
    pub unaided_cov_deg2: Option<[f64; 6]>,
}

/// The estimated errors of a camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraRecord {
    /// Name of the camera.
    pub name: String,
    /// Rotation from the told mount to the estimated one, about the axes of the camera, degrees.
    pub misalignment_deg: [f64; 3],
    /// Its 1-sigma.
    pub misalignment_sigma_deg: [f64; 3],
    /// Time that the clock of the camera differs, s.
    pub clock_s: f64,
    /// Its 1-sigma.
    pub clock_sigma_s: f64,
    /// The mount that was told, scalar first.
    pub told_q_vehicle_from_camera_wxyz: [f64; 4],
}

/// An innovation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InnovationRecord {
    /// Time, s.
    pub time_s: f64,
    /// Name of the camera, `gnss`, or `star-tracker`.
    pub source: String,
    /// `limb`, `sun`, `moon`, `limb-position`, `position`, `velocity` or `attitude`.
    pub kind: &'static str,
    /// First component, in `unit`.
    pub first: f64,
    /// Second component.
    pub second: f64,
    /// Third component; a direction has two.
    pub third: Option<f64>,
    /// 1-sigma of the first component.
    pub first_sigma: f64,
    /// 1-sigma of the second component.
    pub second_sigma: f64,
    /// 1-sigma of the third component.
    pub third_sigma: Option<f64>,
    /// `deg`, `m` or `m/s`.
    pub unit: &'static str,
    /// The square of the innovation over its covariance: chi-square with two or three degrees of freedom.
    pub nis: f64,
    /// Whether the filter took the measurement.
    pub taken: bool,
    /// Angle of a direction from the solution, degrees.
    pub angle_deg: Option<f64>,
    /// Angle of a direction from the unaided solution, degrees.
    pub unaided_deg: Option<f64>,
    /// Largest 1-sigma of the direction that the sensor tells, degrees.
    pub sensor_sigma_deg: Option<f64>,
}

/// Returns all solutions: back to the first sample, the filter's, the smoother's.
pub fn states(fused: &Fused) -> impl Iterator<Item = StateRecord> + '_ {
    // The last solution of the way back is the first one of the filter.
    let back = fused.back.iter().take(fused.back.len().saturating_sub(1));
    let record = |phase| move |epoch: &Epoch| state(fused, epoch, phase);
    let filter = fused.epochs.iter().map(record(Phase::Filter));
    back.map(record(Phase::Back)).chain(filter).chain(fused.smoothed.iter().map(record(Phase::Smoothed)))
}

/// Returns all innovations.
pub fn innovations(fused: &Fused) -> impl Iterator<Item = InnovationRecord> + '_ {
    fused.innovations.iter().map(|i| innovation(fused, i))
}

/// Returns the upper triangle of a covariance.
fn triangle<F>(covariance: &Covariance<F>) -> [f64; 6] {
    let p = covariance.as_inner();
    [p.m11, p.m12, p.m13, p.m22, p.m23, p.m33]
}

/// Returns the upper triangle of a covariance in deg².
fn deg2(covariance_rad2: &Covariance<Vehicle>) -> [f64; 6] {
    triangle(covariance_rad2).map(|v| v * 1f64.to_degrees().powi(2))
}

fn state(fused: &Fused, epoch: &Epoch, phase: Phase) -> StateRecord {
    let now = &epoch.state;
    let [[x_m, y_m, z_m], [vx_mps, vy_mps, vz_mps]] = [now.position_m, now.velocity_m_s].map(|v| v.xyz());
    let [qw, qx, qy, qz] = now.attitude.wxyz();
    let [yaw_deg, pitch_deg, roll_deg] = yaw_pitch_roll_deg(&now.attitude, &now.position_m);
    let deg = |v: Vector3<f64>| -> [f64; 3] { v.map(f64::to_degrees).into() };
    let per_hour = |v: Vector3<f64>| deg(v * 3600.0);
    let [sigma_x_deg, sigma_y_deg, sigma_z_deg] = deg(epoch.attitude_sigma_rad());
    let largest = |p: &Covariance<Fixed>| p.as_inner().diagonal().max().max(0.0).sqrt();
    let camera = |((name, state), told): ((&String, &CameraState), &Rotation<Cam, Vehicle>)| CameraRecord {
        name: name.clone(),
        misalignment_deg: deg(state.misalignment_rad.into_inner()),
        misalignment_sigma_deg: deg(state.misalignment_sigma_rad),
        clock_s: state.clock_s,
        clock_sigma_s: state.clock_sigma_s,
        told_q_vehicle_from_camera_wxyz: told.wxyz(),
    };
    StateRecord {
        time_s: now.time_s,
        phase,
        qw,
        qx,
        qy,
        qz,
        sigma_x_deg,
        sigma_y_deg,
        sigma_z_deg,
        yaw_deg,
        pitch_deg,
        roll_deg,
        x_m,
        y_m,
        z_m,
        vx_mps,
        vy_mps,
        vz_mps,
        position_sigma_m: largest(&epoch.position_covariance_m2),
        velocity_sigma_mps: largest(&epoch.velocity_covariance_m2_s2),
        attitude_cov_deg2: deg2(&epoch.attitude_covariance_rad2),
        velocity_cov_m2ps2: triangle(&epoch.velocity_covariance_m2_s2),
        position_cov_m2: triangle(&epoch.position_covariance_m2),
        gyro_bias_deg_h: per_hour(epoch.corrections.gyro_bias.into_inner()),
        gyro_bias_sigma_deg_h: per_hour(epoch.gyro_bias_sigma_rad_s),
        accel_bias_mps2: epoch.corrections.accel_bias.xyz(),
        accel_bias_sigma_mps2: epoch.accel_bias_sigma_m_s2.into(),
        limb_height_km: epoch.corrections.limb_height_km,
        limb_height_sigma_km: epoch.limb_height_sigma_km,
        limb_latitude_km: epoch.corrections.limb_latitude_km,
        limb_latitude_sigma_km: epoch.limb_latitude_sigma_km,
        cameras: fused.cameras.iter().zip(&epoch.cameras).zip(&fused.told_mounts).map(camera).collect(),
        verdict: fused.verdict.level().name(),
        unaided_q_wxyz: epoch.unaided.map(|unaided| unaided.attitude.wxyz()),
        unaided_cov_deg2: epoch.unaided.map(|unaided| deg2(&unaided.covariance_rad2)),
    }
}

fn innovation(fused: &Fused, i: &Innovation) -> InnovationRecord {
    use crate::results::Kind;
    let (unit, scale) = match i.kind {
        Kind::Direction(_) | Kind::Attitude => ("deg", 1f64.to_degrees()),
        Kind::Centre | Kind::Position => ("m", 1.0),
        Kind::Velocity => ("m/s", 1.0),
    };
    let at = |list: &[f64], k: usize| list.get(k).map(|x| x * scale);
    let source = match (i.camera.and_then(|c| fused.cameras.get(c)), i.kind) {
        (Some(name), _) => name.clone(),
        (None, Kind::Attitude) => "star-tracker".into(),
        (None, _) => "gnss".into(),
    };
    InnovationRecord {
        time_s: i.time_s,
        source,
        kind: i.kind.name(),
        first: at(&i.value, 0).unwrap_or(f64::NAN),
        second: at(&i.value, 1).unwrap_or(f64::NAN),
        third: at(&i.value, 2),
        first_sigma: at(&i.sigma, 0).unwrap_or(f64::NAN),
        second_sigma: at(&i.sigma, 1).unwrap_or(f64::NAN),
        third_sigma: at(&i.sigma, 2),
        unit,
        nis: i.nis,
        taken: i.taken,
        angle_deg: i.angle_rad.map(f64::to_degrees),
        unaided_deg: i.unaided_rad.map(f64::to_degrees),
        sensor_sigma_deg: i.sensor_sigma_rad.map(f64::to_degrees),
    }
}

/// Returns yaw, pitch and roll against north, east and down (geodetic), degrees.
fn yaw_pitch_roll_deg(fixed_from_vehicle: &Rotation<Vehicle, Fixed>, position_m: &Vector<Fixed>) -> [f64; 3] {
    let [x, y, _] = position_m.xyz();
    let (lat, _) = geodetic(position_m.xyz(), WGS84_A_M, WGS84_B_M);
    let lon = y.atan2(x);
    let ((sl, cl), (so, co)) = (lat.sin_cos(), lon.sin_cos());
    let north = Vector3::new(-sl * co, -sl * so, cl);
    let east = Vector3::new(-so, co, 0.0);
    let down = Vector3::new(-cl * co, -cl * so, -sl);
    let ned = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[north, east, down]));
    let to_ned = UnitQuaternion::from_rotation_matrix(&ned).inverse() * fixed_from_vehicle.as_inner();
    let (roll, pitch, yaw) = to_ned.euler_angles();
    [yaw, pitch, roll].map(f64::to_degrees)
}
