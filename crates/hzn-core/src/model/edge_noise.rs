//! The errors of edge points: for all bodies, or for one of them.

use crate::base::error::ConfigError;
use crate::base::keys::{Form, Section, Value, choices, section};

choices! {
    /// Where the noise model of an edge comes from.
    pub enum Noise {
        /// Sigma, common shift and the RMS of a common tilt are the RMS of the edge's own residuals, and the
        /// correlation length is a twelfth of the edge's length; the values of `[covariance]` are their floor.
        @1 Rms = "rms";
        /// The values of `[covariance]` hold; only the sigma is raised to the RMS of the residuals where that is
        /// larger.
        ///
        /// This is for values that were measured with the same camera and in the same kind of scene.
        @0 Told = "told";
        /// Restricted maximum likelihood of the residuals gives sigma, correlation length and white part, averaged over
        /// their posterior; the sigma of `[covariance]` is the floor.
        @- Reml = "reml" needs "reml";
    }
}

choices! {
    /// How the covariance is found.
    pub enum Method {
        /// N⁻¹ X N⁻¹ of the fit, where X holds the correlated errors of the edge; the expected half-angle is fused.
        @- Sandwich = "sandwich";
        /// The covariance of the direct nadir, whatever the fit; the expected half-angle is not fused, and the
        /// residuals raise nothing (Braun & Barf 2022, (33)).
        @- BraunBarf = "braun-barf" needs "dlr";
    }
}

section! {
    /// `[covariance]` of sensor.toml: the errors of edge points as a Gauss-Markov process along the limb.
    "covariance" pub struct Config: Copy {
        /// How the covariance is found.
        @- method: Method = Method::Sandwich, [choice];
        /// Whether the values below hold as they are, or are the floor of values that are measured in each picture.
        @102 noise: Noise = Noise::Rms, [choice];
        /// 1σ of an edge point, px; raised to the RMS of the residuals where that is larger.
        @100 sigma_px: f64 = 0.1, [above 0.0 to 1e4];
        /// Length along the edge over which the errors of edge points stay alike, px; 0 for white errors.
        @101 correlation_px: f64 = 60.0, [0.0 to 1e6];
        /// 1σ of a shift that all points of an edge share, px.
        ///
        /// Threshold, blur, and the profile of a limb that is no wider than a pixel cause it. It counts against the
        /// expected half-angle.
        @103 bias_px: f64 = 0.3, [0.0 to 1e4];
        /// 1σ of a tilt that the whole edge shares, px: an error from −1 to 1 times it along the edge.
        ///
        /// Light that fades along the limb causes it. It counts against the axis.
        @104 tilt_px: f64 = 0.1, [0.0 to 1e4];
        /// For `braun-barf`: the largest variance holds in every direction.
        ///
        /// Braun & Barf 2022, (37); it is about twenty times too large.
        @- overbound: bool = false, ["true or false"] { needs: "dlr" };
    }
}

impl Config {
    /// A known noise model: these values, and no error that the points of an edge share.
    pub fn told(sigma_px: f64, correlation_px: f64) -> Self {
        Self { noise: Noise::Told, sigma_px, correlation_px, bias_px: 0.0, tilt_px: 0.0, ..Self::default() }
    }
}

/// A body has a table of its own with these keys.
impl Value for Config {
    const FORM: Form = Form::Table;
    fn check(&self, _path: &'static str, _low: f64, _above: bool, _high: f64) -> Result<(), ConfigError> {
        self.check_keys()
    }
}
