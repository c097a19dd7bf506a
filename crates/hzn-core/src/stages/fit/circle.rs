//! HORACE: a circle through the edge points, its centre for the direction, its radius for the half-angle (Barf 2014,
//! 2.2.4 and 2.2.5; Barf et al. 2015).
//!
//! The circle is laid through the picture as it is, in focal lengths from the principal point; the lens is asked only
//! where its centre looks, and how far off axis its radius reaches, which is α for sin α = R/(R + h). (2.27) prints
//! (R − h)/R, which at 80 km is 0.98744 and not 0.98760. (2.37) counts the picture's centre from its corner, half a
//! pixel beside the centre of the pixels; here the calibrated principal point is taken.
//!
//! All this is right for a camera that points at the body's centre. A limb beside the axis is no circle: an equidistant
//! lens makes it nearly one, so that 25° off nadir cost a tenth of a degree; in the picture of a pinhole it is a conic,
//! whose circle of curvature is centred elsewhere, 6° to 25° and more off, whatever the noise. It is here to be
//! compared with.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::circle::Circle;
use crate::geometry::frames::UnitVec3;

/// The axis and cos α of the circle through the points that may count.
pub(crate) fn fit<T: Real>(blocks: &[Block<T>], camera: &Camera<T>) -> Option<(V3<T>, T)> {
    let points = blocks.iter().flat_map(|b| {
        (0..LANES)
            .filter(move |&l| b.weight[l & 7] > T::ZERO)
            .filter_map(move |l| camera.project(&UnitVec3::assume_unit(b.ray(l))))
            .map(|p| camera.in_focal_lengths(p))
    });
    let Circle { centre, radius } = Circle::through(points)?;
    let axis = camera.continued(centre)?;
    Some((*axis.v(), camera.continued([radius, T::ZERO])?.v().z))
}
