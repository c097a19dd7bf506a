//! How large the errors of the edge points are, and over which length they stay alike: told, or measured.

use super::{Config, EdgeNoise, Noise, correlated};
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;
use crate::stages::fit::Fit;

/// With `rms` the correlation length is the length of the edge over this. The fit takes up the longest wavelengths of
/// the errors (shift, tilt, bend of the whole edge); the residuals show the shorter ones, best those of about half the
/// edge. The spectrum of a Gauss-Markov process is flat above the wavelength 2πL, which is 0.52 edges for a twelfth of
/// the edge: the wavelengths that the fit takes up are assumed to be as strong as the longest that the residuals show.
const LENGTHS_PER_EDGE: f64 = 12.0;

/// The correlation length that an edge's own residuals are taken to have, pixels.
pub(crate) fn measured_length_px<T: Real>(fit: &Fit<T>) -> T {
    fit.arc_px / T::from_f64(LENGTHS_PER_EDGE)
}

/// A tilt whose RMS along the edge is 1 is so large at its ends: √3.
const ENDS: f64 = 1.732_050_807_568_877_2;

/// The noise model of one edge.
pub(super) struct Levels<T> {
    /// Variance of an edge point, px².
    pub(super) variance: T,
    /// Correlation length, px.
    pub(super) length_px: T,
    /// 1-sigma of the common shift, px.
    pub(super) shift_px: T,
    /// 1-sigma of the common tilt, px.
    pub(super) tilt_px: T,
    /// The told sigma where the residuals' likelihood is asked.
    #[cfg(feature = "reml")]
    reml: Option<f64>,
}

impl<T: Real> Levels<T> {
    /// Of an edge, by its residuals where the configuration says so.
    pub(super) fn new(fit: &Fit<T>, config: &Config) -> Self {
        let told = T::from_f64(config.sigma_px);
        let (length_px, common) = match config.noise {
            Noise::Rms => (measured_length_px(fit), fit.rms_px),
            // What the fit takes up is in the likelihood, at every length.
            Noise::Told | Noise::Reml => (T::ZERO, T::ZERO),
        };
        Self {
            variance: (told * told).max(fit.rms_px * fit.rms_px),
            length_px: T::from_f64(config.correlation_px).max(length_px),
            shift_px: T::from_f64(config.bias_px).max(common),
            tilt_px: T::from_f64(config.tilt_px).max(common * T::from_f64(ENDS)),
            #[cfg(feature = "reml")]
            reml: (config.noise == Noise::Reml).then_some(config.sigma_px),
        }
    }

    /// The edge's own errors, with their part of the variance of the freely fitted cos α.
    pub(super) fn edge(&self, var_cos: T) -> EdgeNoise<T> {
        EdgeNoise { var_cos, sigma_px: self.variance.sqrt(), length_px: self.length_px }
    }

    /// Covariance of the right-hand side Σ w r h of the normal equations, upper triangle.
    pub(super) fn correlated(&self, blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> [T; 6] {
        #[cfg(not(feature = "reml"))]
        let _ = expected;
        #[cfg(feature = "reml")]
        if let Some(x) = self.reml.and_then(|floor_px| super::reml::averaged(blocks, fit, expected, floor_px)) {
            return x;
        }
        let (b1, b2) = basis(&fit.e);
        correlated(blocks, &fit.e, &b1, &b2, fit.mean, self.length_px).map(|x| x * self.variance)
    }
}
