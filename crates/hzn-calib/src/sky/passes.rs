//! The estimate of a lens that may be several percent wrong: the pictures are processed again with the estimated lens.

use hzn_core::{Config, body, camera};

use super::estimate::{Estimate, estimate};
use super::refusal::Refusal;
use super::unknowns::{LimbPrior, Unknowns};
use super::view::View;

/// Number of times that the pictures are processed at most. The first lens may be several percent wrong, and with it
/// the choice of the edge points.
const PASSES: usize = 3;
/// The pictures are processed again if the focal length changes by more than this, in percent: the edge points at the
/// border of a wide picture then move by about a pixel.
const PROCESS_AGAIN_PERCENT: f64 = 0.2;

/// The estimate with the views that it is made of, or why the flight does not determine the lens.
pub type Estimated = Result<(Estimate, Vec<View>), Refusal>;

/// Processes the pictures of a flight and estimates the lens, with the estimated lens again if it differs. `process`
/// gets the lens to process with and returns the views, or `None` if it was interrupted. `again` gets the difference of
/// the focal length and its sigma, in percent, before the pictures are processed again. `body` is the body that the
/// sensor looks for. Returns the estimate with the views of the last pass.
///
/// # Errors
/// `process` fails. The inner error says why the flight does not determine the lens.
pub fn estimate_in_passes<E>(
    sensor: &Config,
    body: &body::Config,
    unknowns: &Unknowns,
    limb: LimbPrior,
    mut process: impl FnMut(&camera::Config) -> Result<Option<Vec<View>>, E>,
    mut again: impl FnMut([f64; 2]),
) -> Result<Option<Estimated>, E> {
    let focal_sigma_percent = unknowns.focal_sigma_percent();
    let mut used = camera::Config { covariance: None, focal_sigma_percent, ..sensor.camera.clone() };
    let mut before_percent = 0.0;
    for pass in 1..=PASSES {
        let Some(views) = process(&used)? else { return Ok(None) };
        let estimate = match estimate(unknowns, body, &views, limb) {
            Ok(estimate) => estimate,
            Err(why) => return Ok(Some(Err(why))),
        };
        let [percent, sigma] = estimate.focal_percent;
        if pass == PASSES || (percent - before_percent).abs() <= PROCESS_AGAIN_PERCENT {
            return Ok(Some(Ok((estimate, views))));
        }
        again([percent, sigma]);
        before_percent = percent;
        let focal_sigma_percent = sigma.max(PROCESS_AGAIN_PERCENT);
        used = camera::Config { covariance: None, focal_sigma_percent, ..estimate.camera.clone() };
    }
    Ok(None)
}
