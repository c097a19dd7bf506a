//! The answer of a fit with its covariance.

use crate::base::linalg::M3;
use crate::base::linalg::V3;

/// Covariance of the fitted (δ₁₂, δc).
pub(super) struct ConeCovariance<T> {
    /// All terms.
    pub(super) whole: M3<T>,
    /// The terms that the next picture shares: see [`Solution::common`](crate::model::report::Solution::common).
    pub(super) common: M3<T>,
    /// A term that is added after the fusion, so that it changes no weight. It is common, too.
    pub(super) late: M3<T>,
}

/// The answer of a fit with its covariance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fused<T> {
    /// Unit axis after fusing the expected half-angle, in the camera frame.
    pub(crate) e: V3<T>,
    /// cos of the half-angle after fusing.
    pub(crate) c: T,
    /// Covariance (11, 12, 22) on the tangent basis of `e`, rad².
    pub(crate) p: [T; 3],
    /// The part of `p` that the next picture shares; `None` if the method does not know it.
    pub(crate) common: Option<[T; 3]>,
    /// Covariance (11, 12, 22) of the freely fitted axis on its own tangent basis, rad².
    // It is kept for a filter that treats the limb height as one error of all pictures: fused covariances hide it.
    pub(crate) free_p: [T; 3],
    /// Covariance of the freely fitted axis with its cosine, on the same basis.
    pub(crate) free_with_cos: [T; 2],
    /// The part of the covariance of the freely fitted (δ₁₂, δc) that the next picture shares, on the same basis;
    /// `None` if the method does not know it.
    pub(crate) free_common: Option<M3<T>>,
    /// Derivative of the axis by the cosine of the expected half-angle, on the tangent basis of the fitted axis.
    pub(crate) by_cos: [T; 2],
    /// Variance of the freely fitted cos α; `None` when it was not fitted.
    pub(crate) var_free_cos: Option<T>,
    /// (ĉ − c₀)²/(P₃₃ + σ_c²): a χ² of one degree of freedom when the candidate is the body's limb.
    pub(crate) chi2: T,
    /// Errors of the edge points in this answer.
    pub(crate) edge: EdgeNoise<T>,
    /// The position of the body, if it was fitted.
    pub(crate) located: Option<Located<T>>,
}

/// The position of a body with its covariance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Located<T> {
    /// From the camera to the centre of the body in the camera frame, in units of the target's mean semi-axis.
    pub(crate) r: V3<T>,
    /// Covariance of `r` in the same units.
    pub(crate) p: M3<T>,
    /// The part of `p` that the next picture shares.
    pub(crate) common: M3<T>,
    /// The same before the known distance was fused.
    pub(crate) free_r: V3<T>,
    pub(crate) free_p: M3<T>,
    /// The rotation about the line to the body, if it is known well enough.
    pub(crate) turn: Option<Turn<T>>,
}

/// A rotation of the body about the line to it, relative to the given orientation; right-handed about the direction
/// from the camera to the body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn<T> {
    pub(crate) rad: T,
    /// 1-sigma.
    pub(crate) sigma_rad: T,
}

/// Errors of the edge points that a covariance includes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EdgeNoise<T> {
    /// Contribution to the variance of the freely fitted cos α; 0 if it was not fitted.
    pub(crate) var_cos: T,
    /// Contribution of the lens to the same variance.
    pub(crate) lens_var_cos: T,
    /// 1-sigma of an edge point in pixels. `length_px` is the correlation length, in pixels.
    pub(crate) sigma_px: T,
    pub(crate) length_px: T,
    /// 1-sigma of the shift that all points share, in pixels.
    pub(crate) shift_px: T,
}
