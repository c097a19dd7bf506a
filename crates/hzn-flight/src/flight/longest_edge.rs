//! The longest edge of a picture, which a command asks for.

use core::cell::RefCell;

use hzn_core::observer::Observer;
use hzn_core::pixel::Pixel;
use hzn_core::report::MAX_LISTED;

use super::line::Line;
use super::stuck::{Equality, StuckPlaces};
use crate::board::Board;
use crate::cuc::Cuc;
use crate::messages::{EDGE_PIXELS, EdgePart, EdgePixel};
use crate::packet::Apid;

/// Most pixels of an edge that are sent.
const MAX_PIXELS: usize = 512;

/// The longest edge of a picture, thinned to fit.
#[derive(Debug)]
pub(super) struct LongestEdge {
    length: u32,
    candidate: u32,
    stride: u32,
    pixels: [Pixel; MAX_PIXELS],
    len: usize,
}

impl LongestEdge {
    /// No edge.
    pub(super) const NONE: Self =
        Self { length: 0, candidate: 0, stride: 0, pixels: [Pixel { x: 0, y: 0 }; MAX_PIXELS], len: 0 };

    /// Removes the edge of the picture before.
    pub(super) fn clear(&mut self) {
        (self.length, self.len) = (0, 0);
    }

    /// Sends the edge in parts.
    pub(super) fn send(&self, line: &mut Line, board: &mut impl Board, time: Cuc, picture: u32) {
        let pixels = self.pixels.get(..self.len).unwrap_or_default();
        for (part, pixels) in pixels.chunks(EDGE_PIXELS).enumerate() {
            let head = EdgePart {
                picture,
                candidate: self.candidate,
                stride: self.stride,
                first: (part * EDGE_PIXELS) as u16,
                total: self.len as u16,
                count: pixels.len() as u16,
            };
            line.send(board, Apid::Edge, time, |out| {
                head.write(out);
                for place in 0..EDGE_PIXELS {
                    let pixel = pixels.get(place).map_or(EdgePixel::default(), |p| EdgePixel { x: p.x, y: p.y });
                    pixel.write(out);
                }
            });
        }
    }
}

/// Watches the edges of a picture: keeps the longest one if it is wanted, and looks for stuck pixels along each. There
/// is only one type of observer, so that the pipeline is linked once.
pub(super) struct EdgeWatch<'a> {
    pub(super) wanted: bool,
    pub(super) longest: RefCell<&'a mut LongestEdge>,
    /// The pixels of the picture, and its width.
    pub(super) pixels: &'a [u8],
    pub(super) width: usize,
    pub(super) equality: Equality,
    /// The edges with stuck places. Pictures with more such edges have stuck places in all further ones.
    pub(super) stuck: RefCell<heapless::Vec<StuckPlaces, MAX_LISTED>>,
}

impl EdgeWatch<'_> {
    /// Returns what was found along the edge of a candidate, if it is stuck.
    pub(super) fn stuck_places(&self, candidate: u32) -> Option<StuckPlaces> {
        let list = self.stuck.try_borrow().ok()?;
        let found = list.iter().find(|places| places.candidate == candidate).copied();
        found.or(list.last().filter(|_| list.is_full()).copied()).filter(StuckPlaces::is_stuck)
    }
}

impl Observer<f32> for EdgeWatch<'_> {
    fn look(&self, _number: u32, _level: u16) {
        // The candidates of another look have the same numbers.
        if let Ok(mut stuck) = self.stuck.try_borrow_mut() {
            stuck.clear();
        }
    }
    fn edge(&self, candidate: u32, border: impl Iterator<Item = Pixel>, stride: u32) {
        let Ok(mut longest) = self.longest.try_borrow_mut() else { return };
        let list = &mut **longest;
        let (pixels, _) = border.size_hint();
        let length = (pixels as u32).saturating_mul(stride);
        let is_kept = self.wanted && length > list.length;
        let most = if is_kept { MAX_PIXELS } else { StuckPlaces::MOST };
        let every = pixels.div_ceil(most).max(1);
        if is_kept {
            (list.length, list.candidate, list.len) = (length, candidate, 0);
            list.stride = stride.saturating_mul(every as u32);
        }
        let mut found = StuckPlaces { candidate, ..StuckPlaces::default() };
        for (place, pixel) in border.step_by(every).enumerate() {
            if is_kept && let Some(kept) = list.pixels.get_mut(place) {
                *kept = pixel;
                list.len += 1;
            }
            if place % (most / StuckPlaces::MOST) == 0 {
                found.places += 1;
                found.stuck += u32::from(self.equality.is_stuck(self.pixels, self.width, pixel));
            }
        }
        if found.is_stuck()
            && let Ok(mut stuck) = self.stuck.try_borrow_mut()
        {
            // A list that is full is dealt with above.
            let _ = stuck.push(found);
        }
    }
}
