//! What the filter estimates and how well everything is known at the start. The defaults are those of Braun & Barf
//! 2022, table 3.
//!
//! Their noise is large, because it also covers vibration and unknown delays: the second number of
//! [`ImuOptions::accel_noise`] and [`ImuOptions::gyro_noise`]. In simulated flights without vibration the covariance is
//! therefore larger than the errors.

use crate::frames::{Cam, Rotation, Vehicle};

/// Standard gravity, m/s².
const G_M_S2: f64 = 9.80665;
/// Degrees per hour in rad/s.
const DEG_PER_HOUR: f64 = core::f64::consts::PI / 180.0 / 3600.0;
/// Degrees per √hour in rad/√s.
const DEG_PER_ROOT_HOUR: f64 = core::f64::consts::PI / 180.0 / 60.0;

/// How the filter treats an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// The error is estimated and corrected.
    #[default]
    Estimated,
    /// The error widens the covariance, and is not corrected (Schmidt 1966).
    Considered,
    /// The error does not exist.
    Off,
}

/// An error with its 1-sigma at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block {
    /// How the filter treats it.
    pub mode: Mode,
    /// 1-sigma of each component at the start, in the unit of the error.
    pub sigma: f64,
}

impl Block {
    /// An error that is estimated.
    pub const fn estimated(sigma: f64) -> Self {
        Self { mode: Mode::Estimated, sigma }
    }
    /// An error that is considered.
    pub const fn considered(sigma: f64) -> Self {
        Self { mode: Mode::Considered, sigma }
    }
    /// An error that does not exist.
    pub const OFF: Self = Self { mode: Mode::Off, sigma: 0.0 };
}

/// Errors of the inertial measurement unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuOptions {
    /// Bias of the accelerometers, m/s².
    pub accel_bias: Block,
    /// Scale factor error of the accelerometers.
    pub accel_scale: Block,
    /// Rotation of the accelerometers' axes, rad.
    pub accel_misalignment: Block,
    /// Bias of the gyros, rad/s.
    pub gyro_bias: Block,
    /// Scale factor error of the gyros.
    pub gyro_scale: Block,
    /// Rotation of the gyros' axes, rad.
    pub gyro_misalignment: Block,
    /// White noise of the accelerometers, and the noise that stands for unmodelled errors, m/s²/√Hz.
    pub accel_noise: [f64; 2],
    /// White noise of the gyros, and the noise that stands for unmodelled errors, rad/√s.
    pub gyro_noise: [f64; 2],
    /// Longest time between two samples, s. A longer one is a gap.
    pub max_step_s: f64,
    /// 1-sigma of the angular rate during a gap and during saturation, rad/s.
    pub gap_rate_rad_s: f64,
    /// 1-sigma of the specific force during a gap and during saturation, m/s².
    pub gap_accel_m_s2: f64,
}

impl Default for ImuOptions {
    fn default() -> Self {
        Self {
            accel_bias: Block::estimated(2e-3 * G_M_S2),
            accel_scale: Block::considered(300e-6),
            accel_misalignment: Block::considered(2e-3),
            gyro_bias: Block::considered(6.0 * DEG_PER_HOUR),
            gyro_scale: Block::considered(2000e-6),
            gyro_misalignment: Block::considered(2e-3),
            accel_noise: [0.05e-3 * G_M_S2, 2.5e-3 * G_M_S2],
            gyro_noise: [0.05 * DEG_PER_ROOT_HOUR, 2.5 * DEG_PER_ROOT_HOUR],
            max_step_s: 0.5,
            gap_rate_rad_s: 1.0,
            gap_accel_m_s2: 50.0,
        }
    }
}

/// A sensor of directions: a horizon sensor or a Sun sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraOptions {
    /// The mount that is told: rotation from the camera to the vehicle's frame.
    pub mount: Rotation<Cam, Vehicle>,
    /// Error of the mount, rad.
    pub misalignment: Block,
    /// The slowly changing error of a direction. Its sigma comes with each direction.
    pub slow_error: Mode,
    /// Correlation time of the slow error, s.
    pub slow_error_time_s: f64,
    /// Number of bodies that the camera sees, from 1 to [`MAX_BODIES`](crate::layout::MAX_BODIES). Each has a slow
    /// error of its own: limb and Sun in one picture do not share their errors. With one slow error for both, the
    /// filter took the error of one for that of the other, and the NEES of the attitude was 18 to 38 (3 is ideal).
    pub bodies: usize,
    /// White noise of a direction, rad.
    pub white_rad: f64,
    /// The time that is added to the camera's clock to give that of the inertial unit, s.
    pub clock: Block,
}

impl Default for CameraOptions {
    fn default() -> Self {
        Self {
            mount: Rotation::identity(),
            misalignment: Block::estimated(core::f64::consts::PI / 180.0),
            // An estimated slow error makes the filter over-confident, so the default considers it.
            slow_error: Mode::Considered,
            slow_error_time_s: 20.0,
            bodies: 1,
            white_rad: 0.005,
            // A clock offset moves a direction only while the vehicle turns, and cameras on one clock have none.
            clock: Block::OFF,
        }
    }
}

/// What is known at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartSigmas {
    /// 1-sigma of the attitude about each axis, rad.
    pub attitude_rad: f64,
    /// 1-sigma of each component of the velocity, m/s.
    pub velocity_m_s: f64,
    /// 1-sigma of each component of the position, m.
    pub position_m: f64,
}

impl Default for StartSigmas {
    fn default() -> Self {
        Self { attitude_rad: 2f64.to_radians(), velocity_m_s: 1.0, position_m: 30.0 }
    }
}

/// Options of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Errors of the inertial measurement unit.
    pub imu: ImuOptions,
    /// What is known at the start.
    pub start: StartSigmas,
    /// Error of the limb height, km. It is common to all cameras and constant: an error that fades, as the slow error
    /// does, would make the filter over-confident after many pictures.
    pub limb_height: Block,
    /// Change of the limb height with the latitude φ of the limb, km: two coefficients c₁ and c₂ with the same sigma.
    /// The height is c₁ sin φ + c₂ (3 sin² φ − 1)/2 above the constant one. The infrared limb is lower over the winter
    /// pole, and often lower over both poles.
    pub limb_latitude: Block,
    /// A measurement is refused if the square of its innovation over its covariance is above the value that a right one
    /// exceeds with this probability.
    pub gate_probability: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            imu: ImuOptions::default(),
            start: StartSigmas::default(),
            // 7 km, because the sensor assumes the same of a limb without a calibration (`body.limb_height_sigma_km`).
            limb_height: Block::considered(7.0),
            // It takes several orbits to estimate the change with the latitude, so it does not help a rocket.
            limb_latitude: Block { mode: Mode::Off, sigma: 0.0 },
            // A right direction is refused once in 10 000 times. The false ones of the tests are 52° off, and all of
            // them are refused.
            gate_probability: 1e-4,
        }
    }
}
