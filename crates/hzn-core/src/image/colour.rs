//! A colour picture, read as one brightness per pixel.

use super::grey::{Grey, check};
use super::layout::{ImageError, Layout};
use super::pixels::Pixels;
use super::sample::Sample;
use crate::base::keys::choices;

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

/// A picture with interleaved colours, read as one brightness per pixel.
///
/// ```
/// use hzn_core::image::{Channel, Colour, Layout, Pixels};
///
/// let rgb = [10u8, 20, 33, 0, 0, 0];
/// let mean = Colour::try_new(&rgb, Layout::packed(2, 1, 3, 8), Channel::Mean)?;
/// let green = Colour::try_new(&rgb, Layout::packed(2, 1, 3, 8), Channel::Green)?;
/// assert_eq!((mean.at(0, 0), green.at(0, 0)), (21, 20));
/// # Ok::<(), hzn_core::image::ImageError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Colour<'a, S> {
    grey: Grey<'a, S>,
    channels: usize,
    first: usize,
    mean: bool,
}

impl<'a, S: Sample> Colour<'a, S> {
    /// Makes an interleaved colour picture, or grey with alpha (2 channels, where the mean is the first channel).
    pub fn try_new(data: &'a [S], layout: Layout, channel: Channel) -> Result<Self, ImageError> {
        let grey = check(data, layout)?;
        let colours: usize = match layout.channels {
            // A second channel is alpha, so it never enters the mean.
            1 | 2 => 1,
            _ => 3,
        };
        // The choice becomes an offset and a flag once, so that a read has no `match`.
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
            // One check of the slice serves three reads, and the code has no panic path.
            match self.grey.data.get(index..index + 3) {
                Some(&[r, g, b]) => ((u32::from(r.into()) + u32::from(g.into()) + u32::from(b.into())) / 3) as u16,
                _ => 0,
            }
        } else {
            self.grey.read(index)
        }
    }
}
