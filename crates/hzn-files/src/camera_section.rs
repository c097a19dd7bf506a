//! A `[camera]` whose calibration comes from the `file` of another tool.

use std::path::{Path, PathBuf};

use hzn_core::camera::Config;
use toml::de::{DeTable, DeValue};

use crate::merge::take;
use crate::{Problem, camera_file, limited};

/// The keys of `[camera]` that camera files do not have. They may be next to `file`.
const KEYS_ALLOWED_WITH_FILE: [&str; 5] =
    ["focal_sigma_percent", "centre_sigma_px", "covariance", "temperature", "readout_s"];

/// Returns the camera file that the text of a sensor.toml or scene.toml names; `path` is the file of the text.
pub fn named_camera_file(text: &str, path: &Path) -> Option<PathBuf> {
    let table = DeTable::parse(text).ok()?.into_inner();
    let file = table.get("camera")?.get_ref().get("file")?;
    Some(next_to(path, file.get_ref().as_str()?))
}

/// Returns the path of a file that is named relative to the file at `path`.
fn next_to(path: &Path, file: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(file)
}

/// Returns a sensor.toml or scene.toml with the camera file that it names.
pub fn files_of_sensor(path: &Path) -> Vec<PathBuf> {
    let text = limited::read_text(path, limited::SETTINGS_BYTES).unwrap_or_default();
    [path.to_owned()].into_iter().chain(named_camera_file(&text, path)).collect()
}

/// Takes `file` and its options out of the `[camera]` table and loads the calibration with the doubts about it; `None`
/// if there is no `file`.
pub(crate) fn camera_from_file(
    table: &mut DeTable<'_>,
    text: &str,
    path: &Path,
) -> Result<Option<(Config, Vec<Problem>)>, Problem> {
    let Some(section) = table.get_mut("camera") else { return Ok(None) };
    let DeValue::Table(camera) = section.get_mut() else { return Ok(None) };
    let Some((file, span)) = take(camera, "file") else { return Ok(None) };
    let refused = |what: String| Problem::new(path, what).at_offset(text, span.start).in_field("[camera] file");
    let Some(file) = file.as_str() else {
        return Err(refused("must be the path of a camera file, in quotes".into()));
    };
    let name = take(camera, "camera");
    let angles = ["theta_max_deg", "theta_min_deg"].map(|key| (key, take(camera, key)));
    if let Some((key, _)) = camera.iter().find(|(key, _)| !KEYS_ALLOWED_WITH_FILE.contains(&&**key.get_ref())) {
        let what = "cannot be next to `file`, which has the whole calibration; only camera, theta_max_deg, \
                    theta_min_deg, readout_s, temperature, covariance and the calibration's sigmas may be";
        let field = format!("[camera] {}", key.get_ref());
        return Err(Problem::new(path, what).at_offset(text, key.span().start).in_field(field));
    }
    let file = next_to(path, file);
    if !file.exists() {
        return Err(refused(format!("{}: no such file (paths are relative to the sensor.toml)", file.display())));
    }
    let choice = camera_file::Choice { camera: name.as_ref().and_then(|(n, _)| n.as_str()), size_px: None };
    let (mut config, warnings) = camera_file::load_any(&file, choice)?.exact(&file)?;
    for (key, taken) in angles {
        let Some((value, span)) = taken else { continue };
        let number = match &value {
            DeValue::Float(x) => x.as_str().replace('_', "").parse().ok(),
            DeValue::Integer(x) => x.as_str().replace('_', "").parse().ok(),
            _ => None,
        };
        let Some(deg) = number else {
            let what = "must be a number of degrees";
            return Err(Problem::new(path, what).at_offset(text, span.start).in_field(format!("[camera] {key}")));
        };
        match key {
            "theta_max_deg" => config.theta_max_deg = Some(deg),
            _ => config.theta_min_deg = Some(deg),
        }
    }
    Ok(Some((config, warnings)))
}
