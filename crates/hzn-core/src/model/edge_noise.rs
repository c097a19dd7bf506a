//! The noise model of edge points, for all bodies or for one body.

use crate::base::error::ConfigError;
use crate::base::keys::{Form, Section, Value, choices, section};

choices! {
    /// Source of the noise model of an edge.
    pub enum Noise {
        /// The sigma, the common shift and the RMS of the common tilt each equal the RMS of the edge's residuals. The
        /// correlation length is a twelfth of the edge's length. The common bend is as strong as the strongest slow
        /// wave of the residuals. The values of `[covariance]` are the floors of these five numbers.
        // The default measures in each picture, because no fixed set of values held on flights with other seeds:
        // between 0 and 38 % of the answers were beyond 3 sigma.
        @1 Rms = "rms";
        /// The values of `[covariance]` are used; only the sigma is raised to the RMS of the residuals if that is
        /// larger.
        ///
        /// This choice is for values that were measured with the same camera and in the same kind of scene.
        @0 Given = "told";
        /// Restricted maximum likelihood of the residuals gives sigma, correlation length and white part, averaged over
        /// their posterior; the sigma of `[covariance]` is the floor.
        @- Reml = "reml" needs "reml";
    }
}

choices! {
    /// Method that computes the covariance.
    pub enum Method {
        /// The correlated errors of the edge points are propagated through the fit, N⁻¹ X N⁻¹ with their covariance
        /// in X; the expected half-angle is fused.
        @- Sandwich = "sandwich";
        /// The covariance is that of the direct nadir, whichever fit is used; the expected half-angle is not fused, and
        /// the residuals do not raise the covariance (Braun & Barf 2022, (33)).
        @- BraunBarf = "braun-barf" needs "dlr";
    }
}

section! {
    /// `[covariance]` of sensor.toml: the errors of edge points as a Gauss-Markov process along the limb.
    "covariance" pub struct Config: Copy {
        /// Method that computes the covariance.
        @- method: Method = Method::Sandwich, [choice];
        /// Source of the noise: the residuals of each picture, with the values below as their floor (`rms`, `reml`), or
        /// the values below (`told`).
        ///
        /// Keep `rms` unless the values were measured with the same camera in the same kind of scene: a noise that is
        /// told too small makes sigma too small.
        @102 noise: Noise = Noise::Rms, [choice];
        /// 1σ of an edge point, px; raised to the RMS of the residuals if that is larger.
        ///
        /// A larger value widens the covariance of clean edges and gives the expected half-angle more weight. The
        /// default is that of a pixel of 0.62° (1/92 rad) or less. In a camera with wider pixels, such as a thermal
        /// array of 32×24, the defaults of this key, `correlation_px`, `bias_px` and `tilt_px` are the same angle and
        /// thus fewer pixels; this one and `bias_px` are at least 0.062 px.
        // 0.1 px is what sub-pixel points reach on a clean edge. It was 1 px before, which was too large: the mean NEES
        // of infrared pictures was 0.02 instead of about 0.5.
        @100 sigma_px: f64 = 0.1, [above 0.0 to 1e4];
        /// Correlation length of the errors of edge points along the edge, px; 0 for white errors.
        ///
        /// A larger value leaves fewer independent points, so that the covariance widens.
        // No fixed length held on fresh flights (60 to 300 px were tried), which is why it is only the floor of the
        // measured one.
        @101 correlation_px: f64 = 60.0, [0.0 to 1e6];
        /// 1σ of a shift that all points of an edge have in common, px.
        ///
        /// Its causes are the threshold, blur, and the profile of a limb that is no wider than a pixel. A larger value
        /// widens the variance of the fitted half-angle, which then has less weight against the expected one.
        // 0.3 px is the shift of an edge by threshold and blur.
        @103 bias_px: f64 = 0.3, [0.0 to 1e4];
        /// 1σ of a tilt that the whole edge has in common, px: an error that goes from −1 to 1 times this value along
        /// the edge.
        ///
        /// Its cause is light that fades along the limb. A larger value widens the covariance of the axis.
        @104 tilt_px: f64 = 0.1, [0.0 to 1e4];
        /// 1σ of a bend that the whole edge has in common, px: an error that is this value at both ends of the edge,
        /// and minus half of it in the middle.
        ///
        /// Its cause is light that changes along the limb, most of all with a low Sun. The bend widens the covariance
        /// of the answer, and changes no weight in the fusion with the expected half-angle.
        @- bend_px: f64 = 0.0, [0.0 to 1e4];
        /// 1σ of the part of an edge point's error that is new at every point, px. `hzn calibrate noise` measures it.
        ///
        /// With `rms`, only the rest of the residuals counts as correlated, as common shift and as common tilt.
        // Without a calibration it is 0, because one picture cannot separate the two parts well enough.
        @- white_px: f64 = 0.0, [0.0 to 1e4];
        /// Probability with which the error of an answer exceeds its protection level (the column `protection_deg`).
        ///
        /// A smaller value makes the level larger: 2.95 `sigma_max_deg` for 10⁻², 4.55 for 10⁻³, 6.15 for 10⁻⁴. The
        /// probability holds for an edge that is the limb, by day, with the defaults of `[covariance]`.
        // The range is that of the factor in `protection.rs`.
        @105 protection_probability: f64 = 1e-4, [1e-4 to 1e-2];
        /// For `braun-barf`: whether the largest variance is used in every direction.
        ///
        /// This is the overbound of Braun & Barf 2022, (37), which is about twenty times too large.
        @- overbound: bool = false, ["true or false"] { needs: "dlr" };
    }
}

