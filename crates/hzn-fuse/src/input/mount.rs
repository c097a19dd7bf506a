//! The mount of a camera on the vehicle.

use std::path::Path;

use hzn_core::config::Mount;
use hzn_files::limited;
use hzn_nav::frames::{Cam, Rotation, Vehicle};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use serde::Deserialize;

use crate::error::Error;

/// Largest error of a matrix that counts as a rotation.
const TOLERANCE: f64 = 1e-3;

/// A file with a mount: the table `[mount]`, other tables are ignored.
#[derive(Debug, Deserialize)]
struct File {
    mount: Table,
}

/// `[mount]`: a quaternion, as in sensor.toml, or a matrix.
#[derive(Debug, Deserialize)]
struct Table {
    q_vehicle_from_camera_wxyz: Option<[f64; 4]>,
    /// Rows of the rotation from the camera to the vehicle's frame.
    vehicle_from_camera: Option<[[f64; 3]; 3]>,
}

/// Reads the mount (camera to vehicle) from the table `[mount]` of a TOML file: `q_vehicle_from_camera_wxyz`, or
/// `vehicle_from_camera` as a matrix with its rows.
///
/// # Errors
/// The file cannot be read, has no such table, or the numbers are not a rotation.
pub fn mount(path: &Path) -> Result<Rotation<Cam, Vehicle>, Error> {
    let shown = path.display();
    let text =
        limited::read_text(path, limited::SETTINGS_BYTES).map_err(|e| Error::unusable(format!("{shown}: {e}")))?;
    let file: File = toml::from_str(&text).map_err(|e| {
        let before = e.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        Error::unusable(format!("{shown}:{}: {}", before.matches('\n').count() + 1, e.message()))
    })?;
    let refuse = |what: String| Error::unusable(format!("{shown}: [mount] {what}"));
    match (file.mount.q_vehicle_from_camera_wxyz, file.mount.vehicle_from_camera) {
        (Some(wxyz), None) => of_quaternion(wxyz).map_err(refuse),
        (None, Some(rows)) => of_matrix(rows).map_err(refuse),
        _ => Err(refuse("must have either q_vehicle_from_camera_wxyz or vehicle_from_camera".into())),
    }
}

/// Returns whether a file with a mount is a whole sensor.toml: it has a table `[camera]`.
pub fn is_sensor(path: &Path) -> bool {
    let text = limited::read_text(path, limited::SETTINGS_BYTES).unwrap_or_default();
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key("camera"))
}

/// Returns the mount of a sensor.toml.
pub(super) fn of_config(mount: Mount) -> Result<Rotation<Cam, Vehicle>, String> {
    of_quaternion(mount.q_vehicle_from_camera_wxyz)
}

fn of_quaternion(wxyz: [f64; 4]) -> Result<Rotation<Cam, Vehicle>, String> {
    super::rotation(wxyz)
        .map_err(|length| format!("q_vehicle_from_camera_wxyz: the length is {length:.4}, but must be 1"))
}

fn of_matrix(rows: [[f64; 3]; 3]) -> Result<Rotation<Cam, Vehicle>, String> {
    let m = Matrix3::from_fn(|i, j| rows[i][j]);
    if !((m * m.transpose() - Matrix3::identity()).amax() < TOLERANCE) {
        return Err("vehicle_from_camera: the rows must be perpendicular unit vectors".into());
    }
    if m.determinant() < 0.0 {
        return Err(
            "vehicle_from_camera: the determinant is -1, so the matrix mirrors; check the sign of one axis".into()
        );
    }
    Ok(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(m)).into())
}
