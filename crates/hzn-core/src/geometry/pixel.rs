//! Places in a picture. **The pixel-centre rule**, written once: the centre of the top-left pixel is (0, 0), x runs
//! right, y down; the centre of a w×h picture is ((w − 1)/2, (h − 1)/2).

/// An integer cell of the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pixel {
    /// Column, from 0 at the left.
    pub x: u16,
    /// Row, from 0 at the top.
    pub y: u16,
}

/// A point of the picture, finer than a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ImagePoint<T> {
    /// Right, in pixels.
    pub u: T,
    /// Down, in pixels.
    pub v: T,
}
