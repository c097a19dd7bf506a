//! Limbs of bodies that were found before in the same picture.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// The limb of a body that was found before in the same picture.
pub(super) struct FoundLimb<T> {
    /// Axis of the limb in the camera frame, and the cosine of its half-angle.
    pub(super) e: V3<T>,
    pub(super) c: T,
}

/// Points within this many thresholds of another body's limb count as points on it, because the limb at other
/// brightness levels lies next to the limb that was found.
const TAKEN_THRESHOLDS: f64 = 3.0;

impl<T: Real> FoundLimb<T> {
    /// Removes the points on this limb and returns their number.
    pub(super) fn withdraw(&self, blocks: &mut [Block<T>], threshold_px: T) -> u32 {
        let limit = threshold_px * T::from_f64(TAKEN_THRESHOLDS);
        let mut count = 0;
        for block in blocks {
            for lane in 0..LANES {
                let [gu, gv] = block.gradient_at(lane, &self.e);
                let r = self.c - block.ray(lane).dot(&self.e);
                if block.weight[lane] > T::ZERO && r * r <= limit * limit * (gu * gu + gv * gv) {
                    block.clear(lane);
                    count += 1;
                }
            }
        }
        count
    }
}
