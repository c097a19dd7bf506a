//! Brightness gate, and the threshold between dark and lit, from a sparse sample of the picture.
//!
//! The picture is cut into equal cells, and one pixel is drawn at random in each cell. The sample is therefore both
//! even and random. A small body may be missed: then the histogram of the sample has no second class. In this case a
//! second sample is drawn, which is sixteen times finer. For a body that is smaller than its cells, a third sample has
//! places as far apart as the expected radius.

mod histogram;
mod level;
mod lost_blocks;
mod sample;
mod small_body;
#[cfg(test)]
mod tests;

use core::cell::Cell;

use crate::base::real::Real;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::status::Status;

pub(crate) use crate::model::threshold::SUN;
pub use crate::model::threshold::{Brightness, Config, Method};
pub use level::Level;
pub(crate) use level::fixed_level;
pub(crate) use lost_blocks::{READS as LOST_READS, without_lost_blocks};
pub(crate) use sample::RowSampler;
use sample::{SIDES_LOG2, SIGMA_PER_MEAN_DISTANCE, Sample};
pub(crate) use small_body::split_small_body;

/// Finds the threshold. `last` is the threshold that the previous picture proposes, for `track`.
///
/// # Errors
/// Returns `too-dark` or `too-bright` if the mean is outside of the gate. Returns `no-limb` if dark and lit differ by
/// less than 3 % of full scale and the noise of the sample explains the difference.
pub fn split<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    brightness: &Brightness,
    config: &Config,
    last: Option<u16>,
    seed: u32,
    observer: &O,
) -> Result<Level<T>, Status> {
    // The coarse sample comes first, because every further row costs lines of memory that are in no cache.
    for side_log2 in SIDES_LOG2 {
        let mut sample = Sample::new(seed, side_log2, picture.full_scale(), region);
        while let Some(y) = sample.row() {
            sample.take(region, observer, |x| Some(picture.at(x, y)));
        }
        if let Some(decided) = sample.decide(brightness, config, last, observer) {
            return decided;
        }
    }
    Err(Status::NoLimb)
}

/// Number of places in both samples of a picture in which nothing is bright.
pub(crate) const SAMPLED: u32 = (1 << (2 * SIDES_LOG2[0])) + (1 << (2 * SIDES_LOG2[1]));

/// Number of reads of [`dark_noise`]: two neighbours in each cell of the coarse sample.
pub(crate) const NOISE_READS: u32 = 2 << (2 * SIDES_LOG2[0]);

/// Returns the 1-sigma noise of the dark pixels in counts, from the differences of neighbours below the threshold
/// `level`. The result is 0 if there are no dark neighbours.
///
/// If the noise is clipped at 0 counts, its differences are smaller: by half if half of the noise is clipped, and
/// nearly in proportion to the part that is not. The part of the dark pixels that are 0 corrects this, up to a half.
/// Black corners of an image circle, which have no noise, are corrected in the same way.
#[cold]
pub(crate) fn dark_noise<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    level: u16,
    seed: u32,
    observer: &O,
) -> T {
    let mut sample = Sample::new(seed, SIDES_LOG2[0], picture.full_scale(), region);
    let clipped = Cell::new(0u32);
    while let Some(y) = sample.row() {
        sample.take(region, observer, |x| {
            // Differences of neighbours show the noise without the slope of the brightness, which a deviation from the
            // mean includes.
            let next = x.checked_add(1).filter(|&next| region.contains(next, y) && !region.masked(next, y))?;
            let (here, there) = (picture.at(x, y), picture.at(next, y));
            (here < level && there < level).then(|| {
                clipped.set(clipped.get() + u32::from(here == 0) + u32::from(there == 0));
                here.abs_diff(there)
            })
        });
    }
    let pairs = T::from_i32(sample.histogram.count.max(1) as i32);
    let seen = T::one() - (T::from_i32(clipped.get() as i32) / (pairs + pairs)).min(T::from_f64(0.5));
    sample.histogram.mean().unwrap_or(T::ZERO) * T::from_f64(SIGMA_PER_MEAN_DISTANCE) / seen
}
