//! Edge noise of one picture from the residuals along its limb, by restricted maximum likelihood.
//!
//! The residuals are r = H δ + ε, with ε a Gauss-Markov process that has a white part: V = σ²[(1 − ν) e^(−Δs/L) + ν I].
//! With the three fitted parameters integrated out, −2 ln of the likelihood is (n − 3) ln(q/(n − 3)) + ln|V/σ²| +
//! ln|HᵀV⁻¹H|, with q = rᵀV⁻¹r after the fit and σ² = q/(n − 3). A Kalman filter along the points whitens r and the
//! columns of H in one pass. The likelihood of one picture is flat in L. Therefore the variance of the fit is averaged
//! over (L, ν), with a prior for L: a quarter of the arc, within a factor of two.

use hzn_core::covariance::{self, Noise};
use nalgebra::{Matrix3, Vector3};

use super::cone::{Cone, Row, decay};

/// Lengths L that are tried, in pixels.
pub(crate) const LENGTHS_PX: [f64; 10] = [2.5, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0, 1280.0];
/// White parts ν that are tried.
pub(crate) const WHITE: [f64; 7] = [0.0, 0.25, 0.5, 0.7, 0.85, 0.95, 0.99];
/// Centre of the prior of the length, as a fraction of the arc.
const PRIOR_LENGTH_ARC: f64 = 0.25;
/// 1-sigma of that prior, in the natural logarithm of the length.
const PRIOR_LENGTH_SIGMA: f64 = 0.7;
/// Number of steps from one pixel to the prior's centre in the search for the equivalent length.
const EQUIVALENT_STEPS: u32 = 40;
/// Correlation length of a sensor that measures the edge noise in each picture, as a fraction of the arc.
const SENSOR_ARC: f64 = 1.0 / 12.0;
/// Points with a smaller weight are skipped: at half weight they are about 2.7 sigma off.
const MIN_WEIGHT: f64 = 0.5;
/// Floor of the sigma of an edge point, in pixels.
pub(crate) const MIN_SIGMA_PX: f64 = 0.03;
/// Largest variance of a model, in mean squares of the residuals. The residuals do not support a larger one.
const MAX_VARIANCE: f64 = 4.0;

/// The result of one noise model for one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Score {
    /// −2 ln of the restricted likelihood, up to a constant.
    pub(crate) minus_two_ln_likelihood: f64,
    /// σ², px².
    pub(crate) variance_px2: f64,
}

/// The scores of every model of the grid for one picture, indexed by length and then by white part.
pub(crate) type Scores = [[Score; WHITE.len()]; LENGTHS_PX.len()];

/// Returns the scores of a picture's residuals; `None` if there are too few or all are zero.
pub(crate) fn score_models(cone: &Cone) -> Option<Scores> {
    let mut scores =
        [[Score { minus_two_ln_likelihood: f64::INFINITY, variance_px2: f64::NAN }; WHITE.len()]; LENGTHS_PX.len()];
    for (scores, length) in scores.iter_mut().zip(LENGTHS_PX) {
        let decays: Vec<f64> = cone.rows.iter().map(|r| decay(r.step_px, length)).collect();
        for (score, white) in scores.iter_mut().zip(WHITE) {
            *score = score_model(&cone.rows, &decays, white)?;
        }
    }
    Some(scores)
}

