//! The equations of all pictures together, with the scatter of the limb height between pictures.
//!
//! The limb height of picture i is d + η_i with η ~ N(0, τ²). With the cost xᵀNx − 2bᵀx + c of a picture and its height
//! in row h, η is eliminated by N − N_h N_hᵀ/(N_hh + 1/τ²), and in the same way b and c. τ maximises the likelihood
//! with all unknowns integrated out: Σ ln(1 + τ² N_hh) + ln|A| + c − bᵀA⁻¹b is minimal, with A = ΣN plus the prior.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::layout::Layout;
use super::linear::Reduced;

/// Smallest and largest scatter that are tried, in kilometres, and the number of tries per factor of 10.
const MIN_SCATTER_KM: f64 = 1e-3;
const DECADES: i32 = 5;
const STEPS: i32 = 8;

/// A prior of the unknowns as normal equations.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PriorEquations {
    pub(super) information: DMatrix<f64>,
    pub(super) right: DVector<f64>,
}

impl PriorEquations {
    pub(super) fn new(unknowns: usize) -> Self {
        Self { information: DMatrix::zeros(unknowns, unknowns), right: DVector::zeros(unknowns) }
    }

    /// Adds a prior with this covariance for the unknowns from `first` on. `None` if the covariance is singular.
    pub(super) fn add(&mut self, first: usize, mean: &DVector<f64>, covariance: &DMatrix<f64>) -> Option<()> {
        // Rows of unit variance keep numbers of different units apart.
        let scale = DVector::from_iterator(mean.len(), covariance.diagonal().iter().map(|v| 1.0 / v.sqrt()));
        let scaled = DMatrix::from_fn(mean.len(), mean.len(), |i, j| covariance[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        let information = DMatrix::from_fn(mean.len(), mean.len(), |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let mut block = self.information.view_mut((first, first), (mean.len(), mean.len()));
        block += &information;
        let mut right = self.right.rows_mut(first, mean.len());
        right += information * mean;
        Some(())
    }

    /// Adds an independent prior with mean 0 and this sigma for one unknown.
    pub(super) fn add_zero(&mut self, place: usize, sigma: f64) {
        self.information[(place, place)] += 1.0 / (sigma * sigma);
    }
}

/// The solution for the unknowns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Solution {
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    /// Scatter of the limb height between pictures, in kilometres.
    pub(super) scatter_km: f64,
}

/// Solves for the unknowns with a known scatter.
pub(super) fn solve(pictures: &[&Reduced], prior: &PriorEquations, scatter_km: f64) -> Option<Solution> {
    let (factor, scale, right, ..) = factorise(pictures, prior, scatter_km)?;
    let n = right.len();
    let inverse = factor.inverse();
    let covariance = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
    let values = &covariance * right;
    values.iter().all(|x| x.is_finite()).then_some(Solution { values, covariance, scatter_km })
}

/// Solves for the unknowns and the scatter.
pub(super) fn solve_with_scatter(pictures: &[&Reduced], prior: &PriorEquations) -> Option<Solution> {
    let scored = |km: f64| cost(pictures, prior, km).map(|cost| (cost, km));
    let tries = (0..=DECADES * STEPS).map(|k| MIN_SCATTER_KM * 10f64.powf(f64::from(k) / f64::from(STEPS)));
    let best = std::iter::once(0.0).chain(tries).filter_map(scored).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (mut min, mut scatter_km) = best;
    let mut factor = 10f64.powf(1.0 / f64::from(STEPS));
    for _ in 0..8 {
        factor = factor.sqrt();
        for next in [scatter_km * factor, scatter_km / factor].into_iter().filter_map(scored) {
            if next.0 < min {
                (min, scatter_km) = next;
            }
        }
    }
    solve(pictures, prior, scatter_km)
}

/// Returns −2 ln of the likelihood of a scatter, up to a constant.
fn cost(pictures: &[&Reduced], prior: &PriorEquations, scatter_km: f64) -> Option<f64> {
    let (factor, scale, right, constant, log_det) = factorise(pictures, prior, scatter_km)?;
    let scaled = right.component_mul(&scale);
    let of_a: f64 = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>()
        - 2.0 * scale.iter().map(|s| s.ln()).sum::<f64>();
    let cost = log_det + of_a + constant - scaled.dot(&factor.solve(&scaled));
    cost.is_finite().then_some(cost)
}

/// The factor of S A S, the scale S, the right side b, the constant, and Σ ln(1 + τ² N_hh).
type Factorised = (Cholesky<f64, Dyn>, DVector<f64>, DVector<f64>, f64, f64);

fn factorise(pictures: &[&Reduced], prior: &PriorEquations, scatter_km: f64) -> Option<Factorised> {
    let (mut a, mut b) = (prior.information.clone(), prior.right.clone());
    let (mut constant, mut log_det) = (0.0, 0.0);
    let h = Layout::HEIGHT;
    for picture in pictures {
        a += &picture.information;
        b += &picture.right;
        constant += picture.constant;
        if scatter_km > 0.0 {
            let (column, own) = (picture.information.column(h), picture.information[(h, h)]);
            let gain = 1.0 / (own + 1.0 / (scatter_km * scatter_km));
            a.syger(-gain, &column, &column, 1.0);
            b.axpy(-gain * picture.right[h], &column, 1.0);
            constant -= gain * picture.right[h] * picture.right[h];
            log_det += (scatter_km * scatter_km * own).ln_1p();
        }
    }
    a.fill_upper_triangle_with_lower_triangle();
    let scale = DVector::from_iterator(a.nrows(), a.diagonal().iter().map(|d| 1.0 / d.max(1e-300).sqrt()));
    let scaled = DMatrix::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] * scale[i] * scale[j]);
    Some((scaled.cholesky()?, scale, b, constant, log_det))
}
