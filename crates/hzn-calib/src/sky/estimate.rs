//! Estimates the intrinsic parameters of the lens from the limb pictures of a flight.

use hzn_core::body;
use hzn_core::camera::Config;
use nalgebra::{DMatrix, DVector, Matrix2};

use super::conflict::Conflict;
pub use super::fit::MIN_PICTURES;
use super::fit::{Fit, Fitted};
use super::layout::Layout;
use super::observable::Observability;
use super::parameters::{Determined, Parameters};
use super::refusal::Refusal;
use super::unknowns::Unknowns;
use super::view::View;
use crate::limb_prior::LimbPrior;
use crate::quantile;

/// Returns the largest mean square without an alarm for a number of pictures.
pub(super) fn max_chi2(pictures: usize) -> f64 {
    quantile::max_mean_square(pictures.saturating_sub(1))
}

/// One picture in the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Name of the picture.
    pub name: String,
    /// Limb height that it measures with the new lens, in kilometres.
    pub km: f64,
    /// 1-sigma from edge noise, in kilometres.
    pub sigma_km: f64,
    /// RMS distance of the edge points from the limb, in pixels.
    pub rms_px: f64,
    /// Limb axis in the camera frame with the new lens.
    pub axis: [f64; 3],
    /// Whether the picture counts, because its height agrees with the others.
    pub counts: bool,
}

/// The lens that a flight measures, with the limb height.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The calibration with the determined parameters.
    pub camera: Config,
    /// All parameters that take part.
    pub parameters: Vec<Determined>,
    /// Change of the focal length in percent, and its 1-sigma, even if it is not determined.
    pub focal_percent: [f64; 2],
    /// 1-sigma of the focal length before the flight, in percent.
    pub focal_sigma_before_percent: f64,
    /// Limb height and its 1-sigma after the flight, in kilometres.
    pub height_km: [f64; 2],
    /// The limb height before the flight.
    pub limb_before: LimbPrior,
    /// Scatter of the limb height between pictures, in kilometres; `None` if there are too few pictures to measure it.
    pub scatter_km: Option<f64>,
    /// Sigma of the shift that all edges have in common before and after the flight, in pixels.
    pub shift_sigma_px: [f64; 2],
    /// Mean square of the pictures' deviations over their variances without the scatter; `None` for a single picture.
    pub chi2: Option<f64>,
    /// Largest mean square without an alarm: 2, and more for fewer than 25 pictures.
    pub max_chi2: f64,
    /// Focal length and limb height against what was known of them before the flight.
    pub conflict: Conflict,
    /// What the flight makes observable.
    pub observability: Observability,
    /// The pictures, in order.
    pub pictures: Vec<Picture>,
}

/// Estimates the parameters from the views of a flight. `body` is the body that the sensor looks for, and `limb` is its
/// limb height before the flight.
///
/// # Errors
/// The flight does not determine the lens: see [`Refusal`].
pub fn estimate(
    unknowns: &Unknowns,
    body: &body::Config,
    views: &[View],
    limb: LimbPrior,
) -> Result<Estimate, Refusal> {
    let fit = Fit::new(unknowns, body, views, limb)?;
    let observability = Observability::new(&fit, unknowns).ok_or(Refusal::Singular)?;
    let (changes, covariance) = with_common_errors(&fit, unknowns).ok_or(Refusal::Singular)?;
    let lens = Parameters::new(unknowns, &changes, &covariance, fit.rms_px().max(1.0)).ok_or(Refusal::Singular)?;
    let height_variance = fit.solution.covariance[(Layout::HEIGHT, Layout::HEIGHT)];
    let shift = fit.layout.first_common();
    let conflict = conflict(&fit, unknowns, body, (&changes, &covariance));
    Ok(Estimate {
        camera: lens.camera,
        parameters: lens.list,
        focal_percent: lens.focal_percent,
        focal_sigma_before_percent: unknowns.focal_sigma_percent(),
        height_km: [fit.solution.values[Layout::HEIGHT], height_variance.sqrt()],
        limb_before: limb,
        scatter_km: (fit.counted().len() >= MIN_PICTURES).then_some(fit.solution.scatter_km),
        shift_sigma_px: [fit.common_px[0], fit.solution.covariance[(shift, shift)].sqrt()],
        chi2: chi2(&fit),
        max_chi2: max_chi2(fit.counted().len()),
        conflict,
        observability,
        pictures: pictures(&fit, views),
    })
}

