//! The form that makes a first sensor.toml from the pictures, a field of view and an altitude.

use hzn_core::camera::Model;
use hzn_files::start::{self, Body, CameraFacts, Exif, StartConfig};

use crate::work::lens_from_limb::LensFromLimb;

/// Where the focal length comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FocalFrom {
    /// The user states the field of view.
    FieldOfView,
    /// EXIF has it.
    Exif,
    /// The user does not know the lens, so that the limb in the pictures says it.
    Limb,
}

/// The answers of the user, and what the picture itself says.
#[derive(Debug)]
pub(super) struct Wizard {
    /// Name of the picture that size and EXIF come from.
    pub(super) name: String,
    pub(super) size_px: [u32; 2],
    pub(super) exif: Exif,
    pub(super) focal_from: FocalFrom,
    pub(super) fov_deg: f64,
    pub(super) fisheye: bool,
    /// The pictures have altitudes of their own, from frames.csv or a recording.
    pub(super) has_altitudes: bool,
    /// All pictures have one altitude; otherwise frames.csv has them.
    pub(super) one_altitude: bool,
    pub(super) altitude_km: f64,
    pub(super) body: Body,
    /// The measurement of the lens in the pictures, while it runs.
    pub(super) measuring: Option<LensFromLimb>,
    /// Why this measurement had no result.
    pub(super) no_lens: Option<String>,
}

impl Wizard {
    /// Begins with a picture of this size.
    pub(super) fn new(size_px: [u32; 2], exif: Exif, has_altitudes: bool) -> Self {
        let known = exif.focal_mm.is_some() || exif.focal_35mm_mm.is_some();
        Self {
            name: String::new(),
            size_px,
            exif,
            focal_from: if known { FocalFrom::Exif } else { FocalFrom::FieldOfView },
            fov_deg: 60.0,
            fisheye: false,
            has_altitudes,
            one_altitude: !has_altitudes,
            altitude_km: 400.0,
            body: Body::default(),
            measuring: None,
            no_lens: None,
        }
    }

    /// Returns what the answers say apart from the lens.
    pub(super) fn facts_without_lens(&self) -> CameraFacts {
        CameraFacts {
            altitude_km: self.one_altitude.then_some(self.altitude_km),
            body: self.body,
            ..CameraFacts::of_size(self.size_px)
        }
    }

    /// Returns the sensor.toml with its warnings.
    ///
    /// # Errors
    /// The field of view is impossible for the lens, or EXIF has no focal length; the message says what to do.
    pub(super) fn write(&self) -> Result<StartConfig, String> {
        let facts = CameraFacts {
            fov_deg: (self.focal_from == FocalFrom::FieldOfView).then_some(self.fov_deg),
            lens: Some(if self.fisheye { Model::Equidistant } else { Model::Pinhole }),
            exif: self.exif.clone(),
            ..self.facts_without_lens()
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
        assert_eq!(wizard.focal_from, FocalFrom::FieldOfView, "this picture has no EXIF");
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
        assert!(from_exif.focal_from == FocalFrom::Exif && from_exif.write().is_ok());
    }
}
