//! A picture of any kind, read through a pointer.

use super::pixels::Pixels;

/// A picture that is read through a pointer, so that pictures of every kind use the same compiled pipeline. Each kind
/// of picture that the pipeline gets directly is another copy of the pipeline; use this one where code size and
/// compile time count more than speed: for pictures that somebody watches, and for crops.
///
/// ```
/// use hzn_core::image::{Grey, Indirect, Layout, Pixels};
///
/// let grey = Grey::try_new(&[3_u8, 4, 5, 6], Layout::packed(2, 2, 1, 8))?;
/// let read = |index| grey.read(index);
/// let picture = Indirect::new(&grey, &read);
/// assert_eq!((picture.width(), picture.full_scale(), picture.at(1, 1)), (2, 255, 6));
/// # Ok::<(), hzn_core::image::ImageError>(())
/// ```
#[derive(Clone, Copy)]
pub struct Indirect<'a> {
    read: &'a dyn Fn(usize) -> u16,
    size: [u16; 2],
    full_scale: u16,
    /// Index of the first pixel, and the steps from a column and from a row to the next.
    places: [usize; 3],
}

impl<'a> Indirect<'a> {
    /// Makes the picture; `read` returns the brightness of `picture` at an index, as [`Pixels::read`] does.
    pub fn new<P: Pixels>(picture: &P, read: &'a dyn Fn(usize) -> u16) -> Self {
        Self {
            read,
            size: [picture.width(), picture.height()],
            full_scale: picture.full_scale(),
            places: [picture.index(0, 0), picture.across(), picture.down()],
        }
    }
}

impl Pixels for Indirect<'_> {
    fn width(&self) -> u16 {
        self.size[0]
    }
    fn height(&self) -> u16 {
        self.size[1]
    }
    fn full_scale(&self) -> u16 {
        self.full_scale
    }
    fn index(&self, x: u16, y: u16) -> usize {
        let [first, across, down] = self.places;
        first + usize::from(x) * across + usize::from(y) * down
    }
    fn across(&self) -> usize {
        self.places[1]
    }
    fn down(&self) -> usize {
        self.places[2]
    }
    fn read(&self, index: usize) -> u16 {
        (self.read)(index)
    }
}
