//! Stuck readouts: runs of equal pixels where the noise of the camera makes equality impossible.
//!
//! A readout that hangs repeats a value. The border of such a run is a sharp, straight edge, and may be taken for a
//! limb. A pixel of a camera has noise, so that it rarely equals its neighbour. How often it does is counted in a small
//! sample of the same picture, for its dark and its bright part: with a share e of equal neighbours a run of n equal
//! pixels has the probability e^(n-1). A run is stuck if this is below one in a million. Without noise (e = 1), nothing
//! is. Black and saturated pixels are equal without a fault, so they never count.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::pixel::{ImagePoint, Pixel};
use hzn_core::report::MAX_LISTED;

use super::row_readout::{RowRuns, RowSample, SHORTEST, sample_step};

/// Probability of a run that noise does not allow.
const RARE: f32 = 1e-6;
/// Fewest pairs of pixels that give a share; with fewer, the share of the whole picture is used.
// Otherwise a handful of pairs would decide how long a stuck run is.
const FEWEST: u32 = 16;
/// Largest share of equal neighbours that is known well enough from the sample.
// Nearer to 1, a small error of the share would make a stuck run several times longer or shorter.
const MOST_EQUAL: f32 = 0.9;
/// Number of places that are looked at along an edge.
pub(super) const PLACES: usize = 64;
/// A limb is stuck if more than one in this many of its places is.
// Fewer are outliers of the fit, which leaves them out by itself.
const MOST_STUCK: u32 = 8;
/// Places that are nearer to the fitted limb than this belong to it: the edge points may be a few pixels off the border
/// pixels, and the limb of an ellipsoid is not quite a circle.
const NEAR_PX: f32 = 4.0;

/// How long a run of equal pixels must be to be stuck.
#[derive(Debug, Clone, Copy)]
pub(super) struct Equality {
    mean: u8,
    dark: u32,
    bright: u32,
}

/// What was found along a limb.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct StuckPlaces {
    /// Number of the candidate.
    candidate: u32,
    /// Places where the pixels are stuck.
    pub(crate) stuck: u32,
    /// Places on the limb that were looked at.
    pub(crate) places: u32,
}

impl StuckPlaces {
    /// Returns whether too much of the limb is stuck.
    fn is_stuck(&self) -> bool {
        self.stuck * MOST_STUCK > self.places
    }
}

/// The pixels, or the data of the rows, that are still in memory when the edges are known.
#[derive(Clone, Copy)]
pub(super) enum Readout<'a> {
    /// Every pixel, and the width of the picture.
    Pixels(&'a [u8], usize),
    /// The longest runs of every row. Other runs are not noticed.
    Rows(&'a [RowRuns]),
}

/// Looks for stuck pixels along the edges of a picture, one edge after the other.
pub(super) struct StuckWatch<'a> {
    readout: Readout<'a>,
    camera: &'a Camera<f32>,
    equality: Equality,
    /// Places along the edge that is examined, and whether they are stuck.
    places: heapless::Vec<(Pixel, bool), PLACES>,
    /// Limbs that are stuck.
    found: heapless::Vec<StuckPlaces, MAX_LISTED>,
}

impl<'a> StuckWatch<'a> {
    pub(super) fn new(readout: Readout<'a>, equality: Equality, camera: &'a Camera<f32>) -> Self {
        Self { readout, camera, equality, places: heapless::Vec::new(), found: heapless::Vec::new() }
    }
    /// Forgets the edges of another look at the picture.
    pub(super) fn clear(&mut self) {
        self.found.clear();
    }
    /// Begins another edge.
    pub(super) fn begin(&mut self) {
        self.places.clear();
    }
    /// Looks at a pixel of the edge.
    pub(super) fn look_at(&mut self, pixel: Pixel) {
        let is_stuck = self.equality.is_stuck(self.readout, pixel);
        // There is room, because the caller takes as many pixels.
        let _ = self.places.push((pixel, is_stuck));
    }