impl Estimate {
    /// Returns the refusal if the flight determines no parameter.
    pub fn undetermined(&self) -> Option<Refusal> {
        let none = !self.parameters.iter().any(|p| p.determined);
        none.then_some(Refusal::Undetermined {
            focal_percent: self.focal_percent[1],
            before_percent: self.focal_sigma_before_percent,
            with_known_limb_percent: self.observability.known_limb_percent,
        })
    }

    /// Returns the alarm if the pictures do not agree with each other, or not with what was known before.
    pub fn alarm(&self) -> Option<Refusal> {
        if let Some(chi2) = self.chi2.filter(|chi2| *chi2 > self.max_chi2) {
            return Some(Refusal::Alarm { chi2, max_chi2: self.max_chi2 });
        }
        self.conflict.is_significant().then(|| Refusal::Conflict {
            conflict: self.conflict,
            focal_percent: self.conflict.focal_sigmas * self.focal_sigma_before_percent,
            height_km: [self.limb_before.km, self.height_km[0]],
        })
    }
}

/// Returns the changes of the lens and their covariance, with the errors S that all edges of this flight have in
/// common.
///
/// These errors belong to the flight, and not to what was known before: a good lens must not become worse by a flight,
/// and must not follow it more than S allows. With the covariance P before and C after a flight without such errors,
/// M = 1 − C P⁻¹ and K = (1 + M S P⁻¹)⁻¹, the changes are K times those of that flight, and the covariance is
/// C + K M S Mᵀ. If nothing was known before, it is C + S.
fn with_common_errors(fit: &Fit, unknowns: &Unknowns) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let (first, n) = (fit.layout.first_intrinsic(), fit.layout.intrinsics);
    let one = DMatrix::identity(n, n);
    let flight = fit.solution.covariance.view((first, first), (n, n)).into_owned();
    let before = unknowns.covariance.clone().cholesky()?;
    // Both are symmetric: A P⁻¹ = (P⁻¹ A)ᵀ.
    let gained = &one - before.solve(&flight).transpose();
    let common = fit.systematic(unknowns);
    let kept = (&one + &gained * before.solve(&common).transpose()).try_inverse()?;
    let covariance = flight + &kept * &gained * common * gained.transpose();
    Some((kept * fit.changes(), (&covariance + covariance.transpose()) * 0.5))
}

/// Compares focal length and limb height with what was known of them, by the changes of the lens with their covariance.
fn conflict(
    fit: &Fit,
    unknowns: &Unknowns,
    body: &body::Config,
    (changes, intrinsics): (&DVector<f64>, &DMatrix<f64>),
) -> Conflict {
    let scale = unknowns.scale_weights();
    let (first, n) = (fit.layout.first_intrinsic(), fit.layout.intrinsics);
    let covariance = &fit.solution.covariance;
    let focal = 1e4 * (scale.transpose() * intrinsics * &scale)[(0, 0)];
    let both = 100.0 * covariance.view((Layout::HEIGHT, first), (1, n)).transpose().dot(&scale);
    let shift = [100.0 * scale.dot(changes), fit.solution.values[Layout::HEIGHT] - fit.limb.km];
    let after = Matrix2::new(focal, both, both, covariance[(Layout::HEIGHT, Layout::HEIGHT)]);
    Conflict::new(body, fit.limb, unknowns.focal_sigma_percent(), shift, after)
}

/// Returns the mean square of the deviations of the limb heights over their variances from edge noise.
pub(super) fn chi2(fit: &Fit) -> Option<f64> {
    let counted: Vec<&Fitted> = fit.pictures.iter().filter(|p| p.counts).collect();
    let freedom = counted.len().checked_sub(1).filter(|n| *n > 0)? as f64;
    let weights: f64 = counted.iter().map(|p| p.height_km[1].powi(-2)).sum();
    let mean = counted.iter().map(|p| p.height_km[0] * p.height_km[1].powi(-2)).sum::<f64>() / weights;
    Some(counted.iter().map(|p| ((p.height_km[0] - mean) / p.height_km[1]).powi(2)).sum::<f64>() / freedom)
}

fn pictures(fit: &Fit, views: &[View]) -> Vec<Picture> {
    let picture = |p: &Fitted| Picture {
        name: views.get(p.view).map(|v| v.name.clone()).unwrap_or_default(),
        km: p.height_km[0],
        sigma_km: p.height_km[1],
        rms_px: p.reduced.rms_px,
        axis: p.reduced.axis.into(),
        counts: p.counts,
    };
    fit.pictures.iter().map(picture).collect()
}
