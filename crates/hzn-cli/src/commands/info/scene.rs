//! A scene, for `hzn simulate`.

use std::path::Path;

use hzn_sim::scenario;

use super::facts::Facts;
use crate::exit::{Stop, failed};

/// Describes a scene, which is read as `hzn simulate` reads it.
pub(super) fn describe(text: &str, file: &Path) -> Result<Facts, Stop> {
    let scenario = scenario::parse(text, file, None, None)?;
    let mut out = Facts::new("scene", "scene, for `hzn simulate FILE`");
    let (capture, camera) = (&scenario.capture, &scenario.camera);
    out.fact("name", scenario.name.clone(), "name", scenario.name.clone());
    let times = format!("{}, at {} to {} s from {}", capture.frames, capture.from_s, capture.to_s, scenario.utc);
    out.fact("pictures", times, "pictures", capture.frames);
    out.key("time_s", [capture.from_s, capture.to_s].to_vec());
    out.key("utc", scenario.utc.to_string());
    let text = format!("{} x {} px, {}", camera.width, camera.height, camera.model.name());
    out.fact("camera", text, "camera", serde_json::to_value(camera).map_err(failed)?);
    out.fact("bodies", scenario.body_names().join(", "), "bodies", scenario.body_names());
    let instruments = [("imu.csv", scenario.imu.is_some()), ("gnss.csv", scenario.gnss.is_some())];
    let written: Vec<&str> = instruments.iter().filter(|(_, there)| *there).map(|(name, _)| *name).collect();
    let names = if written.is_empty() { "none".to_owned() } else { written.join(", ") };
    out.fact("instruments", names, "instruments", written);
    Ok(out)
}
