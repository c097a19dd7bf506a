//! A grey picture.

use super::layout::{ImageError, Layout};
use super::pixels::Pixels;
use super::sample::Sample;

/// A picture with one sample per pixel.
///
/// ```
/// use hzn_core::image::{Grey, ImageError, Layout};
///
/// let data = [0u8; 640 * 480];
/// assert!(Grey::try_new(&data, Layout::packed(640, 480, 1, 8)).is_ok());
/// // One row more than there is data for.
/// assert_eq!(Grey::try_new(&data, Layout::packed(640, 481, 1, 8)).unwrap_err(), ImageError::TooShort);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Grey<'a, S> {
    pub(super) data: &'a [S],
    pub(super) stride: usize,
    pub(super) width: u16,
    pub(super) height: u16,
    pub(super) full_scale: u16,
}

/// Checks that the data has the shape of the layout, whatever the number of channels.
pub(super) fn check<S: Sample>(data: &[S], l: Layout) -> Result<Grey<'_, S>, ImageError> {
    let (Ok(width @ 1..), Ok(height @ 1..)) = (u16::try_from(l.width), u16::try_from(l.height)) else {
        return Err(ImageError::Size);
    };
    if l.channels == 0 {
        return Err(ImageError::Channel);
    }
    if l.bits < 8 || l.bits > S::BITS {
        return Err(ImageError::Bits);
    }
    // The last row needs no padding behind it, because a view of a larger picture ends with the last sample of its last
    // row.
    let row = usize::from(width) * usize::from(l.channels);
    if l.stride < row {
        return Err(ImageError::Stride);
    }
    // The product may overflow on 32-bit targets, and a wrapped size would accept a buffer that is too short.
    let need = l.stride.checked_mul(usize::from(height) - 1).and_then(|n| n.checked_add(row));
    if need.is_none_or(|n| n > data.len()) {
        return Err(ImageError::TooShort);
    }
    // The shift is in 32 bits because 1 << 16 does not fit 16.
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
        // `get` links no panic path. The check of the size makes the 0 unreachable for pixels of the picture.
        self.data.get(index).map_or(0, |&s| s.into())
    }
    #[inline(always)]
    fn three(&self, index: usize) -> [u16; 3] {
        match self.data.get(index..index + 3) {
            // The check of three neighbours at once saves two of three comparisons; edge points read most pixels this
            // way.
            Some(&[a, b, c]) => [a.into(), b.into(), c.into()],
            _ => [0, 1, 2].map(|k| self.read(index + k)),
        }
    }
    #[inline(always)]
    fn run_length(&self, index: usize, count: usize, level: u16, lit: bool) -> usize {
        // The samples are contiguous here, so the search lines compare eight bytes at a time.
        self.data.get(index..index + count).map_or(0, |samples| S::run_length(samples, level, lit))
    }
}
