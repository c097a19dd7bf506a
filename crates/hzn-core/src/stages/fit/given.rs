//! The fit at a given cone: its normal equations and statistics, with the weights that the points have.

use super::cone::{Cone, State};
#[cfg(any(test, feature = "_edges"))]
use super::cone::{Fit, count_points};
use super::sums::{Weights, means, pass};
use crate::base::linalg::{V3, basis, unit};
use crate::base::real::Real;
use crate::geometry::block::Block;
#[cfg(any(test, feature = "_edges"))]
use crate::geometry::scaling::Scaling;

/// Returns the fit at a given cone, with the weights that the points have.
#[cfg(any(test, feature = "_edges"))]
pub(crate) fn fit_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, c: T) -> Option<Fit<T>> {
    let cone = cone_at(blocks, e, T::one() - c)?;
    Some(count_points(blocks, cone))
}

/// Fits axis and half-angle of a position with the weights that the points have, from a start: axis and 1 − cos of the
/// half-angle.
#[cfg(any(test, feature = "_edges"))]
pub(crate) fn fit_position_from<T: Real>(
    blocks: &mut [Block<T>],
    (e, k): (V3<T>, T),
    scaling: &Scaling<T>,
) -> Option<Fit<T>> {
    let start = cone_at(blocks, e, k)?.at;
    let cone = super::angle::settle(blocks, start, None, scaling)?;
    Some(count_points(blocks, cone))
}

/// Returns a cone, given by axis and 1 − cos of the half-angle, with the normal equations at it.
pub(super) fn cone_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, k: T) -> Option<Cone<T>> {
    let e = unit(&e)?;
    // Outside of these limits no angle has this cosine; the comparison also refuses NaN.
    if !(k > T::ZERO && k < T::from_f64(2.0)) {
        return None;
    }
    let (b1, b2) = basis(&e);
    let mean = means(blocks, &b1, &b2);
    let sums = pass(blocks, &e, &b1, &b2, k, mean, &Weights::Kept, None);
    // This test also refuses NaN.
    (sums.weight > T::from_f64(2.5) && sums.cost >= T::ZERO).then_some(Cone {
        at: State { e, k, mean, nearby: 0 },
        mean,
        sums,
        free: true,
        quadric: None,
    })
}
