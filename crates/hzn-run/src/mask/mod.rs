//! Masks for star trackers: which pixels of a picture are covered by the body that was found, and by Sun and Moon where
//! their direction is known. A covered pixel shows no star, whether the body is lit there or not.

mod outline;
#[cfg(test)]
mod tests;

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use hzn_core::body::{AU_KM, Kind, MOON_RADIUS_KM, SUN_RADIUS_KM};
use hzn_core::camera::Camera;
use hzn_core::error::ConfigError;
use hzn_core::frames::{Cam, Fixed, Rotation, UnitVec3};
use hzn_core::pixel::ImagePoint;
use hzn_core::{Config, Sensor, Solution};
use hzn_files::FrameData;
use hzn_nav::ephemeris;
use image::{GrayImage, Luma};

use crate::error::{Error, failed};
use crate::overlay::file_name;

pub use outline::Outline;

/// The value of a covered pixel in a mask; the sky has 0.
pub const COVERED: u8 = 255;
/// Side of the squares of pixels that are tested at once.
const TILE: u32 = 8;
/// 1-sigma of an attitude without a sigma, degrees; that of the sensor. From [`USELESS_DEG`] on, an attitude says
/// nothing, as for the sensor.
const ATTITUDE_SIGMA_DEG: f64 = 5.0;
const USELESS_DEG: f64 = 30.0;
/// Accuracy of the directions of Sun and Moon, degrees.
const SUN_DEG: f64 = 0.01;
const MOON_DEG: f64 = 0.1;

/// What is known of the sky in one picture.
#[derive(Debug, Clone)]
pub struct Covered {
    /// The bodies.
    pub outlines: Vec<Outline>,
    /// The bodies that the sensor searches for, but that were not found and whose direction is not known: the mask is
    /// without them.
    pub without: Vec<Kind>,
}

/// Makes masks from the answers of one sensor.
#[derive(Debug, Clone)]
pub struct Masker {
    sensor: Sensor<f64>,
}

impl Masker {
    /// Prepares masks for the answers of a sensor.
    ///
    /// # Errors
    /// The first field of the configuration that is outside its limits.
    pub fn new(config: &Config) -> Result<Self, ConfigError> {
        Sensor::new(config).map(|sensor| Self { sensor })
    }

    /// Returns what covers the sky in a picture. `answers` has one entry for each body of the sensor; `data` was given
    /// with the picture. The outlines are moved outwards by three standard deviations, and by `margin_rad`.
    ///
    /// # Errors
    /// Why there is no mask, in words: the first body of the sensor has no answer, or it is an ellipsoid whose position
    /// could not be fitted.
    pub fn cover(
        &self,
        answers: &[Option<&Solution<f64>>],
        data: Option<&FrameData>,
        margin_rad: f64,
    ) -> Result<Covered, String> {
        let mut covered = Covered { outlines: Vec::new(), without: Vec::new() };
        let at = self.sensor.config().body.kind;
        let disc = |kind| Some(Disc::known(kind, data?, at)?.outline(margin_rad));
        let mut seen = Vec::new();
        for (which, body) in self.sensor.config().each_body().iter().enumerate() {
            let outline = answers.get(which).copied().flatten().map(|s| self.outline(which, s, data, margin_rad));
            match (outline, disc(body.kind)) {
                (Some(outline), _) => covered.outlines.push(outline?),
                (None, _) if which == 0 => return Err("no answer".into()),
                (None, Some(disc)) => covered.outlines.push(disc),
                (None, None) => covered.without.push(body.kind),
            }
            seen.push(body.kind);
        }
        let others = [Kind::Sun, Kind::Moon].into_iter().filter(|kind| !seen.contains(kind));
        covered.outlines.extend(others.filter_map(disc));
        Ok(covered)
    }

