//! Whether errors are as large as they are said to be.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Squared errors over covariances (NEES, two degrees of freedom) of many answers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Honesty {
    /// Answers that have one.
    pub answers: usize,
    /// Its mean: 2 is ideal, larger means too sure, smaller too careful.
    pub nees: f64,
    /// Where 95 % of such means fall when the covariances are right and the answers independent.
    pub interval: [f64; 2],
    /// What sigma would have to be multiplied by for a mean of 2.
    pub sigma_scale: f64,
    /// Shares of the answers within 1, 2 and 3 sigma.
    pub within: [Within; 3],
}

/// The share of answers whose error is within so many sigma (Mahalanobis distance).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Within {
    /// How many sigma.
    pub sigma: f64,
    /// The share that should be, 1 − exp(−k²/2).
    pub expected: f64,
    /// The share that is.
    pub share: f64,
}

impl Honesty {
    /// Of squared errors over covariances; `None` without any.
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

    /// Whether the mean is where 95 % of honest means are.
    pub fn is_within_interval(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.nees)
    }
}

/// The middle 95 % of the mean of `n` independent squares of two degrees of freedom: χ²(2n)/n.
pub(super) fn interval(n: usize) -> [f64; 2] {
    // The constructor refuses only freedoms that are not above zero.
    match ChiSquared::new(2.0 * n as f64) {
        Ok(chi2) => [0.025, 0.975].map(|p| chi2.inverse_cdf(p) / n as f64),
        Err(_) => [f64::NAN; 2],
    }
}