    /// Judges the limb that was fitted to the edge. Places away from it are not counted: the fit left them out.
    pub(super) fn judge(&mut self, candidate: u32, limb: &Solution<f32>) {
        // Rays take time, and most edges have no stuck places.
        if !self.places.iter().any(|(_, is_stuck)| *is_stuck) {
            return;
        }
        let mut count = StuckPlaces { candidate, ..StuckPlaces::default() };
        let near = NEAR_PX / self.camera.focal_px().0;
        for (pixel, is_stuck) in &self.places {
            let point = ImagePoint { u: f32::from(pixel.x), v: f32::from(pixel.y) };
            let Some(ray) = self.camera.unproject(point) else { continue };
            // At first all places of the edge were counted, so that stuck places cost an answer that did not use them.
            if (ray.angle_rad(&limb.axis) - limb.fused_half_angle_rad).abs() < near {
                count.places += 1;
                count.stuck += u32::from(*is_stuck);
            }
        }
        if count.is_stuck() {
            // A list that is full is dealt with in `found`.
            let _ = self.found.push(count);
        }
    }

    /// Returns what was found along the limb of a candidate, if it is stuck.
    pub(super) fn found(&self, candidate: u32) -> Option<StuckPlaces> {
        let found = self.found.iter().find(|found| found.candidate == candidate);
        // If the list is full, further limbs may be stuck without being in it, so that they count as stuck.
        found.or(self.found.last().filter(|_| self.found.is_full())).copied()
    }
}

/// Pairs of neighbours of a sample, and those that are equal.
#[derive(Clone, Copy, Default)]
struct Pairs {
    equal: u32,
    all: u32,
}

impl Pairs {
    /// Returns the length of a run that noise does not allow; the largest number if noise allows any.
    fn longest_run(self) -> u32 {
        // Of a small sample, the share is known badly: it is taken a little nearer to one half.
        let share = (self.equal + 1) as f32 / (self.all + 2) as f32;
        if share > MOST_EQUAL {
            return u32::MAX;
        }
        let (mut probability, mut length) = (1.0, 1);
        while probability > RARE {
            probability *= share;
            length += 1;
        }
        length.max(SHORTEST as u32)
    }
}

impl Equality {
    /// Samples a picture of one byte per pixel.
    pub(super) fn sample(pixels: &[u8]) -> Self {
        let pair = |pair: &[u8]| pair.first_chunk().copied();
        Self::of(|| pixels.windows(2).step_by(sample_step(pixels.len())).filter_map(pair))
    }
    /// Takes the sample of a picture whose rows came one by one.
    pub(super) fn of_rows(sample: &RowSample) -> Self {
        Self::of(|| sample.pairs())
    }
    fn of<I: Iterator<Item = [u8; 2]>>(pairs: impl Fn() -> I) -> Self {
        let (sum, count) = pairs().fold((0u32, 0u32), |(sum, count), [a, _]| (sum + u32::from(a), count + 1));
        // The mean, because the threshold of a picture in memory is not known yet.
        let mean = sum.checked_div(count).unwrap_or(0) as u8;
        // Two parts, because noise grows with the light, so that bright neighbours are equal less often.
        let (mut dark, mut bright) = (Pairs::default(), Pairs::default());
        for [a, b] in pairs().filter(|[a, _]| !matches!(*a, 0 | u8::MAX)) {
            let part = if a < mean { &mut dark } else { &mut bright };
            part.equal += u32::from(a == b);
            part.all += 1;
        }
        let whole = Pairs { equal: dark.equal + bright.equal, all: dark.all + bright.all };
        let run = |part: Pairs| if part.all < FEWEST { whole } else { part }.longest_run();
        Self { mean, dark: run(dark), bright: run(bright) }
    }

    /// Returns whether the pixels at a pixel of an edge are stuck: its own run or that of a neighbour.
    pub(super) fn is_stuck(&self, readout: Readout<'_>, at: Pixel) -> bool {
        let (x, y) = (usize::from(at.x), usize::from(at.y));
        // The neighbours count, because an edge runs next to a stuck run as often as in it. Before the first column and
        // row, the wrapped number is no place, so that `get` refuses it.
        let near = [(x, y), (x, y.wrapping_sub(1)), (x, y + 1), (x.wrapping_sub(1), y), (x + 1, y)];
        near.iter().any(|&(x, y)| match readout {
            Readout::Pixels(pixels, width) => self.is_in_stuck_run(pixels, width, x, y),
            Readout::Rows(rows) => {
                let run = rows.get(y).and_then(|row| row.at(x));
                run.is_some_and(|run| u32::from(run.length) >= self.needed(run.value))
            }
        })
    }

