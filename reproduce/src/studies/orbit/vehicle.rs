//! The instruments of both satellites, and the settings of the filter for them.

use hzn_fuse::Settings;
use hzn_fuse::settings::Treatment;
use hzn_sim::trajectory::instruments::{Gnss, Imu};

/// The inertial unit of both satellites: the errors of table 3 of \[BB\] at five samples a second.
pub(super) fn imu() -> Imu {
    Imu {
        rate_hz: 5.0,
        gyro_bias_deg_s: 6.0 / 3600.0,
        gyro_scale_ppm: 2000.0,
        gyro_misalignment_mrad: 2.0,
        gyro_noise_deg_s: 0.0019,
        gyro_step_deg_s: 0.0005,
        accel_bias_mps2: 0.0196,
        accel_scale_ppm: 300.0,
        accel_misalignment_mrad: 2.0,
        accel_noise_mps2: 0.0011,
        accel_step_mps2: 0.001,
        ..Imu::default()
    }
}

/// A fix of the receiver every ten seconds.
pub(super) fn gnss() -> Gnss {
    Gnss { rate_hz: 0.1, ..Gnss::default() }
}

/// Settings for gyros whose errors are seen over hours: all errors are estimated, and the tuning noise, which covers
/// the vibration of a rocket, is as large as the noise itself.
pub(super) fn estimating() -> Settings {
    let mut own = Settings::default();
    for error in [&mut own.imu.gyro_bias_deg_h, &mut own.imu.gyro_scale_ppm, &mut own.imu.gyro_misalignment_mrad] {
        error.mode = Treatment::Estimated;
    }
    own.imu.gyro_noise_deg_rth = [0.05, 0.05];
    own.limb_height.mode = Treatment::Estimated;
    own.camera.white_rad = 5e-4;
    own
}
