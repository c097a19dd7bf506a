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
    /// Interval that holds 95 % of the means if the covariances are right and the answers are independent.
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
    /// Summarises NEES values; returns `None` if there are none.
    pub fn from_nees(nees: &[f64]) -> Option<Self> {
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
        Some(Self { answers: n, nees: mean, interval: interval(n), sigma_scale: (mean / 2.0).sqrt(), within })
    }

    /// Returns true if the mean is within the 95 % interval.
    pub fn is_within_interval(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.nees)
    }
}

/// Returns the middle 95 % of the distribution of the mean NEES of `n` independent answers: χ²(2n)/n.
pub(crate) fn interval(n: usize) -> [f64; 2] {
    // The constructor refuses only degrees of freedom that are not above zero.
    match ChiSquared::new(2.0 * n as f64) {
        Ok(chi2) => [0.025, 0.975].map(|p| chi2.inverse_cdf(p) / n as f64),
        Err(_) => [f64::NAN; 2],
    }
}
