//! Writes a calibrated lens into the text of a sensor.toml.

use hzn_core::camera::Config;
use hzn_files::camera_file::{self, Format};
use toml_edit::{DocumentMut, Item, Table, Value};

use crate::sky::{Written, set};

/// Writes a whole lens into the text of a sensor.toml: each key of `[camera]` that changes gets a comment with the
/// `source`, for example `13 board pictures of boards`. Keys that do not belong to a lens stay, and so does the image
/// circle unless the calibration sets it.
///
/// # Errors
/// The text is not valid TOML, `[camera]` is not a section, or the lens cannot be written.
pub fn into_sensor_toml(text: &str, camera: &Config, source: &str) -> Result<Written, String> {
    let mut document: DocumentMut = text.parse().map_err(|e| format!("is not valid TOML: {e}"))?;
    let item = document.entry("camera").or_insert_with(|| Item::Table(Table::new()));
    if let Item::Value(Value::InlineTable(table)) = item {
        *item = Item::Table(table.clone().into_table());
    }
    let table = item.as_table_like_mut().ok_or("camera is not a section")?;
    let written = camera_file::write(camera, Format::Sensor).map_err(|e| e.to_string())?;
    let lens: DocumentMut = written.parse().map_err(|e| format!("the lens is not valid TOML: {e}"))?;
    let lens = lens.get("camera").and_then(Item::as_table_like).ok_or("the lens has no section")?;
    // What described the lens before must not mix with the new one.
    for key in ["file", "camera", "k", "covariance", "focal_sigma_percent", "centre_sigma_px"] {
        if !lens.contains_key(key) || table.get(key).is_some_and(|item| item.as_value().is_none()) {
            table.remove(key);
        }
    }
    let (why, mut keys) = (format!("from {source} by `hzn calibrate board`"), Vec::new());
    for (key, item) in lens.iter() {
        let Ok(mut value) = item.clone().into_value() else { continue };
        value.decor_mut().clear();
        let text_of = |value: &Value| {
            let mut plain = value.clone();
            plain.decor_mut().clear();
            plain.to_string()
        };
        let before = table.get(key).and_then(Item::as_value).map(text_of);
        if before != Some(text_of(&value)) {
            set(table, "[camera]", key, value, &why, &mut keys);
        }
    }
    Ok(Written { text: document.to_string(), keys })
}

#[cfg(test)]
mod tests {
    use hzn_core::camera::Model;

    use super::*;

    #[test]
    fn the_whole_lens_is_replaced_and_all_else_stays() {
        let mut camera = Config::ideal(Model::KannalaBrandt, 640, 480, 531.25);
        camera.k = [0.01, -0.002, 0.0, 0.0].into_iter().collect();
        let text = "# mine\n[camera]\nwidth = 640   # px\nheight = 480\nmodel = \"brown-conrady\"\nfx_px = 500.0\n\
                    fy_px = 500.0\ncx_px = 319.5\ncy_px = 239.5\nk = [0.1, 0, 0, 0, 0]\nfocal_sigma_percent = 2.0\n\
                    theta_max_deg = 40.0\nreadout_s = 0.01\n\n[body]\nkind = \"earth\"\n";
        let written = into_sensor_toml(text, &camera, "13 board pictures of boards").unwrap();
        let sensor = hzn_files::sensor::parse(&written.text, std::path::Path::new("sensor.toml")).unwrap();
        let now = &sensor.config.camera;
        assert_eq!((now.model, now.fx_px, now.k.as_slice()), (camera.model, 531.25, camera.k.as_slice()));
        assert_eq!((now.theta_max_deg, now.readout_s), (Some(40.0), 0.01));
        assert!(
            written.text.starts_with("# mine") && written.text.contains("# px") && !written.text.contains("percent")
        );
        assert!(written.text.contains("# calibrated: from 13 board pictures of boards by"), "{}", written.text);
        assert!(written.keys.iter().any(|key| key == "[camera] fx_px = 531.25"), "{:?}", written.keys);
        assert!(!written.keys.iter().any(|key| key.contains("width")), "the width is as before");
        let again = into_sensor_toml(&written.text, &camera, "13 board pictures of boards").unwrap();
        assert_eq!((again.keys.len(), again.text), (0, written.text));
    }
}
