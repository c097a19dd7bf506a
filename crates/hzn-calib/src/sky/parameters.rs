//! The parameters of a lens after a flight: which are determined, their values, and their covariance.

use hzn_core::camera::{Camera, Config, Covariance, Equation, Intrinsic};
use hzn_core::pixel::ImagePoint;
use nalgebra::{DMatrix, DVector};

use super::unknowns::Unknowns;

/// A parameter is determined if its sigma is at most this fraction of that before the flight.
const DETERMINED: f64 = 0.5;
/// A lens whose calibration states the covariance of all its parameters is written if a sigma is at most this fraction
/// of that before. All parameters are then written, because they are one adjustment with what was known before. Above
/// it, the values before are within half a sigma of that adjustment.
const GAINED: f64 = 0.9;

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
    /// known to a pixel, or as well as the edges if they are worse. If the calibration states the covariance of all
    /// parameters, the flight determines all of them if it makes one sigma smaller by a tenth.
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
        let mut determined: Vec<bool> = (0..changes.len()).map(is_determined).collect();
        let is_gained = |i: usize| sigma(covariance, i) <= GAINED * sigma(&unknowns.covariance, i);
        if unknowns.is_calibrated() && (0..changes.len()).any(is_gained) {
            determined.fill(true);
        }
        let scale = unknowns.scale_weights();
        let focal_sigma = (scale.transpose() * covariance * &scale)[(0, 0)].sqrt();
        let prior = &unknowns.covariance;
        let (kept, written) = loop {
            let (kept, written) = keep_undetermined(changes, covariance, prior, &determined)?;
            // A parameter that follows one that is kept may be known less well than before the flight.
            let is_worse = |i: &usize| determined[*i] && sigma(&written, *i) > sigma(prior, *i);
            match (0..changes.len()).find(is_worse) {
                Some(worse) => determined[worse] = false,
                None => break (kept, written),
            }
        };
        let mut camera = unknowns.changed_by(kept.as_slice());
        // If nothing is determined, the calibration stays as it was.
        if determined.contains(&true) {
            camera.covariance = Some(written_covariance(unknowns, &written, &determined));
            (camera.focal_sigma_percent, camera.centre_sigma_px) = (0.0, 0.0);
        }
        let list = parameters(unknowns, &camera, &written, &determined);
        // Parameters that keep their values move the others. Without any determined one, the flight's own value is
        // shown.
        let shown = if determined.contains(&true) { &kept } else { changes };
        Some(Self { camera, list, focal_percent: [100.0 * scale.dot(shown), 100.0 * focal_sigma] })
    }
}

/// Returns the changes of the lens and their covariance if the undetermined parameters keep their values and their
/// covariance of before the flight, `prior`. The flight then says how the others depend on them: their mean and
/// covariance if these are given. `None` if a covariance is singular.
fn keep_undetermined(
    changes: &DVector<f64>,
    covariance: &DMatrix<f64>,
    prior: &DMatrix<f64>,
    determined: &[bool],
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let fixed: Vec<usize> = determined.iter().enumerate().filter(|(_, known)| !**known).map(|(i, _)| i).collect();
    let own = |c: &DMatrix<f64>| c.select_rows(&fixed).select_columns(&fixed);
    // The change of every parameter by one of those that are kept, from the covariance of the flight.
    let slopes = if fixed.is_empty() {
        DMatrix::zeros(changes.len(), 0)
    } else {
        own(covariance).cholesky()?.solve(&covariance.select_rows(&fixed)).transpose()
    };
    let given = covariance - &slopes * covariance.select_rows(&fixed);
    let off = DVector::from_iterator(fixed.len(), fixed.iter().map(|i| changes[*i]));
    Some((changes - &slopes * off, given + &slopes * own(prior) * slopes.transpose()))
}

/// Returns the covariance that is written: of the determined parameters, and of those whose sigma is stated.
fn written_covariance(unknowns: &Unknowns, covariance: &DMatrix<f64>, determined: &[bool]) -> Covariance {
    let kept: Vec<usize> = (0..determined.len()).filter(|i| determined[*i] || unknowns.stated[*i]).collect();
    // Rounding errors of parameters that do not depend on each other would be written with fifteen digits.
    let is_noise = |i: usize, j: usize| covariance[(i, j)].powi(2) < 1e-20 * covariance[(i, i)] * covariance[(j, j)];
    let at = |i: usize, j: usize| if is_noise(i, j) { 0.0 } else { 0.5 * (covariance[(i, j)] + covariance[(j, i)]) };
    let row = |i: &usize| kept.iter().map(|j| at(*i, *j)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_that_is_kept_keeps_its_sigma_too() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 1.0]);
        let prior = DMatrix::from_row_slice(2, 2, &[9.0, 0.0, 0.0, 100.0]);
        let changes = DVector::from_vec(vec![3.0, 2.0]);
        let (kept, written) = keep_undetermined(&changes, &covariance, &prior, &[false, true]).unwrap();
        // The second one is at its mean for the value that the first one keeps, 2 - 1/4 * 3. Its variance is 1 - 1/4
        // for each value of the first one, and it moves by 1/4 of the error of the first one.
        assert!((kept - DVector::from_vec(vec![0.0, 1.25])).amax() < 1e-12);
        let want = DMatrix::from_row_slice(2, 2, &[9.0, 9.0 / 4.0, 9.0 / 4.0, 0.75 + 9.0 / 16.0]);
        assert!((&written - want).amax() < 1e-12, "{written}");
        // Without a kept value, it is the covariance of the flight.
        let (all, written) = keep_undetermined(&changes, &covariance, &prior, &[true, true]).unwrap();
        assert_eq!((all, written), (changes, covariance));
    }
}
