//! The form that makes a first sensor.toml from the pictures, a field of view and an altitude.

use hzn_core::camera::Model;
use hzn_files::start::{self, Body, CameraFacts, Exif};

/// The answers of the user, and what the picture itself says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wizard {
    pub(super) size_px: [u32; 2],
    pub(super) exif: Exif,
    /// The field of view is stated; otherwise the focal length comes from EXIF.
    pub(super) states_fov: bool,
    pub(super) fov_deg: f64,
    pub(super) fisheye: bool,
    /// The pictures have altitudes of their own, from frames.csv or a recording.
    pub(super) has_altitudes: bool,
    /// All pictures have one altitude; otherwise frames.csv has them.
    pub(super) one_altitude: bool,
    pub(super) altitude_km: f64,
    pub(super) body: Body,
}

impl Wizard {
    /// Begins with a picture of this size.
    pub(super) fn new(size_px: [u32; 2], exif: Exif, has_altitudes: bool) -> Self {
        let known = exif.focal_mm.is_some() || exif.focal_35mm_mm.is_some();
        Self {
            size_px,
            exif,
            states_fov: !known,
            fov_deg: 60.0,
            fisheye: false,
            has_altitudes,
            one_altitude: !has_altitudes,
            altitude_km: 400.0,
            body: Body::default(),
        }
    }

    /// Returns the text of the sensor.toml with its warnings.
    ///
    /// # Errors
    /// The field of view is impossible for the lens, or EXIF has no focal length; the message says what to do.
    pub(super) fn write(&self) -> Result<(String, Vec<String>), String> {
        let facts = CameraFacts {
            fov_deg: self.states_fov.then_some(self.fov_deg),
            lens: Some(if self.fisheye { Model::Equidistant } else { Model::Pinhole }),
            exif: self.exif.clone(),
            altitude_km: self.one_altitude.then_some(self.altitude_km),
            body: self.body,
            ..CameraFacts::of_size(self.size_px)
        };
        let start = start::write_sensor_toml(&facts).map_err(|e| e.to_string())?;
        Ok((start.text, start.warnings))
    }
}

/// Returns the sigmas that a text of a sensor.toml has: each line without its comment.
pub(super) fn sigmas(text: &str) -> Vec<&str> {
    let key = |line: &str| line.split('=').next().unwrap_or_default().trim().to_owned();
    let is_sigma = |line: &&str| !line.trim_start().starts_with('#') && key(line).contains("sigma");
    text.lines().filter(is_sigma).map(|line| line.split('#').next().unwrap_or(line).trim()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Session;
    use std::path::Path;

    #[test]
    fn the_answers_make_a_sensor_that_works() {
        let mut wizard = Wizard::new([640, 480], Exif::default(), false);
        assert!(wizard.states_fov, "this picture has no EXIF");
        wizard.fov_deg = 90.0;
        let (text, _) = wizard.write().unwrap();
        let session = Session::new(&text, Path::new("sensor.toml"), None);
        assert!(session.problem().is_none(), "{:?}", session.problem());
        let config = session.config().unwrap();
        assert!((config.camera.fx_px - 320.0).abs() < 0.5, "half of the width is at 45 degrees");
        assert_eq!(config.body.altitude_km, Some(400.0));
        let written = sigmas(&text);
        assert!(written.iter().any(|line| line.starts_with("focal_sigma_percent")), "{written:?} {text}");
        wizard.body = Body::from_name("mars").unwrap();
        let (on_mars, _) = wizard.write().unwrap();
        let session = Session::new(&on_mars, Path::new("sensor.toml"), None);
        assert_eq!(session.config().unwrap().body.kind.name(), "mars");
        wizard.fov_deg = 200.0;
        assert!(wizard.write().unwrap_err().contains("200"));
        let exif = Exif { focal_mm: Some(24.0), focal_35mm_mm: Some(24.0), ..Exif::default() };
        let from_exif = Wizard::new([6000, 4000], exif, true);
        assert!(!from_exif.states_fov && from_exif.write().is_ok());
    }
}
