//! The answer of a fit with its covariance.

use crate::base::linalg::V3;

/// The answer of a fit with its covariance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused<T> {
    /// Unit axis after fusing the expected half-angle, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the half-angle after fusing.
    pub(crate) c: T,
    /// Covariance (11, 12, 22) on the tangent basis of `e`, rad².
    pub(crate) p: [T; 3],
    /// Covariance (11, 12, 22) of the freely fitted axis on its own tangent basis, rad².
    pub(crate) free_p: [T; 3],
    /// Derivative of the axis by the cosine of the expected half-angle, on the tangent basis of the fitted axis.
    pub(crate) by_cos: [T; 2],
    /// Variance of the freely fitted cos α; `None` when it was not fitted.
    pub(crate) var_free_cos: Option<T>,
    /// (ĉ − c₀)²/(P₃₃ + σ_c²): a χ² of one degree of freedom when the candidate is the body's limb.
    pub(crate) chi2: T,
    /// Errors of the edge points in this answer.
    pub(crate) edge: EdgeNoise<T>,
}

/// Errors of the edge points that a covariance includes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeNoise<T> {
    /// Contribution to the variance of the freely fitted cos α; 0 if it was not fitted.
    pub(crate) var_cos: T,
    /// 1-sigma of an edge point in pixels. `length_px` is the correlation length, in pixels.
    pub(crate) sigma_px: T,
    pub(crate) length_px: T,
}
