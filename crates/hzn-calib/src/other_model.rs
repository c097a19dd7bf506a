//! Whether another lens model explains the same points better than by chance.
//!
//! The covariance of a lens has the disagreement between pictures. What a wrong model bends in all of them alike is not
//! in it, so that the answers with such a lens are wrong by many sigmas.

use hzn_core::camera::Model;

use crate::calibrated::{Calibrated, Refusal, ViewResult, Warning};

/// The models that are tried: with their coefficients they follow most lenses of an angle and of a plane.
const GENERAL: [Model; 2] = [Model::KannalaBrandt, Model::BrownConrady];
/// RMS up to which no lens is refused, in pixels: corners of real boards are measured to about this.
const SMALL_RMS_PX: f64 = 0.1;
/// RMS up to which the rest is that of the solution and not of the points, in pixels.
const ROUNDING_PX: f64 = 1e-3;
/// Ratio of the two RMS above which the calibration is refused: nearly the whole rest is then an error of the model.
const REFUSED: f64 = 3.0;
/// Ratio above which there is a warning if there are too few pictures for the test: more than half of the variance of
/// the rest is an error of the model.
const WORTH_A_WARNING: f64 = 1.5;
/// Fewest pictures whose scatter can be estimated.
const FEWEST: usize = 5;
/// Quantile of the normal distribution that one of 1000 lenses of the right model exceeds.
const ONE_IN_1000: f64 = 3.090;

/// Compares a calibration with those of other models. `calibrated_with` calibrates a model on the same points.
///
/// # Errors
/// The other model leaves less than a third of the RMS.
pub(crate) fn compare(
    model: Model,
    calibrated: &mut Calibrated,
    calibrated_with: impl Fn(Model) -> Option<Calibrated>,
) -> Result<(), Refusal> {
    let rms_px = calibrated.rms_px;
    if rms_px <= ROUNDING_PX {
        return Ok(());
    }
    let others = GENERAL.into_iter().filter(|other| *other != model);
    let each = others.filter_map(|other| Some((other, calibrated_with(other)?)));
    let Some((other, better)) = each.min_by(|a, b| a.1.rms_px.total_cmp(&b.1.rms_px)) else { return Ok(()) };
    let other_rms_px = better.rms_px;
    if rms_px > SMALL_RMS_PX && other_rms_px * REFUSED < rms_px {
        return Err(Refusal::OtherModel { model, rms_px, other, other_rms_px });
    }
    let more = other.intrinsics().len().saturating_sub(model.intrinsics().len());
    let is_better = is_better(&calibrated.views, &better, more)
        .unwrap_or(rms_px > SMALL_RMS_PX && other_rms_px * WORTH_A_WARNING < rms_px);
    if is_better && other_rms_px < rms_px {
        calibrated.warnings.push(Warning::OtherModel { model, rms_px, other, other_rms_px });
        widen(calibrated, (rms_px * rms_px - other_rms_px * other_rms_px).sqrt());
    }
    Ok(())
}

/// Returns whether another model is better than one of 1000 lenses of the right model would show by chance; `None` with
/// too few pictures.
///
/// It is the test of Vuong (Econometrica 57, 1989) for models of which none contains the other. Each picture gives one
/// number, the difference of its two log-likelihoods, with the noise of the better fit. The sum of them over its own
/// scatter has Student's distribution if both models are equally good. Unlike an F-test over all corners, this does not
/// take the corners of one picture as independent, which those of a real board are not. Each parameter that the other
/// model has `more` counts as half the logarithm of the number of points (Schwarz 1978).
fn is_better(views: &[ViewResult], better: &Calibrated, more: usize) -> Option<bool> {
    let variance_px2 = better.sigma_px * better.sigma_px;
    let mut count = 0_usize;
    let mut gain = |(one, other): (&ViewResult, &ViewResult)| {
        let both = one.residuals.iter().zip(&other.residuals).filter(|(a, b)| a.counts && b.counts);
        let square = |e: [f64; 2]| e[0] * e[0] + e[1] * e[1];
        let before = count;
        let sum: f64 = both.inspect(|_| count += 1).map(|(a, b)| square(a.error_px) - square(b.error_px)).sum();
        (count > before).then_some(sum / (2.0 * variance_px2))
    };
    let gains: Vec<f64> = views.iter().zip(&better.views).filter_map(&mut gain).collect();
    if gains.len() < FEWEST {
        return None;
    }
    let n = gains.len() as f64;
    let sum: f64 = gains.iter().sum();
    let variance = gains.iter().map(|g| (g - sum / n).powi(2)).sum::<f64>() / (n - 1.0);
    let price = 0.5 * more as f64 * (count as f64).ln();
    Some(sum - price > student(n - 1.0) * (n * variance).sqrt())
}

/// Returns the quantile of Student's distribution that one of 1000 exceeds, by the expansion of Cornish and Fisher
/// (Abramowitz and Stegun, equation 26.7.5): within 4 % from four degrees of freedom on.
fn student(freedom: f64) -> f64 {
    let z = ONE_IN_1000;
    let terms = [
        (z.powi(3) + z) / 4.0,
        (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0,
        (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0,
    ];
    terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom) + z
}

/// Raises the covariance of a lens so that its sigma is not below what its model cannot follow.
fn widen(calibrated: &mut Calibrated, misfit_px: f64) {
    let factor = misfit_px / calibrated.lens_sigma_px;
    if !(factor > 1.0) {
        return;
    }
    calibrated.lens_sigma_px *= factor;
    calibrated.corner_sigma_px *= factor;
    let rows = calibrated.camera.covariance.iter_mut().flat_map(|c| c.rows.iter_mut());
    rows.flat_map(|row| row.iter_mut()).for_each(|cell| *cell *= factor * factor);
}

#[cfg(test)]
mod tests {
    use super::student;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, quantile) in [(4.0, 7.173), (9.0, 4.297), (29.0, 3.396)] {
            assert!((student(freedom) / quantile - 1.0).abs() < 0.04, "{freedom}: {}", student(freedom));
        }
    }
}
