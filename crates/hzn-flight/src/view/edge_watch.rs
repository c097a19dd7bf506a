//! The edges of a picture, watched for stuck pixels and for the longest one, which a command asks for.

use core::cell::RefCell;

use hzn_core::observer::{Border, Observer};
use hzn_core::pixel::Pixel;
use hzn_core::report::Candidate;
use hzn_core::{Report, Solution};

use super::stuck::{PLACES, StuckPlaces, StuckWatch};

/// Most pixels of an edge that are sent.
// They make eight packets, which take 0.2 s of a line with 115 200 baud.
const MAX_PIXELS: usize = 512;

/// The longest edge of a picture, thinned to fit.
#[derive(Debug)]
pub(crate) struct LongestEdge {
    length: u32,
    pub(crate) candidate: u32,
    pub(crate) stride: u32,
    pixels: [Pixel; MAX_PIXELS],
    len: usize,
}

impl LongestEdge {
    /// No edge.
    pub(crate) const NONE: Self =
        Self { length: 0, candidate: 0, stride: 0, pixels: [Pixel { x: 0, y: 0 }; MAX_PIXELS], len: 0 };

    /// Removes the edge of the picture before.
    pub(super) fn clear(&mut self) {
        (self.length, self.len) = (0, 0);
    }

    /// Returns the pixels that were kept.
    pub(crate) fn pixels(&self) -> &[Pixel] {
        self.pixels.get(..self.len).unwrap_or_default()
    }
}

/// Watches the edges of a picture: keeps the longest one if it is wanted, and looks for stuck pixels along each. There
/// is only one type of observer, so that the pipeline is linked once.
pub(super) struct EdgeWatch<'a> {
    pub(super) wanted: bool,
    // Cells, because an observer gets `&self`. Their `borrow_mut` is not used, because it has a panic path.
    pub(super) longest: RefCell<&'a mut LongestEdge>,
    pub(super) stuck: RefCell<StuckWatch<'a>>,
}

impl Observer<f32> for EdgeWatch<'_> {
    fn begin_again(&self) {
        if let (Ok(mut longest), Ok(mut stuck)) = (self.longest.try_borrow_mut(), self.stuck.try_borrow_mut()) {
            longest.clear();
            stuck.clear();
        }
    }

    fn look(&self, _number: u32, _level: u16) {
        // The candidates of another look have the same numbers.
        if let Ok(mut stuck) = self.stuck.try_borrow_mut() {
            stuck.clear();
        }
    }

    fn edge(&self, candidate: u32, border: Border<'_>) {
        let (Ok(mut longest), Ok(mut stuck)) = (self.longest.try_borrow_mut(), self.stuck.try_borrow_mut()) else {
            return;
        };
        let list = &mut **longest;
        let (pixels, stride) = (border.len(), border.stride());
        // The stride counts, because a long edge is listed with gaps.
        let length = (pixels as u32).saturating_mul(stride);
        let is_kept = self.wanted && length > list.length;
        let most = if is_kept { MAX_PIXELS } else { PLACES };
        let every = pixels.div_ceil(most).max(1);
        if is_kept {
            (list.length, list.candidate, list.len) = (length, candidate, 0);
            list.stride = stride.saturating_mul(every as u32);
        }
        stuck.begin();
        for (place, pixel) in border.pixels().step_by(every).enumerate() {
            if is_kept && let Some(kept) = list.pixels.get_mut(place) {
                *kept = pixel;
                list.len += 1;
            }
            // `checked_rem`, because a plain remainder would be a panic path.
            if place.checked_rem(most / PLACES) == Some(0) {
                stuck.look_at(pixel);
            }
        }
    }

    fn verdict(&self, candidate: u32, _outcome: &Candidate<f32>, solution: Option<&Solution<f32>>) {
        // Only now the limb is known, so that places away from it can be left out.
        if let Some(solution) = solution
            && let Ok(mut stuck) = self.stuck.try_borrow_mut()
        {
            stuck.judge(candidate, solution);
        }
    }
}

impl EdgeWatch<'_> {
    /// Returns the stuck pixels at the limb of a report, if there are any.
    pub(super) fn found(self, report: &Report<f32>) -> Option<StuckPlaces> {
        report.solution.as_ref().and_then(|s| self.stuck.into_inner().found(s.candidate))
    }
}
