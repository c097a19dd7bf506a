//! The packets of the longest edge of a picture, which a command asks for.

use super::line::Line;
use crate::board::Board;
use crate::cuc::Cuc;
use crate::messages::{EDGE_PIXELS, EdgePart, EdgePixel};
use crate::packet::Apid;
use crate::view::LongestEdge;

/// Sends the edge in parts.
pub(super) fn send(edge: &LongestEdge, line: &mut Line, board: &mut impl Board, time: Cuc, picture: u32) {
    let pixels = edge.pixels();
    for (part, part_pixels) in pixels.chunks(EDGE_PIXELS).enumerate() {
        let head = EdgePart {
            picture,
            candidate: edge.candidate,
            stride: edge.stride,
            first: (part * EDGE_PIXELS) as u16,
            total: pixels.len() as u16,
            count: part_pixels.len() as u16,
        };
        line.send(board, Apid::Edge, time, |out| {
            head.write(out);
            // Filled up with zeros, because every packet has a fixed size.
            for place in 0..EDGE_PIXELS {
                let pixel = part_pixels.get(place).map_or(EdgePixel::default(), |p| EdgePixel { x: p.x, y: p.y });
                pixel.write(out);
            }
        });
    }
}
