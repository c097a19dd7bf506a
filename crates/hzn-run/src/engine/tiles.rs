//! Whether the limb of a picture is that of an earlier picture, to the last bit.
//!
//! A camera or a recorder that stands still may change a few pixels: a counter in a pixel, a clock that is burnt in, a
//! row of telemetry; or it renews only a part of the picture. The checksum of the whole picture then says nothing, so
//! that each small square of pixels, a tile, has one of its own. Only the tiles on the fitted limb count, because the
//! answer comes from these, and because the sky may be black, without noise, in every picture.
//!
//! Noise never repeats, so that a tile that is equal was not exposed again. This is not quite so for JPEG, which rounds
//! the noise away: at rest, with a noise of half a count and a quality of 50, up to 22 % of the tiles on the limb are
//! equal to those of another picture, and at a quality of 75 5 %. The limit allows for more than that.

use std::f64::consts::TAU;

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::image::Layout;

use crate::source::Picture;
use crate::source::picture::Samples;
use crate::tangent::basis;

/// Sides of a tile, in pixels: the first with which the picture is at least [`MIN_TILES`] tiles wide and high, or the
/// last. 16 is the block of a JPEG with reduced colours.
const SIDES: [u32; 3] = [16, 8, 4];
const MIN_TILES: u32 = 12;
/// Directions around the limb that are looked at.
const STEPS: u32 = 1024;
/// Probability that a tile on the limb is equal to that of another exposure, at most.
const EQUAL: f64 = 0.25;
/// Probability of a false alarm in a comparison of two pictures.
const RARE: f64 = 1e-6;

/// The checksums of the tiles of a picture, row by row; 0 for a tile of one value, which has no noise.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tiles {
    side_px: u32,
    columns: u32,
    rows: u32,
    sums: Box<[u64]>,
}

impl Tiles {
    /// Makes the checksums of a decoded picture; `None` for a frame of a video, which may copy a part of an earlier one
    /// although it was exposed anew.
    pub fn of_picture(picture: &Picture) -> Option<Self> {
        if picture.is_video_frame {
            return None;
        }
        Some(match &picture.samples {
            Samples::Bytes(bytes) => Self::of_bytes(bytes, picture.layout),
            Samples::Words(words) => Self::new(picture.layout, words, |pair| {
                let [a, b, c, d] = pair.try_into().unwrap_or_default();
                [a, b, c, d].into_iter().fold(0, |word, sample: u16| word << 16 | u64::from(sample))
            }),
        })
    }

    /// Makes the checksums of a picture of 8 bits.
    pub fn of_bytes(bytes: &[u8], layout: Layout) -> Self {
        Self::new(layout, bytes, |eight| u64::from_le_bytes(eight.try_into().unwrap_or_default()))
    }

    /// `word` packs 64 bits of samples.
    fn new<S: Copy + Into<u64>>(layout: Layout, samples: &[S], word: impl Fn(&[S]) -> u64) -> Self {
        let fits = |side: &u32| layout.width.min(layout.height) / side >= MIN_TILES;
        let side_px = SIDES.into_iter().find(fits).unwrap_or(SIDES[SIDES.len() - 1]);
        let (columns, rows) = (layout.width.div_ceil(side_px), layout.height.div_ceil(side_px));
        let channels = usize::from(layout.channels);
        let (width, chunk) = (side_px as usize * channels, 8 / size_of::<S>());
        let mut sums = vec![0u64; columns as usize * rows as usize];
        // The first sample of each tile, and whether another one differs from it.
        let mut firsts: Vec<Option<(u64, bool)>> = vec![None; sums.len()];
        for y in 0..layout.height as usize {
            let from = y * layout.stride;
            let row = samples.get(from..from + layout.width as usize * channels).unwrap_or_default();
            let at = y / side_px as usize * columns as usize;
            let tiles = sums.iter_mut().zip(&mut firsts).skip(at);
            for (part, (sum, first)) in row.chunks(width).zip(tiles) {
                let (words, rest) = part.split_at(part.len() - part.len() % chunk);
                let mut mix = |value: u64| *sum = (*sum ^ value).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(29);
                words.chunks_exact(chunk).for_each(|samples| mix(word(samples)));
                rest.iter().for_each(|sample| mix((*sample).into()));
                let (value, differs) = first.get_or_insert((part.first().map_or(0, |s| (*s).into()), false));
                *differs = *differs || part.iter().any(|sample| Into::<u64>::into(*sample) != *value);
            }
        }
        for (sum, first) in sums.iter_mut().zip(firsts) {
            *sum = if first.is_some_and(|(_, differs)| differs) { (*sum).max(1) } else { 0 };
        }
        Self { side_px, columns, rows, sums: sums.into() }
    }