    /// Returns the outline of one answer.
    fn outline(
        &self,
        which: usize,
        solution: &Solution<f64>,
        data: Option<&FrameData>,
        margin_rad: f64,
    ) -> Result<Outline, String> {
        let config = self.sensor.config();
        let body = config.each_body().get(which).ok_or("no such body")?;
        if config.fits_position(body) && solution.position.is_none() {
            return Err(format!("the arc of {} is too short for the outline of its ellipsoid", body.kind.name()));
        }
        let known = data.map(|data| data.for_body(which, body)).transpose().map_err(|e| e.to_string())?;
        let prior = known.map(|data| data.to_prior(None)).unwrap_or_default();
        let expected = self.sensor.expect_body(which, &prior).map_err(|e| e.to_string())?;
        Ok(Outline::of_answer(solution, &expected, margin_rad))
    }
}

impl From<Sensor<f64>> for Masker {
    fn from(sensor: Sensor<f64>) -> Self {
        Self { sensor }
    }
}

/// Sun or Moon in a known direction.
struct Disc {
    direction: UnitVec3<Cam, f64>,
    half_angle_rad: f64,
    /// Largest error of the direction, radians.
    error_rad: f64,
}

impl Disc {
    /// Returns Sun or Moon in the direction that the data of a picture give: the direction to the Sun itself, or that
    /// of the ephemeris at the time (for the Moon, at the position too) through the attitude; `None` if it is unknown.
    fn known(kind: Kind, data: &FrameData, at: Kind) -> Option<Self> {
        let is_at_earth = matches!(at, Kind::Earth | Kind::EarthSphere);
        // The nearest that the Sun comes to a camera at this body.
        let least_sun_au = match at {
            Kind::Mercury => 0.307,
            Kind::Venus => 0.718,
            _ => 0.983,
        };
        let (radius_km, accuracy_deg) = match kind {
            Kind::Sun => (SUN_RADIUS_KM, SUN_DEG),
            Kind::Moon => (MOON_RADIUS_KM, MOON_DEG),
            _ => return None,
        };
        let given = data.sun_camera.filter(|_| kind == Kind::Sun).and_then(UnitVec3::try_new);
        if let Some(direction) = given {
            let half_angle_rad = (SUN_RADIUS_KM / (AU_KM * least_sun_au)).asin();
            return Some(Self { direction, half_angle_rad, error_rad: 0.0 });
        }
        let utc_s = data.utc_s.filter(|_| is_at_earth)?;
        let position_m = data.position_km.map(|p| p.map(|km| km * 1e3));
        let place = match (kind, position_m) {
            (Kind::Sun, None) => ephemeris::sun(utc_s),
            (Kind::Sun, Some(position_m)) => ephemeris::sun(utc_s).seen_from(position_m.into()),
            // From an unknown position the Moon can be a degree from its direction at the Earth's centre.
            (_, position_m) => ephemeris::moon(utc_s).seen_from(position_m?.into()),
        };
        let sigma_deg = data.attitude_sigma_deg.unwrap_or(ATTITUDE_SIGMA_DEG);
        let attitude = data.q_fixed_from_camera_wxyz.filter(|_| sigma_deg < USELESS_DEG)?;
        let fixed: UnitVec3<Fixed, f64> = place.direction.to_unit()?;
        Some(Self {
            direction: Rotation::<Cam, Fixed, f64>::assume_from_quaternion(attitude)?.inverse().apply(&fixed),
            half_angle_rad: (radius_km * 1e3 / place.distance_m).min(1.0).asin(),
            error_rad: (3.0 * sigma_deg + accuracy_deg).to_radians(),
        })
    }

    fn outline(&self, margin_rad: f64) -> Outline {
        Outline::disc(&self.direction, self.half_angle_rad, self.error_rad + margin_rad)
    }
}

