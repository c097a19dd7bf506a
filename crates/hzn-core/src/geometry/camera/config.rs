//! `[camera]` of sensor.toml.

use super::intrinsic::{Covariance, Intrinsic};
use super::temperature::Temperature;
use crate::base::error::{ConfigError, Limit, between, require};
use crate::base::keys::{Section, choices, section};

choices! {
    /// The projection of the lens.
    pub enum Model {
        /// r = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸); OpenCV calls this model `fisheye`, Kalibr `equidistant`.
        @0 KannalaBrandt = "kannala-brandt";
        /// r = θ, without coefficients.
        @1 Equidistant = "equidistant";
        /// r = tan θ, without coefficients.
        @2 Pinhole = "pinhole";
        /// Pinhole with radial and tangential distortion; k = [k1, k2, p1, p2, k3], in OpenCV's order.
        @3 BrownConrady = "brown-conrady";
        /// Kalibr's `ds`: k = [ξ, α].
        @- DoubleSphere = "double-sphere" needs "kalibr";
        /// Kalibr's `eucm`: k = [α, β].
        @- Eucm = "eucm" needs "kalibr";
    }
}

/// Families of projections.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// The image radius is a polynomial of the angle θ off axis, as in OpenCV's fisheye model.
    Angle,
    /// The image radius grows with tan θ, with distortion in the plane z = 1, as in OpenCV's pinhole model.
    Plane,
    /// The lens has equations of its own, which other formats do not have.
    Own,
}

impl Model {
    /// Returns the names of the coefficients, in the order of `camera.k`.
    pub const fn coefficients(self) -> &'static [&'static str] {
        match self {
            Self::KannalaBrandt => &["k1", "k2", "k3", "k4"],
            Self::BrownConrady => &["k1", "k2", "p1", "p2", "k3"],
            Self::DoubleSphere => &["xi", "alpha"],
            Self::Eucm => &["alpha", "beta"],
            Self::Equidistant | Self::Pinhole => &[],
        }
    }

    /// Returns the intrinsic parameters of the lens: `fx_px`, `fy_px`, `cx_px`, `cy_px`, then the coefficients in the
    /// order of `camera.k`.
    pub const fn intrinsics(self) -> &'static [Intrinsic] {
        use Intrinsic::{Alpha, Beta, CxPx, CyPx, FxPx, FyPx, K1, K2, K3, K4, P1, P2, Xi};
        match self {
            Self::KannalaBrandt => &[FxPx, FyPx, CxPx, CyPx, K1, K2, K3, K4],
            Self::BrownConrady => &[FxPx, FyPx, CxPx, CyPx, K1, K2, P1, P2, K3],
            Self::DoubleSphere => &[FxPx, FyPx, CxPx, CyPx, Xi, Alpha],
            Self::Eucm => &[FxPx, FyPx, CxPx, CyPx, Alpha, Beta],
            Self::Equidistant | Self::Pinhole => &[FxPx, FyPx, CxPx, CyPx],
        }
    }

    /// Returns the index of a parameter in [`Self::intrinsics`]; `None` if the model does not have the parameter.
    // A list of at most nine names is searched, because a calibration is loaded once.
    pub(super) fn index_of(self, which: Intrinsic) -> Option<usize> {
        self.intrinsics().iter().position(|intrinsic| *intrinsic == which)
    }

    /// Returns the family of the projection. Programs that treat lenses by their family need no change for a new lens.
    pub const fn projection(self) -> Projection {
        match self {
            Self::KannalaBrandt | Self::Equidistant => Projection::Angle,
            Self::Pinhole | Self::BrownConrady => Projection::Plane,
            Self::DoubleSphere | Self::Eucm => Projection::Own,
        }
    }

    /// Returns whether the lens ends before 90° off axis.
    pub const fn is_planar(self) -> bool {
        matches!(self.projection(), Projection::Plane)
    }
}

