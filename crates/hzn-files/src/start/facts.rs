//! What is known about a camera, and the file that follows from it.

use hzn_core::camera::Model;
use hzn_core::tone::Tone;

use super::bars::Bars;
use super::body::Body;
use super::circle::ImageCircle;
use super::exif::Exif;

/// Known properties of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFacts {
    /// Columns and rows of its pictures.
    pub size_px: [u32; 2],
    /// Stated field of view over the whole width, with bars, in degrees.
    pub fov_deg: Option<f64>,
    /// [`Model::Pinhole`] or [`Model::Equidistant`]. If it is missing, a pinhole is assumed. A stated field of view
    /// above 90 degrees requires it.
    pub lens: Option<Model>,
    /// EXIF data of a picture.
    pub exif: Exif,
    /// Curve between light and counts that the pictures say.
    pub tone: Option<Tone>,
    /// Altitude of all pictures, in kilometres.
    pub altitude_km: Option<f64>,
    /// The body in the pictures.
    pub body: Body,
    /// Field of view that the limb in the pictures says. It is used if neither a field of view nor EXIF is known.
    pub measured: Option<MeasuredFov>,
    /// 1-sigma in percent that is added to that of a stated focal length, because the limb contradicts it.
    pub doubt_percent: Option<f64>,
    /// Radius about the picture's centre beyond which no light arrives, in pixels, if the pictures show it. The file of
    /// a fisheye limits the lens to it.
    pub image_circle_px: Option<f64>,
    /// Black bars, or a bright frame, that all pictures have along their sides, which the file masks.
    pub bars: Option<Bars>,
    /// Width of a pixel over its height; 1 for nearly all cameras, but not for every video.
    pub pixel_aspect: f64,
    /// Time from the first to the last row of a picture in seconds, if the video says it.
    pub readout_s: Option<f64>,
}

impl CameraFacts {
    /// Makes the facts of a camera of which only the size of the pictures is known.
    pub fn of_size(size_px: [u32; 2]) -> Self {
        Self {
            size_px,
            fov_deg: None,
            lens: None,
            exif: Exif::default(),
            tone: None,
            altitude_km: None,
            body: Body::default(),
            measured: None,
            doubt_percent: None,
            image_circle_px: None,
            bars: None,
            pixel_aspect: 1.0,
            readout_s: None,
        }
    }
    /// Returns whether a stated field of view or EXIF gives the focal length.
    pub fn has_focal(&self) -> bool {
        self.fov_deg.is_some() || self.exif.focal(self.size_px.map(f64::from)).is_ok()
    }
}

/// A field of view that was measured on the limb in pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredFov {
    /// Field of view over the whole width, in degrees.
    pub fov_deg: f64,
    /// 1-sigma of the focal length of a lens with this angle at the edge, in percent.
    pub focal_sigma_percent: f64,
    /// Number of pictures.
    pub pictures: usize,
}

/// A sensor.toml to start from, with its main values.
#[derive(Debug, Clone, PartialEq)]
pub struct StartConfig {
    /// Text of the file.
    pub text: String,
    /// Ideal lens that is closest to the guess: [`Model::Pinhole`] or [`Model::Equidistant`].
    pub lens: Model,
    /// Focal length, in pixels.
    pub focal_px: f64,
    /// Field of view over the whole width, in degrees.
    pub fov_deg: f64,
    /// 1-sigma of the focal length, in percent, with the part that the shape of the lens explains.
    pub focal_sigma_percent: f64,
    /// 1-sigma of the coefficient k1 with k2 = 0, which is the main part of the shape of the lens.
    pub k1_sigma: f64,
    /// 1-sigma of the coefficient k2.
    pub k2_sigma: f64,
    /// 1-sigma of the coefficients p1 and p2 (decentring); `None` for a fisheye, whose model does not have them.
    pub p_sigma: Option<f64>,
    /// 1-sigma of the principal point, in pixels.
    pub centre_sigma_px: f64,
    /// The image circle that the file has.
    pub image_circle: Option<ImageCircle>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}
