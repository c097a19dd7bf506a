//! The first sensor.toml for a picture.

use hzn_core::camera::Model;
use hzn_files::start::{CameraFacts, write_sensor_toml as write};
use hzn_run::diagnosis::find_field_of_view;
use hzn_run::source::{OnePicture, Payload};
use hzn_run::start::read_camera_facts;
use serde_json::{Value, json};

use crate::request::Known;

/// Writes a sensor.toml as `hzn init` does: the focal length comes from the field of view, from EXIF, or from the limb
/// in the picture.
pub(crate) fn write_sensor_toml(known: &Known, picture: &[u8]) -> Result<Value, String> {
    let Known { name, fov_deg, lens, altitude_km } = known;
    if let Some(km) = altitude_km.filter(|km| !(*km > 0.0 && km.is_finite())) {
        return Err(format!("altitude: {km} is refused: it must be above 0 km"));
    }
    let lens = match lens.as_deref() {
        None => None,
        Some("pinhole") => Some(Model::Pinhole),
        Some("fisheye") => Some(Model::Equidistant),
        Some(other) => return Err(format!("lens: {other:?} is refused: it must be pinhole or fisheye")),
    };
    let read = read_camera_facts(&mut OnePicture::new(name, picture)).map_err(|e| e.to_string())?;
    let mut facts = CameraFacts { fov_deg: *fov_deg, lens, altitude_km: *altitude_km, ..read };
    let mut from = if fov_deg.is_some() { "the field of view" } else { "EXIF" };
    if !facts.has_focal() && altitude_km.is_some() {
        let (decoded, _) = Payload::Encoded(picture.to_vec()).decode(None)?;
        match find_field_of_view(&[(decoded, None)], &facts).as_slice() {
            [found] if found.is_certain() => {
                (facts.lens, facts.measured) = (Some(found.lens), Some(found.measured));
                from = "the limb in the picture";
            }
            [] | [_] => {}
            several => {
                let each = several.iter().map(|one| one.describe(facts.size_px[0])).collect::<Vec<_>>();
                return Err(format!(
                    "lens: the limb says {}; choose the lens, or give the field of view",
                    each.join(", but ")
                ));
            }
        }
    }
    let start = write(&facts).map_err(|why| in_page(&why))?;
    Ok(json!({ "sensor_toml": start.text, "fov_deg": start.fov_deg, "from": from, "warnings": start.warnings }))
}

/// Returns a message of `hzn init` with the names of the page's fields instead of options.
fn in_page(message: &str) -> String {
    let named = message.replace("--fov ", "field of view ").replace("--altitude ", "altitude ");
    named.replace("--lens fisheye", "lens: fisheye").replace("--lens pinhole", "lens: pinhole")
}
