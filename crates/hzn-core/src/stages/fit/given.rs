//! The fit at a given cone: its normal equations and statistics, with the weights that the points have.

use super::cone::{Cone, State};
#[cfg(any(test, feature = "_edges"))]
use super::cone::{Fit, count_points};
use super::sums::{Weights, means, pass};
use crate::base::linalg::{V3, basis, unit};
use crate::base::real::Real;
use crate::geometry::block::Block;

/// Returns the fit at a given cone, with the weights that the points have.
#[cfg(any(test, feature = "_edges"))]
#[allow(dead_code, reason = "behind a feature")]
pub(crate) fn fit_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, c: T) -> Option<Fit<T>> {
    let cone = cone_at(blocks, e, c)?;
    Some(count_points(blocks, cone))
}

/// Returns a cone with the normal equations at it.
pub(super) fn cone_at<T: Real>(blocks: &mut [Block<T>], e: V3<T>, c: T) -> Option<Cone<T>> {
    let e = unit(&e)?;
    if !(c.abs() < T::one()) {
        return None;
    }
    let (b1, b2) = basis(&e);
    let mean = means(blocks, &b1, &b2);
    let sums = pass(blocks, &e, &b1, &b2, T::one() - c, mean, &Weights::Kept, None);
    // This test also refuses NaN.
    (sums.weight > T::from_f64(2.5) && sums.cost >= T::ZERO).then_some(Cone {
        at: State { e, k: T::one() - c, mean, nearby: 0 },
        mean,
        sums,
        free: true,
        #[cfg(feature = "zju")]
        quadric: None,
    })
}
