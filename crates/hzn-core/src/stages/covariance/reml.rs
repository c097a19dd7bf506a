//! Edge noise from the residuals of one fit, by restricted maximum likelihood.
//!
//! The fit has three parameters with the columns H. The residuals r of n points are modelled as a Gauss-Markov process
//! with a white part, V = σ² [(1 − ν) exp(−Δs/L) + ν I]. A fitted autocovariance would be biased, because the fit has
//! removed the longest wavelengths. The likelihood of the part that is orthogonal to H has no bias:
//!
//! −2 ℓ = (n − 3) ln(q/(n − 3)) + ln|V/σ²| + ln|Hᵀ(V/σ²)⁻¹H|, σ² = q/(n − 3),
//!
//! where q is the sum of squares of generalised least squares. A scalar Kalman filter along the edge with the columns
//! (r, H) gives all terms in one pass. The likelihood of one picture says little about L: a tenth of L and ten times L
//! are nearly as likely as L. The covariance is therefore averaged over the posterior with the prior
//! ln L ~ N(ln(arc/4), 0.7²). A flat prior would make the sigma of a disc three times too large, and without a white
//! part the process would have an L of a few pixels.

use super::gauss_markov::correlated;
use crate::base::linalg::{basis, invert_spd3};
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::cone::Azimuth;
use crate::model::body::Expected;
use crate::stages::fit::Fit;

/// One point of an edge, in the order of the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Distance from the previous point along the edge, in pixels.
    pub step_px: f64,
    /// Residual: the distance from the fitted limb, in pixels.
    pub residual_px: f64,
    /// Derivatives of the residual by the three fitted parameters, in any units and about any means.
    pub columns: [f64; 3],
}

/// Likelihood of one noise model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Likelihood {
    /// −2 ln of the restricted likelihood at the best sigma, except for a constant that depends only on the rows.
    pub minus_two_ln: f64,
    /// The best variance, px².
    pub variance_px2: f64,
    /// Number of points minus the number of fitted parameters.
    pub freedoms: f64,
}

/// Computes the restricted likelihood of the correlation length (in pixels, above 0) and the white part ν (0 to 1). The
/// result is `None` if there are too few rows, or if the columns cannot separate the three parameters.
pub fn likelihood(rows: impl IntoIterator<Item = Row>, length_px: f64, white: f64) -> Option<Likelihood> {
    let alike = 1.0 - white;
    // Estimate of the correlated part for each column, and its variance.
    let (mut state, mut variance) = ([0.0; 4], alike);
    let (mut sums, mut ln_v, mut n) = ([[0.0; 4]; 4], 0.0, 0.0);
    for row in rows {
        let rho = libm::exp(-row.step_px / length_px);
        // The first point has no point before it, therefore it carries nothing over.
        let rho = if n > 0.0 { rho } else { 0.0 };
        variance = rho * rho * variance + (1.0 - rho * rho) * alike;
        // Two points at one place with ν = 0 have no variance of their own; the floor avoids a division by 0.
        let total = (variance + white).max(1e-12);
        let (gain, weight) = (variance / total, 1.0 / total);
        let [a, b, c] = row.columns;
        let mut new = [row.residual_px, a, b, c];
        for (new, state) in new.iter_mut().zip(&mut state) {
            *state *= rho;
            *new -= *state;
            *state += gain * *new;
        }
        for (sums, x) in sums.iter_mut().zip(new) {
            for (sum, y) in sums.iter_mut().zip(new) {
                *sum += x * y * weight;
            }
        }
        variance *= 1.0 - gain;
        ln_v += libm::log(total);
        n += 1.0;
    }
    let [[rr, r1, r2, r3], [_, n11, n12, n13], [_, _, n22, n23], [_, _, _, n33]] = sums;
    let inverse = invert_spd3(&[n11, n12, n13, n22, n23, n33])?;
    let right = nalgebra::Vector3::new(r1, r2, r3);
    let q = rr - right.dot(&(inverse * right));
    let freedoms = n - 3.0;
    // The value is positive, because the inverse exists.
    let cofactors = [n22 * n33 - n23 * n23, n23 * n13 - n12 * n33, n12 * n23 - n22 * n13];
    let ln_h = libm::log(n11 * cofactors[0] + n12 * cofactors[1] + n13 * cofactors[2]);
    let variance_px2 = q / freedoms;
    let minus_two_ln = freedoms * libm::log(variance_px2) + ln_v + ln_h;
    (freedoms > 0.0 && minus_two_ln.is_finite()).then_some(Likelihood { minus_two_ln, variance_px2, freedoms })
}

/// Correlation lengths in the average, in standard deviations of ln L.
const LENGTHS: [f64; 7] = [-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5];
/// Standard deviation of ln L.
// A flat prior made the sigma of a disc three times too large.
const SPREAD: f64 = 0.7;
/// Ratio of the edge length to the most likely L.
const LENGTHS_PER_EDGE: f64 = 4.0;
/// White parts in the average.
// Without a white part the likelihood chose an L of some 5 px in most scenes, and sigma was far too small.
const WHITES: [f64; 6] = [0.0, 0.2, 0.4, 0.6, 0.8, 0.95];
/// Largest ratio of sigma to the RMS of the residuals. It limits processes with a very long correlation length: they
/// hardly vary along the edge, so that any sigma would be possible.
const MOST_RMS: f64 = 2.0;

