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

/// Half-angle of the Earth from half of the way to the Moon, degrees.
const NEAR_DEG: f64 = 1.9;

impl<T: Real> FoundLimb<T> {
    /// Returns whether this body hides a Sun or Moon in a direction. The Earth looks smaller than [`NEAR_DEG`] from
    /// beyond half of the way to the Moon; only from there the Moon can be in front of it.
    pub(super) fn hides(&self, direction: &V3<T>) -> bool {
        let (_, near) = T::from_f64(NEAR_DEG.to_radians()).sin_cos();
        self.c < near && self.e.dot(direction) > self.c
    }
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
