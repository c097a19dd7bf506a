//! Places along the limb from which the gates look at the picture, and the brightness on both sides of it.

use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::camera::Camera;
use crate::geometry::frames::UnitVec3;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Returns up to `count` inliers, evenly along the edge, each from the middle of its part.
pub(super) fn inliers<T: Real>(blocks: &[Block<T>], count: usize) -> impl Iterator<Item = (&Block<T>, usize)> {
    let all = || blocks.iter().flat_map(|b| (0..LANES).filter(|&l| b.weight[l & 7] > T::ZERO).map(move |l| (b, l)));
    let every = (all().count() / count.max(1)).max(1);
    all().skip(every / 2).step_by(every).take(count)
}

/// Number of inliers from which the gates look outwards and inwards.
pub(super) const MAX_PLACES: usize = 12;

/// Distance from the limb at which the brightness on both sides is read for the threshold of the next picture, in
/// pixels.
const PLATEAU_PX: i32 = 6;

/// Returns the brightness halfway between both sides of the limb, in counts; `None` if the body is not brighter than
/// the sky.
pub(crate) fn middle_level<T: Real, P: Pixels, O: Observer<T>>(
    e: &V3<T>,
    blocks: &[Block<T>],
    binary: &BinaryPicture<'_, T, P, O>,
    camera: &Camera<T>,
) -> Option<u16> {
    let (mut dark, mut lit, mut looks) = (0u32, 0u32, 0u32);
    for (block, lane) in inliers(blocks, MAX_PLACES) {
        let Some(from) = camera.project(&UnitVec3::assume_unit(block.ray(lane))) else { continue };
        let [gu, gv] = block.gradient_at(lane, e);
        let norm = (gu * gu + gv * gv).sqrt().max(T::from_f64(1e-20));
        let at = |px: i32| {
            let px = T::from_i32(px);
            let (x, y) = ((from.u + gu / norm * px).to_i32(), (from.v + gv / norm * px).to_i32());
            let (x, y) = (u16::try_from(x).ok()?, u16::try_from(y).ok()?);
            (binary.region.contains(x, y) && !binary.masked(x, y)).then(|| u32::from(binary.brightness(x, y)))
        };
        if let (Some(d), Some(l)) = (at(-PLATEAU_PX), at(PLATEAU_PX)) {
            (dark, lit, looks) = (dark + d, lit + l, looks + 1);
        }
    }
    (lit > dark).then(|| ((dark + lit) / 2 / looks.max(1)) as u16)
}
