//! `[camera]` of sensor.toml.

use super::uncertain::INTRINSICS;
use crate::base::error::{ConfigError, Limit, above, between, require};

/// The projection of the lens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Model {
    /// r = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸); OpenCV `fisheye`, Kalibr `equidistant`.
    #[default]
    KannalaBrandt,
    /// r = θ, without coefficients.
    Equidistant,
    /// r = tan θ, without coefficients.
    Pinhole,
    /// Pinhole with radial and tangential distortion: k = [k1, k2, p1, p2, k3] as OpenCV writes them.
    BrownConrady,
}

impl Model {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::KannalaBrandt => "kannala-brandt",
            Self::Equidistant => "equidistant",
            Self::Pinhole => "pinhole",
            Self::BrownConrady => "brown-conrady",
        }
    }
}

/// An intrinsic parameter, by its name in sensor.toml.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[allow(missing_docs, reason = "the names are those of the keys")]
pub enum Intrinsic {
    FxPx,
    FyPx,
    CxPx,
    CyPx,
    K1,
    K2,
    K3,
    K4,
    P1,
    P2,
}

/// `[camera.covariance]`: covariance of the intrinsic parameters, as a calibration program gives it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Covariance {
    /// The parameters of the rows and columns: `fx_px`, `fy_px`, `cx_px`, `cy_px`, and the coefficients by their names, `k1` to
    /// `k4` of `kannala-brandt`, `k1, k2, p1, p2, k3` of `brown-conrady`. What is left out counts as known exactly.
    pub order: heapless::Vec<Intrinsic, INTRINSICS>,
    /// The matrix row by row, symmetric and positive semidefinite, in px² and the coefficients' own unit.
    pub rows: heapless::Vec<heapless::Vec<f64, INTRINSICS>, INTRINSICS>,
}

/// A camera calibration. Pixel centres at integers, x right, y down, z forward (as OpenCV).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Config {
    /// Columns of the picture, 2 to 65535.
    pub width: u16,
    /// Rows of the picture, 2 to 65535.
    pub height: u16,
    /// The projection.
    #[cfg_attr(feature = "serde", serde(default))]
    pub model: Model,
    /// Focal length along x in pixels, above 0.
    pub fx_px: f64,
    /// Focal length along y in pixels, above 0.
    pub fy_px: f64,
    /// Principal point, column in pixels.
    pub cx_px: f64,
    /// Principal point, row in pixels.
    pub cy_px: f64,
    /// Coefficients: up to 4 for `kannala-brandt`, up to 5 for `brown-conrady`, none for the others. Missing ones are 0.
    #[cfg_attr(feature = "serde", serde(default))]
    pub k: heapless::Vec<f64, 5>,
    /// Radius of the image circle in degrees off axis; pixels beyond count as masked. The lens must be monotone up
    /// to the smaller of this and the farthest corner, with 2° to spare.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub theta_max_deg: Option<f64>,
    /// 1-sigma of the focal length, of both axes alike, in percent of it, 0 to 100. It widens the covariance.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub focal_sigma_percent: f64,
    /// 1-sigma of the principal point in pixels, of each coordinate, 0 or more. It widens the covariance.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub centre_sigma_px: f64,
    /// Covariance of the intrinsic parameters; it counts instead of the two sigmas.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub covariance: Option<Covariance>,
    /// Time from the exposure of the first row to that of the last one in seconds, 0 to 10; 0 for a global shutter, and
    /// negative where the last row comes first. It counts where a frame brings the camera's rate of rotation: the rays of each
    /// row are turned to the time of the middle row.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub readout_s: f64,
}

/// What a lens that is known exactly leaves out.
#[cfg(feature = "serde")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl Config {
    /// An ideal lens with its principal point in the middle and equal focal lengths.
    pub fn ideal(model: Model, width: u16, height: u16, focal_px: f64) -> Self {
        Self {
            width,
            height,
            model,
            fx_px: focal_px,
            fy_px: focal_px,
            cx_px: (f64::from(width) - 1.0) / 2.0,
            cy_px: (f64::from(height) - 1.0) / 2.0,
            k: heapless::Vec::new(),
            theta_max_deg: None,
            focal_sigma_percent: 0.0,
            centre_sigma_px: 0.0,
            covariance: None,
            readout_s: 0.0,
        }
    }

    /// Coefficient `i` (from 0), or 0 where the list ends before it.
    pub fn coefficient(&self, i: usize) -> f64 {
        self.k.get(i).copied().unwrap_or(0.0)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        require(self.width >= 2, "camera.width", f64::from(self.width), Limit::AtLeast(2.0))?;
        require(self.height >= 2, "camera.height", f64::from(self.height), Limit::AtLeast(2.0))?;
        above("camera.fx_px", self.fx_px, 0.0)?;
        above("camera.fy_px", self.fy_px, 0.0)?;
        // A principal point far outside the picture is a mistake of units or order, not a lens.
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        between("camera.cx_px", self.cx_px, -w, 2.0 * w)?;
        between("camera.cy_px", self.cy_px, -h, 2.0 * h)?;
        let most = match self.model {
            Model::KannalaBrandt => 4,
            Model::BrownConrady => 5,
            Model::Equidistant | Model::Pinhole => 0,
        };
        for (i, &k) in self.k.iter().enumerate() {
            require(k.is_finite(), "camera.k", k, Limit::Finite)?;
            require(
                i < most || k == 0.0,
                "camera.k",
                k,
                Limit::Rule(match self.model {
                    Model::KannalaBrandt => "kannala-brandt has four coefficients k1 to k4",
                    Model::BrownConrady => "brown-conrady has five coefficients k1, k2, p1, p2, k3",
                    Model::Equidistant | Model::Pinhole => "this model has no coefficients: leave camera.k out",
                }),
            )?;
        }
        if let Some(deg) = self.theta_max_deg {
            between("camera.theta_max_deg", deg, 0.1, 175.0)?;
        }
        between("camera.focal_sigma_percent", self.focal_sigma_percent, 0.0, 100.0)?;
        between("camera.centre_sigma_px", self.centre_sigma_px, 0.0, 1e6)?;
        between("camera.readout_s", self.readout_s, -10.0, 10.0)
    }
}
