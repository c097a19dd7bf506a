//! Size and correlation length of the errors of the edge points, from the configuration or from the residuals.

use super::answer::EdgeNoise;
use super::gauss_markov::correlated;
use crate::base::linalg::basis;
use crate::base::real::Real;
use crate::geometry::block::Block;
use crate::model::body::Expected;
use crate::model::edge_noise::{Config, END_PER_RMS, LENGTHS_PER_EDGE, Noise};
use crate::stages::fit::Fit;

/// Returns the correlation length that is assumed for the residuals of the edge, in pixels.
pub(crate) fn measured_length_px<T: Real>(fit: &Fit<T>) -> T {
    // The length is a part of the edge and not a number of pixels, so that it scales with the resolution.
    fit.arc_px / T::from_f64(LENGTHS_PER_EDGE)
}

/// The noise model of one edge.
pub(super) struct EdgeNoiseModel<T> {
    /// Variance of an edge point, px².
    pub(super) variance: T,
    /// The part of `variance` that is new at every point, px².
    white: T,
    /// Correlation length of the rest, px.
    pub(super) length_px: T,
    /// 1-sigma of the common shift, px.
    pub(super) shift_px: T,
    /// 1-sigma of the common tilt, px.
    pub(super) tilt_px: T,
    /// 1-sigma of the common bend that is told, px, and whether the residuals may raise it.
    pub(super) bend_px: T,
    pub(super) measures_bend: bool,
    /// Sigma of the configuration in pixels, if the likelihood of the residuals gives the noise.
    reml: Option<f64>,
}

impl<T: Real> EdgeNoiseModel<T> {
    /// Makes the noise model of an edge, from its residuals if the configuration says so.
    pub(super) fn new(fit: &Fit<T>, config: &Config) -> Self {
        Self::with_residuals(fit, fit.rms_px, config)
    }

    /// Does the same for another RMS of the residuals.
    pub(super) fn with_residuals(fit: &Fit<T>, rms_px: T, config: &Config) -> Self {
        let told = T::from_f64(config.sigma_px);
        let white = T::from_f64(config.white_px * config.white_px);
        let (length_px, common) = match config.noise {
            // Without a told white part, the square root of the square would change the last bit.
            Noise::Rms if white > T::ZERO => (measured_length_px(fit), (rms_px * rms_px - white).max(T::ZERO).sqrt()),
            Noise::Rms => (measured_length_px(fit), rms_px),
            // The likelihood includes the errors that the fit absorbs, at every length.
            Noise::Given | Noise::Reml => (T::ZERO, T::ZERO),
        };
        // Residuals only raise the variance: the fit absorbs the longest waves of the errors, so that it does not see
        // them.
        let variance = (told * told).max(rms_px * rms_px);
        Self {
            variance,
            white: white.min(variance),
            length_px: T::from_f64(config.correlation_px).max(length_px),
            shift_px: T::from_f64(config.bias_px).max(common),
            tilt_px: T::from_f64(config.tilt_px).max(common * T::from_f64(END_PER_RMS)),
            bend_px: T::from_f64(config.bend_px),
            measures_bend: config.noise == Noise::Rms,
            reml: (config.noise == Noise::Reml).then_some(config.sigma_px),
        }
    }

    /// Returns the errors of the edge points, with their contribution to the variance of the freely fitted cos α.
    pub(super) fn edge(&self, var_cos: T) -> EdgeNoise<T> {
        EdgeNoise {
            var_cos,
            lens_var_cos: T::ZERO,
            sigma_px: self.variance.sqrt(),
            length_px: self.length_px,
            shift_px: self.shift_px,
        }
    }

    /// Returns the upper triangle of the covariance of the right-hand side Σ w r h of the normal equations.
    pub(super) fn correlated(&self, blocks: &[Block<T>], fit: &Fit<T>, expected: &Expected<T>) -> [T; 6] {
        if cfg!(feature = "reml")
            && let Some(x) = self.reml.and_then(|floor_px| super::reml::averaged(blocks, fit, expected, floor_px))
        {
            return x;
        }
        let (b1, b2) = basis(&fit.e);
        let sum = |length_px: T| correlated(blocks, &fit.e, &b1, &b2, fit.mean, length_px);
        if self.white > T::ZERO {
            let (rest, white) = (sum(self.length_px), sum(T::ZERO));
            return core::array::from_fn(|i| rest[i] * (self.variance - self.white) + white[i] * self.white);
        }
        sum(self.length_px).map(|x| x * self.variance)
    }
}
