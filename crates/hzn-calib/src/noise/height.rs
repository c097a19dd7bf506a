//! Estimates one limb height from many measurements, with the scatter that their errors do not explain.
//!
//! The model is d_i = A_i h + η_i + ε_i, with known variances s_i² of ε and an unknown variance τ² of η. The restricted
//! likelihood is maximal where Σ ln(s_i² + τ²) + ln|AᵀWA| + Σ w_i (d_i − A_i ĥ)² is minimal over τ, with
//! w = 1/(s² + τ²). Where the known variances explain the heights, this minimum is at τ = 0, although the heights only
//! say that τ is smaller than its own standard error. The likelihood is therefore multiplied by τ, which adds −ln τ² to
//! the sum: τ is then about one standard error where the likelihood alone has its maximum at 0, and changes little
//! elsewhere (Chung et al. 2013, Psychometrika 78, 685).

use nalgebra::{DMatrix, DVector};

use crate::quantile;

/// Largest 1-sigma of a limb height from the pictures' own errors, in kilometres: half of the sigma that a sensor
/// assumes for an unmeasured limb.
pub(super) const MAX_SIGMA_KM: f64 = 3.5;

/// A measured height.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measured {
    /// Measured height, in kilometres.
    pub(super) km: f64,
    /// Variance of the height from edge noise alone, in km².
    pub(super) variance_km2: f64,
    /// Row A_i: the weights of the parameters in this height.
    pub(super) weights: Vec<f64>,
}

/// The fitted parameters with their covariance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Solved {
    /// Parameters h.
    pub(super) h: DVector<f64>,
    /// Covariance of the parameters, including the scatter.
    pub(super) covariance: DMatrix<f64>,
    /// Variance τ² of the scatter, in the parameters' unit squared.
    pub(super) scatter2: f64,
    /// −2 ln of the (not restricted) likelihood at the solution, for the comparison of models with different
    /// parameters.
    pub(super) minus_two_ln_likelihood: f64,
    /// Mean square of the residuals over their own variances, without the scatter: χ² per degree of freedom.
    pub(super) chi2: f64,
    /// Largest one without an alarm, for this number of measurements and parameters.
    pub(super) max_chi2: f64,
}

/// Number of values of τ that are tried per decade.
const STEPS: i32 = 8;

/// Fits the parameters. The result is `None` if the measurements do not determine them.
pub(super) fn solve(all: &[Measured]) -> Option<Solved> {
    let parameters = all.first()?.weights.len();
    let freedom = all.len().checked_sub(parameters).filter(|n| *n > 0)?;
    let mean_variance_km2 = all.iter().map(|m| m.variance_km2).sum::<f64>() / all.len() as f64;
    let tries = (-3 * STEPS..=3 * STEPS).map(|k| mean_variance_km2 * 10f64.powf(2.0 * f64::from(k) / f64::from(STEPS)));
    let scored =
        |scatter2: f64| solve_with_scatter(all, scatter2).map(|found| (found.restricted - scatter2.ln(), scatter2));
    let best = tries.filter_map(scored).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let scatter2 = refine(best, &scored);
    let found = solve_with_scatter(all, scatter2)?;
    let without_scatter = solve_with_scatter(all, 0.0)?;
    Some(Solved {
        h: found.h,
        covariance: found.covariance,
        scatter2,
        minus_two_ln_likelihood: found.minus_two_ln_likelihood,
        chi2: without_scatter.square / freedom as f64,
        max_chi2: quantile::max_mean_square(freedom),
    })
}

/// Refines the best τ² by 12 halvings of its logarithmic step.
fn refine((mut min, mut scatter2): (f64, f64), scored: &dyn Fn(f64) -> Option<(f64, f64)>) -> f64 {
    let mut factor = 10f64.powf(2.0 / f64::from(STEPS));
    for _ in 0..12 {
        factor = factor.sqrt();
        for next in [scatter2 * factor, scatter2 / factor].into_iter().filter_map(scored) {
            if next.0 < min {
                (min, scatter2) = next;
            }
        }
    }
    scatter2
}

/// The weighted solution for one value of τ².
struct WeightedSolution {
    h: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Σ w (d − A h)².
    square: f64,
    minus_two_ln_likelihood: f64,
    /// −2 ln of the restricted likelihood.
    restricted: f64,
}

