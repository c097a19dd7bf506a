//! An edge point with its lit side.

use crate::base::real::Real;
use crate::geometry::block::Lit;
use crate::geometry::pixel::{ImagePoint, Pixel};
use crate::image::Profile;

/// An edge point.
pub(super) struct EdgePoint<T> {
    pub(super) point: ImagePoint<T>,
    /// The side of the point that is lit.
    pub(super) lit: Lit,
    /// Whether the point is at the threshold of the picture, because no local mid-level was found.
    pub(super) fallback: bool,
    /// Whether the lit side is clipped at full scale, so that half of its brightness is not half of the light.
    pub(super) clipped: bool,
}

/// What the search for a point gives besides the point.
// It is handed down instead of being returned, because most points are not asked for a profile.
#[derive(Debug, Default)]
pub(super) struct Aside {
    /// What the points so far have cost in addition: next to a mask or the border of the picture, or on a wide edge.
    pub(super) extra_cost: u32,
    pub(super) wants_profile: bool,
    /// Width and contrast of the edge at the point that was asked for them.
    pub(super) profile: Profile,
}

impl<T> EdgePoint<T> {
    /// Makes a point of a method that has no mid-level.
    pub(super) fn plain(point: ImagePoint<T>, lit: Lit) -> Self {
        Self { point, lit, fallback: false, clipped: false }
    }
}

/// Returns the lit side along the axis of the larger component, and the step (dx, dy) towards the dark. The result is
/// `None` if the gradient is zero.
pub(super) fn orientation((gx, gy): (i32, i32)) -> Option<(Lit, i32, i32)> {
    if gx == 0 && gy == 0 {
        return None;
    }
    // Along the axis of the larger gradient the brightness changes fastest, so that noise moves the crossing least.
    let lit = if gx.abs() >= gy.abs() {
        if gx > 0 { Lit::Right } else { Lit::Left }
    } else if gy > 0 {
        Lit::Below
    } else {
        Lit::Above
    };
    let (dx, dy) = lit.towards_dark();
    Some((lit, dx, dy))
}

/// Makes an edge point for the methods that know the direction of the gradient.
pub(super) fn towards_light<T: Real>((point, [x, y]): (ImagePoint<T>, [T; 2])) -> Option<EdgePoint<T>> {
    // `orientation` compares integers, and the direction is a unit vector.
    let scale = T::from_f64(1024.0);
    let (lit, _, _) = orientation(((x * scale).to_i32(), (y * scale).to_i32()))?;
    Some(EdgePoint::plain(point, lit))
}

pub(super) fn point_off<T: Real>(p: Pixel, (dx, dy): (i32, i32), towards_dark: T) -> ImagePoint<T> {
    ImagePoint {
        u: T::from_i32(i32::from(p.x)) + T::from_i32(dx) * towards_dark,
        v: T::from_i32(i32::from(p.y)) + T::from_i32(dy) * towards_dark,
    }
}
