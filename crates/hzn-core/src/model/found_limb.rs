//! Limbs of bodies that were found before in the same picture.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::pixel::ImagePoint;
use crate::geometry::scaling::ScaledCone;
use crate::model::report::Solution;

/// The limb of a body that was found before in the same picture.
pub(crate) struct FoundLimb<T> {
    /// Axis of the limb in the camera frame, and the cosine of its half-angle.
    e: V3<T>,
    c: T,
    /// The limb in scaled space, if the position of the body was fitted.
    scaled: Option<ScaledCone<T>>,
}

/// Points within this many thresholds of another body's limb count as points on it, because the limb at other
/// brightness levels lies next to the limb that was found.
const TAKEN_THRESHOLDS: f64 = 3.0;

/// Half-angle of the Earth from half of the way to the Moon, degrees.
const NEAR_DEG: f64 = 1.9;

impl<T: Real> FoundLimb<T> {
    /// Takes the limb of an answer.
    pub(crate) fn new(solution: &Solution<T>) -> Self {
        Self {
            e: *solution.axis.v(),
            // The fused half-angle is used and not the fitted one, because it is the better one on a short arc.
            c: solution.fused_half_angle_rad.sin_cos().1,
            scaled: solution.position.as_ref().map(|position| position.limb),
        }
    }
    /// Makes a limb that is circular in the camera frame.
    #[cfg(any(test, feature = "_edges"))]
    pub(crate) fn circular(e: V3<T>, c: T) -> Self {
        Self { e, c, scaled: None }
    }
    /// Returns whether this body hides a Sun or Moon in a direction. The Earth looks smaller than [`NEAR_DEG`] from
    /// beyond half of the way to the Moon; only from there the Moon can be in front of it.
    pub(crate) fn hides(&self, direction: &V3<T>) -> bool {
        let (_, near) = T::from_f64(NEAR_DEG.to_radians()).sin_cos();
        self.c < near && self.e.dot(direction) > self.c
    }
    /// Removes the points on this limb and returns their number. The points are rays of `camera`.
    pub(crate) fn withdraw(&self, blocks: &mut [Block<T>], camera: &Camera<T>, threshold_px: T) -> u32 {
        let limit = threshold_px * T::from_f64(TAKEN_THRESHOLDS);
        let mut count = 0;
        for block in blocks {
            for lane in 0..LANES {
                let (r, gradient) = self.offset(&block.ray(lane), camera);
                let [gu, gv] = block.gradient_at(lane, &gradient);
                // Squares are compared, so that no point needs a root or a division.
                if block.weight[lane] > T::ZERO && r * r <= limit * limit * (gu * gu + gv * gv) {
                    block.clear(lane);
                    count += 1;
                }
            }
        }
        count
    }

    /// Returns whether an image point of `camera` is within `limit_px` of this limb.
    pub(crate) fn is_within(&self, limit_px: T, point: ImagePoint<T>, camera: &Camera<T>) -> bool {
        camera.ray(point).is_some_and(|ray| {
            let (r, gradient) = self.offset(&ray.s, camera);
            let [x, y, z] = ray.jacobian();
            let by = |k: usize| x[k & 1] * gradient.x + y[k & 1] * gradient.y + z[k & 1] * gradient.z;
            let (gu, gv) = (by(0), by(1));
            r * r <= limit_px * limit_px * (gu * gu + gv * gv)
        })
    }

    /// Returns cos α − s·e for a ray of `camera`, and the vector v with d(s·e) = v·ds.
    #[inline(always)]
    fn offset(&self, ray: &V3<T>, camera: &Camera<T>) -> (T, V3<T>) {
        // The rays of the two bodies may be in different scaled spaces; without positions one product is enough.
        if cfg!(feature = "position") && (self.scaled.is_some() || camera.scaling().is_some()) {
            let limb = self.scaled.unwrap_or(ScaledCone { e: self.e, c: self.c, scaling: None });
            return limb.offset_from(ray, camera.scaling());
        }
        (self.c - ray.dot(&self.e), self.e)
    }
}
