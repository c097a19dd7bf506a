//! What a flight makes observable: the focal length against the limb height.

use super::fit::Fit;
use super::layout::Layout;
use super::unknowns::Unknowns;
use crate::limb_prior::LimbPrior;

/// How well the flight separates the focal length from the limb height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observability {
    /// 1-sigma of the focal length with the limb height known exactly, in percent.
    pub known_limb_percent: f64,
    /// 1-sigma of the focal length with a free limb height, in percent.
    pub free_limb_percent: f64,
    /// Correlation of focal length and limb height if the limb height is free.
    pub correlation: f64,
    /// Change of the focal length that looks like one kilometre of limb height, in percent.
    pub percent_per_km: f64,
    /// 1-sigma of a free limb height, in kilometres.
    pub free_limb_km: f64,
}

impl Observability {
    /// Computes the figures from the equations of a fit; `None` if they have no solution.
    pub(super) fn new(fit: &Fit, unknowns: &Unknowns) -> Option<Self> {
        let scale = unknowns.scale_weights();
        let with = |sigma_km: f64| {
            let solution = fit.solve_again(&unknowns.covariance, LimbPrior { sigma_km, ..fit.limb })?;
            let (first, n) = (fit.layout.first_intrinsic(), fit.layout.intrinsics);
            let variance = (scale.transpose() * solution.covariance.view((first, first), (n, n)) * &scale)[(0, 0)];
            let shared = (scale.transpose() * solution.covariance.view((first, Layout::HEIGHT), (n, 1)))[(0, 0)];
            Some((variance.sqrt(), shared, solution.covariance[(Layout::HEIGHT, Layout::HEIGHT)].sqrt()))
        };
        let (known, ..) = with(0.0)?;
        let (free, shared, height_km) = with(f64::INFINITY)?;
        Some(Self {
            known_limb_percent: 100.0 * known,
            free_limb_percent: 100.0 * free,
            correlation: shared / (free * height_km),
            percent_per_km: 100.0 * shared / (height_km * height_km),
            free_limb_km: height_km,
        })
    }
}
