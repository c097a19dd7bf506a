//! The input picture. It is checked once; after that no read can fail.
//!
//! A picture is a borrowed slice of 8- or 16-bit samples, grey or interleaved colour, with any row stride. The pipeline
//! is generic over [`Pixels`]. Each kind of picture gets its own compiled copy, and a flight computer links only the
//! one that it uses.

#[cfg(feature = "horace")]
mod cropped;
pub mod region;

use core::fmt;

use crate::base::keys::choices;
use crate::geometry::block::Lit;

#[cfg(feature = "horace")]
pub(crate) use cropped::Cropped;

/// The input of the pipeline: one brightness per pixel.
pub trait Pixels {
    /// Whether the picture arrived row by row and is no longer in memory. Only [`Self::streamed_point`] then has its
    /// edges.
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
    fn across(&self) -> usize;
    /// Returns the index distance from a row to the next.
    fn down(&self) -> usize;
    /// Returns the brightness at an index; 0 beyond the end.
    fn read(&self, index: usize) -> u16;
    /// Returns the brightness at an index and at the two columns to the right of it.
    #[inline(always)]
    fn three(&self, index: usize) -> [u16; 3] {
        [0, 1, 2].map(|k| self.read(index + k * self.across()))
    }
    /// Counts pixels from an index to the right, up to `count`, before the first that is not as `lit` says. A pixel is
    /// lit at `level` or above.
    #[inline(always)]
    fn alike(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        (0..count).take_while(|k| (self.read(index + k * self.across()) >= level) == lit).count()
    }
    /// Returns the edge point of a border pixel, for a picture that arrived row by row. The point was measured while
    /// the rows around it were in memory.
    fn streamed_point(&self, _x: u16, _y: u16) -> Option<StreamedPoint> {
        None
    }
    /// Returns the brightness at column `x`, row `y`. The caller must stay within the picture; beyond it, the result is
    /// some other pixel or 0.
    #[inline(always)]
    fn at(&self, x: u16, y: u16) -> u16 {
        self.read(self.index(x, y))
    }
}

/// An edge point that is stored with its border pixel, see [`Pixels::streamed_point`].
#[derive(Debug, Clone, Copy)]
pub struct StreamedPoint {
    /// Distance from the pixel's centre, away from the light, px.
    pub(crate) towards_dark_px: f32,
    pub(crate) lit: Lit,
    /// Whether the point is located at the picture's threshold, because no local mid-level was found.
    pub(crate) fallback: bool,
    /// Whether its lit side is clipped at full scale.
    pub(crate) clipped: bool,
    /// Whether its plateaus were not within the rows that were held.
    pub(crate) cut: bool,
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
    fn alike(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        (**self).alike(index, count, level, lit)
    }
}

/// Why a picture was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageError {
    /// Width or height is zero, or above 65535.
    Size,
    /// The stride is shorter than a row of samples.
    Stride,
    /// The slice ends before the end of the last row.
    TooShort,
    /// There is no channel with that number, or the number of channels is zero.
    Channel,
    /// Bits per sample are not 8 for bytes, or not 8 to 16 for words.
    Bits,
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Size => "width and height must be 1 to 65535 pixels",
            Self::Stride => "the row stride is shorter than a row of samples",
            Self::TooShort => "the picture's data end before its last row",
            Self::Channel => "there is no channel of that number",
            Self::Bits => "bits per sample must be 8 for bytes and 8 to 16 for words",
        })
    }
}
impl core::error::Error for ImageError {}

choices! {
    /// The brightness of a colour pixel.
    pub enum Channel {
        /// The mean of the first three channels, rounded down; with fewer than three channels, the first one.
        @- Mean = "mean";
        /// The first channel (red, in RGB order).
        @- Red = "red";
        /// The second channel.
        @- Green = "green";
        /// The third channel.
        @- Blue = "blue";
    }
}

