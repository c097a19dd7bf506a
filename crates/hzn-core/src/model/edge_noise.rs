//! The errors of edge points: for all bodies, or for one of them.

use crate::base::error::{ConfigError, above, between};
#[cfg(not(feature = "reml"))]
use crate::base::error::{Limit, require};

/// Where the noise model of an edge comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Noise {
    /// The values of `[covariance]`; only the sigma is raised to the RMS of the residuals where that is larger. For values that
    /// were measured on the same camera and scene.
    Told,
    /// The RMS of each edge's own residuals as sigma, as common shift and as the RMS of a common tilt, and a twelfth of the edge's
    /// length as correlation length; never below the values of `[covariance]`.
    #[default]
    Rms,
    /// Restricted maximum likelihood of the residuals: sigma, correlation length and white part, averaged over their
    /// posterior; never below the told sigma. Needs the feature `reml`.
    Reml,
}

impl Noise {
    pub(crate) fn check(self) -> Result<(), ConfigError> {
        #[cfg(not(feature = "reml"))]
        require(self != Self::Reml, "covariance.noise", 2.0, Limit::Rule("this build lacks the feature `reml`"))?;
        Ok(())
    }
}

/// How the covariance is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Method {
    /// N⁻¹ X N⁻¹ of the fit, X with the correlated errors of the edge, and the expected half-angle fused.
    #[default]
    Sandwich,
    /// That of the direct nadir, for every estimate; the expected half-angle is not fused, and the residuals raise
    /// nothing (Braun & Barf 2022, (33)).
    #[cfg(feature = "dlr")]
    BraunBarf,
}

/// `[covariance]` of sensor.toml: edge errors as a Gauss-Markov process along the limb.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Config {
    /// How the covariance is found.
    pub method: Method,
    /// Whether the errors of the edge points are the values below, or are measured in each picture with the values below as
    /// floor.
    pub noise: Noise,
    /// 1-sigma of an edge point in pixels, above 0. Where the residuals of an edge are larger, their RMS counts instead.
    pub sigma_px: f64,
    /// Length along the edge over which errors stay alike, in pixels; 0 for white errors.
    pub correlation_px: f64,
    /// 1-sigma in pixels of what shifts every point of an edge alike, 0 or more: level, blur, and the limb's profile where
    /// it is no wider than a pixel. It counts against the expected half-angle.
    pub bias_px: f64,
    /// 1-sigma in pixels of a tilt that the whole edge shares, 0 or more: an error that grows in proportion to the place along
    /// the edge, from −`tilt_px` at one end to `tilt_px` at the other, such as light that fades along the limb. It counts
    /// against the axis.
    pub tilt_px: f64,
    /// For `braun-barf`: the largest variance in every direction (Braun & Barf 2022, (37)). Too careful by far.
    #[cfg(feature = "dlr")]
    pub overbound: bool,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            method: Method::Sandwich,
            noise: Noise::Rms,
            sigma_px: 0.1,
            correlation_px: 60.0,
            bias_px: 0.3,
            tilt_px: 0.1,
            #[cfg(feature = "dlr")]
            overbound: false,
        }
    }
}

impl Config {
    /// A noise model that is known: these values, and nothing that the points of an edge share.
    pub fn told(sigma_px: f64, correlation_px: f64) -> Self {
        Self { noise: Noise::Told, sigma_px, correlation_px, bias_px: 0.0, tilt_px: 0.0, ..Self::default() }
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        self.noise.check()?;
        above("covariance.sigma_px", self.sigma_px, 0.0)?;
        between("covariance.sigma_px", self.sigma_px, 0.0, 1e4)?;
        between("covariance.bias_px", self.bias_px, 0.0, 1e4)?;
        between("covariance.tilt_px", self.tilt_px, 0.0, 1e4)?;
        between("covariance.correlation_px", self.correlation_px, 0.0, 1e6)
    }
}
