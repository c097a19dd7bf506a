//! The brightness of a picture at places all over it.

use crate::base::real::Real;
use crate::geometry::camera::Camera;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::geometry::pixel::ImagePoint;
use crate::image::Pixels;
use crate::image::region::Region;

/// Columns and rows of the places: 5 degrees from each other in a camera of 60 degrees, which is fine enough for a
/// direction that is good to some degrees.
const GRID: [u16; 2] = [12, 9];

/// Number of places.
pub(super) const PLACES: usize = GRID[0] as usize * GRID[1] as usize;

/// The brightness of a picture at places all over it, for [`coarse`](super::coarse()).
///
/// A picture without a limb still says whether the camera sees the body or the sky. These few pixels are all that is
/// kept of it.
///
/// ```
/// use hzn_core::image::region::Region;
/// use hzn_core::image::{Grey, Layout};
/// use hzn_core::rig::Glimpse;
///
/// let data = vec![200_u8; 64 * 48];
/// let picture = Grey::try_new(&data, Layout::packed(64, 48, 1, 8))?;
/// let glimpse = Glimpse::take(&picture, &Region::<f32>::whole(64, 48));
/// assert_eq!(glimpse.lit_part(100), Some(1.0));
/// assert_eq!(glimpse.full_scale(), 255);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Glimpse {
    /// Counts, row by row; `None` where the camera does not look, or behind a mask.
    counts: [Option<u16>; PLACES],
    size: [u16; 2],
    full_scale: u16,
}

impl Glimpse {
    /// Reads the places of a picture that has the size of the region.
    pub fn take<T: Real, P: Pixels>(picture: &P, region: &Region<T>) -> Self {
        let size = [picture.width().min(region.width()), picture.height().min(region.height())];
        let mut counts = [None; PLACES];
        for ([x, y], counts) in places(size).zip(&mut counts) {
            if region.contains(x, y) && !region.masked(x, y) {
                *counts = Some(picture.at(x, y));
            }
        }
        Self { counts, size, full_scale: picture.full_scale() }
    }

    /// Returns the largest value that a sample of the picture can have.
    pub fn full_scale(&self) -> u16 {
        self.full_scale
    }

    /// Returns the part of the places that are lit, at this level or above, from 0 to 1. `None` if the region leaves
    /// out all places.
    pub fn lit_part(&self, level: u16) -> Option<f32> {
        let seen = self.counts.iter().flatten();
        let (lit, all) = seen.fold((0u16, 0u16), |(lit, all), &c| (lit + u16::from(c >= level), all + 1));
        (all > 0).then(|| f32::from(lit) / f32::from(all))
    }

    /// Returns the brightness from which on a place is lit, in counts, from a limb that was found: a quarter of the way
    /// from the mean of the sky to that of the body. The noise of the sky is below it, and dark parts of the body are
    /// above it. `axis` and `cos` are those of the limb's cone. `None` unless there are both sky and a brighter body.
    pub fn level_at_limb<T: Real>(&self, camera: &Camera<T>, axis: &UnitVec3<Cam, T>, cos: T) -> Option<u16> {
        let (mut sky, mut body) = ((0u32, 0u32), (0u32, 0u32));
        for (point, counts) in self.seen::<T>() {
            let Some(ray) = camera.unproject(point) else { continue };
            let (sum, number) = if ray.dot(axis) > cos { &mut body } else { &mut sky };
            *sum += u32::from(counts);
            *number += 1;
        }
        let sky = sky.0.checked_div(sky.1)?;
        let brighter = body.0.checked_div(body.1)?.checked_sub(sky).filter(|x| *x > 0)?;
        u16::try_from(sky + brighter.div_ceil(4)).ok()
    }

    /// Returns the places with their counts.
    pub(super) fn seen<T: Real>(&self) -> impl Iterator<Item = (ImagePoint<T>, u16)> + '_ {
        let at = |x: u16| T::from_i32(x.into());
        let point = move |[x, y]: [u16; 2]| ImagePoint { u: at(x), v: at(y) };
        places(self.size).zip(&self.counts).filter_map(move |(place, counts)| Some((point(place), (*counts)?)))
    }
}

/// Returns the pixels in the middle of equal cells, row by row.
fn places([width, height]: [u16; 2]) -> impl Iterator<Item = [u16; 2]> {
    let middle = |i: u16, n: u16, size: u16| ((2 * u32::from(i) + 1) * u32::from(size) / (2 * u32::from(n))) as u16;
    let [columns, rows] = GRID;
    (0..rows).flat_map(move |j| (0..columns).map(move |i| [middle(i, columns, width), middle(j, rows, height)]))
}
