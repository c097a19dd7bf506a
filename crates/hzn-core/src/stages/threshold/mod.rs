//! Brightness gate, and the threshold between dark and lit, from a sparse sample of the picture.
//!
//! The picture is cut into equal cells, and one pixel is drawn at random in each cell. The sample is therefore both
//! even and random. A small body may be missed: then the histogram of the sample has no second class. In this case a
//! second sample is drawn, which is sixteen times finer.

mod histogram;
mod level;
mod sample;
#[cfg(test)]
mod tests;

use crate::base::real::Real;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use crate::model::status::Status;

pub(crate) use crate::model::threshold::SUN;
pub use crate::model::threshold::{Brightness, Config, Method};
pub use level::Level;
pub(crate) use level::fixed_level;
pub(crate) use sample::RowSampler;
use sample::{SIDES_LOG2, SIGMA_PER_MEAN_DISTANCE, Sample};

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

/// Number of reads of [`dark_noise`]: two neighbours in each cell of the coarse sample.
pub(crate) const NOISE_READS: u32 = 2 << (2 * SIDES_LOG2[0]);

/// Returns the 1-sigma noise of the dark pixels in counts, from the differences of neighbours below the threshold
/// `level`. The result is 0 if there are no dark neighbours. If the noise is clipped at 0 counts, the result is too
/// small.
#[cold]
pub(crate) fn dark_noise<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    level: u16,
    seed: u32,
    observer: &O,
) -> T {
    let mut sample = Sample::new(seed, SIDES_LOG2[0], picture.full_scale(), region);
    while let Some(y) = sample.row() {
        sample.take(region, observer, |x| {
            // Differences of neighbours show the noise without the slope of the brightness, which a deviation from the
            // mean includes.
            let next = x.checked_add(1).filter(|&next| region.contains(next, y) && !region.masked(next, y))?;
            let (here, there) = (picture.at(x, y), picture.at(next, y));
            (here < level && there < level).then(|| here.abs_diff(there))
        });
    }
    sample.histogram.mean().unwrap_or(T::ZERO) * T::from_f64(SIGMA_PER_MEAN_DISTANCE)
}
