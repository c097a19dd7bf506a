//! Camera calibrations of other tools: Kalibr camchains, OpenCV's YAML, XML and JSON, EuRoC `sensor.yaml`, ROS's
//! camera_info, Foxglove's CameraCalibration; camodocal (VINS), ORB-SLAM3, Basalt, COLMAP, Metashape, OCamCalib.
//!
//! | file | lens there | in hzn |
//! |---|---|---|
//! | Kalibr, EuRoC | `pinhole` + `equidistant` | `kannala-brandt` |
//! | Kalibr, EuRoC | `pinhole` + `radtan`, `radial-tangential`, `plumb_bob` | `brown-conrady` |
//! | Kalibr, EuRoC | `pinhole` + `none` | `pinhole` |
//! | Kalibr | `ds`, `eucm` + `none` | `double-sphere`, `eucm` |
//! | Kalibr | `omni` + `none` | `eucm` with β = 1 |
//! | OpenCV | `camera_matrix` or `K`, `distortion_coefficients` or `D`, `fisheye_model: 1` | `kannala-brandt` |
//! | OpenCV | the same with a column of four coefficients | `kannala-brandt` |
//! | OpenCV | the same with `fisheye_model: 0`, or with five coefficients | `brown-conrady` |
//! | ROS, Foxglove | `distortion_model`: `plumb_bob`, or `rational_polynomial` with k4 to k6 = 0 | `brown-conrady` |
//! | ROS, Foxglove | the same with `distortion_model`: `equidistant`, `fisheye`, `kannala_brandt` | `kannala-brandt` |
//! | OpenCV, ROS, COLMAP, Basalt | eight or twelve coefficients | none; a fit replaces it |
//! | OCamCalib, `calib_results.txt` | a polynomial of the radius | none; a fit replaces it |
//! | camodocal (VINS) | `KANNALA_BRANDT`; `PINHOLE`; `MEI` | `kannala-brandt`; `brown-conrady`; as Kalibr's `omni` |
//! | ORB-SLAM3 | `KannalaBrandt8`; `PinHole`; `Rectified` | `kannala-brandt`; `brown-conrady`; `pinhole` |
//! | Basalt | `kb4`; `ds`; `eucm`; `pinhole`; `pinhole-radtan8` | the lens of this name |
//! | COLMAP, `cameras.txt` | all but `FOV` and thin prisms | the lens of this name |
//! | Metashape | `frame` with k4 = b2 = 0; `fisheye` with p1 = p2 = b2 = 0 | `brown-conrady`; `kannala-brandt` |
//!
//! Four coefficients in a row or in a plain list, without either word, are ambiguous. Such a file is refused. The text
//! tells the format, and the name of the file tells nothing.
//!
//! [`load`] reads a file, [`load_any`] one whose lens hzn may not have, [`write()`] writes one; [`from_braun_barf`]
//! converts the five coefficients of that paper.

mod camchain;
mod camera_matrix;
mod chain_mounts;
mod document;
mod foreign;
mod format;
mod kalibr;
mod lens;
mod loaded;
mod numbers;
mod omni;
mod opencv;
mod rational;
mod read;
mod reader;
mod scaramuzza;
mod several;
mod to_imu;
mod values;
mod write;
mod write_kalibr;
mod write_opencv;
mod write_ros;

use hzn_core::camera::{Config, Model};

pub use camera_matrix::camera_matrix;
pub use chain_mounts::chain_mounts;
pub use foreign::Foreign;
pub use format::{Format, UnsupportedLens};
pub use loaded::{CameraFile, Choice, Loaded};
pub use omni::Omni;
pub use rational::Rational;
pub use read::{load, load_any, parse, parse_any};
pub use scaramuzza::Scaramuzza;
pub use to_imu::{ToImu, to_imu};
pub use write::write;

/// Returns the lens of Braun & Barf 2022, (13), with the distance from the centre in pixels
/// r = κ₁θ + κ₂θ³ + κ₃θ⁵ + κ₄θ⁷ + κ₅θ⁹ and θ in radians.
///
/// With f = κ₁ and kⱼ = κⱼ₊₁/κ₁ this lens is `kannala-brandt`. `size_px` is width and height, `centre_px` is the
/// principal point. The result is `None` if κ₁ is not finite or not above 0.
pub fn from_braun_barf(kappa_px: [f64; 5], size_px: [u16; 2], centre_px: [f64; 2]) -> Option<Config> {
    let [f, higher @ ..] = kappa_px;
    let mut config = Config::ideal(Model::KannalaBrandt, size_px[0], size_px[1], f);
    [config.cx_px, config.cy_px] = centre_px;
    config.k = higher.iter().map(|k| k / f).collect();
    (f > 0.0 && f.is_finite()).then_some(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hzn_core::camera::Camera;
    use hzn_core::frames::UnitVec3;

    #[test]
    fn five_coefficients_are_the_same_lens() {
        let kappa = [1235.0, -67.9, 13.6, -4.3, 0.25];
        let config = from_braun_barf(kappa, [1920, 1080], [963.2, 536.7]).unwrap();
        let camera = Camera::<f64>::try_new(&config).unwrap();
        for theta in [0.1f64, 0.4, 0.8] {
            let p = camera.project(&UnitVec3::try_new([theta.sin(), 0.0, theta.cos()]).unwrap()).unwrap();
            let r: f64 = kappa.iter().enumerate().map(|(j, k)| k * theta.powi(2 * j as i32 + 1)).sum();
            assert!((p.u - 963.2 - r).abs() < 1e-9 && (p.v - 536.7).abs() < 1e-9);
        }
        assert!(from_braun_barf([0.0; 5], [1920, 1080], [0.0; 2]).is_none());
    }
}
