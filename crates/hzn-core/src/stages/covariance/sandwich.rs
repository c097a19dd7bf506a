//! From the covariance of the right-hand side to the covariance of the fit.

use crate::base::linalg::{M3, invert_spd2};
use crate::base::real::Real;
use crate::stages::fit;

/// Returns the linear map from Σ w h x, about the means, to the errors (δ₁₂, δc) that a signal x in the residuals
/// causes. It is T N⁻¹ with T = [[I, 0], [mᵀ, 1]]. With a fixed half-angle it is the inverse of the upper block, and δc
/// is 0.
pub(crate) fn response<T: Real>(sums: &fit::Sums<T>, [m1, m2]: [T; 2], free: bool) -> Option<M3<T>> {
    let (one, zero) = (T::one(), T::ZERO);
    if free {
        return Some(M3::new(one, zero, zero, zero, one, zero, m1, m2, one) * fit::inverse(sums)?);
    }
    // With a fixed half-angle only the axis is unknown, so that the upper block alone is inverted.
    let [a, b, d] = invert_spd2(sums.normal_fixed([m1, m2]))?;
    // The rows are Bᵀs = h₁₂ − m h₃.
    Some(M3::new(a, b, -(a * m1 + b * m2), b, d, -(b * m1 + d * m2), zero, zero, zero))
}

/// Returns the covariance of (δ₁₂, δc) from the upper triangle of the covariance of the right-hand side.
pub(crate) fn sandwich<T: Real>(response: &M3<T>, x: &[T; 6]) -> M3<T> {
    response * M3::new(x[0], x[1], x[2], x[1], x[3], x[4], x[2], x[4], x[5]) * response.transpose()
}
