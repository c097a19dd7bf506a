//! Quantiles of χ².

/// Returns the value that χ² with so many degrees of freedom exceeds with the probability of a Gaussian beyond `z`
/// sigmas on one side (Wilson and Hilferty 1931). From three degrees of freedom on it is right to 1 %.
pub(super) fn chi2(freedom: usize, z: f64) -> f64 {
    let n = freedom as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + z * part.sqrt()).powi(3)
}
