//! The longest edge of a picture, which a command asks for.

use core::cell::RefCell;

use hzn_core::observer::Observer;
use hzn_core::pixel::Pixel;

use super::line::Line;
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

/// Keeps the longest edge if it is wanted. There is only one type of observer, so that the pipeline is linked once.
pub(super) struct EdgeWatch<'a> {
    pub(super) wanted: bool,
    pub(super) longest: RefCell<&'a mut LongestEdge>,
}

impl Observer<f32> for EdgeWatch<'_> {
    fn edge(&self, candidate: u32, border: impl Iterator<Item = Pixel>, stride: u32) {
        if !self.wanted {
            return;
        }
        let Ok(mut longest) = self.longest.try_borrow_mut() else { return };
        let (pixels, _) = border.size_hint();
        let length = (pixels as u32).saturating_mul(stride);
        if length <= longest.length {
            return;
        }
        let every = pixels.div_ceil(MAX_PIXELS).max(1);
        let list = &mut **longest;
        list.len = 0;
        for (place, pixel) in list.pixels.iter_mut().zip(border.step_by(every)) {
            *place = pixel;
            list.len += 1;
        }
        (list.length, list.candidate, list.stride) = (length, candidate, stride.saturating_mul(every as u32));
    }
}