/// Ratio of the edge length to the correlation length, with `rms`. The fit absorbs the longest wavelengths of the
/// errors (shift, tilt and curvature of the whole edge). The residuals show the shorter wavelengths, and best those of
/// about half the edge. The spectrum of a Gauss-Markov process is flat above the wavelength 2πL, which is 0.52 edge
/// lengths for this ratio. The model thus assumes that the absorbed wavelengths are as strong as the longest ones in
/// the residuals.
pub(crate) const LENGTHS_PER_EDGE: f64 = 12.0;

/// Value of a tilt at the ends of the edge if its RMS along the edge is 1: √3.
pub(crate) const END_PER_RMS: f64 = 1.732_050_807_568_877_2;

/// Pixels per radian of the coarsest camera on which the floors were measured: the scene `leo-infrared`.
const COARSEST_PX_PER_RAD: f64 = 92.0;

/// RMS of the error that linear interpolation between pixel centres makes for the sharpest possible edge, in pixels.
/// One pixel has a part p of the light, from a half to 1; the error is (p − ½)(1 − p)/p. The root of its mean square
/// over all places of the edge is 0.062 px. An edge along the rows has the same error at every point.
const SAMPLING_PX: f64 = 0.062;

impl Config {
    /// Returns the default values for a camera with this focal length: in pixels wider than those of the cameras on
    /// which the floors were measured, the floors keep their angle.
    ///
    /// The floors stand for errors of the scene (light that fades along the limb, a wide profile, clouds), which do not
    /// grow with the pixel. Without this, a correlation of 60 px is twice as long as the whole limb of 32×24 pixels, so
    /// that all noise of the edge counts as a shift of the picture, and the fusion with the expected half-angle moves
    /// the axis by the wrong amount. The error of the sampling does grow with the pixel. No sigma of a point or of a
    /// shift is below it: otherwise an edge along the columns had a sigma of the half-angle that was too small, and one
    /// of 600 pictures was answered on the body's other side.
    pub fn for_focal_length(focal_px: f64) -> Self {
        let all = Self::default();
        // A wrong focal length is refused with the camera.
        if !(focal_px > 0.0 && focal_px < COARSEST_PX_PER_RAD) {
            return all;
        }
        let scaled = |px: f64| px * focal_px / COARSEST_PX_PER_RAD;
        Self {
            sigma_px: scaled(all.sigma_px).max(SAMPLING_PX),
            correlation_px: scaled(all.correlation_px),
            bias_px: scaled(all.bias_px).max(SAMPLING_PX),
            tilt_px: scaled(all.tilt_px),
            ..all
        }
    }

    /// Returns the values that a picture gives whose residuals have this RMS, along an edge of this length. With `reml`
    /// the correlation length is that of `rms`.
    pub fn measured(&self, rms_px: f64, edge_px: f64) -> Self {
        let (length_px, common) = match self.noise {
            Noise::Rms => (edge_px / LENGTHS_PER_EDGE, self.correlated_px(rms_px)),
            Noise::Reml => (edge_px / LENGTHS_PER_EDGE, 0.0),
            Noise::Given => (0.0, 0.0),
        };
        Self {
            noise: Noise::Given,
            // The residuals only raise the values: the fit absorbs the longest waves of the errors, so that small
            // residuals do not prove small errors.
            sigma_px: self.sigma_px.max(rms_px),
            correlation_px: self.correlation_px.max(length_px),
            bias_px: self.bias_px.max(common),
            tilt_px: self.tilt_px.max(common * END_PER_RMS),
            ..*self
        }
    }

    /// Returns the RMS of residuals without the part that is new at every point.
    pub(crate) fn correlated_px(&self, rms_px: f64) -> f64 {
        libm::sqrt((rms_px * rms_px - self.white_px * self.white_px).max(0.0))
    }

    /// Makes a known noise model from these values, without a common shift or tilt.
    pub fn given(sigma_px: f64, correlation_px: f64) -> Self {
        Self { noise: Noise::Given, sigma_px, correlation_px, bias_px: 0.0, tilt_px: 0.0, ..Self::default() }
    }
}

/// Each body may have its own table with these keys.
impl Value for Config {
    const FORM: Form = Form::Table;
    fn check(&self, _path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        self.check_keys()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_floors_keep_their_angle_in_wide_pixels() {
        let floors = |focal_px: f64| {
            let c = Config::for_focal_length(focal_px);
            [c.correlation_px, c.tilt_px, c.bias_px, c.sigma_px]
        };
        let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
        let (wide, usual) = (floors(23.0), floors(92.0));
        assert!(wide.iter().zip(usual).take(3).all(|(wide, usual)| near(4.0 * wide, usual)), "{wide:?}");
        // The error of the sampling is a part of a pixel.
        assert_eq!((wide[3], floors(1.0)[2]), (SAMPLING_PX, SAMPLING_PX));
        // Narrow pixels, and a focal length that the camera refuses, have the defaults.
        for focal_px in [92.0, 1170.0, 0.0, -3.0, f64::NAN] {
            assert_eq!(Config::for_focal_length(focal_px), Config::default(), "{focal_px}");
        }
    }
}