/// Shape of a picture in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples from the start of a row to the start of the next; at least `width * channels`.
    pub stride: usize,
    /// Interleaved samples per pixel: 1 grey, 3 RGB, 4 RGBA.
    pub channels: u8,
    /// Significant bits of a sample: 8 for bytes, 8 to 16 for words.
    pub bits: u8,
}

impl Layout {
    /// Makes the layout of a picture without padding.
    pub const fn packed(width: u32, height: u32, channels: u8, bits: u8) -> Self {
        Self { width, height, stride: width as usize * channels as usize, channels, bits }
    }
}

/// A byte or a 16-bit word.
pub trait Sample: Copy + Into<u16> {
    /// Largest number of significant bits.
    const BITS: u8;
    /// 0.
    const ZERO: Self;
    /// Counts the samples before the first that is not as `lit` says. A sample is lit at `level` or above.
    #[inline(always)]
    fn alike(samples: &[Self], level: u16, lit: bool) -> usize {
        samples.iter().take_while(|&&s| (s.into() >= level) == lit).count()
    }
}
impl Sample for u8 {
    const BITS: u8 = 8;
    const ZERO: Self = 0;
    /// Compares eight bytes at once. The high bit of `rest` says whether the low seven bits of a byte are at least
    /// those of the level. For a level with a high bit, a byte is at the level or above if both its own high bit and
    /// that of `rest` are set. For a level without a high bit, one of the two is enough.
    #[inline(always)]
    fn alike(samples: &[Self], level: u16, lit: bool) -> usize {
        const EACH: u64 = 0x0101_0101_0101_0101;
        const HIGH: u64 = 0x80 * EACH;
        if level > 255 {
            return if lit { 0 } else { samples.len() };
        }
        let all = |yes: bool| if yes { u64::MAX } else { 0 };
        let rest_of_level = u64::from(level & 0x7f) * EACH;
        let either = all(level < 128);
        let turn = either ^ all(lit);
        let (eights, last) = samples.as_chunks();
        let mut count = 0;
        for eight in eights {
            let bytes = u64::from_le_bytes(*eight);
            let rest = (bytes | HIGH).wrapping_sub(rest_of_level);
            let others = (((bytes ^ either) & (rest ^ either)) ^ turn) & HIGH;
            if others != 0 {
                return count + (others.trailing_zeros() / 8) as usize;
            }
            count += 8;
        }
        count + last.iter().take_while(|&&s| (u16::from(s) >= level) == lit).count()
    }
}
impl Sample for u16 {
    const BITS: u8 = 16;
    const ZERO: Self = 0;
}

/// A picture with one sample per pixel.
#[derive(Debug, Clone, Copy)]
pub struct Grey<'a, S> {
    data: &'a [S],
    stride: usize,
    width: u16,
    height: u16,
    full_scale: u16,
}

/// A picture with interleaved colours, read as one brightness per pixel.
#[derive(Debug, Clone, Copy)]
pub struct Colour<'a, S> {
    grey: Grey<'a, S>,
    channels: usize,
    first: usize,
    mean: bool,
}

fn check<S: Sample>(data: &[S], l: Layout) -> Result<Grey<'_, S>, ImageError> {
    let (Ok(width @ 1..), Ok(height @ 1..)) = (u16::try_from(l.width), u16::try_from(l.height)) else {
        return Err(ImageError::Size);
    };
    if l.channels == 0 {
        return Err(ImageError::Channel);
    }
    if l.bits < 8 || l.bits > S::BITS {
        return Err(ImageError::Bits);
    }
    let row = usize::from(width) * usize::from(l.channels);
    if l.stride < row {
        return Err(ImageError::Stride);
    }
    let need = l.stride.checked_mul(usize::from(height) - 1).and_then(|n| n.checked_add(row));
    if need.is_none_or(|n| n > data.len()) {
        return Err(ImageError::TooShort);
    }
    let full_scale = ((1u32 << l.bits) - 1) as u16;
    Ok(Grey { data, stride: l.stride, width, height, full_scale })
}

