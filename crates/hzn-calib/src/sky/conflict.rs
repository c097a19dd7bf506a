//! Whether the pictures disagree with what was known before the flight.
//!
//! For a prior x ~ N(x₀, P₀) and an estimate with the covariance P, the shift d = x − x₀ has the covariance P₀ − P.
//! Then dᵀP₀⁻¹d is a sum of squares of independent normal deviates with the weights λ, the eigenvalues of 1 − P₀⁻¹P. A
//! weight is near 1 in a direction that the flight determines, and near 0 where the prior stays.

use hzn_core::body;
use nalgebra::{Matrix2, Vector2};

use crate::limb_prior::{LimbPrior, TWO_SIDED};
use crate::quantile;

/// Sigmas above which prior and pictures disagree: one right flight in a hundred is refused.
const SIGMAS: f64 = 2.33;

/// The shifts of focal length and limb height against their priors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conflict {
    /// Shift of the focal length over its 1-sigma before the flight.
    pub focal_sigmas: f64,
    /// Shift of the limb height over its 1-sigma before the flight; 0 if the height is free.
    pub height_sigmas: f64,
    /// Both together: the sum of the squares.
    pub chi2: f64,
    /// Largest sum that is consistent: a right flight is above it once in a hundred times.
    pub max_chi2: f64,
    /// Lowest and highest limb height that the air of the body and what is known of it allow, in kilometres.
    pub range_km: [f64; 2],
    /// Distance of the limb height from that range, over its 1-sigma with the error of the altitude.
    pub outside_sigmas: f64,
}

impl Conflict {
    /// Takes the shifts of focal length (percent) and limb height (km), with their covariances before and after the
    /// flight. `body` is the body that the sensor looks for.
    pub(super) fn new(
        body: &body::Config,
        limb: LimbPrior,
        focal_sigma_percent: f64,
        shift: [f64; 2],
        after: Matrix2<f64>,
    ) -> Self {
        let height_km = limb.km + shift[1];
        let before = Vector2::new(focal_sigma_percent.max(1e-9), limb.sigma_km.max(1e-9));
        // Without a prior of the height, its shift says nothing.
        let scale = Vector2::new(1.0 / before[0], if before[1].is_finite() { 1.0 / before[1] } else { 0.0 });
        let shifts = Vector2::from(shift).component_mul(&scale);
        let known = Matrix2::from_diagonal(&scale.map(|s| f64::from(u8::from(s > 0.0))));
        let gained = known - Matrix2::from_diagonal(&scale) * after * Matrix2::from_diagonal(&scale);
        let weights = gained.symmetric_eigenvalues().map(|w| w.clamp(0.0, 1.0));
        let range_km = limb.possible_km(body);
        let outside_km = (range_km[0] - height_km).max(height_km - range_km[1]).max(0.0);
        let sigma_km = after[(1, 1)].sqrt().hypot(body.altitude_sigma_km);
        Self {
            focal_sigmas: shifts[0],
            height_sigmas: shifts[1],
            chi2: shifts.norm_squared(),
            max_chi2: quantile::weighted_chi2(weights.as_slice(), SIGMAS),
            range_km,
            outside_sigmas: outside_km / sigma_km.max(1e-9),
        }
    }

    /// Returns whether prior and pictures disagree.
    pub fn is_significant(&self) -> bool {
        self.chi2 > self.max_chi2 || self.outside_sigmas > TWO_SIDED
    }
}
