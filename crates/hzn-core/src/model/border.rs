//! The border pixels of an edge, as an observer receives them.

use crate::geometry::crop::Crop;
use crate::geometry::pixel::Pixel;

/// The border pixels of an edge that were kept, in order, in the coordinates of the whole picture.
#[derive(Debug, Clone, Copy)]
pub struct Border<'a> {
    pixels: &'a [Pixel],
    stride: u32,
    /// The part of the picture that the pixels were found in, if it is not the whole.
    crop: Option<Crop>,
}

impl<'a> Border<'a> {
    pub(crate) fn new(pixels: &'a [Pixel], stride: u32) -> Self {
        Self { pixels, stride, crop: None }
    }
    /// Returns the same border, if its pixels were found in a part of the picture.
    pub(crate) fn within(self, crop: Crop) -> Self {
        Self { crop: Some(crop), ..self }
    }
    /// Returns the pixels in order.
    pub fn pixels(&self) -> impl ExactSizeIterator<Item = Pixel> + use<'a> {
        let crop = self.crop;
        // The conversion is made on request, so that a picture without an observer does not pay for it.
        self.pixels.iter().map(move |p| crop.map_or(*p, |crop| crop.pixel(p.x, p.y)))
    }
    /// Returns the number of pixels.
    pub fn len(&self) -> usize {
        self.pixels.len()
    }
    /// Returns whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }
    /// Returns the distance between pixels that were kept, in pixels of the border: 1 if all were kept.
    pub fn stride(&self) -> u32 {
        self.stride
    }
}