/// Returns the score of one model for one picture.
fn score_model(rows: &[Row], decays: &[f64], white: f64) -> Option<Score> {
    let freedom = rows.iter().filter(|r| r.weight >= MIN_WEIGHT).count() as f64 - 3.0;
    // The Kalman filter's prediction of the correlated part at the next point, for r and the three columns of H, and
    // the variance of that prediction in units of σ².
    let (mut predicted, mut spread) = ([0.0f64; 4], 1.0 - white);
    let (mut log_det, mut rr) = (0.0, 0.0);
    let (mut hr, mut hh) = (Vector3::zeros(), Matrix3::zeros());
    for (row, decay) in rows.iter().zip(decays) {
        if row.weight < MIN_WEIGHT {
            predicted = predicted.map(|x| x * decay);
            spread = decay * decay * spread + (1.0 - decay * decay) * (1.0 - white);
            continue;
        }
        let measured = [row.r_px, row.h.x, row.h.y, row.h.z];
        let variance = (spread + white).max(1e-12);
        let innovation: [f64; 4] = std::array::from_fn(|i| measured[i] - predicted[i]);
        log_det += variance.ln();
        let [r, x, y, z] = innovation;
        let h = Vector3::new(x, y, z);
        rr += r * r / variance;
        hr += h * (r / variance);
        hh += h * h.transpose() / variance;
        let gain = spread / variance;
        predicted = std::array::from_fn(|i| (predicted[i] + gain * innovation[i]) * decay);
        spread = decay * decay * spread * white / variance + (1.0 - decay * decay) * (1.0 - white);
    }
    let information = hh.cholesky()?;
    let q = rr - hr.dot(&information.solve(&hr));
    if !(q > 0.0 && freedom > 0.0) {
        return None;
    }
    let log_det_h: f64 = 2.0 * information.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    Some(Score {
        minus_two_ln_likelihood: freedom * (q / freedom).ln() + log_det + log_det_h,
        variance_px2: q / freedom,
    })
}

/// Returns the length that the sensor assumes for correlated errors, in pixels. Errors with a much shorter length are
/// as good as white.
pub(crate) fn window_px(arc_px: f64) -> f64 {
    let measured = covariance::Config { noise: Noise::Rms, correlation_px: 0.0, ..covariance::Config::default() };
    measured.measured(1.0, arc_px).correlation_px
}

/// Returns the shortest correlation length, in pixels, at which an exponential process with `sigma_px` gives the fitted
/// cos α at least this `variance`. If no length does, the result is the length with the largest variance.
pub(crate) fn equivalent_length_px(cone: &Cone, sigma_px: f64, variance: f64) -> f64 {
    let max_px = PRIOR_LENGTH_ARC * cone.arc_px();
    let mut nearest = (0.0, 0.0);
    for k in 0..=EQUIVALENT_STEPS {
        let length = max_px.powf(f64::from(k) / f64::from(EQUIVALENT_STEPS));
        let model_variance = cone.variance_of_cos(sigma_px, length, 0.0);
        if model_variance >= variance {
            return length;
        }
        if model_variance > nearest.1 {
            nearest = (length, model_variance);
        }
    }
    nearest.0
}

/// Returns the variance of the fitted cos α, averaged over the models by their likelihood. Its floor is the variance
/// for a correlation length of a twelfth of the arc, which is the sensor's default. The floor is needed because a
/// brightness that changes along the limb shifts the limb smoothly. The fit takes this error for curvature, so the
/// residuals do not show it.
pub(crate) fn variance_of_cos(cone: &Cone, scores: &Scores) -> f64 {
    let (arc, mean_square) = (cone.arc_px(), cone.rms_px().powi(2));
    let prior = |length: f64| {
        let deviation = (length / (PRIOR_LENGTH_ARC * arc)).ln() / PRIOR_LENGTH_SIGMA;
        deviation * deviation
    };
    let each = || {
        scores.iter().zip(LENGTHS_PX).flat_map(move |(scores, length)| {
            scores
                .iter()
                .zip(WHITE)
                .map(move |(score, white)| (score, length, white, score.minus_two_ln_likelihood + prior(length)))
        })
    };
    let min_cost = each().map(|(.., cost)| cost).fold(f64::INFINITY, f64::min);
    let (mut sum, mut total) = (0.0, 0.0);
    for (score, length, white, cost) in each() {
        let likely = (-0.5 * (cost - min_cost)).exp();
        if likely > 1e-6 {
            let variance = score.variance_px2.min(MAX_VARIANCE * mean_square).max(MIN_SIGMA_PX * MIN_SIGMA_PX);
            sum += likely * cone.variance_of_cos(variance.sqrt(), length, white);
            total += likely;
        }
    }
    (sum / total).max(cone.variance_of_cos(mean_square.sqrt(), SENSOR_ARC * arc, 0.0))
}
