//! The estimate of a lens that may be several percent wrong: the pictures are processed again with the estimated lens.

use hzn_core::camera::Camera;
use hzn_core::{Config, body, camera};

use super::estimate::{Estimate, estimate};
use super::refusal::Refusal;
use super::unknowns::Unknowns;
use super::view::View;
use crate::limb_prior::LimbPrior;

/// Number of times that the pictures are processed at most. The first lens may be several percent wrong, and with it
/// the choice of the edge points.
const PASSES: usize = 5;
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
    let mut most = 0;
    for pass in 1..=PASSES {
        let Some(views) = process(&used)? else { return Ok(None) };
        let found = estimate(unknowns, body, &views, limb);
        if let Some(lost) = lost(&found, before_percent, [most, views.len()]) {
            return Ok(Some(Err(lost)));
        }
        let estimate = match found {
            Ok(estimate) => estimate,
            Err(why) => return Ok(Some(Err(why))),
        };
        let [percent, sigma] = estimate.focal_percent;
        let moved_percent = (percent - before_percent).abs();
        if moved_percent <= PROCESS_AGAIN_PERCENT || (pass == PASSES && moved_percent <= sigma) {
            return Ok(Some(Ok((estimate, views))));
        }
        if pass < PASSES {
            again([percent, sigma]);
        }
        before_percent = percent;
        most = views.len().max(most);
        // The new lens may still be wrong by as much as it moved: a limb of another size than it expects is no reason
        // to refuse a picture.
        let focal_sigma_percent = sigma.max(moved_percent).max(PROCESS_AGAIN_PERCENT);
        used = camera::Config { covariance: None, focal_sigma_percent, ..estimate.camera.clone() };
        // It would be refused as if the user had written it.
        if let Err(why) = Camera::<f64>::try_new(&used) {
            return Ok(Some(Err(Refusal::Impossible { why: why.to_string() })));
        }
    }
    Ok(Some(Err(Refusal::NotSettled { passes: PASSES })))
}

/// Returns the refusal if the pictures have lost their answers with the lens that they asked for: more than half of
/// them, or so many that nothing is estimated any more.
fn lost(found: &Result<Estimate, Refusal>, percent: f64, answered: [usize; 2]) -> Option<Refusal> {
    let [before, after] = answered;
    let why = match found {
        _ if before == 0 => return None,
        Err(Refusal::TooFew { .. }) => None,
        Err(why) => Some(Box::new(why.clone())),
        Ok(_) if 2 * after < before => None,
        Ok(_) => return None,
    };
    Some(Refusal::Lost { percent, answered, why })
}
