//! The interface between a picture and the pipeline.

use super::Profile;
use crate::geometry::block::Lit;

/// The input of the pipeline: one brightness per pixel.
///
/// # Example
///
/// A frame buffer with a layout of its own, here two pixels in each byte, needs the methods without a default:
///
/// ```
/// use hzn_core::image::Pixels;
///
/// struct Nibbles<'a>(&'a [u8]);
///
/// impl Pixels for Nibbles<'_> {
///     fn width(&self) -> u16 { 64 }
///     fn height(&self) -> u16 { 48 }
///     fn full_scale(&self) -> u16 { 15 }
///     fn index(&self, x: u16, y: u16) -> usize { usize::from(y) * 64 + usize::from(x) }
///     fn across(&self) -> usize { 1 }
///     fn down(&self) -> usize { 64 }
///     fn read(&self, index: usize) -> u16 {
///         let byte = self.0.get(index / 2).copied().unwrap_or(0);
///         u16::from(if index % 2 == 0 { byte >> 4 } else { byte & 15 })
///     }
/// }
///
/// let frame = [0x5a; 32 * 48];
/// assert_eq!((Nibbles(&frame).at(0, 0), Nibbles(&frame).at(1, 0)), (5, 10));
/// ```
pub trait Pixels {
    /// Whether the picture arrived row by row and is no longer in memory. The edge points then come from
    /// [`Self::streamed_point`] only.
    // It is a constant and not a method, so that a build for pictures in memory has no code for rows.
    const STREAMED: bool = false;
    /// Returns the number of columns, 1 to 65535.
    fn width(&self) -> u16;
    /// Returns the number of rows, 1 to 65535.
    fn height(&self) -> u16;
    /// Returns the largest value that a sample can have, for example 255 or 4095.
    fn full_scale(&self) -> u16;
    /// Returns the index of column `x`, row `y` in memory, for [`Self::read`].
    fn index(&self, x: u16, y: u16) -> usize;
    /// Returns the index distance from a column to the next.
    // Steps let a stage walk along a row by addition. Otherwise each read would multiply a row by its stride.
    fn across(&self) -> usize;
    /// Returns the index distance from a row to the next.
    fn down(&self) -> usize;
    /// Returns the brightness at an index; 0 beyond the end.
    fn read(&self, index: usize) -> u16;
    /// Returns the brightness at an index and at the two columns to the right of it.
    #[inline(always)]
    fn three(&self, index: usize) -> [u16; 3] {
        // A picture that knows its memory replaces this by one check; the default serves every other layout.
        [0, 1, 2].map(|k| self.read(index + k * self.across()))
    }
    /// Counts the pixels from an index to the right, at most `count`, before the first dark pixel (if `lit` is true) or
    /// the first lit pixel (if it is false). A pixel is lit at `level` or above.
    #[inline(always)]
    fn run_length(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        (0..count).take_while(|k| (self.read(index + k * self.across()) >= level) == lit).count()
    }
    /// Returns the edge point of a border pixel, for a picture that arrived row by row. The point was measured while
    /// the rows around it were in memory.
    fn streamed_point(&self, _x: u16, _y: u16) -> Option<StreamedPoint> {
        None
    }
    /// Returns the brightness at column `x`, row `y`. The caller must stay within the picture; beyond the picture, the
    /// result is some other pixel or 0.
    #[inline(always)]
    fn at(&self, x: u16, y: u16) -> u16 {
        self.read(self.index(x, y))
    }
}

/// An edge point that is stored with its border pixel, see [`Pixels::streamed_point`].
#[derive(Debug, Clone, Copy)]
pub struct StreamedPoint {
    /// Distance from the pixel's centre, away from the light, px; NaN if no point was found.
    // The type is f32 in both precisions, because the points of all border pixels of a picture are stored.
    pub(crate) towards_dark_px: f32,
    pub(crate) lit: Lit,
    /// Sum of those of [`Self::FALLBACK`], [`Self::CUT`] and [`Self::CLIPPED`] that apply.
    // With one byte for all of them the point is returned in two registers.
    pub(crate) marks: u8,
    /// Width and contrast of the edge at the point.
    pub(crate) profile: Profile,
}

impl StreamedPoint {
    /// The point is located at the picture's threshold, because no local mid-level was found.
    pub(crate) const FALLBACK: u8 = 1;
    /// One of its plateaus was not within the rows in memory.
    pub(crate) const CUT: u8 = 2;
    /// Its lit side is clipped at full scale.
    pub(crate) const CLIPPED: u8 = 4;
    /// Number of bits of the marks.
    pub(crate) const MARK_BITS: u8 = 3;
    /// No point was found, because its search left the rows in memory.
    pub(crate) const LOST: Self = Self {
        towards_dark_px: f32::NAN,
        lit: Lit::Right,
        marks: Self::CUT,
        profile: Profile { width: 0, contrast: 0 },
    };

    pub(crate) fn is(&self, mark: u8) -> bool {
        self.marks & mark > 0
    }
}

impl<P: Pixels> Pixels for &P {
    const STREAMED: bool = P::STREAMED;
    fn streamed_point(&self, x: u16, y: u16) -> Option<StreamedPoint> {
        (**self).streamed_point(x, y)
    }
    fn width(&self) -> u16 {
        (**self).width()
    }
    fn height(&self) -> u16 {
        (**self).height()
    }
    fn full_scale(&self) -> u16 {
        (**self).full_scale()
    }
    #[inline(always)]
    fn index(&self, x: u16, y: u16) -> usize {
        (**self).index(x, y)
    }
    #[inline(always)]
    fn across(&self) -> usize {
        (**self).across()
    }
    #[inline(always)]
    fn down(&self) -> usize {
        (**self).down()
    }
    #[inline(always)]
    fn read(&self, index: usize) -> u16 {
        (**self).read(index)
    }
    #[inline(always)]
    fn three(&self, index: usize) -> [u16; 3] {
        (**self).three(index)
    }
    #[inline(always)]
    fn run_length(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        (**self).run_length(index, count, level, lit)
    }
}
