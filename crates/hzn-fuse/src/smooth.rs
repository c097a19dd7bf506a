//! The smoother of Rauch, Tung and Striebel (1965): the solution at every measurement from all measurements.
//!
//! It needs a filter that estimates every error: a considered error makes the gain of the filter less than optimal, and
//! the recursion would be wrong. With the state x⁺ₖ and covariance P⁺ₖ after the measurements at k, the transition Φ to
//! k + 1, and x⁻, P⁻ before the measurements there:
//!
//! C = P⁺ₖ Φᵀ (P⁻ₖ₊₁)⁻¹, xˢₖ = x⁺ₖ + C (xˢₖ₊₁ − x⁻ₖ₊₁), Pˢₖ = P⁺ₖ + C (Pˢₖ₊₁ − P⁻ₖ₊₁) Cᵀ.

use hzn_nav::filter::Filter;
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use crate::results::{Epoch, Unaided};

/// Most measurements that a smoother keeps; each takes 80 to 160 kB.
pub const MAX_EPOCHS: usize = 40_000;

/// A filter before and after a measurement.
#[derive(Debug, Clone)]
pub(crate) struct Recorded<const N: usize> {
    pub(crate) before: Filter<N>,
    pub(crate) after: Filter<N>,
    /// Transition from the measurement before.
    pub(crate) transition: SMatrix<f64, N, N>,
    /// Whether the filter began again here: nothing before is related.
    pub(crate) begins: bool,
    pub(crate) unaided: Option<Unaided>,
}

/// Returns the smoothed solution, in the order of time.
pub(crate) fn smooth<const N: usize>(recorded: &[Recorded<N>]) -> Vec<Epoch> {
    let mut out = Vec::with_capacity(recorded.len());
    let mut next: Option<(Filter<N>, &Recorded<N>)> = None;
    for here in recorded.iter().rev() {
        let smoothed = match &next {
            Some((smoothed, later)) if !later.begins => step(here, later, smoothed),
            _ => None,
        };
        let smoothed = smoothed.unwrap_or_else(|| here.after.clone());
        out.push(Epoch::of(&smoothed, here.unaided));
        next = Some((smoothed, here));
    }
    out.reverse();
    out
}

/// One step back; `None` if the covariance has no inverse.
fn step<const N: usize>(here: &Recorded<N>, later: &Recorded<N>, smoothed: &Filter<N>) -> Option<Filter<N>> {
    let n = here.after.layout().len;
    let part = |m: &SMatrix<f64, N, N>| m.view((0, 0), (n, n)).into_owned();
    let (p, transition) = (part(here.after.covariance()), part(&later.transition));
    let predicted = part(later.before.covariance());
    let inverse = scaled_inverse(&predicted)?;
    let gain = &p * transition.transpose() * inverse;
    let difference = smoothed.minus(&later.before);
    let difference = DVector::from_iterator(n, difference.iter().take(n).copied());
    let moved = &gain * difference;
    let mut error = SVector::<f64, N>::zeros();
    error.rows_mut(0, n).copy_from(&moved);
    let covariance = p + &gain * (part(smoothed.covariance()) - predicted) * gain.transpose();
    let mut whole = SMatrix::<f64, N, N>::zeros();
    whole.view_mut((0, 0), (n, n)).copy_from(&((&covariance + covariance.transpose()) * 0.5));
    Some(here.after.moved(&error, whole))
}

/// Returns the inverse of a covariance whose components have very different sizes. Components without an error have an
/// inverse of 0.
fn scaled_inverse(p: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = p.diagonal().map(|v| if v > 0.0 { 1.0 / v.sqrt() } else { 0.0 });
    let n = p.nrows();
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let c = p[(i, j)] * scale[i] * scale[j];
        // The slow error of a direction has almost no component along it.
        if i == j { 1.0 + 1e-11 } else { c }
    });
    let inverse = correlation.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
