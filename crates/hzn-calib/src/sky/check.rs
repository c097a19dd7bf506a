//! Tests whether a calibration still holds in flight.
//!
//! The flight measures the scale of the lens without the calibration's focal length, and its difference from the
//! calibration is compared with the sigmas of both. A difference beyond three sigmas is significant. If it is not, the
//! calibration holds only if an error of the stated size would have been found: with z₁ = 3 sigmas for the test and
//! z₂ = 1.645 for a power of 95 %, the sigma must be below the error over (z₁ + z₂).

use hzn_core::body;
use hzn_core::camera::Config;
use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::layout::Layout;
use super::observable::Observability;
use super::refusal::Refusal;
use super::unknowns::Unknowns;
use super::view::View;
use crate::limb_prior::LimbPrior;

/// Error of the focal length that a check detects unless another is stated, in percent.
pub const DEFAULT_DETECT_PERCENT: f64 = 0.3;
/// Sigmas beyond which a difference is significant: 0.27 % of the differences of right calibrations.
const SIGNIFICANT: f64 = 3.0;
/// Sigmas of a one-sided probability of 95 %.
const POWER: f64 = 1.645;

/// The result of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The flight agrees with the calibration, and it would have shown an error of the stated size.
    Holds,
    /// The flight disagrees with the calibration, or its pictures contradict each other.
    DoesNotHold,
    /// The flight agrees with the calibration, but it would not have shown an error of the stated size.
    CannotTell,
}

impl Verdict {
    /// Returns the verdict in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::DoesNotHold => "does not hold",
            Self::CannotTell => "cannot tell",
        }
    }
}

/// The difference of one quantity from the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Value in flight minus value of the calibration.
    pub value: f64,
    /// 1-sigma from the flight and the calibration together.
    pub sigma: f64,
    /// 1-sigma of the calibration alone.
    pub calibration_sigma: f64,
    /// The difference in sigmas of a normal law with the same probability.
    pub sigmas: f64,
    /// Probability of a larger difference if the calibration holds.
    pub p_value: f64,
    /// Smallest difference that is found with a probability of 95 %.
    pub detectable: f64,
}

impl Deviation {
    fn new(value: f64, variance: f64, calibration_variance: f64, freedom: f64) -> Self {
        let sigma = (variance + calibration_variance).sqrt();
        let sigmas = super::normal_law::normal_sigmas(value / sigma, freedom);
        Self {
            value,
            sigma,
            calibration_sigma: calibration_variance.sqrt(),
            sigmas,
            p_value: super::normal_law::two_sided(sigmas),
            detectable: (super::normal_law::student_t(SIGNIFICANT, freedom) + POWER) * sigma,
        }
    }

    /// Returns whether the difference is significant.
    pub fn is_significant(&self) -> bool {
        self.sigmas.abs() > SIGNIFICANT
    }
}

/// The check of a calibration against a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// The verdict.
    pub verdict: Verdict,
    /// The focal length, in percent.
    pub focal: Deviation,
    /// The principal point (u, v), in pixels. It is tested with the focal length of the calibration.
    pub centre_px: [Deviation; 2],
    /// Error of the focal length that the check must detect, in percent.
    pub detect_percent: f64,
    /// Limb height and its 1-sigma after the flight, in kilometres.
    pub height_km: [f64; 2],
    /// What the flight makes observable.
    pub observability: Observability,
    /// Mean square of the pictures' deviations over their variances without the scatter; `None` for a single picture.
    /// Pictures above [`Self::max_chi2`] contradict each other: no lens explains them all.
    pub chi2: Option<f64>,
    /// Largest mean square of pictures that agree: 2, and more for fewer than 25 pictures, as in [`super::estimate()`].
    pub max_chi2: f64,
    /// Number of pictures that count, and of pictures whose limb height disagrees.
    pub pictures: [usize; 2],
}

impl Check {
    /// Returns the mean square of the deviations if the pictures contradict each other.
    pub fn contradiction(&self) -> Option<f64> {
        self.chi2.filter(|chi2| *chi2 > self.max_chi2)
    }
}

/// Tests a calibration with the views of a flight. `limb` is the limb height before the flight, and `detect_percent` is
/// the error of the focal length that the check must detect.
///
/// # Errors
/// The fit has no solution: see [`Refusal`].
pub fn check(
    calibration: &Config,
    body: &body::Config,
    views: &[View],
    limb: LimbPrior,
    detect_percent: f64,
) -> Result<Check, Refusal> {
    let unknowns = Unknowns::for_check(calibration);
    let fit = Fit::new(&unknowns, body, views, limb)?;
    let observability = Observability::new(&fit, &unknowns).ok_or(Refusal::Singular)?;
    let claimed = Unknowns::of_calibration(calibration);
    let counted = fit.counted().len();
    // The scatter, and the sigmas with it, come from the pictures.
    let freedom = counted.saturating_sub(1).max(1) as f64;
    let (first, n) = (fit.layout.first_intrinsic(), fit.layout.intrinsics);
    let percent = unknowns.scale_weights() * 100.0;
    let variance = |c: &DMatrix<f64>, along: &DVector<f64>| (along.transpose() * c * along)[(0, 0)];
    let systematic = fit.systematic(&unknowns);
    let flown = fit.solution.covariance.view((first, first), (n, n)) + &systematic;
    let value = percent.dot(&fit.changes());
    let focal = Deviation::new(value, variance(&flown, &percent), variance(&claimed.covariance, &percent), freedom);
    let centre_px = test_centre(&claimed, &fit, &systematic, freedom).ok_or(Refusal::Singular)?;
    let chi2 = super::estimate::chi2(&fit);
    let max_chi2 = super::estimate::max_chi2(counted);
    let contradicts = chi2.is_some_and(|chi2| chi2 > max_chi2);
    let verdict = if contradicts || focal.is_significant() || centre_px.iter().any(Deviation::is_significant) {
        Verdict::DoesNotHold
    } else if focal.detectable <= detect_percent {
        Verdict::Holds
    } else {
        Verdict::CannotTell
    };
    let height = Layout::HEIGHT;
    Ok(Check {
        verdict,
        focal,
        centre_px,
        detect_percent,
        height_km: [fit.solution.values[height], fit.solution.covariance[(height, height)].sqrt()],
        observability,
        chi2,
        max_chi2,
        pictures: [counted, fit.pictures.len() - counted],
    })
}

/// Tests the principal point with the focal length of the calibration.
fn test_centre(claimed: &Unknowns, fit: &Fit, systematic: &DMatrix<f64>, freedom: f64) -> Option<[Deviation; 2]> {
    let solution = fit.solve_again(&claimed.with_free_centre(), fit.limb)?;
    let deviation = |place: Option<usize>| {
        let place = place?;
        let at = fit.layout.first_intrinsic() + place;
        let calibration = claimed.covariance[(place, place)];
        Some(Deviation::new(
            solution.values[at],
            solution.covariance[(at, at)] + systematic[(place, place)],
            calibration,
            freedom,
        ))
    };
    let [u, v] = claimed.centre();
    Some([deviation(u)?, deviation(v)?])
}
