//! `[camera]` of sensor.toml.

use crate::error::{ConfigError, Limit, above, between, require};

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
        Ok(())
    }
}
