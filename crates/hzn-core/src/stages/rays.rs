//! Converts image points to unit rays with their derivatives, and computes the distances along the edge.

use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::pixel::ImagePoint;

/// Converts the points of `blocks` to rays in the camera frame, in place. A point beyond the image circle gets weight
/// 0.
pub(crate) fn to_rays<T: Real>(camera: &Camera<T>, blocks: &mut [Block<T>]) {
    let Some(first) = blocks.first() else { return };
    let ImagePoint { mut u, mut v } = first.point(0);
    for block in blocks {
        // The point before: the previous lane, or the last lane of the previous block.
        let [us, vs, _] = &block.s;
        let (mut before_u, mut before_v) = ([u; LANES], [v; LANES]);
        before_u[1..].copy_from_slice(&us[..LANES - 1]);
        before_v[1..].copy_from_slice(&vs[..LANES - 1]);
        (u, v) = (us[LANES - 1], vs[LANES - 1]);
        // The distances are computed here, because the rays replace the image points a moment later.
        let mut step_px = [T::ZERO; LANES];
        for l in 0..LANES {
            let (du, dv) = (us[l] - before_u[l], vs[l] - before_v[l]);
            // Lanes without a point come after all others and have weight 0.
            step_px[l] = (du * du + dv * dv).sqrt() * block.weight[l];
        }
        block.step_px = step_px;
        camera.rays(block);
    }
}
