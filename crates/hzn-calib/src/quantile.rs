//! Quantiles of χ².

/// Largest mean square of deviations over their variances without an alarm, for a flight of many pictures.
const MAX_MEAN_SQUARE: f64 = 2.0;
/// Sigmas of a one-sided probability of 0.27 %: a right flight of few pictures raises an alarm as rarely as another
/// test with 3 sigmas does.
const ALARM_SIGMAS: f64 = 2.78;

/// Returns the largest mean square of the pictures' deviations over their variances without an alarm. It scatters more
/// if the pictures are few. `freedom` is their number without that of the fitted parameters.
pub(crate) fn max_mean_square(freedom: usize) -> f64 {
    let freedom = freedom.max(1);
    MAX_MEAN_SQUARE.max(chi2(freedom, ALARM_SIGMAS) / freedom as f64)
}

/// Returns a limit of χ² with `freedom` degrees of freedom. χ² is above it as rarely as a Gaussian is above `z` sigmas
/// (Wilson and Hilferty 1931). From three degrees of freedom on it is right to 1 %.
pub(crate) fn chi2(freedom: usize, z: f64) -> f64 {
    wilson_hilferty(freedom as f64, z)
}

/// Returns the same limit for a sum of squares of independent normal deviates with weights, by a χ² of the same mean
/// and variance (Satterthwaite 1946). A single weight gives a limit that is right to 3 %.
pub(crate) fn weighted_chi2(weights: &[f64], z: f64) -> f64 {
    let sum: f64 = weights.iter().sum();
    let squares: f64 = weights.iter().map(|w| w * w).sum();
    if !(sum > 0.0 && squares > 0.0) {
        return f64::INFINITY;
    }
    squares / sum * wilson_hilferty(sum * sum / squares, z)
}

fn wilson_hilferty(freedom: f64, z: f64) -> f64 {
    let part = 2.0 / (9.0 * freedom);
    freedom * (1.0 - part + z * part.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::weighted_chi2;

    #[test]
    fn weights_of_one_and_of_nothing_give_the_table() {
        // The 99 % points of χ² are 6.635 for one degree of freedom and 9.210 for two.
        assert!((weighted_chi2(&[1.0, 0.0], 2.326) / 6.635 - 1.0).abs() < 0.03);
        assert!((weighted_chi2(&[1.0, 1.0], 2.326) / 9.210 - 1.0).abs() < 0.02);
        assert!((weighted_chi2(&[0.5, 0.5], 2.326) / weighted_chi2(&[1.0, 1.0], 2.326) - 0.5).abs() < 1e-12);
        assert!(weighted_chi2(&[0.0, 0.0], 2.326).is_infinite());
    }
}