/// Draws a mask of the size of the camera's picture: [`COVERED`] where an outline covers any part of a pixel, else 0.
/// Pixels beyond the image circle, which show nothing, have 0.
pub fn draw(outlines: &[Outline], camera: &Camera<f64>) -> GrayImage {
    let (width, height) = (u32::from(camera.width()), u32::from(camera.height()));
    let mut mask = GrayImage::new(width, height);
    let ray = |x: f64, y: f64| camera.ray(ImagePoint { u: x, v: y });
    for y0 in (0..height).step_by(TILE as usize) {
        for x0 in (0..width).step_by(TILE as usize) {
            let (x1, y1) = ((x0 + TILE).min(width), (y0 + TILE).min(height));
            let [left, right, top, bottom] = [x0, x1 - 1, y0, y1 - 1].map(f64::from);
            let corners = [(left, top), (right, top), (left, bottom), (right, bottom)];
            let is_whole = corners.iter().all(|&(x, y)| ray(x, y).is_some());
            let middle = ray((left + right) / 2.0, (top + bottom) / 2.0).filter(|_| is_whole);
            let half_px = f64::from(TILE) / 2.0;
            let all = |outline: &Outline| outline.covers_all(middle.as_ref()?, half_px);
            if outlines.iter().any(|outline| all(outline) == Some(true)) {
                (y0..y1).for_each(|y| (x0..x1).for_each(|x| mask.put_pixel(x, y, Luma([COVERED]))));
                continue;
            }
            let near: Vec<&Outline> = outlines.iter().filter(|outline| all(outline) != Some(false)).collect();
            if near.is_empty() {
                continue;
            }
            for (y, x) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (y, x))) {
                let ray = ray(f64::from(x), f64::from(y));
                if ray.is_some_and(|ray| near.iter().any(|outline| outline.covers(&ray))) {
                    mask.put_pixel(x, y, Luma([COVERED]));
                }
            }
        }
    }
    mask
}

/// The folder into which a run writes a mask for each answered picture.
#[derive(Debug, Clone)]
pub struct MaskFolder {
    folder: PathBuf,
    masker: Masker,
    margin_rad: f64,
}

/// What became of the mask of a picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MaskOutcome {
    /// It was written, without these bodies: see [`Covered::without`].
    Written(Vec<Kind>),
    /// There is none, for this reason.
    Missing(String),
}

impl MaskFolder {
    /// Prepares the masks of a run. The outlines are moved outwards by three standard deviations, and by `margin_deg`.
    ///
    /// # Errors
    /// The first field of the configuration that is outside its limits.
    pub fn new(folder: &Path, config: &Config, margin_deg: f64) -> Result<Self, ConfigError> {
        let masker = Masker::new(config)?;
        Ok(Self { folder: folder.to_owned(), masker, margin_rad: margin_deg.to_radians() })
    }

    /// Writes the mask of the picture `name`. A picture without a mask loses the one of an earlier run in this folder,
    /// because that would be used as its own.
    ///
    /// # Errors
    /// The file cannot be written or removed.
    pub(crate) fn write(
        &self,
        name: &str,
        answers: &[Option<&Solution<f64>>],
        data: Option<&FrameData>,
        camera: &Camera<f64>,
    ) -> Result<MaskOutcome, Error> {
        let path = self.folder.join(file_name(name));
        match self.masker.cover(answers, data, self.margin_rad) {
            Ok(covered) => {
                let bytes = png(&draw(&covered.outlines, camera))?;
                crate::disk::write(&path, bytes)?;
                Ok(MaskOutcome::Written(covered.without))
            }
            Err(why) => self.remove(name).map(|()| MaskOutcome::Missing(why)),
        }
    }

    /// Removes the mask of the picture `name`, if there is one.
    ///
    /// # Errors
    /// The file cannot be removed.
    pub(crate) fn remove(&self, name: &str) -> Result<(), Error> {
        let path = self.folder.join(file_name(name));
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != ErrorKind::NotFound => Err(crate::disk::cannot_write(&path, &e)),
            _ => Ok(()),
        }
    }
}

/// Encodes a mask as PNG.
fn png(mask: &GrayImage) -> Result<Vec<u8>, Error> {
    use image::codecs::png::{CompressionType, FilterType, PngEncoder};
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Up);
    mask.write_with_encoder(encoder).map_err(|e| failed(format!("mask: {e}")))?;
    Ok(bytes)
}
