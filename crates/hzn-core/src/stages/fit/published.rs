//! Fits by the methods of published systems, with the normal equations of the default method at the cone that they
//! find.

use super::cone::Cone;
use super::given::cone_at;
use super::quadric::Quadric;
use super::sums::Sums;
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::stages::consensus::Consensus;

/// Fits the cone by another method, `find`, and adds the normal equations at this cone. Weights, gates and covariance
/// are therefore the same as for the default method. The method uses the points within `threshold_px` of the consensus,
/// or all points if `start.all` is set. `find` receives the blocks with weights 0 and 1, and returns the axis and 1 −
/// cos of the half-angle.
pub(super) fn fit_by<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    threshold_px: T,
    find: impl FnOnce(&[Block<T>]) -> Option<(V3<T>, T)>,
) -> Option<Cone<T>> {
    // These methods have no robust weights, so that outliers must be left out before.
    if !start.all {
        let limit2 = threshold_px * threshold_px;
        for b in blocks.iter_mut() {
            let g = b.gradient(&start.e);
            for l in 0..LANES {
                let r = start.c - b.ray(l).dot(&start.e);
                if !(r * r <= limit2 * (g[0][l] * g[0][l] + g[1][l] * g[1][l])) {
                    b.weight[l] = T::ZERO;
                }
            }
        }
    }
    let (e, k) = find(blocks)?;
    cone_at(blocks, e, k)
}

/// Largest possible angle between the axis and the optical axis, in radians.
pub(super) const HALF_TURN_RAD: f64 = core::f64::consts::PI;

/// Fits an elliptic cone to the points. `rms_px` uses the distances from this cone, and the covariance comes from
/// `quadric`.
pub(super) fn elliptic<T: Real>(
    blocks: &mut [Block<T>],
    start: &Consensus<T>,
    threshold_px: T,
    weigh_above_rad: f64,
) -> Option<Cone<T>> {
    let mut quadric = None;
    let cone = fit_by(blocks, start, threshold_px, |blocks| {
        let found = Quadric::fit(blocks, T::from_f64(weigh_above_rad))?;
        quadric = Some(found);
        Some((found.e, T::one() - found.c))
    })?;
    let found = quadric?;
    // The distances are those from the elliptic cone, because distances from a circular one would count its ellipticity
    // as noise.
    let sums = Sums { weight: found.weight, cost: found.cost, ..cone.sums };
    Some(Cone { sums, quadric, ..cone })
}
