//! Quantiles of χ².

/// Returns a limit of χ² with `freedom` degrees of freedom. χ² is above it as rarely as a Gaussian is above `z` sigmas
/// (Wilson and Hilferty 1931). From three degrees of freedom on it is right to 1 %.
pub(super) fn chi2(freedom: usize, z: f64) -> f64 {
    let n = freedom as f64;
    let part = 2.0 / (9.0 * n);
    n * (1.0 - part + z * part.sqrt()).powi(3)
}
