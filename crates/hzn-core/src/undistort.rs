//! From image points to unit rays with their derivatives, and the distances along the edge.

use crate::block::{Block, LANES};
use crate::camera::Camera;
use crate::pixel::ImagePoint;
use crate::real::Real;

/// Turns the points of `blocks` into rays, in place. A point beyond the image circle gets weight 0.
pub(crate) fn to_rays<T: Real>(camera: &Camera<T>, blocks: &mut [Block<T>]) {
    let mut before: Option<ImagePoint<T>> = None;
    for block in blocks {
        for lane in 0..LANES {
            if block.weight[lane] == T::ZERO {
                continue;
            }
            let p = block.point(lane);
            if let Some(b) = before {
                let (du, dv) = (p.u - b.u, p.v - b.v);
                block.step_px[lane] = (du * du + dv * dv).sqrt();
            }
            before = Some(p);
        }
        camera.rays(block);
    }
}
