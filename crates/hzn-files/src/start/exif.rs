//! The focal length of a camera by the EXIF of its pictures.

use super::focal::{Focal, SQRT_3};

/// 1-sigma of the focal length in EXIF, in percent: uniform within ± 10 %.
const EXIF_PERCENT: f64 = 10.0 / SQRT_3;
const SIGMA_FROM: &str = "EXIF (10 % at most)";
/// Sides of the 35 mm film, in millimetres.
const FILM_MM: [f64; 2] = [36.0, 24.0];
/// Smallest longer side of a sensor whose pitch is used without another value that confirms it, in millimetres. The
/// sensors of cameras that write their pitch are larger: the smallest usual format, 1/3 inch, has 4.8 mm. A picture
/// that was made smaller afterwards keeps the pitch of the original pixels, so that its sensor seems too small.
const MIN_SENSOR_MM: f64 = 4.0;

/// EXIF data of a picture about the lens; every field may be missing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Exif {
    /// Maker's name of the camera.
    pub camera: Option<String>,
    /// `FocalLength`, in millimetres.
    pub focal_mm: Option<f64>,
    /// `FocalLengthIn35mmFilm`, in millimetres.
    pub focal_35mm_mm: Option<f64>,
    /// `FocalPlaneXResolution`, converted to pixels per millimetre on the sensor.
    pub plane_px_per_mm: Option<f64>,
    /// `PixelXDimension`: columns of the picture as the camera wrote it. A picture with another width was scaled later.
    pub columns: Option<f64>,
    /// `DigitalZoomRatio`, if the camera enlarged its picture.
    pub digital_zoom: Option<f64>,
    /// Whether a viewer turns the picture by 90 degrees (`Orientation` 5 to 8).
    pub turned: bool,
}

/// Returns a number that can be a length or a ratio.
fn sound(x: Option<f64>) -> Option<f64> {
    x.filter(|x| x.is_finite() && *x > 0.0)
}

impl Exif {
    /// Returns the focal length from EXIF for a picture of this size (pixels).
    ///
    /// # Errors
    /// There is none; the text says why, if EXIF has one that is not used.
    pub(super) fn focal(&self, size: [f64; 2]) -> Result<Focal, Option<String>> {
        let (pitch, film) = (self.focal_by_pitch(size), self.focal_on_film(size));
        let Some((pitch, sensor_mm)) = pitch else { return film.ok_or_else(|| self.without_sensor()) };
        if sensor_mm >= MIN_SENSOR_MM {
            return Ok(pitch);
        }
        match film {
            Some(film) if (pitch.px / film.px - 1.0).abs() <= 0.03 * pitch.percent.hypot(film.percent) => Ok(pitch),
            Some(film) => Ok(film),
            None => Err(Some(format!(
                "{} over {:.0} px of width would be a sensor of {sensor_mm:.1} mm: the picture was probably made \
                 smaller or cut after exposure, and its EXIF is still that of the original",
                pitch.from, size[0]
            ))),
        }
    }

    /// Says what a focal length without the size of the sensor still needs; `None` without a focal length.
    fn without_sensor(&self) -> Option<String> {
        let mm = sound(self.focal_mm)?;
        Some(format!(
            "EXIF has a focal length of {mm} mm, but not the width W of the camera's sensor: a pinhole has a field of \
             view of 2 atan(W / {} mm)",
            2.0 * mm
        ))
    }

    /// Returns the focal length by the pitch of the pixels, and the longer side of the sensor in millimetres.
    fn focal_by_pitch(&self, [width, height]: [f64; 2]) -> Option<(Focal, f64)> {
        let (mm, px_per_mm) = sound(self.focal_mm).zip(sound(self.plane_px_per_mm))?;
        let scale =
            sound(self.columns).map_or(1.0, |columns| width / columns) * sound(self.digital_zoom).unwrap_or(1.0);
        let pitch_um = 1e3 / (px_per_mm * scale);
        // Some programs write wrong values there. No sensor has pixels below half a micrometre or above 0.1 mm.
        if !(0.5..100.0).contains(&pitch_um) {
            return None;
        }
        let from = format!("EXIF: {mm} mm, pixels of {pitch_um:.2} um");
        let focal = Focal {
            px: mm * px_per_mm * scale,
            percent: EXIF_PERCENT,
            from,
            sigma_from: SIGMA_FROM,
            is_at_edge: false,
        };
        Some((focal, width.max(height) * sound(self.digital_zoom).unwrap_or(1.0) * pitch_um * 1e-3))
    }

    /// Returns the focal length by its equivalent on 35 mm film.
    fn focal_on_film(&self, [width, height]: [f64; 2]) -> Option<Focal> {
        let mm = sound(self.focal_35mm_mm)?;
        // The 35 mm equivalent compares diagonals. A picture wider than the film is cropped in height and keeps its
        // width.
        let [film_width, film_height] = FILM_MM;
        let px = if width * film_height > height * film_width {
            mm * width / film_width
        } else {
            mm * width.hypot(height) / film_width.hypot(film_height)
        };
        let rounded = 100.0 * 0.5 / mm / SQRT_3;
        Some(Focal {
            px,
            percent: EXIF_PERCENT.hypot(rounded),
            from: format!("EXIF: equivalent to {mm} mm on 35 mm film"),
            sigma_from: SIGMA_FROM,
            is_at_edge: false,
        })
    }
}