impl<'a, S: Sample> Grey<'a, S> {
    /// Makes a grey picture; `layout.channels` must be 1.
    pub fn try_new(data: &'a [S], layout: Layout) -> Result<Self, ImageError> {
        if layout.channels != 1 {
            return Err(ImageError::Channel);
        }
        check(data, layout)
    }
}

impl<'a, S: Sample> Colour<'a, S> {
    /// Makes an interleaved colour picture, or grey with alpha (2 channels, where the mean is the first channel).
    pub fn try_new(data: &'a [S], layout: Layout, channel: Channel) -> Result<Self, ImageError> {
        let grey = check(data, layout)?;
        let colours: usize = match layout.channels {
            1 | 2 => 1,
            _ => 3,
        };
        let (first, mean) = match channel {
            Channel::Mean => (0, colours == 3),
            Channel::Red => (0, false),
            Channel::Green => (1, false),
            Channel::Blue => (2, false),
        };
        if first >= colours {
            return Err(ImageError::Channel);
        }
        Ok(Self { grey, channels: usize::from(layout.channels), first, mean })
    }
}

impl<S: Sample> Pixels for Grey<'_, S> {
    fn width(&self) -> u16 {
        self.width
    }
    fn height(&self) -> u16 {
        self.height
    }
    fn full_scale(&self) -> u16 {
        self.full_scale
    }
    #[inline(always)]
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * self.stride + usize::from(x)
    }
    #[inline(always)]
    fn across(&self) -> usize {
        1
    }
    #[inline(always)]
    fn down(&self) -> usize {
        self.stride
    }
    #[inline(always)]
    fn read(&self, index: usize) -> u16 {
        self.data.get(index).map_or(0, |&s| s.into())
    }
    #[inline(always)]
    fn three(&self, index: usize) -> [u16; 3] {
        match self.data.get(index..index + 3) {
            Some(&[a, b, c]) => [a.into(), b.into(), c.into()],
            _ => [0, 1, 2].map(|k| self.read(index + k)),
        }
    }
    #[inline(always)]
    fn alike(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        self.data.get(index..index + count).map_or(0, |samples| S::alike(samples, level, lit))
    }
}

impl<S: Sample> Pixels for Colour<'_, S> {
    fn width(&self) -> u16 {
        self.grey.width
    }
    fn height(&self) -> u16 {
        self.grey.height
    }
    fn full_scale(&self) -> u16 {
        self.grey.full_scale
    }
    #[inline(always)]
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * self.grey.stride + usize::from(x) * self.channels + self.first
    }
    #[inline(always)]
    fn across(&self) -> usize {
        self.channels
    }
    #[inline(always)]
    fn down(&self) -> usize {
        self.grey.stride
    }
    #[inline(always)]
    fn read(&self, index: usize) -> u16 {
        if self.mean {
            match self.grey.data.get(index..index + 3) {
                Some(&[r, g, b]) => ((u32::from(r.into()) + u32::from(g.into()) + u32::from(b.into())) / 3) as u16,
                _ => 0,
            }
        } else {
            self.grey.read(index)
        }
    }
}