/// A noise model with its weight.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Model {
    /// Correlation length, in pixels.
    pub length_px: f64,
    /// White part of the variance, 0 to 1.
    pub white: f64,
    /// Variance of a point, px².
    pub variance_px2: f64,
    /// Posterior probability; the sum over all models is 1.
    pub weight: f64,
}

/// The posterior of an edge's noise over a grid of correlation lengths and white parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// Noise models, by correlation length and then by white part.
    pub models: [[Model; WHITES.len()]; LENGTHS.len()],
}

impl Posterior {
    /// Computes the posterior from the rows of an edge of the length `arc_px`, with the RMS `rms_px` of its residuals.
    /// Sigma is between `floor_px` and twice the RMS. The result is `None` in the same cases as for [`likelihood`].
    pub fn new<R: IntoIterator<Item = Row>>(
        rows: impl Fn() -> R,
        arc_px: f64,
        rms_px: f64,
        floor_px: f64,
    ) -> Option<Self> {
        let mut models = [[Model::default(); WHITES.len()]; LENGTHS.len()];
        let mut least = f64::INFINITY;
        let most = MOST_RMS * MOST_RMS * rms_px * rms_px;
        for (models, z) in models.iter_mut().zip(LENGTHS) {
            let length_px = arc_px / LENGTHS_PER_EDGE * libm::exp(SPREAD * z);
            for (model, white) in models.iter_mut().zip(WHITES) {
                let found = likelihood(rows(), length_px, white)?;
                let minus_two_ln = found.minus_two_ln + z * z;
                least = least.min(minus_two_ln);
                let variance_px2 = found.variance_px2.min(most).max(floor_px * floor_px);
                *model = Model { length_px, white, variance_px2, weight: minus_two_ln };
            }
        }
        let mut total = 0.0;
        for model in models.iter_mut().flatten() {
            // The smallest value is subtracted first, because the exponential of a likelihood of hundreds of points is
            // 0.
            model.weight = libm::exp(0.5 * (least - model.weight));
            total += model.weight;
        }
        models.iter_mut().flatten().for_each(|model| model.weight /= total);
        Some(Self { models })
    }

    /// Returns the posterior mean of a function of the model.
    pub fn mean(&self, f: impl Fn(&Model) -> f64) -> f64 {
        self.models.iter().flatten().map(|model| model.weight * f(model)).sum()
    }
}

/// Returns the covariance of the right-hand side of the normal equations, averaged over the posterior, as its upper
/// triangle.
pub(super) fn averaged<T: Real>(
    blocks: &[Block<T>],
    fit: &Fit<T>,
    expected: &Expected<T>,
    floor_px: f64,
) -> Option<[T; 6]> {
    let (b1, b2) = basis(&fit.e);
    let azimuth = expected.azimuth();
    let rows = || rows(blocks, fit, azimuth.as_ref());
    let posterior = Posterior::new(rows, fit.arc_px.to_f64(), fit.rms_px.to_f64(), floor_px)?;
    let of_length = |length_px: f64| correlated(blocks, &fit.e, &b1, &b2, fit.mean, T::from_f64(length_px));
    let mut x = [T::ZERO; 6];
    let mut add = |part: [T; 6], variance: f64| {
        for (x, part) in x.iter_mut().zip(part) {
            *x += part * T::from_f64(variance);
        }
    };
    // The white parts of all models are added up first, because their sum over pairs does not depend on L.
    add(of_length(0.0), posterior.mean(|m| m.variance_px2 * m.white));
    for models in &posterior.models {
        let length_px = models.first()?.length_px;
        let variance = models.iter().map(|m| m.weight * m.variance_px2 * (1.0 - m.white)).sum();
        add(of_length(length_px), variance);
    }
    Some(x)
}