    /// Returns the length of a run of this value that noise does not allow.
    fn needed(&self, value: u8) -> u32 {
        if value < self.mean { self.dark } else { self.bright }
    }

    fn is_in_stuck_run(&self, pixels: &[u8], width: usize, x: usize, y: usize) -> bool {
        let start = y.saturating_mul(width);
        let Some(row) = pixels.get(start..start.saturating_add(width)) else { return false };
        let Some(&value) = row.get(x) else { return false };
        // Most pixels differ from both neighbours, which ends the look at once.
        let is_beside = |x: usize| row.get(x) == Some(&value);
        if !is_beside(x.wrapping_sub(1)) && !is_beside(x + 1) {
            return false;
        }
        let needed = self.needed(value);
        if matches!(value, 0 | u8::MAX) || needed == u32::MAX {
            return false;
        }
        let needed = needed as usize;
        let is_equal = |p: &&u8| **p == value;
        // At most as many as needed, so that a long run costs no more.
        let after = row.get(x..).unwrap_or_default().iter().take(needed).take_while(is_equal).count();
        let before = row.get(..x).unwrap_or_default().iter().rev().take(needed - after).take_while(is_equal).count();
        after + before >= needed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Sky above row 40, ground below, with noise of this width in counts.
    fn picture(noise: u32) -> Vec<u8> {
        let mut state = 1u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % (noise + 1)
        };
        (0..160 * 120).map(|i| (if i / 160 < 40 { 20 } else { 150 } + draw()) as u8).collect()
    }

    /// Returns the number of stuck places of a row; in memory and row by row there are as many.
    fn stuck_places(pixels: &[u8], y: u16) -> usize {
        let equality = Equality::sample(pixels);
        let count = |readout| (0..160).filter(|&x| equality.is_stuck(readout, Pixel { x, y })).count();
        let rows: Vec<RowRuns> = pixels.chunks(160).map(|row| RowRuns::find(row, 90)).collect();
        let found = count(Readout::Pixels(pixels, 160));
        assert_eq!(found, count(Readout::Rows(&rows)), "row {y}");
        found
    }

    #[test]
    fn a_run_of_equal_pixels_is_stuck_where_there_is_noise() {
        // Miri takes seconds for a row.
        let rows = || (0..120).step_by(if cfg!(miri) { 40 } else { 1 });
        for noise in [1, 2, 5, 20] {
            let clean = picture(noise);
            assert_eq!(rows().map(|y| stuck_places(&clean, y)).sum::<usize>(), 0, "{noise}");
            let mut stuck = clean.clone();
            stuck[80 * 160..80 * 160 + 140].fill(97);
            assert!(stuck_places(&stuck, 80) >= 140, "{noise}: the run itself");
            assert!(stuck_places(&stuck, 81) >= 140, "{noise}: the row below");
            assert_eq!(stuck_places(&stuck, 83), 0, "{noise}");
        }
    }

    #[test]
    fn black_and_saturated_runs_and_pictures_without_noise_do_not_count() {
        for value in [0, 255] {
            let mut pixels = picture(5);
            pixels[80 * 160..82 * 160].fill(value);
            assert_eq!(stuck_places(&pixels, 80), 0, "{value}");
        }
        let mut quiet = picture(0);
        quiet[80 * 160..80 * 160 + 140].fill(97);
        assert_eq!(stuck_places(&quiet, 80), 0);
        assert_eq!(stuck_places(&[], 0), 0);
    }

    #[test]
    fn a_few_stuck_places_are_left_to_the_fit() {
        let places = |stuck| StuckPlaces { candidate: 0, stuck, places: 64 };
        assert_eq!([0, 8, 9, 64].map(|n| places(n).is_stuck()), [false, false, true, true]);
    }
}
