//! Shape of a picture in memory, and the reasons why a picture can be refused.

use core::fmt;

/// Reason why a picture is refused.
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
            Self::Channel => "the picture has no channel with this number",
            Self::Bits => "bits per sample must be 8 for bytes and 8 to 16 for words",
        })
    }
}

impl core::error::Error for ImageError {}

/// Shape of a picture in memory.
///
/// ```
/// use hzn_core::image::{Grey, Layout};
///
/// // A 12-bit camera whose rows of 640 samples begin every 672 samples.
/// let data = vec![0u16; 672 * 480];
/// let layout = Layout { stride: 672, ..Layout::packed(640, 480, 1, 12) };
/// assert!(Grey::try_new(&data, layout).is_ok());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Columns.
    // The fields are wider than a picture may be, so that a larger picture is refused instead of cut off by a cast.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples from the start of a row to the start of the next; at least `width * channels`.
    // The stride is in samples and not in bytes, because a slice of words is indexed in words.
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
