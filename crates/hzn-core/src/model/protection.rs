//! The protection level: the angle that the error of an answer exceeds with a stated probability.
//!
//! It is `sigma_max_deg` times a factor. The factor is measured, because the errors are not Gaussian: sigma covers the
//! scatter of limbs, clouds and cameras, and the error over sigma has the tail of this mixture.
//!
//! The factors come from 2103 answers by day with default settings, each of a flight of its own, with another lens,
//! calibration error, altitude, Sun and ground (27 November 2026, `cargo xtask campaign integrity 2500 700000 day`):
//! for 10⁻² the upper end of the 95 % interval of the quantile of error over sigma, and for 10⁻³ their largest value,
//! which the quantile exceeds with a probability of 12 %. The tail of a mixture of scales falls about exponentially, so
//! that the factor is linear in the logarithm of the probability. Among 3189 answers to other seeds the shares above
//! the line are those stated: 34 (31.9 are expected) at 10⁻², 14 (15.9) at 5·10⁻³, 4 (6.4) at 2·10⁻³, 1 (3.2) at 10⁻³.
//! At 10⁻¹ the line is too low. So few answers cannot measure 10⁻⁴: the line continues to there, and none is above it.

use super::edge_noise::Config;

/// Error over sigma that one answer of a hundred exceeds.
const AT_ONE_PERCENT: f64 = 2.95;
/// Increase of the error over sigma when its probability is ten times smaller.
const PER_DECADE: f64 = 1.60;

impl Config {
    /// Returns the factor from `sigma_max_deg` to the protection level for `protection_probability`.
    pub fn protection_factor(&self) -> f64 {
        AT_ONE_PERCENT - PER_DECADE * libm::log10(100.0 * self.protection_probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::keys::Section;

    #[test]
    fn the_factor_goes_through_the_measured_ones() {
        for (protection_probability, factor) in [(1e-2, 2.95), (1e-3, 4.55), (1e-4, 6.15), (2e-3, 4.068)] {
            let config = Config { protection_probability, ..Config::default() };
            assert!((config.protection_factor() - factor).abs() < 1e-3, "{protection_probability}");
        }
    }

    #[test]
    fn a_probability_that_was_not_measured_is_refused() {
        for protection_probability in [1e-1, 1.1e-2, 0.9e-4, 0.0, f64::NAN] {
            let config = Config { protection_probability, ..Config::default() };
            let refused = config.check_keys().map_err(|e| e.field);
            assert_eq!(refused, Err("covariance.protection_probability"), "{protection_probability}");
        }
    }
}
