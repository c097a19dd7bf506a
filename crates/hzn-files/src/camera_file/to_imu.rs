//! The pose and the clock of a camera against the inertial unit, in a camchain of kalibr_calibrate_imu_camera.

use std::path::Path;

use serde_json::Value;

use super::document;
use super::values::{matrix, number};
use crate::nearest::suggestion;
use crate::{Problem, limited};

/// Largest error of a matrix that counts as a rotation. Kalibr writes all digits; a rounded copy has four or more.
const TOLERANCE: f64 = 1e-3;

/// A camera against the inertial unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ToImu {
    /// The name of the camera.
    pub camera: String,
    /// Rows of the rotation from the axes of the inertial unit to those of the camera.
    pub camera_from_imu: [[f64; 3]; 3],
    /// Seconds to add to the times of the camera: t_imu = t_cam + shift. `None` if the file does not have it.
    pub timeshift_s: Option<f64>,
}

/// Reads `T_cam_imu` and `timeshift_cam_imu` of one camera. A camchain of several needs the name of one.
///
/// # Errors
/// The file cannot be read, has no such camera, or its matrix is not a rotation.
pub fn to_imu(path: &Path, name: Option<&str>) -> Result<ToImu, Problem> {
    let text = limited::read_text(path, limited::CAMERA_FILE_BYTES)
        .map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    let value = document::parse(&text, path)?;
    let chain: Vec<(&String, &Value)> =
        value.as_object().into_iter().flatten().filter(|(_, v)| v.is_object()).collect();
    let names: Vec<&str> = chain.iter().map(|(name, _)| name.as_str()).collect();
    let camera = match (name, &chain[..]) {
        (Some(name), _) => chain.iter().find(|(known, _)| *known == name).ok_or_else(|| {
            let cameras = names.join(", ");
            format!("has no camera {name:?}{}; its cameras are {cameras}", suggestion(name, &names))
        }),
        (None, [only]) => Ok(only),
        (None, []) => Err("is no camchain of Kalibr (cam0: ...)".to_owned()),
        (None, _) => Err(format!("has the cameras {}; choose one with --camera", names.join(", "))),
    };
    let (name, camera) = camera.map_err(|what| Problem::new(path, what))?;
    let refused = |field: &str, what: &str| Problem::new(path, what).in_field(format!("{name}.{field}"));
    let Some(pose) = camera.get("T_cam_imu") else {
        let what = "missing: kalibr_calibrate_imu_camera writes it, into the file camchain-imucam";
        return Err(refused("T_cam_imu", what));
    };
    let rows = rotation(pose).map_err(|what| refused("T_cam_imu", what))?;
    let timeshift_s = match camera.get("timeshift_cam_imu") {
        Some(shift) => Some(number(shift).ok_or_else(|| refused("timeshift_cam_imu", "a number is expected"))?),
        None => None,
    };
    Ok(ToImu { camera: (*name).clone(), camera_from_imu: rows, timeshift_s })
}

/// Returns the rows of the rotation in a pose of 4 x 4 numbers.
pub(super) fn rotation(pose: &Value) -> Result<[[f64; 3]; 3], &'static str> {
    let Some(Ok(pose)) = matrix(pose).map(<[f64; 16]>::try_from) else {
        return Err("a matrix of 4 rows with 4 finite numbers is expected");
    };
    let rows: [[f64; 3]; 3] = core::array::from_fn(|i| core::array::from_fn(|j| pose[4 * i + j]));
    if is_rotation(&rows) { Ok(rows) } else { Err("its first three columns are not a rotation") }
}

fn is_rotation(rows: &[[f64; 3]; 3]) -> bool {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [a, b, c] = *rows;
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let lengths = [a, b, c].iter().all(|row| (dot(*row, *row) - 1.0).abs() < TOLERANCE);
    lengths && dot(a, b).abs() < TOLERANCE && (dot(cross, c) - 1.0).abs() < 2.0 * TOLERANCE
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHAIN: &str = "cam0:\n  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.02]\n  - [0.6, 0.0, -0.8, -0.05]\n  - [0.8, 0.0, \
                         0.6, 0.01]\n  - [0.0, 0.0, 0.0, 1.0]\n  camera_model: pinhole\n  timeshift_cam_imu: -0.0042\n";

    fn read(text: &str, name: Option<&str>) -> Result<ToImu, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("chain.yaml");
        std::fs::write(&path, text).unwrap();
        to_imu(&path, name).map_err(|e| e.to_string().split_once("chain.yaml: ").unwrap().1.to_owned())
    }

    #[test]
    fn pose_and_clock() {
        let read_back = read(CHAIN, None).unwrap();
        assert_eq!(read_back.camera_from_imu, [[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]]);
        assert_eq!(read_back.timeshift_s, Some(-0.0042));
        let two = format!("{CHAIN}{}", CHAIN.replace("cam0", "cam1"));
        assert_eq!(read(&two, None).unwrap_err(), "has the cameras cam0, cam1; choose one with --camera");
        assert_eq!(read(&two, Some("cam1")).unwrap().camera, "cam1");
        assert!(read(&two, Some("cam7")).unwrap_err().ends_with("its cameras are cam0, cam1"));
        assert!(
            read(&CHAIN.replace("T_cam_imu", "T_cn_cnm1"), None).unwrap_err().starts_with("cam0.T_cam_imu: missing")
        );
        let mirrored = CHAIN.replace("[0.0, -1.0, 0.0, 0.02]", "[0.0, 1.0, 0.0, 0.02]");
        assert!(read(&mirrored, None).unwrap_err().ends_with("are not a rotation"));
        assert!(read(&CHAIN.replace("0.8, 0.0, ", "0.8, "), None).unwrap_err().contains("a matrix of 4 rows"));
    }
}
