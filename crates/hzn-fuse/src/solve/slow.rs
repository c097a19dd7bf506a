//! The slow errors of directions: a Gauss-Markov process for each camera and body.
//!
//! The slow error of a direction with the covariance P is √P u, and u forgets: u' = Φ u + √(1 − Φ²) w with Φ =
//! exp(−Δt/T) and w of covariance 1. These are the filter's equations, whose slow error becomes √P' √P⁻¹ ζ when P
//! changes.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::sparse::Linear;

/// Smallest share of the variance that comes between two directions, so that two at one time do not make equal
/// unknowns.
const LEAST: f64 = 1e-6;

/// The slow errors that follow each other.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Link {
    /// The slow error before it, with the time in between over the correlation time.
    pub(crate) before: Option<(usize, f64)>,
    pub(crate) index: usize,
}

impl Link {
    /// Returns the error of the process; `block` gives the block of a slow error.
    pub(crate) fn error(&self, slow: &[Vector3<f64>], block: impl Fn(usize) -> usize) -> Linear {
        let at = |i: usize| slow.get(i).copied().unwrap_or_default();
        let one = DMatrix::identity(3, 3);
        let dense = |v: Vector3<f64>| DVector::from_column_slice(v.as_slice());
        let Some((before, share)) = self.before else {
            return Linear { error: dense(at(self.index)), derivatives: vec![(block(self.index), one)] };
        };
        let keep = (-share).exp();
        let sigma = (1.0 - keep * keep).max(LEAST).sqrt();
        Linear {
            error: dense((at(self.index) - at(before) * keep) / sigma),
            derivatives: vec![(block(before), &one * (-keep / sigma)), (block(self.index), one / sigma)],
        }
    }
}