/// Solves for the parameters with a known variance τ² of the scatter.
fn solve_with_scatter(all: &[Measured], scatter2: f64) -> Option<WeightedSolution> {
    let parameters = all.first()?.weights.len();
    let (mut normal, mut right) = (DMatrix::zeros(parameters, parameters), DVector::zeros(parameters));
    let mut log_variances = 0.0;
    for m in all {
        let (row, variance) = (DVector::from_column_slice(&m.weights), m.variance_km2 + scatter2);
        normal += &row * row.transpose() / variance;
        right += row * (m.km / variance);
        log_variances += variance.ln();
    }
    let information = normal.cholesky()?;
    let h = information.solve(&right);
    let residual = |m: &Measured| m.km - m.weights.iter().zip(h.iter()).map(|(a, h)| a * h).sum::<f64>();
    let square = all.iter().map(|m| residual(m).powi(2) / (m.variance_km2 + scatter2)).sum::<f64>();
    let log_det: f64 = 2.0 * information.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let minus_two_ln_likelihood = log_variances + square;
    let restricted = minus_two_ln_likelihood + log_det;
    (restricted.is_finite()).then(|| WeightedSolution {
        covariance: information.inverse(),
        h,
        square,
        minus_two_ln_likelihood,
        restricted,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;

    fn measured(values: &[(f64, f64)]) -> Vec<Measured> {
        values.iter().map(|&(km, sigma)| Measured { km, variance_km2: sigma * sigma, weights: vec![1.0] }).collect()
    }

    #[test]
    fn without_scatter_it_is_the_weighted_mean() {
        let found = solve(&measured(&[(10.0, 1.0), (10.2, 1.0), (12.0, 10.0), (9.9, 1.0)])).unwrap();
        let weight = 3.0 + 0.01;
        assert!((found.h[0] - (10.0 + 10.2 + 9.9 + 0.12) / weight).abs() < 0.02, "{found:?}");
        // The scatter is about its own standard error: it hardly changes the mean.
        assert!((0.3..1.5).contains(&found.scatter2), "{found:?}");
        assert!((1.0..2.5).contains(&(found.covariance[(0, 0)] * weight)) && found.chi2 < 0.1);
    }

    #[test]
    fn scatter_is_found_where_errors_do_not_explain_it() {
        // ±3 about 20, with errors of 0.1: almost pure scatter.
        let values: Vec<(f64, f64)> = (0..40).map(|i| (if i % 2 == 0 { 17.0 } else { 23.0 }, 0.1)).collect();
        let found = solve(&measured(&values)).unwrap();
        assert!((found.scatter2.sqrt() - 3.0).abs() < 0.1, "{found:?}");
        assert!((found.h[0] - 20.0).abs() < 1e-9);
        assert!((found.covariance[(0, 0)].sqrt() - 3.0 / 40f64.sqrt()).abs() < 0.02);
        assert!(found.chi2 > 800.0);
    }

    /// Right flights raise an alarm in 0.27 % of all cases, whatever the number of their pictures is. With the limit
    /// of a long flight, 2, more than two of a hundred flights of 12 pictures would.
    #[test]
    fn few_right_heights_raise_no_alarm_more_often_than_many() {
        const FLIGHTS: u32 = 20_000;
        let mut draws = Draws(77);
        for (pictures, rows) in [(12, 1), (12, 2), (20, 3), (40, 1)] {
            let (mut alarms, mut above_two) = (0, 0);
            for _ in 0..FLIGHTS {
                let one = |k: usize, draws: &mut Draws| {
                    let sigma = 0.5 + draws.uniform();
                    let weights = (0..rows).map(|row| f64::from(u8::from(k % rows == row))).collect();
                    Measured { km: 20.0 + sigma * draws.normal(), variance_km2: sigma * sigma, weights }
                };
                let all: Vec<Measured> = (0..pictures).map(|k| one(k, &mut draws)).collect();
                let parameters = all[0].weights.len();
                let square = solve_with_scatter(&all, 0.0).unwrap().square / (pictures - parameters) as f64;
                alarms += u32::from(square > quantile::max_mean_square(pictures - parameters));
                above_two += u32::from(square > 2.0);
            }
            let [share, before] = [alarms, above_two].map(|n| 100.0 * f64::from(n) / f64::from(FLIGHTS));
            println!("{pictures} pictures, {rows} rows: {share:.2} % alarms, {before:.2} % above 2");
            assert!(share < 0.4 && (pictures > 25 || share > 0.15), "{pictures}: {share} %");
            assert!(pictures > 12 || before > 1.5, "{pictures}: {before} %");
        }
        // The solution has the limit of its own number of pictures and parameters.
        let few = solve(&measured(&[(10.0, 1.0), (12.0, 1.0), (11.0, 1.0)])).unwrap();
        assert_eq!(few.max_chi2, quantile::max_mean_square(2));
    }

    #[test]
    fn too_few_or_blind_measurements_say_nothing() {
        assert!(solve(&measured(&[(10.0, 1.0)])).is_none());
        let blind: Vec<Measured> =
            (0..5).map(|_| Measured { km: 1.0, variance_km2: 1.0, weights: vec![0.5, 0.5] }).collect();
        assert!(solve(&blind).is_none());
    }
}
