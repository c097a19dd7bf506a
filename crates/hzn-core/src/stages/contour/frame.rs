//! A dark frame around the picture: rows and columns that the camera fills with black, as demosaicing and scaling do.
//!
//! If a lit body reaches the frame, the outline of the picture becomes an edge that is joined to the limb at both ends.

use super::follow::BinaryPicture;
use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::model::work::{self, WorkBudget};

/// In a ring of the frame, at most one in `SPECKS` pixels is lit. In the ring next to the frame, more than one in `LIT`
/// is lit. Both fractions refer to the whole circumference of the picture: if an image circle leaves only few pixels of
/// it, these pixels do not show whether there is a frame.
const SPECKS: u32 = 64;
const LIT: u32 = 8;
/// Distance in pixels between the pixels that are read first. They show for nearly every picture that it has no frame.
const COARSE: u16 = 64;

impl<T: Real, P: Pixels, O: Observer<T>> BinaryPicture<'_, T, P, O> {
    /// Returns the width of the frame in pixels, at most `most`; 0 if there is none. The light must begin abruptly at
    /// the inner side of the frame. The light of a disc or a glare grows from the border of the picture inwards, and is
    /// no sign of a frame.
    // A photograph of the satellite OPS-SAT has such a frame of one pixel, which joined its limb to the outline of the
    // picture; therefore every picture is tested.
    pub(crate) fn dark_frame_px(&self, most: u16, work: &mut WorkBudget) -> u16 {
        let (w, h) = (self.region.width(), self.region.height());
        // At most a quarter is cut off on each side, so that a picture cannot vanish behind its frame.
        let most = most.min(w.min(h).saturating_sub(1) / 4);
        let around = 2 * (u32::from(w) + u32::from(h));
        let is_dark = |lit: u32, stride: u16| lit * SPECKS * u32::from(stride) <= around;
        let is_lit = |lit: u32, stride: u16| lit * LIT * u32::from(stride) > around;
        work.charge(work::ring_cost(w, h, COARSE, self.mask_cost()));
        if most == 0 || !is_dark(self.count_ring(0, COARSE), COARSE) || !is_lit(self.count_ring(most, COARSE), COARSE) {
            return 0;
        }
        for px in 0..=most {
            if !work.try_spend(work::ring_cost(w, h, 1, self.mask_cost())) {
                return 0;
            }
            let lit = self.count_ring(px, 1);
            if is_lit(lit, 1) {
                return px;
            }
            // Light that begins in the middle of the frame grows gradually, so it belongs to a disc or a glare.
            if !is_dark(lit, 1) {
                return 0;
            }
        }
        0
    }

    /// Returns how many pixels are lit, of every `stride`-th pixel of the region that is `px` pixels from the sides of
    /// the picture.
    fn count_ring(&self, px: u16, stride: u16) -> u32 {
        let (right, bottom) = (self.region.width().saturating_sub(1 + px), self.region.height().saturating_sub(1 + px));
        let mut lit = 0;
        let mut look = |x: u16, y: u16| {
            let is_lit = self.region.is_usable(x.into(), y.into()) && self.brightness(x, y) >= self.level;
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
