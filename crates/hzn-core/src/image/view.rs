//! A picture whose kind is known only at run time.

use super::colour::{Channel, Colour};
use super::grey::Grey;
use super::layout::{ImageError, Layout};
use super::pixels::Pixels;

/// A picture whose kind is known only at run time, as on a workstation.
///
/// ```
/// use hzn_core::image::{Channel, ImageView, Layout, Pixels};
///
/// let view = ImageView::from_words(&[4095, 0], Layout::packed(2, 1, 1, 12), Channel::Mean)?;
/// assert_eq!((view.width(), view.full_scale(), view.at(0, 0)), (2, 4095, 4095));
/// # Ok::<(), hzn_core::image::ImageError>(())
/// ```
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

impl<'a> From<&Self> for ImageView<'a> {
    fn from(picture: &Self) -> Self {
        *picture
    }
}
impl<'a> From<&Grey<'a, u8>> for ImageView<'a> {
    fn from(picture: &Grey<'a, u8>) -> Self {
        Self::Grey8(*picture)
    }
}
impl<'a> From<&Grey<'a, u16>> for ImageView<'a> {
    fn from(picture: &Grey<'a, u16>) -> Self {
        Self::Grey16(*picture)
    }
}
impl<'a> From<&Colour<'a, u8>> for ImageView<'a> {
    fn from(picture: &Colour<'a, u8>) -> Self {
        Self::Colour8(*picture)
    }
}
impl<'a> From<&Colour<'a, u16>> for ImageView<'a> {
    fn from(picture: &Colour<'a, u16>) -> Self {
        Self::Colour16(*picture)
    }
}

// The kind is matched at every read, so that one compiled pipeline serves all four. A flight computer avoids the match:
// it uses the kinds themselves.
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