/// A picture whose kind is known only at run time, as on a workstation.
#[derive(Debug, Clone, Copy)]
pub enum ImageView<'a> {
    /// One byte per pixel.
    Grey8(Grey<'a, u8>),
    /// One word per pixel.
    Grey16(Grey<'a, u16>),
    /// Several bytes per pixel.
    Colour8(Colour<'a, u8>),
    /// Several words per pixel.
    Colour16(Colour<'a, u16>),
}

impl<'a> ImageView<'a> {
    /// Makes a picture from bytes.
    pub fn from_bytes(data: &'a [u8], layout: Layout, channel: Channel) -> Result<Self, ImageError> {
        Ok(if layout.channels == 1 {
            Self::Grey8(Grey::try_new(data, layout)?)
        } else {
            Self::Colour8(Colour::try_new(data, layout, channel)?)
        })
    }
    /// Makes a picture from 16-bit words.
    pub fn from_words(data: &'a [u16], layout: Layout, channel: Channel) -> Result<Self, ImageError> {
        Ok(if layout.channels == 1 {
            Self::Grey16(Grey::try_new(data, layout)?)
        } else {
            Self::Colour16(Colour::try_new(data, layout, channel)?)
        })
    }
}

macro_rules! forward {
    ($self:ident, $p:ident => $e:expr) => {
        match $self {
            ImageView::Grey8($p) => $e,
            ImageView::Grey16($p) => $e,
            ImageView::Colour8($p) => $e,
            ImageView::Colour16($p) => $e,
        }
    };
}

impl Pixels for ImageView<'_> {
    fn width(&self) -> u16 {
        forward!(self, p => p.width())
    }
    fn height(&self) -> u16 {
        forward!(self, p => p.height())
    }
    fn full_scale(&self) -> u16 {
        forward!(self, p => p.full_scale())
    }
    fn index(&self, x: u16, y: u16) -> usize {
        forward!(self, p => p.index(x, y))
    }
    fn across(&self) -> usize {
        forward!(self, p => p.across())
    }
    fn down(&self) -> usize {
        forward!(self, p => p.down())
    }
    fn read(&self, index: usize) -> u16 {
        forward!(self, p => p.read(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eight_pixels_at_once_are_as_one_by_one() {
        // This tests every threshold and some that no byte reaches, with samples at it, around it and far from it.
        for level in 0..=300u16 {
            for seed in 0..64u32 {
                let near = |k: usize| match seed.wrapping_mul(0x9E37_79B1).rotate_left(5 * k as u32) % 64 {
                    0 => 0,
                    1 => 255,
                    n => (i32::from(level) + n as i32 / 8 - if seed % 2 == 0 { 7 } else { 0 }).clamp(0, 255) as u8,
                };
                let bytes: [u8; 21] = core::array::from_fn(near);
                let words = bytes.map(u16::from);
                for lit in [false, true] {
                    assert_eq!(u8::alike(&bytes, level, lit), u16::alike(&words, level, lit), "{bytes:?} at {level}");
                }
            }
        }
        // If the pixels reach beyond the picture's end, the count is 0.
        let picture = Grey::try_new(&[9u8; 10], Layout::packed(10, 1, 1, 8)).unwrap();
        assert_eq!([0, 2, 3, 10].map(|i| picture.alike(i, 8, 5, true)), [8, 8, 0, 0]);
    }

    #[test]
    fn stride_and_channels_are_honoured() {
        let data = [1u8, 2, 3, 9, 9, 30, 60, 90, 9, 9];
        let l = Layout { width: 1, height: 2, stride: 5, channels: 3, bits: 8 };
        let mean = Colour::try_new(&data, l, Channel::Mean).unwrap();
        assert_eq!((mean.at(0, 0), mean.at(0, 1)), (2, 60));
        let blue = Colour::try_new(&data, l, Channel::Blue).unwrap();
        assert_eq!((blue.at(0, 0), blue.at(0, 1)), (3, 90));
    }

    #[test]
    fn short_or_odd_pictures_are_refused() {
        let data = [0u8; 11];
        assert_eq!(Grey::try_new(&data, Layout::packed(4, 3, 1, 8)).unwrap_err(), ImageError::TooShort);
        assert_eq!(Grey::try_new(&data, Layout::packed(0, 3, 1, 8)).unwrap_err(), ImageError::Size);
        assert_eq!(Grey::try_new(&data, Layout::packed(70_000, 1, 1, 8)).unwrap_err(), ImageError::Size);
        assert_eq!(Grey::try_new(&data, Layout::packed(3, 3, 1, 12)).unwrap_err(), ImageError::Bits);
        let l = Layout { width: 4, height: 2, stride: 3, channels: 1, bits: 8 };
        assert_eq!(Grey::try_new(&data, l).unwrap_err(), ImageError::Stride);
        // The last row need not be padded.
        let l = Layout { width: 1, height: 2, stride: 10, channels: 1, bits: 8 };
        assert!(Grey::try_new(&data, l).is_ok());
    }
}
