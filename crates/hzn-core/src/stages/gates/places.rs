//! Places along the limb from which the gates look at the picture, and the brightness on both sides of it.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, every_weighted};
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Returns up to `count` of all `inliers` of the fit, evenly along the edge, each from the middle of its part.
pub(super) fn inliers<T: Real>(
    blocks: &[Block<T>],
    inliers: u32,
    count: usize,
) -> impl Iterator<Item = (&Block<T>, usize)> {
    let every = inliers as usize / count.max(1);
    every_weighted(blocks, every).take(count).map(|(_, block, lane)| (block, lane))
}

/// Number of inliers from which the gates look outwards and inwards.
pub(super) const MAX_PLACES: usize = 12;

/// A place on the limb, from which the gates look outwards and inwards.
pub(super) struct Place<T> {
    /// Image point (u, v), in pixels.
    pub(super) from: [T; 2],
    /// Unit vector in the picture, across the limb towards the body.
    pub(super) inwards: [T; 2],
    /// Derivative of s·e by a step of one pixel inwards, in radians per pixel.
    pub(super) by_px: T,
}

impl<T: Real> Place<T> {
    /// Returns the image point at a distance inwards, in pixels.
    pub(super) fn inwards_by(&self, px: T) -> [T; 2] {
        [self.from[0] + self.inwards[0] * px, self.from[1] + self.inwards[1] * px]
    }
}

/// Places evenly along a limb.
pub(super) type Places<T> = heapless::Vec<Place<T>, MAX_PLACES>;

/// Returns the places on the limb about `e`, at some of its `inliers`.
pub(super) fn along_limb<T: Real>(e: &V3<T>, blocks: &[Block<T>], count: u32, camera: &Camera<T>) -> Places<T> {
    let mut places = Places::new();
    inliers(blocks, count, MAX_PLACES).for_each(|(block, lane)| {
        let Some(from) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { return };
        let [gu, gv] = block.gradient_at(lane, e);
        let by_px = (gu * gu + gv * gv).sqrt().max(T::from_f64(1e-20));
        let _ = places.push(Place { from: [from.u, from.v], inwards: [gu / by_px, gv / by_px], by_px });
    });
    places
}

/// Returns the mean brightness of nine pixels at this distance inwards of a place, in pixels; `None` outside of the
/// region. One pixel would be too noisy.
pub(super) fn mean_brightness<T: Real, P: Pixels, O: Observer<T>>(
    place: &Place<T>,
    inwards_px: T,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<u16> {
    u16::try_from(sum_of_nine(place, inwards_px, binary)? / 9).ok()
}

/// Returns the sum of the same nine pixels. In a dim picture, the whole counts of the mean would hide small steps.
pub(super) fn sum_of_nine<T: Real, P: Pixels, O: Observer<T>>(
    place: &Place<T>,
    inwards_px: T,
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<u32> {
    sum_about(place.inwards_by(inwards_px), binary)
}

/// Returns the sum of the nine pixels about an image point; `None` outside of the region.
pub(super) fn sum_about<T: Real, P: Pixels, O: Observer<T>>(
    at: [T; 2],
    binary: &BinaryPicture<'_, T, P, O>,
) -> Option<u32> {
    let half = T::from_f64(0.5);
    let [x, y] = at.map(|at| at + half);
    if !(x >= T::one() && y >= T::one()) {
        return None;
    }
    let (x, y) = (u16::try_from(x.to_i32()).ok()?, u16::try_from(y.to_i32()).ok()?);
    let (right, below) = (x.checked_add(1)?, y.checked_add(1)?);
    // The second pixel of the margin is for the rounding at the image circle.
    let free = !binary.region.has_mask() && binary.region.is_inside_by(x, y, 2);
    let mut sum = 0;
    for v in [y - 1, y, below] {
        for u in [x - 1, x, right] {
            if !free && (!binary.region.contains(u, v) || binary.masked(u, v)) {
                return None;
            }
            sum += u32::from(binary.brightness(u, v));
        }
    }
    Some(sum)
}

/// Distance from the limb at which the brightness on both sides is read for the threshold of the next picture, in
/// pixels.
const PLATEAU_PX: i32 = 6;

/// Returns the brightness halfway between both sides of the limb, in counts; `None` if the body is not brighter than
/// the sky.
pub(crate) fn middle_level<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    inliers: u32,
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
) -> Option<u16> {
    let (mut dark, mut lit, mut looks) = (0u32, 0u32, 0u32);
    for place in &along_limb(e, blocks, inliers, camera) {
        let at = |px: i32| {
            let [x, y] = place.inwards_by(T::from_i32(px)).map(Real::to_i32);
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            (binary.region.contains(x, y) && !binary.masked(x, y)).then(|| u32::from(binary.brightness(x, y)))
        };
        if let (Some(d), Some(l)) = (at(-PLATEAU_PX), at(PLATEAU_PX)) {
            (dark, lit, looks) = (dark + d, lit + l, looks + 1);
        }
    }
    (lit > dark).then(|| ((dark + lit) / 2 / looks.max(1)) as u16)
}
