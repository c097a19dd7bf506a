//! The enhanced unified camera model of Kalibr (`eucm`) (Khomutenko, Garcia & Martinet 2016, (1)).
//!
//! A ray is projected onto an ellipsoid of revolution, then into a plane. For a unit ray (sin θ, cos θ) this gives
//! r = sin θ/(α d + (1 − α) cos θ) with d = √(β sin² θ + cos² θ).

use crate::base::real::Real;

/// Returns r(θ) and r'(θ).
pub(super) fn radius_and_slope<T: Real>(k: &[T; 2], theta: T) -> (T, T) {
    let [alpha, beta] = *k;
    let one = T::one();
    let (sin, cos) = theta.sin_cos();
    let d = (beta * sin * sin + cos * cos).sqrt();
    let below = alpha * d + (one - alpha) * cos;
    // d' = (β − 1) sin θ cos θ/d.
    let below_slope = alpha * (beta - one) * sin * cos / d - (one - alpha) * sin;
    (sin / below, (cos * below - sin * below_slope) / (below * below))
}

/// Returns ∂r/∂α and ∂r/∂β.
pub(super) fn by_coefficients<T: Real>(k: &[T; 2], theta: T) -> [T; 2] {
    let [alpha, beta] = *k;
    let one = T::one();
    let (sin, cos) = theta.sin_cos();
    let d = (beta * sin * sin + cos * cos).sqrt();
    let below = alpha * d + (one - alpha) * cos;
    let scale = -sin / (below * below);
    [scale * (d - cos), scale * alpha * sin * sin * T::from_f64(0.5) / d]
}
