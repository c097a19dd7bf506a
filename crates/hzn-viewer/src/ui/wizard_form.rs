//! The form that makes a first sensor.toml from the pictures, a field of view and an altitude.

use hzn_core::camera::Model;
use hzn_files::start::{self, Body, CameraFacts, Exif, StartConfig};

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

    /// Returns the sensor.toml with its warnings.
    ///
    /// # Errors
    /// The field of view is impossible for the lens, or EXIF has no focal length; the message says what to do.
    pub(super) fn write(&self) -> Result<StartConfig, String> {
        let facts = CameraFacts {
            fov_deg: self.states_fov.then_some(self.fov_deg),
            lens: Some(if self.fisheye { Model::Equidistant } else { Model::Pinhole }),
            exif: self.exif.clone(),
            altitude_km: self.one_altitude.then_some(self.altitude_km),
            body: self.body,
            ..CameraFacts::of_size(self.size_px)
        };
        start::write_sensor_toml(&facts).map_err(|e| e.to_string())
    }

    /// Says which sigmas this sensor.toml has, because the values are guesses.
    pub(super) fn sigmas_in_words(start: &StartConfig) -> String {
        let written = start.text.lines().find_map(|line| line.strip_prefix("altitude_sigma_km = "));
        let of_altitude = written.and_then(|value| value.split(' ').next());
        let of_altitude = of_altitude.map_or_else(String::new, |km| format!(", the altitude ± {km} km"));
        format!(
            "Focal length {:.0} px ± {:.1} %, k1 = 0 ± {:.2}, principal point ± {:.0} px{of_altitude} (1 sigma).",
            start.focal_px, start.focal_sigma_percent, start.k1_sigma, start.centre_sigma_px
        )
    }
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
        let start = wizard.write().unwrap();
        let session = Session::new(&start.text, Path::new("sensor.toml"), None);
        assert!(session.problem().is_none(), "{:?}", session.problem());
        let config = session.config().unwrap();
        assert!((config.camera.fx_px - 320.0).abs() < 0.5, "half of the width is at 45 degrees");
        assert_eq!(config.body.altitude_km, Some(400.0));
        let words = Wizard::sigmas_in_words(&start);
        assert!(words.starts_with("Focal length 320 px ± ") && words.contains("the altitude ± 8.0 km"), "{words}");
        assert!(start.text.contains("altitude_sigma_km = 8.0"), "{}", start.text);
        wizard.body = Body::from_name("mars").unwrap();
        let on_mars = wizard.write().unwrap();
        let session = Session::new(&on_mars.text, Path::new("sensor.toml"), None);
        assert_eq!(session.config().unwrap().body.kind.name(), "mars");
        wizard.fov_deg = 200.0;
        assert!(wizard.write().unwrap_err().contains("200"));
        let exif = Exif { focal_mm: Some(24.0), focal_35mm_mm: Some(24.0), ..Exif::default() };
        let from_exif = Wizard::new([6000, 4000], exif, true);
        assert!(!from_exif.states_fov && from_exif.write().is_ok());
    }
}
