//! Comparison of the errors with their covariances.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// NEES (normalised estimation error squared, two degrees of freedom) of many answers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Honesty {
    /// Number of answers that have a NEES.
    pub answers: usize,
    /// Mean NEES. 2 is ideal; with a larger mean the covariances are too small, with a smaller mean too large.
    pub nees: f64,
    /// Number of independent answers that would say as much about the covariance. Answers of one flight whose errors
    /// are mostly common say little more than one of them.
    pub independent: f64,
    /// Interval that holds 95 % of the means if the covariances and their common parts are right.
    pub interval: [f64; 2],
    /// Factor on sigma that would give a mean of 2.
    pub sigma_scale: f64,
    /// Shares of the answers within 1, 2 and 3 sigma.
    pub within: [Within; 3],
}

/// Share of answers whose error is within `sigma` standard deviations (Mahalanobis distance).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Within {
    /// Number k of standard deviations.
    pub sigma: f64,
    /// Expected share, 1 − exp(−k²/2).
    pub expected: f64,
    /// Measured share.
    pub share: f64,
}

impl Honesty {
    /// Summarises NEES values; returns `None` if there are none. `common` is the mean square of the share of the
    /// variance that is common to all answers; 0 if they are independent.
    ///
    /// Two errors of which the share ρ of the variance is the same have NEES with the covariance 4ρ², and one NEES has
    /// the variance 4. So the mean of n has the variance of n/(1 + (n − 1)ρ²) independent ones.
    pub fn from_nees(nees: &[f64], common: f64) -> Option<Self> {
        let n = nees.len();
        if n == 0 {
            return None;
        }
        let mean = nees.iter().sum::<f64>() / n as f64;
        let within = [1.0, 2.0, 3.0].map(|sigma: f64| Within {
            sigma,
            expected: 1.0 - (-0.5 * sigma * sigma).exp(),
            share: nees.iter().filter(|&&x| x <= sigma * sigma).count() as f64 / n as f64,
        });
        let independent = n as f64 / (1.0 + (n as f64 - 1.0) * common.clamp(0.0, 1.0));
        let interval = interval(independent);
        Some(Self { answers: n, nees: mean, independent, interval, sigma_scale: (mean / 2.0).sqrt(), within })
    }

    /// Returns true if the mean is within the 95 % interval.
    pub fn is_within_interval(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.nees)
    }
}

/// Returns the middle 95 % of the distribution of the mean NEES of `n` independent answers: χ²(2n)/n.
pub(crate) fn interval(n: f64) -> [f64; 2] {
    // The constructor refuses only degrees of freedom that are not above zero.
    match ChiSquared::new(2.0 * n) {
        Ok(chi2) => [0.025, 0.975].map(|p| chi2.inverse_cdf(p) / n),
        Err(_) => [f64::NAN; 2],
    }
}
