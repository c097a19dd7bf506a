//! HORACE: fits a circle to the edge points. Its centre gives the direction, and its radius gives the half-angle (Barf
//! 2014, 2.2.4 and 2.2.5; Barf et al. 2015).
//!
//! The circle is fitted in the picture as it is, in focal lengths from the principal point. The lens model gives only
//! two values: the direction of the centre, and the off-axis angle of the radius. This angle is α with
//! sin α = R/(R + h). The printed (2.27) has (R − h)/R, which at 80 km is 0.98744 instead of 0.98760. Equation (2.37)
//! counts the centre of the picture from its corner, which is half a pixel off from the centres of the pixels. Here the
//! calibrated principal point is used.
//!
//! The result is right for a camera that points at the centre of the body. Off the optical axis, a limb is no circle.
//! With an equidistant lens the limb is nearly a circle, so that the error at 25° off nadir is a tenth of a degree. In
//! the picture of a pinhole camera the limb is a conic. Its circle of curvature has another centre, and the error is 6°
//! to 25° and more, independent of noise. The method exists for comparisons.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::circle::Circle;
use crate::geometry::frames::UnitVec3;

/// Returns the axis and cos α of the circle through the points with a weight.
pub(crate) fn fit<T: Real>(blocks: &[Block<T>], camera: &Camera<T>) -> Option<(V3<T>, T)> {
    let points = blocks.iter().flat_map(|b| {
        (0..LANES)
            .filter(move |&l| b.weight[l & 7] > T::ZERO)
            // The image points were replaced by their rays, so they are projected back.
            .filter_map(move |l| camera.project(&UnitVec3::assume_unit(b.ray(l))))
            .map(|p| camera.to_focal_lengths(p))
    });
    let Circle { centre, radius } = Circle::fit(points)?;
    let axis = camera.unproject_extrapolated(centre)?;
    Some((*axis.v(), camera.unproject_extrapolated([radius, T::ZERO])?.v().z))
}
