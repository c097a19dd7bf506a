//! Image coordinates, with **the pixel-centre rule**: the centre of the top-left pixel is (0, 0), x points right and y
//! down. The centre of a w×h picture is ((w − 1)/2, (h − 1)/2).

/// A pixel of the picture, with integer coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
// Sixteen bits are enough because a picture has at most 65535 columns and rows; the lists of border pixels take half of
// the memory that way.
pub struct Pixel {
    /// Column, from 0 at the left.
    pub x: u16,
    /// Row, from 0 at the top.
    pub y: u16,
}

/// A point of the picture with sub-pixel coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImagePoint<T> {
    /// Coordinate to the right, in pixels.
    pub u: T,
    /// Coordinate downwards, in pixels.
    pub v: T,
}
