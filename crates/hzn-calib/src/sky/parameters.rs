//! The parameters of a lens after a flight: which are determined, their values, and their covariance.

use hzn_core::camera::{Camera, Config, Covariance, Equation, Intrinsic};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector};

use super::unknowns::Unknowns;

/// A parameter is determined if its sigma is at most this fraction of that before the flight.
const DETERMINED: f64 = 0.5;
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
    /// Whether the flight determines the parameter: its sigma is at most half of that before, and a principal point is
    /// known to a pixel, or as well as the edges if they are worse.
    pub determined: bool,
}

/// The lens after a flight.
pub(super) struct Parameters {
    /// The calibration with the determined parameters and their covariance.
    pub(super) camera: Config,
    pub(super) list: Vec<Determined>,
    /// Change of the focal length in percent, and its 1-sigma, even if it is not determined.
    pub(super) focal_percent: [f64; 2],
}

impl Parameters {
    /// Takes the changes of the parameters with their covariance after the flight. A principal point counts as
    /// determined only if its sigma is at most `max_centre_px` too: its error turns every direction, as a wrong mount
    /// does, so a principal point that is worse than a pixel makes a sensor worse. `None` if the covariance is
    /// singular.
    pub(super) fn new(
        unknowns: &Unknowns,
        changes: &DVector<f64>,
        covariance: &DMatrix<f64>,
        max_centre_px: f64,
    ) -> Option<Self> {
        let sigma = |c: &DMatrix<f64>, i: usize| c[(i, i)].sqrt();
        let limit = |i: usize| match unknowns.list.get(i) {
            Some(Intrinsic::CxPx | Intrinsic::CyPx) => max_centre_px,
            _ => f64::INFINITY,
        };
        let is_determined = |i: usize| {
            let halved = sigma(covariance, i) <= DETERMINED * sigma(&unknowns.covariance, i);
            halved && sigma(covariance, i) <= limit(i)
        };
        let determined: Vec<bool> = (0..changes.len()).map(is_determined).collect();
        let scale = unknowns.scale_weights();
        let focal_sigma = (scale.transpose() * covariance * &scale)[(0, 0)].sqrt();
        let kept = without_undetermined(changes, covariance, &determined)?;
        let mut camera = unknowns.changed_by(kept.as_slice());
        // If nothing is determined, the calibration stays as it was.
        if determined.contains(&true) {
            camera.covariance = Some(written_covariance(unknowns, covariance, &determined));
            (camera.focal_sigma_percent, camera.centre_sigma_px) = (0.0, 0.0);
        }
        let list = parameters(unknowns, &camera, covariance, &determined);
        // Parameters that keep their values move the others. Without any determined one, the flight's own value is
        // shown.
        let shown = if determined.contains(&true) { &kept } else { changes };
        Some(Self { camera, list, focal_percent: [100.0 * scale.dot(shown), 100.0 * focal_sigma] })
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
