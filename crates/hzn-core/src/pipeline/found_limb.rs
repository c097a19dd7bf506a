//! The limbs of bodies that were found in the same picture before.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};

/// The limb of a body that was found in the same picture before.
pub(super) struct FoundLimb<T> {
    /// Its axis, and the cosine of its half-angle.
    pub(super) e: V3<T>,
    pub(super) c: T,
}

/// Points within this many thresholds of another body's limb are on it: a limb's other levels lie beside it.
const TAKEN_THRESHOLDS: f64 = 3.0;

impl<T: Real> FoundLimb<T> {
    /// Takes out the points on this limb, and counts them.
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
