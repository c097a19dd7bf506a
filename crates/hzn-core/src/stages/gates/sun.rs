//! Gate: a part of the limb that the Sun does not light cannot be seen in its light.

use super::case::{Case, refuse_if};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::model::body::{Expected, LOWEST_SUN_DEG};
use crate::model::verdict::Verdict;

/// Refuses a limb of which the Sun lights too small a part.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let Case { fused, blocks, expected, config, .. } = *case;
    let unlit = unlit(&fused.e, fused.c, blocks, expected);
    refuse_if(unlit > T::from_f64(config.max_unlit), Verdict::Sun)
}

/// Returns the part of the inliers that the Sun does not light, 0 to 1. The result is 0 if the
/// direction of the Sun is unknown or the body shines by itself. The surface normal where the ray s touches the limb is
/// (s cos α − e)/sin α.
fn unlit<T: Real>(e: &V3<T>, c: T, blocks: &[Block<T>], expected: &Expected<T>) -> T {
    let Some(sun) = &expected.sun_seen else { return T::ZERO };
    let sin = (T::one() - c * c).max(T::from_f64(1e-12)).sqrt();
    let (lowest, _) = T::from_f64(LOWEST_SUN_DEG.to_radians()).sin_cos();
    let along = e.dot(sun);
    let (mut dark, mut all) = (0, 0);
    for block in blocks {
        for lane in 0..LANES {
            if block.weight[lane] > T::ZERO {
                all += 1;
                let high = (block.ray(lane).dot(sun) * c - along) / sin;
                dark += i32::from(high < lowest);
            }
        }
    }
    T::from_i32(dark) / T::from_i32(all.max(1))
}
