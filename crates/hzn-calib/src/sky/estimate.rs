//! Estimates the intrinsic parameters of the lens from the limb pictures of a flight.

use hzn_core::body;
use hzn_core::camera::{Camera, Config, Covariance, Equation, Intrinsic};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector};

pub use super::fit::MIN_PICTURES;
use super::fit::{Fit, Fitted};
use super::layout::Layout;
use super::observable::Observability;
use super::refusal::Refusal;
use super::unknowns::{LimbPrior, Unknowns};
use super::view::View;

/// A parameter is determined if its sigma is at most this fraction of that before the flight.
const DETERMINED: f64 = 0.5;
/// Largest mean square of the deviations over their variances without an alarm.
const MAX_CHI2: f64 = 2.0;

/// One intrinsic parameter after the flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Determined {
    /// The parameter.
    pub which: Intrinsic,
    /// Value before the flight, in the unit of the key.
    pub before: f64,
    /// 1-sigma before the flight.
    pub sigma_before: f64,
    /// Whether the calibration states that sigma; otherwise it is assumed.
    pub stated: bool,
    /// Value after the flight. It is the value before the flight if the parameter is not determined.
    pub value: f64,
    /// 1-sigma after the flight.
    pub sigma: f64,
    /// Motion of the corner of the picture for that sigma, in pixels.
    pub corner_px: f64,
    /// Whether the flight determines the parameter: its sigma is at most half of that before.
    pub determined: bool,
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
    /// Change of the focal length in percent, and its 1-sigma.
    pub focal_percent: [f64; 2],
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
    let (first, n) = (fit.layout.first_intrinsic(), fit.layout.intrinsics);
    let covariance = fit.solution.covariance.view((first, first), (n, n)).into_owned();
    let determined: Vec<bool> =
        (0..n).map(|i| covariance[(i, i)].sqrt() <= DETERMINED * unknowns.covariance[(i, i)].sqrt()).collect();
    let scale = unknowns.scale_weights();
    let sigma_of = |c: &DMatrix<f64>| 100.0 * (scale.transpose() * c * &scale)[(0, 0)].sqrt();
    if !determined.contains(&true) {
        return Err(Refusal::Undetermined {
            focal_percent: sigma_of(&covariance),
            before_percent: sigma_of(&unknowns.covariance),
            with_known_limb_percent: observability.known_limb_percent,
        });
    }
    let changes = without_undetermined(&fit.changes(), &covariance, &determined).ok_or(Refusal::Singular)?;
    let height_variance = fit.solution.covariance[(Layout::HEIGHT, Layout::HEIGHT)];
    let shift = fit.layout.first_common();
    let mut camera = unknowns.changed_by(changes.as_slice());
    camera.covariance = Some(written_covariance(unknowns, &covariance, &determined));
    (camera.focal_sigma_percent, camera.centre_sigma_px) = (0.0, 0.0);
    Ok(Estimate {
        parameters: parameters(unknowns, &camera, &covariance, &determined),
        focal_percent: [100.0 * scale.dot(&changes), sigma_of(&covariance)],
        height_km: [fit.solution.values[Layout::HEIGHT], height_variance.sqrt()],
        limb_before: limb,
        scatter_km: (fit.counted().len() >= MIN_PICTURES).then_some(fit.solution.scatter_km),
        shift_sigma_px: [fit.common_px[0], fit.solution.covariance[(shift, shift)].sqrt()],
        chi2: chi2(&fit),
        observability,
        pictures: pictures(&fit, views),
        camera,
    })
}

impl Estimate {
    /// Returns the alarm if the pictures do not agree with each other.
    pub fn alarm(&self) -> Option<Refusal> {
        let chi2 = self.chi2.filter(|chi2| *chi2 > MAX_CHI2)?;
        Some(Refusal::Alarm { chi2, max_chi2: MAX_CHI2 })
    }
}

/// Returns the changes for a lens whose undetermined parameters keep their values: the mean of the others if these are
/// given. `None` if their covariance is singular.
fn without_undetermined(
    changes: &DVector<f64>,
    covariance: &DMatrix<f64>,
    determined: &[bool],
) -> Option<DVector<f64>> {
    let fixed: Vec<usize> = determined.iter().enumerate().filter(|(_, known)| !**known).map(|(i, _)| i).collect();
    let own = DMatrix::from_fn(fixed.len(), fixed.len(), |i, j| covariance[(fixed[i], fixed[j])]);
    let off = DVector::from_iterator(fixed.len(), fixed.iter().map(|i| changes[*i]));
    let weights = if fixed.is_empty() { off } else { own.cholesky()?.solve(&off) };
    let mean = |k: usize| {
        let shift: f64 = fixed.iter().zip(weights.iter()).map(|(i, w)| covariance[(k, *i)] * w).sum();
        if determined[k] { changes[k] - shift } else { 0.0 }
    };
    Some(DVector::from_iterator(changes.len(), (0..changes.len()).map(mean)))
}

/// Returns the covariance that is written: of the determined parameters, and of those whose sigma is stated.
fn written_covariance(unknowns: &Unknowns, covariance: &DMatrix<f64>, determined: &[bool]) -> Covariance {
    let kept: Vec<usize> = (0..determined.len()).filter(|i| determined[*i] || unknowns.stated[*i]).collect();
    let row = |i: &usize| kept.iter().map(|j| covariance[(*i, *j)]).collect();
    Covariance { order: kept.iter().map(|i| unknowns.list[*i]).collect(), rows: kept.iter().map(row).collect() }
}

fn parameters(unknowns: &Unknowns, camera: &Config, covariance: &DMatrix<f64>, determined: &[bool]) -> Vec<Determined> {
    let each = unknowns.list.iter().zip(determined).enumerate();
    let one = |(i, (which, determined)): (usize, (&Intrinsic, &bool))| Determined {
        which: *which,
        before: unknowns.before.intrinsic(*which).unwrap_or(0.0),
        sigma_before: unknowns.covariance[(i, i)].sqrt(),
        stated: unknowns.stated[i],
        value: camera.intrinsic(*which).unwrap_or(0.0),
        sigma: covariance[(i, i)].sqrt(),
        corner_px: covariance[(i, i)].sqrt() * motion_of_corner(camera, *which),
        determined: *determined,
    };
    each.map(one).collect()
}

/// Returns the motion of the farthest corner of the picture, or of the farthest point in the image circle towards it,
/// per unit of a parameter, in pixels.
fn motion_of_corner(config: &Config, which: Intrinsic) -> f64 {
    let place = config.model.intrinsics().iter().position(|i| *i == which);
    let (Ok(camera), Some(place)) = (Camera::<f64>::try_new(config), place) else { return f64::NAN };
    let far = |centre: f64, side: u16| if centre * 2.0 > f64::from(side) { 0.0 } else { f64::from(side) - 1.0 };
    let corner = [far(config.cx_px, config.width), far(config.cy_px, config.height)];
    // The part of the way from the principal point to the corner that still has a ray.
    let at = |part: f64| ImagePoint {
        u: config.cx_px + part * (corner[0] - config.cx_px),
        v: config.cy_px + part * (corner[1] - config.cy_px),
    };
    let ray = (0..20).find_map(|k| camera.unproject(at(1.0 - 0.05 * f64::from(k))));
    let projected = ray.and_then(|ray| Equation::new(config).project(ray.xyz()));
    projected.map_or(f64::NAN, |p| p.by_intrinsics[0][place].hypot(p.by_intrinsics[1][place]))
}

/// Returns the mean square of the deviations of the limb heights over their variances from edge noise.
fn chi2(fit: &Fit) -> Option<f64> {
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