    /// Returns the numbers of the tiles on the limb of an answer that have noise.
    pub fn on_limb(&self, limb: &Solution<f64>, camera: &Camera<f64>) -> Vec<usize> {
        let axis = limb.axis.xyz();
        let (b1, b2) = basis(axis);
        let (sin, cos) = limb.half_angle_rad.sin_cos();
        let tile = |step: u32| {
            let (sin_azimuth, cos_azimuth) = (TAU * f64::from(step) / f64::from(STEPS)).sin_cos();
            let direction = [0, 1, 2].map(|i| cos * axis[i] + sin * (cos_azimuth * b1[i] + sin_azimuth * b2[i]));
            let point = camera.project(&UnitVec3::try_new(direction)?)?;
            // Pixel 0 reaches from -0.5 to 0.5.
            let [column, row] = [point.u, point.v].map(|x| ((x + 0.5) / f64::from(self.side_px)).floor());
            let is_inside = column >= 0.0 && row >= 0.0 && column < self.columns.into() && row < self.rows.into();
            is_inside.then(|| row as usize * self.columns as usize + column as usize)
        };
        let mut tiles: Vec<usize> = (0..STEPS).filter_map(tile).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles.retain(|tile| self.sums.get(*tile).is_some_and(|sum| *sum != 0));
        tiles
    }

    /// Returns whether so many of these tiles are equal to those of an earlier picture that the limb was not exposed
    /// again.
    pub fn repeat(&self, limb: &[usize], earlier: &Self) -> bool {
        let is_same = |tile: &&usize| self.sums.get(**tile) == earlier.sums.get(**tile);
        let is_comparable = (self.side_px, self.columns, self.rows) == (earlier.side_px, earlier.columns, earlier.rows);
        is_comparable && limb.iter().filter(is_same).count() > most_by_chance(limb.len())
    }
}

/// Returns the largest number of equal tiles that two exposures have: more of them have at most the probability
/// [`RARE`].
fn most_by_chance(tiles: usize) -> usize {
    // Probabilities of the binomial distribution from the largest number down; the first ones are too small for f64.
    let mut own_log = tiles as f64 * EQUAL.ln();
    let mut at_least = own_log.exp();
    let mut count = tiles;
    while at_least <= RARE && count > 0 {
        own_log += (count as f64 / (tiles - count + 1) as f64 * (1.0 - EQUAL) / EQUAL).ln();
        at_least += own_log.exp();
        count -= 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u32, width: u32, height: u32) -> Vec<u8> {
        let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(1);
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            100 + (state >> 24) as u8 % 4
        };
        (0..width * height).map(|_| draw()).collect()
    }

    #[test]
    fn the_limit_is_that_of_the_binomial_distribution() {
        // 0.25^9 is 3.8e-6, and 0.25^10 is 9.5e-7.
        assert_eq!([0, 9, 10].map(most_by_chance), [0, 9, 9]);
        // From the binomial coefficients, in whole numbers.
        assert_eq!([18, 40, 100, 400].map(most_by_chance), [14, 24, 47, 143]);
        assert!((256..330).contains(&most_by_chance(1024)), "the smallest probabilities are not lost");
    }

    #[test]
    fn a_changed_pixel_is_in_one_tile_and_other_noise_in_all() {
        let layout = Layout::packed(203, 197, 1, 8);
        let of = |bytes: &[u8]| Tiles::of_bytes(bytes, layout);
        let first = noise(1, 203, 197);
        let mut counter = first.clone();
        counter[197 * 203 - 1] ^= 1;
        let (first, counter, other) = (of(&first), of(&counter), of(&noise(2, 203, 197)));
        assert_eq!((first.columns, first.rows, first.side_px), (13, 13, 16));
        let equal = |a: &Tiles, b: &Tiles| a.sums.iter().zip(&b.sums).filter(|(a, b)| a == b).count();
        assert_eq!([equal(&first, &counter), equal(&first, &other)], [168, 0]);
        let all: Vec<usize> = (0..169).collect();
        assert!(first.repeat(&all, &counter) && !first.repeat(&all, &other) && !first.repeat(&[], &first));
    }

    #[test]
    fn a_tile_of_one_value_has_no_noise() {
        let words: Vec<u16> = (0..48 * 48).map(|i| if i % 48 < 8 { 4000 } else { 4000 + i as u16 % 5 }).collect();
        let picture = Picture::new(Samples::Words(words), Layout::packed(48, 48, 1, 12));
        let tiles = Tiles::of_picture(&picture).unwrap();
        assert_eq!((tiles.side_px, tiles.columns), (4, 12));
        assert!(tiles.sums.iter().enumerate().all(|(i, sum)| (*sum == 0) == (i % 12 < 2)));
        assert!(Tiles::of_picture(&Picture { is_video_frame: true, ..picture }).is_none());
    }
}
