//! The double sphere lens of Kalibr (`ds`) and Basalt (Usenko, Demmel & Cremers 2018, (40) to (42)).
//!
//! A ray is projected onto a unit sphere, then onto a second one that is shifted by ξ along the axis, then into a plane
//! that is shifted by α/(1 − α). For a unit ray (sin θ, cos θ): z₁ = ξ + cos θ, d₂ = √(sin² θ + z₁²),
//! r = sin θ/(α d₂ + (1 − α) z₁).
//!
//! r'(0) is 1/(1 + ξ) and not 1: the focal length of this model differs from the scale in the middle of the picture.

use crate::base::real::Real;

/// Returns r(θ) and r'(θ).
pub(super) fn radius_and_slope<T: Real>(k: &[T; 2], theta: T) -> (T, T) {
    let [xi, alpha] = *k;
    let one = T::one();
    let (sin, cos) = theta.sin_cos();
    let z = xi + cos;
    let d = (sin * sin + z * z).sqrt();
    let below = alpha * d + (one - alpha) * z;
    // The slope is an equation, because a difference of two radii would lose half of the digits.
    // d₂' = −ξ sin θ/d₂.
    let below_slope = -alpha * xi * sin / d - (one - alpha) * sin;
    (sin / below, (cos * below - sin * below_slope) / (below * below))
}

/// Returns ∂r/∂ξ and ∂r/∂α.
pub(super) fn by_coefficients<T: Real>(k: &[T; 2], theta: T) -> [T; 2] {
    let [xi, alpha] = *k;
    let one = T::one();
    let (sin, cos) = theta.sin_cos();
    let z = xi + cos;
    let d = (sin * sin + z * z).sqrt();
    let below = alpha * d + (one - alpha) * z;
    let scale = -sin / (below * below);
    [scale * (alpha * z / d + one - alpha), scale * (d - z)]
}
