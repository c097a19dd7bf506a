//! Whether another lens model explains the same points far better.
//!
//! The covariance of a lens has the disagreement between pictures. What a wrong model bends in all of them alike is not
//! in it, so that the answers with such a lens are wrong by many sigmas.

use hzn_core::camera::Model;

use crate::calibrated::{Calibrated, Refusal, Warning};

/// The models that are tried: with their coefficients they follow most lenses of an angle and of a plane.
const GENERAL: [Model; 2] = [Model::KannalaBrandt, Model::BrownConrady];
/// RMS up to which no other model is tried, in pixels: corners of real boards are measured to about this.
const SMALL_RMS_PX: f64 = 0.1;
/// Ratio of the two RMS above which the calibration is refused: nearly the whole rest is then an error of the model.
const REFUSED: f64 = 3.0;
/// Ratio above which there is a warning: more than half of the variance of the rest is an error of the model.
const WORTH_A_WARNING: f64 = 1.5;

/// Compares a calibration with those of other models. `rms_px_of` gives the RMS of a model for the same points.
///
/// # Errors
/// The other model leaves less than a third of the RMS.
pub(crate) fn compare(
    model: Model,
    calibrated: &mut Calibrated,
    rms_px_of: impl Fn(Model) -> Option<f64>,
) -> Result<(), Refusal> {
    let rms_px = calibrated.rms_px;
    if rms_px <= SMALL_RMS_PX {
        return Ok(());
    }
    let others = GENERAL.into_iter().filter(|other| *other != model);
    let each = others.filter_map(|other| Some((other, rms_px_of(other)?)));
    let Some((other, other_rms_px)) = each.min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
    if other_rms_px * REFUSED < rms_px {
        return Err(Refusal::OtherModel { model, rms_px, other, other_rms_px });
    }
    if other_rms_px * WORTH_A_WARNING < rms_px {
        calibrated.warnings.push(Warning::OtherModel { model, rms_px, other, other_rms_px });
    }
    Ok(())
}
