//! A dark frame around the picture: rows and columns that the camera fills with black, as demosaicing and scaling do.
//!
//! Over a lit body it makes the picture's own outline an edge, to which the limb is joined at both ends.

use super::follow::BinaryPicture;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work::{self, WorkBudget};

/// Of a frame's pixels fewer than one in so many is lit, and of those next to it more than one in so many, of all
/// around the picture: where an image circle leaves few of them, they tell nothing.
const SPECKS: u32 = 64;
const LIT: u32 = 8;
/// Pixels between those that are looked at first: they tell of nearly every picture that it has none.
const COARSE: u16 = 64;

impl<T: Real, P: Pixels, O: Observer<T>> BinaryPicture<'_, T, P, O> {
    /// Width of the frame in pixels, `most` at most; 0 where there is none: light must come at once from its inner side
    /// on, and not grow from the picture's border inwards as that of a disc or a glare does.
    pub(crate) fn dark_frame_px(&self, most: u16, work: &mut WorkBudget) -> u16 {
        let (w, h) = (self.region.width(), self.region.height());
        let most = most.min(w.min(h).saturating_sub(1) / 4);
        let around = 2 * (u32::from(w) + u32::from(h));
        let is_dark = |lit: u32, stride: u16| lit * SPECKS * u32::from(stride) <= around;
        let is_lit = |lit: u32, stride: u16| lit * LIT * u32::from(stride) > around;
        if most == 0 || !is_dark(self.count_ring(0, COARSE), COARSE) || !is_lit(self.count_ring(most, COARSE), COARSE) {
            return 0;
        }
        for px in 0..=most {
            if !work.try_spend(work::ring(w, h)) {
                return 0;
            }
            let lit = self.count_ring(px, 1);
            if is_lit(lit, 1) {
                return px;
            }
            if !is_dark(lit, 1) {
                return 0;
            }
        }
        0
    }

    /// How many are lit of every `stride`-th of the region's pixels that are `px` from the picture's sides.
    fn count_ring(&self, px: u16, stride: u16) -> u32 {
        let (right, bottom) = (self.region.width().saturating_sub(1 + px), self.region.height().saturating_sub(1 + px));
        let mut lit = 0;
        let mut look = |x: u16, y: u16| {
            let is_lit = self.region.counts(x.into(), y.into()) && self.brightness(x, y) >= self.level;
            lit += u32::from(is_lit);
        };
        let stride = usize::from(stride.max(1));
        for x in (px..=right).step_by(stride) {
            look(x, px);
            look(x, bottom);
        }
        for y in (px + 1..bottom).step_by(stride) {
            look(px, y);
            look(right, y);
        }
        lit
    }
}