section! {
    /// `[camera]` of sensor.toml: the calibration. Pixel centres are at integers, x points right, y down, z forward, as
    /// in OpenCV.
    "camera" pub struct Config without defaults {
        /// Columns of the picture, px.
        @1 width: u16, serde(), [2.0 to 65535.0] { example: "1920" };
        /// Rows of the picture, px.
        @2 height: u16, serde(), [2.0 to 65535.0] { example: "1080" };
        /// Projection of the lens.
        @3 model: Model, serde(default), [choice]
            { unset: "`kannala-brandt`", example: "\"pinhole\"" };
        /// Focal length along x, px.
        @4 fx_px: f64, serde(), [above 0.0] { example: "1200.0" };
        /// Focal length along y, px.
        @5 fy_px: f64, serde(), [above 0.0] { example: "1200.0" };
        /// Column of the principal point, px.
        @6 cx_px: f64, serde(), ["−1 to 2 times the width"] { example: "959.5" };
        /// Row of the principal point, px.
        @7 cy_px: f64, serde(), ["−1 to 2 times the height"] { example: "539.5" };
        /// Coefficients: k1 to k4 of `kannala-brandt`, k1, k2, p1, p2, k3 of `brown-conrady`, ξ, α of `double-sphere`,
        /// α, β of `eucm`.
        ///
        /// Coefficients that are left out are 0. The other models have none. The list does not contain the factor 1 of
        /// the first power of the angle.
        @8 k: heapless::Vec<f64, 5>, serde(default), ["at most as many as the model has; the lens must be monotone"]
            { unset: "none", example: "[-0.055, 0.011, -0.0035, 0.0002]" };
        /// Radius of the image circle, degrees off the optical axis; pixels beyond it count as masked.
        ///
        /// Set it if the corners of the picture are black, or if the calibration does not cover them.
        ///
        /// The lens must be monotone up to 2° beyond the smaller of this angle and the farthest corner.
        @13 theta_max_deg: Option<f64>, serde(default, skip_serializing_if = "Option::is_none"), [0.1 to 175.0]
            { unset: "none", example: "54.0" };
        /// Radius of the blind centre, degrees off the optical axis; pixels nearer to the axis count as masked.
        ///
        /// A panoramic annular lens has one. It must be smaller than `theta_max_deg` and the angle of the farthest
        /// corner.
        @17 theta_min_deg: Option<f64>, serde(default, skip_serializing_if = "Option::is_none"), [0.1 to 175.0]
            { unset: "none", example: "30.0" };
        /// 1σ of the focal length, the same for both axes, in percent; it widens the covariance.
        ///
        /// Take it from the calibration. Without a calibration it is the error of the field of view that was given.
        @14 focal_sigma_percent: f64, serde(default, skip_serializing_if = "is_zero"), [0.0 to 100.0]
            { unset: "0", example: "0.1" };
        /// 1σ of each coordinate of the principal point, px; it widens the covariance.
        @15 centre_sigma_px: f64, serde(default, skip_serializing_if = "is_zero"), [0.0 to 1e6]
            { unset: "0", example: "0.5" };
        /// Covariance of the intrinsic parameters, used instead of the two sigmas; `order` names rows and columns
        /// (`fx_px`, `fy_px`, `cx_px`, `cy_px`, `k1` ...), `rows` is the matrix.
        @- covariance: Option<Covariance>, serde(default, skip_serializing_if = "Option::is_none"),
            ["symmetric, positive semidefinite"]
            { unset: "none", example: "{ order = [\"fx_px\", \"fy_px\"], rows = [[1.0, 0.9], [0.9, 1.0]] }" };
        /// Change of the lens with the temperature of the camera: `reference_c`, `focal_ppm_per_k`, `cx_px_per_k`,
        /// `cy_px_per_k`, and `untold_sigma_k` for pictures without a temperature.
        ///
        /// `reference_c` (°C) is the temperature of the calibration. The focal lengths grow by `focal_ppm_per_k`
        /// millionths a kelvin, and the principal point moves by `cx_px_per_k` and `cy_px_per_k` pixels a kelvin. The
        /// column `camera_temperature_c` of frames.csv gives the temperature of each picture. A picture without a
        /// temperature has the lens of the reference; `untold_sigma_k`, the 1σ of its temperature in kelvin, then
        /// widens the covariance.
        @24 temperature: Option<Temperature>, serde(default, skip_serializing_if = "Option::is_none"),
            ["focal length and centre change by at most 1 % of the focal length"]
            { unset: "none", example: "{ reference_c = 20.0, focal_ppm_per_k = 25.0 }" };
        /// Rolling shutter: time from the exposure of the first row to that of the last row, s; 0 for a global shutter,
        /// negative if the last row comes first.
        ///
        /// It has an effect only if the prior of the picture has the camera's rate of rotation. The rays of each row
        /// are then turned to the time of the middle row.
        @16 readout_s: f64, serde(default, skip_serializing_if = "is_zero"), [-10.0 to 10.0]
            { unset: "0", example: "0.03" };
    }
}

