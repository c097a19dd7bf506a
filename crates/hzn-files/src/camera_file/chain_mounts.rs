//! The attitudes of several cameras to each other, in a camchain of Kalibr.

use std::path::Path;

use serde_json::Value;

use super::document;
use super::to_imu::rotation;
use crate::{Problem, limited};

/// Rows of a rotation matrix.
type Rows = [[f64; 3]; 3];

/// Reads the cameras of a camchain, in their order, each with the rows of the rotation from its axes to those of the
/// first camera. Kalibr writes the pose of each camera to the one before it, `T_cn_cnm1`.
///
/// # Errors
/// The file cannot be read, is no camchain, or a matrix is missing or not a rotation.
pub fn chain_mounts(path: &Path) -> Result<Vec<(String, Rows)>, Problem> {
    let text = limited::read_text(path, limited::CAMERA_FILE_BYTES)
        .map_err(|e| Problem::new(path, format!("cannot be read: {e}")))?;
    let value = document::parse(&text, path)?;
    let cameras: Vec<(&String, &Value)> =
        value.as_object().into_iter().flatten().filter(|(_, camera)| camera.is_object()).collect();
    if cameras.is_empty() {
        return Err(Problem::new(path, "is no camchain of Kalibr (cam0: ..., cam1: ...)"));
    }
    let mut out: Vec<(String, Rows)> = Vec::new();
    for (name, camera) in cameras {
        let first_from_camera = match out.last() {
            None => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Some((_, first_from_last)) => {
                let refused = |what: &str| Problem::new(path, what).in_field(format!("{name}.T_cn_cnm1"));
                let Some(pose) = camera.get("T_cn_cnm1") else {
                    return Err(refused("missing: the pose to the camera before it, which Kalibr writes"));
                };
                // The inverse of a rotation is its transpose.
                product(first_from_last, &transposed(&rotation(pose).map_err(refused)?))
            }
        };
        out.push((name.clone(), first_from_camera));
    }
    Ok(out)
}

fn transposed(a: &Rows) -> Rows {
    core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
}

fn product(a: &Rows, b: &Rows) -> Rows {
    core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_add_up_along_the_chain() {
        // Each camera is turned by 90 degrees about z, and then about x, against the one before it.
        let z = "  T_cn_cnm1:\n  - [0.0, -1.0, 0.0, 0.1]\n  - [1.0, 0.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - \
                 [0.0, 0.0, 0.0, 1.0]\n";
        let x = "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, 0.1]\n  - [0.0, 0.0, -1.0, 0.0]\n  - [0.0, 1.0, 0.0, 0.0]\n  - \
                 [0.0, 0.0, 0.0, 1.0]\n";
        let lens = "  camera_model: pinhole\n";
        let read = |text: &str| {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("chain.yaml");
            std::fs::write(&path, text).unwrap();
            chain_mounts(&path).map_err(|e| e.to_string().split_once("chain.yaml: ").unwrap().1.to_owned())
        };
        let chain = format!("cam0:\n{lens}cam1:\n{lens}{z}cam2:\n{lens}{x}");
        let found = read(&chain).unwrap();
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["cam0", "cam1", "cam2"]);
        // A point on the z axis of the last camera is on y of the second, which is on x of the first.
        let along_z = |rows: &Rows| [rows[0][2], rows[1][2], rows[2][2]];
        assert_eq!(along_z(&found[2].1), [1.0, 0.0, 0.0]);
        assert_eq!(along_z(&found[1].1), [0.0, 0.0, 1.0]);
        assert!(read(&format!("cam0:\n{lens}cam1:\n{lens}")).unwrap_err().starts_with("cam1.T_cn_cnm1: missing"));
        assert!(read(&chain.replace("-1.0", "1.0")).unwrap_err().contains("not a rotation"));
        assert!(read("a: 1\n").unwrap_err().starts_with("is no camchain"));
    }
}
