//! Turns a picture, as `input.orient` or its EXIF says.

use hzn_core::config::Orient;
use hzn_core::image::Layout;
use image::metadata::Orientation;

use super::picture::{Picture, Samples};

/// Chooses the turn of a picture, from `input.orient` and its EXIF orientation.
pub(super) fn choose(orient: Orient, exif: Orientation) -> Orientation {
    match orient {
        Orient::Exif => exif,
        Orient::Rotate90 => Orientation::Rotate90,
        Orient::Rotate180 => Orientation::Rotate180,
        Orient::Rotate270 => Orientation::Rotate270,
        _ => Orientation::NoTransforms,
    }
}

/// Returns whether the turn exchanges width and height.
pub(super) fn swaps_sides(turn: Orientation) -> bool {
    use Orientation as O;
    matches!(turn, O::Rotate90 | O::Rotate270 | O::Rotate90FlipH | O::Rotate270FlipH)
}

/// Returns the turn in words, for a message.
pub(super) fn describe(turn: Orientation) -> &'static str {
    match turn {
        Orientation::NoTransforms => "as it is",
        Orientation::Rotate90 => "turned by 90 degrees clockwise",
        Orientation::Rotate180 => "turned by 180 degrees",
        Orientation::Rotate270 => "turned by 90 degrees counter-clockwise",
        Orientation::FlipHorizontal | Orientation::FlipVertical => "mirrored",
        Orientation::Rotate90FlipH | Orientation::Rotate270FlipH => "turned and mirrored",
    }
}

/// Returns the turned picture.
pub(super) fn apply(picture: Picture, turn: Orientation) -> Picture {
    if turn == Orientation::NoTransforms {
        return picture;
    }
    let from = picture.layout;
    let (width, height) = if swaps_sides(turn) { (from.height, from.width) } else { (from.width, from.height) };
    let layout = Layout { bits: from.bits, ..Layout::packed(width, height, from.channels, from.bits) };
    let samples = match &picture.samples {
        Samples::Bytes(data) => Samples::Bytes(rearrange(data, from, layout, turn)),
        Samples::Words(data) => Samples::Words(rearrange(data, from, layout, turn)),
    };
    Picture { samples, layout, ..picture }
}

fn rearrange<S: Copy>(data: &[S], from: Layout, to: Layout, turn: Orientation) -> Vec<S> {
    use Orientation as O;
    let (w, h, n) = (from.width as usize, from.height as usize, usize::from(from.channels));
    let mut out = Vec::with_capacity(data.len());
    for y in 0..to.height as usize {
        for x in 0..to.width as usize {
            // The position of this pixel in the stored picture.
            let (column, row) = match turn {
                O::NoTransforms => (x, y),
                O::Rotate90 => (y, h - 1 - x),
                O::Rotate180 => (w - 1 - x, h - 1 - y),
                O::Rotate270 => (w - 1 - y, x),
                O::FlipHorizontal => (w - 1 - x, y),
                O::FlipVertical => (x, h - 1 - y),
                O::Rotate90FlipH => (y, x),
                O::Rotate270FlipH => (w - 1 - y, h - 1 - x),
            };
            let at = row * from.stride + column * n;
            out.extend(data.get(at..at + n).unwrap_or_default());
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{DynamicImage, RgbImage};

    #[test]
    fn every_orientation_is_that_of_the_image_library() {
        let data: Vec<u8> = (0..3 * 2 * 3).collect();
        let picture = Picture::new(Samples::Bytes(data.clone()), Layout::packed(3, 2, 3, 8));
        for number in 1..=8 {
            let turn = Orientation::from_exif(number).unwrap();
            let mut expected = DynamicImage::ImageRgb8(RgbImage::from_raw(3, 2, data.clone()).unwrap());
            expected.apply_orientation(turn);
            let found = apply(picture.clone(), turn);
            assert_eq!((found.layout.width, found.layout.height), (expected.width(), expected.height()), "{turn:?}");
            let Samples::Bytes(found) = found.samples else { panic!() };
            assert_eq!(found, expected.as_bytes(), "{turn:?}");
        }
    }
}