/// Returns whether a value is 0; zero sigmas and a zero readout time are not written to files.
#[cfg(feature = "serde")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl Config {
    /// Makes an ideal lens with its principal point in the middle and equal focal lengths.
    ///
    /// ```
    /// use hzn_core::camera::{Config, Model};
    ///
    /// // 1920×1080 pixels with a horizontal field of view of 94.4°.
    /// let config = Config::ideal(Model::Pinhole, 1920, 1080, 888.97);
    /// assert_eq!((config.cx_px, config.cy_px), (959.5, 539.5));
    /// ```
    pub fn ideal(model: Model, width: u16, height: u16, focal_px: f64) -> Self {
        Self {
            width,
            height,
            model,
            fx_px: focal_px,
            fy_px: focal_px,
            // Pixel centres are at integers, so the middle is (w − 1)/2; w/2 would shift every ray by half a pixel.
            cx_px: (f64::from(width) - 1.0) / 2.0,
            cy_px: (f64::from(height) - 1.0) / 2.0,
            k: heapless::Vec::new(),
            theta_max_deg: None,
            theta_min_deg: None,
            focal_sigma_percent: 0.0,
            centre_sigma_px: 0.0,
            covariance: None,
            temperature: None,
            readout_s: 0.0,
        }
    }

    /// Returns coefficient `i` (from 0), or 0 if the list ends before it.
    pub fn coefficient(&self, i: usize) -> f64 {
        self.k.get(i).copied().unwrap_or(0.0)
    }

    /// Returns an intrinsic parameter; `None` if the model does not have it.
    pub fn intrinsic(&self, which: Intrinsic) -> Option<f64> {
        let index = self.model.index_of(which)?;
        Some(match index {
            0 => self.fx_px,
            1 => self.fy_px,
            2 => self.cx_px,
            3 => self.cy_px,
            _ => self.coefficient(index - 4),
        })
    }

    /// Sets an intrinsic parameter. A parameter that the model does not have is ignored.
    pub fn set_intrinsic(&mut self, which: Intrinsic, value: f64) {
        match self.model.index_of(which) {
            Some(0) => self.fx_px = value,
            Some(1) => self.fy_px = value,
            Some(2) => self.cx_px = value,
            Some(3) => self.cy_px = value,
            Some(index) => {
                // Coefficients before this one count as 0 when they are left out, so they are filled in.
                while self.k.len() < index - 3 && self.k.push(0.0).is_ok() {}
                if let Some(k) = self.k.get_mut(index - 4) {
                    *k = value;
                }
            }
            None => {}
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_keys()?;
        // A principal point far outside the picture is an error in units or order.
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        between("camera.cx_px", self.cx_px, -w, 2.0 * w)?;
        between("camera.cy_px", self.cy_px, -h, 2.0 * h)?;
        self.check_temperature()?;
        let most = self.model.coefficients().len();
        for (i, &k) in self.k.iter().enumerate() {
            require(k.is_finite(), "camera.k", k, Limit::Finite)?;
            require(
                // Further zeros pass because they change nothing: other programs fill their lists up with them.
                i < most || k == 0.0,
                "camera.k",
                k,
                Limit::Rule(match self.model {
                    Model::KannalaBrandt => "kannala-brandt has four coefficients k1 to k4",
                    Model::BrownConrady => "brown-conrady has five coefficients k1, k2, p1, p2, k3",
                    Model::DoubleSphere => "double-sphere has two coefficients, xi and alpha",
                    Model::Eucm => "eucm has two coefficients, alpha and beta",
                    Model::Equidistant | Model::Pinhole => "this model has no coefficients: leave camera.k out",
                }),
            )?;
        }
        let (first, second) = (self.coefficient(0), self.coefficient(1));
        let right = match self.model {
            // The papers define the two lenses for these ranges only, so other values are typing errors.
            Model::DoubleSphere => first > -1.0 && first < 1.0 && (0.0..=1.0).contains(&second),
            Model::Eucm => (0.0..=1.0).contains(&first) && second > 0.0,
            _ => true,
        };
        let rule = "xi must lie between -1 and 1, alpha from 0 to 1, beta above 0";
        require(right, "camera.k", first, Limit::Rule(rule))?;
        Ok(())
    }
}
