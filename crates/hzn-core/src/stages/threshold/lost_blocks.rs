//! Blocks of one grey that a decoder puts where the data of a picture are lost.
//!
//! A lost packet leaves blocks in which every pixel has exactly the same value, the same in every block. Otsu's
//! threshold of a dim picture then separates the blocks from everything else.

use super::sample::{SIDES_LOG2, Sample};
use super::{Brightness, Config, Level};
use crate::base::real::Real;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::observer::Observer;
use core::cell::Cell;

/// Width of the smallest block of a decoder, in pixels.
const RUN: u16 = 8;
/// Fewest places of the sample in lost blocks.
const LEAST: u32 = 3;
/// Number of reads of [`without_lost_blocks`]: two samples, and the neighbours of each place of the first one. Of most
/// places, two neighbours decide; in a block all of them are read.
pub(crate) const READS: u32 = 16 << (2 * SIDES_LOG2[0]);

/// Returns the threshold of the picture without the pixels of lost blocks; `None` without lost blocks.
///
/// A pixel counts as one of a block if it lies in a run of equal pixels as long as a block. With a noise of one count,
/// that happens to one pixel in a thousand. All pixels of blocks must have one value, which is neither black nor full
/// scale. Most other pixels that are not black must lie in no such run, because in a picture without noise every pixel
/// lies in such a run.
#[cold]
pub(crate) fn without_lost_blocks<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    config: &Config,
    seed: u32,
    observer: &O,
) -> Option<Level<T>> {
    let lost = lost_value(picture, region, seed, observer)?;
    let mut sample = Sample::new(seed, SIDES_LOG2[0], picture.full_scale(), region);
    while let Some(y) = sample.row() {
        sample.take(region, observer, |x| Some(picture.at(x, y)).filter(|&value| value != lost));
    }
    // The brightness of the picture was compared with its limits before.
    sample.decide(&Brightness::ANY, config, None, observer)?.ok()
}

/// Returns the value that the pixels of lost blocks have.
fn lost_value<T: Real, P: Pixels, O: Observer<T>>(
    picture: &P,
    region: &Region<T>,
    seed: u32,
    observer: &O,
) -> Option<u16> {
    let (flat, other) = (Cell::new(0), Cell::new(0));
    let (least, most) = (Cell::new(u16::MAX), Cell::new(0));
    let mut sample = Sample::new(seed, SIDES_LOG2[0], picture.full_scale(), region);
    while let Some(y) = sample.row() {
        sample.take(region, observer, |x| {
            let value = picture.at(x, y);
            if value > 0 && value < picture.full_scale() {
                if is_flat(picture, region, x, y) {
                    flat.set(flat.get() + 1);
                    least.set(least.get().min(value));
                    most.set(most.get().max(value));
                } else {
                    other.set(other.get() + 1);
                }
            }
            None
        });
    }
    (flat.get() >= LEAST && flat.get() <= other.get() && least == most).then(|| least.get())
}

/// Returns whether a pixel lies in a run of [`RUN`] equal pixels in its row.
fn is_flat<T: Real, P: Pixels>(picture: &P, region: &Region<T>, x: u16, y: u16) -> bool {
    let value = picture.at(x, y);
    let is_same = |x: u16| region.contains(x, y) && !region.masked(x, y) && picture.at(x, y) == value;
    let left = (1..RUN).take_while(|&k| x.checked_sub(k).is_some_and(is_same)).count();
    let right = (1..RUN).take_while(|&k| x.checked_add(k).is_some_and(is_same)).count();
    left + right + 1 >= usize::from(RUN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Grey, Layout};

    #[test]
    fn a_run_of_eight_equal_pixels_is_flat_and_one_of_seven_is_not() {
        let (run, width) = (usize::from(RUN), 32);
        for (length, is_run) in [(run, true), (run - 1, false)] {
            // The neighbours of the run alternate, so that no other pixels are equal.
            let row: std::vec::Vec<u16> =
                (0..width).map(|x| if (10..10 + length).contains(&x) { 100 } else { 20 + x as u16 % 2 }).collect();
            let picture = Grey::try_new(&row[..], Layout::packed(width as u32, 1, 1, 8)).unwrap();
            let region = Region::<f64>::whole(width as u16, 1);
            for x in 10..10 + length {
                assert_eq!(is_flat(&picture, &region, x as u16, 0), is_run, "{length} at {x}");
            }
        }
    }
}