/// Returns the rows of the inliers of a fit.
fn rows<T: Real>(blocks: &[Block<T>], fit: &Fit<T>, azimuth: Option<&Azimuth<T>>) -> impl Iterator<Item = Row> {
    let (b1, b2) = basis(&fit.e);
    let (e, c, [m1, m2]) = (fit.e, fit.c, fit.mean);
    let mut since = 0.0;
    blocks.iter().flat_map(|b| (0..LANES).map(move |l| (b, l))).filter_map(move |(block, l)| {
        since += block.step_px.get(l).map_or(0.0, |step| step.to_f64());
        let [gu, gv] = block.gradient_at(l, &e);
        let g = (gu * gu + gv * gv).sqrt();
        let counts = block.weight.get(l).is_some_and(|w| *w > T::ZERO) && g > T::ZERO;
        counts.then(|| {
            let s = block.ray(l);
            let d = s.dot(&e);
            let r = c - d + azimuth.map_or(T::ZERO, |a| a.offset([s.x, s.y, s.z], d, a.east.dot(&e)));
            let row = Row {
                step_px: since,
                residual_px: (r / g).to_f64(),
                columns: [(s.dot(&b1) - m1) / g, (s.dot(&b2) - m2) / g, -T::one() / g].map(Real::to_f64),
            };
            since = 0.0;
            row
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use std::vec::Vec;

    /// Draws a Gauss-Markov process with a white part along a straight edge, and subtracts a fitted parabola.
    fn drawn(seed: u32, sigma: f64, length: f64, white: f64) -> Vec<Row> {
        let mut rng = Rng::new(seed);
        let mut normal = || (0..12).map(|_| f64::from(rng.below(1 << 20)) / f64::from(1 << 20)).sum::<f64>() - 6.0;
        let n = 500;
        let rho = libm::exp(-2.0 / length);
        let mut alike = normal();
        let mut rows: Vec<Row> = (0..n)
            .map(|i| {
                alike = rho * alike + libm::sqrt(1.0 - rho * rho) * normal();
                let error = sigma * (libm::sqrt(1.0 - white) * alike + libm::sqrt(white) * normal());
                let x = f64::from(i) / f64::from(n) * 2.0 - 1.0;
                Row { step_px: 2.0, residual_px: error, columns: [x, x * x, 1.0] }
            })
            .collect();
        let mut n6 = [0.0; 6];
        let mut right = nalgebra::Vector3::zeros();
        for row in &rows {
            let [a, b, c] = row.columns;
            for (sum, term) in n6.iter_mut().zip([a * a, a * b, a * c, b * b, b * c, c * c]) {
                *sum += term;
            }
            right += nalgebra::Vector3::new(a, b, c) * row.residual_px;
        }
        let d = invert_spd3(&n6).unwrap() * right;
        for row in &mut rows {
            let [a, b, c] = row.columns;
            row.residual_px -= a * d.x + b * d.y + c * d.z;
        }
        rows
    }

    #[test]
    fn the_filter_is_the_dense_likelihood() {
        let rows: Vec<Row> = drawn(3, 0.2, 40.0, 0.3).into_iter().step_by(9).collect();
        let rows: Vec<Row> = rows.into_iter().map(|row| Row { step_px: 18.0, ..row }).collect();
        let n = rows.len();
        for (length, white) in [(20.0, 0.0), (80.0, 0.4), (500.0, 0.9)] {
            let v = nalgebra::DMatrix::from_fn(n, n, |i, j| {
                let alike = (1.0 - white) * libm::exp(-18.0 * (i as f64 - j as f64).abs() / length);
                if i == j { alike + white } else { alike }
            });
            let h = nalgebra::DMatrix::from_fn(n, 3, |i, j| rows[i].columns[j]);
            let r = nalgebra::DVector::from_fn(n, |i, _| rows[i].residual_px);
            let inverse = v.clone().try_inverse().unwrap();
            let normal = h.transpose() * &inverse * &h;
            let d = normal.clone().try_inverse().unwrap() * h.transpose() * &inverse * &r;
            let left = &r - &h * d;
            let q = (left.transpose() * &inverse * &left)[(0, 0)];
            let freedoms = n as f64 - 3.0;
            let want = freedoms * libm::log(q / freedoms) + v.determinant().ln() + normal.determinant().ln();
            let got = likelihood(rows.iter().copied(), length, white).unwrap();
            assert!((got.minus_two_ln - want).abs() < 1e-6 * want.abs(), "{length} {white}: {got:?} {want}");
            assert!((got.variance_px2 / (q / freedoms) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn sigma_of_drawn_noise_comes_back() {
        for (white, low, high) in [(0.0, 0.6, 1.8), (0.5, 0.6, 1.9), (0.7, 0.6, 2.1)] {
            let ratios: Vec<f64> = (0..12)
                .map(|seed| {
                    let rows = drawn(seed + 1, 0.1, 100.0, white);
                    let rms = libm::sqrt(rows.iter().map(|r| r.residual_px * r.residual_px).sum::<f64>() / 500.0);
                    let posterior = Posterior::new(|| rows.iter().copied(), 1000.0, rms, 0.0).unwrap();
                    let weights: f64 = posterior.models.iter().flatten().map(|m| m.weight).sum();
                    assert!((weights - 1.0).abs() < 1e-12);
                    libm::sqrt(posterior.mean(|m| m.variance_px2)) / 0.1
                })
                .collect();
            let mean = ratios.iter().sum::<f64>() / 12.0;
            assert!(mean > low && mean < high, "{white}: {ratios:?}");
        }
    }

    #[test]
    fn too_few_rows_say_nothing() {
        let rows = drawn(1, 0.1, 50.0, 0.0);
        assert_eq!(likelihood(rows.iter().take(2).copied(), 50.0, 0.0), None);
        assert_eq!(likelihood([], 50.0, 0.0), None);
    }
}
