//! A rectangle of a picture, or a smaller copy of it, read from the picture itself; nothing is stored.

use super::Pixels;
use crate::geometry::crop::Crop;

/// A picture that is read through a crop. If the scales of the picture and of the crop differ, each read interpolates
/// between four pixels.
pub(crate) struct Cropped<'a, P> {
    picture: &'a P,
    crop: Crop,
}

impl<'a, P: Pixels> Cropped<'a, P> {
    pub(crate) fn new(picture: &'a P, crop: Crop) -> Self {
        Self { picture, crop }
    }

    /// Interpolates bilinearly between the four pixels around the centre of the crop's pixel (x, y), which is computed
    /// in 1/65536 of a pixel of the picture.
    fn between(&self, x: u16, y: u16) -> u16 {
        let place = |at: u16, first: u16, k: usize| -> (u16, u16, u64) {
            let (full, copy) = (i64::from(self.crop.full[k]), i64::from(self.crop.copy[k].max(1)));
            // The place is computed in integers, so that both precisions and every machine get the same copy.
            let centre = (2 * (i64::from(at) + i64::from(first)) + 1) * (full << 16) / (2 * copy) - (1 << 15);
            // Centres of the outer pixels may lie outside the centres of the picture's, where there is nothing to
            // interpolate.
            let centre = centre.min((full - 1) << 16).max(0);
            let low = centre >> 16;
            (low as u16, (low + 1).min(full - 1) as u16, (centre & 0xFFFF) as u64)
        };
        let (x0, x1, fx) = place(x, self.crop.x0, 0);
        let (y0, y1, fy) = place(y, self.crop.y0, 1);
        let at = |x: u16, y: u16| u64::from(self.picture.at(x, y));
        let across = |y: u16| at(x0, y) * (65536 - fx) + at(x1, y) * fx;
        // Half of the unit is added, so that the result is rounded and not cut off: a copy would otherwise be half a
        // count darker.
        ((across(y0) * (65536 - fy) + across(y1) * fy + (1 << 31)) >> 32) as u16
    }
}

impl<P: Pixels> Pixels for Cropped<'_, P> {
    fn width(&self) -> u16 {
        self.crop.width
    }
    fn height(&self) -> u16 {
        self.crop.height
    }
    fn full_scale(&self) -> u16 {
        self.picture.full_scale()
    }
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * usize::from(self.crop.width) + usize::from(x)
    }
    fn across(&self) -> usize {
        1
    }
    fn down(&self) -> usize {
        usize::from(self.crop.width)
    }
    fn read(&self, index: usize) -> u16 {
        let w = usize::from(self.crop.width).max(1);
        let (x, y) = ((index % w) as u16, index / w);
        if y >= usize::from(self.crop.height) {
            return 0;
        }
        // A rectangle of the picture itself needs no interpolation and keeps the same counts.
        if self.crop.copy == self.crop.full {
            return self.picture.at(self.crop.x0 + x, self.crop.y0 + y as u16);
        }
        self.between(x, y as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::pixel::ImagePoint;
    use crate::image::{Grey, Layout};
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn a_smaller_copy_of_a_ramp_is_a_ramp() {
        let data: Vec<u16> = (0..120 * 90).map(|i| (100 * (i % 120) + 3 * (i / 120)) as u16).collect();
        let picture = Grey::try_new(&data, Layout::packed(120, 90, 1, 16)).unwrap();
        for height in [10, 30, 45, 60, 89] {
            let crop = Crop::whole([120, 90], Some(height));
            let part = Cropped::new(&picture, crop);
            assert_eq!((part.height(), part.width()), (height, (120.0 * f64::from(height) / 90.0_f64).round() as u16));
            for y in 0..part.height() {
                for x in 0..part.width() {
                    let p = crop.picture_point(ImagePoint { u: f64::from(x), v: f64::from(y) });
                    let want = 100.0 * p.u.clamp(0.0, 119.0) + 3.0 * p.v.clamp(0.0, 89.0);
                    assert!((f64::from(part.at(x, y)) - want).abs() <= 1.0, "{height}: {x} {y}");
                    let near = crop.pixel(x, y);
                    assert!((f64::from(near.x) - p.u).abs() <= 0.51 && (f64::from(near.y) - p.v).abs() <= 0.51);
                }
            }
        }
        // At half the size, each pixel is the mean of four pixels and not a copy of one.
        let four: [u8; 16] = [0, 40, 80, 120, 8, 48, 88, 128, 0, 0, 0, 0, 0, 0, 0, 0];
        let picture = Grey::try_new(&four, Layout::packed(4, 4, 1, 8)).unwrap();
        let part = Cropped::new(&picture, Crop::whole([4, 4], Some(2)));
        assert_eq!([part.at(0, 0), part.at(1, 0)], [24, 104]);
    }

    proptest! {
        /// The smallest halves together cover the picture exactly once and read the same pixels.
        #[test]
        fn halves_cover_the_picture_once(w in 1u16..70, h in 1u16..70) {
            let data: Vec<u16> = (0..u32::from(w) * u32::from(h)).map(|i| i as u16).collect();
            let picture = Grey::try_new(&data, Layout::packed(w.into(), h.into(), 1, 16)).unwrap();
            let mut seen = std::vec![0u8; data.len()];
            let mut parts = std::vec![Crop::whole([w, h], None)];
            prop_assert!(parts[0].is_all());
            while let Some(crop) = parts.pop() {
                if crop.area() > 20 && let Some(halves) = crop.halves() {
                    parts.extend(halves);
                    continue;
                }
                let part = Cropped::new(&picture, crop);
                for y in 0..part.height() {
                    for x in 0..part.width() {
                        let place = crop.pixel(x, y);
                        prop_assert_eq!(part.at(x, y), picture.at(place.x, place.y));
                        seen[usize::from(place.y) * usize::from(w) + usize::from(place.x)] += 1;
                        let back = crop.crop_point(ImagePoint { u: f64::from(place.x), v: f64::from(place.y) });
                        prop_assert!((back.u - f64::from(x)).abs() < 1e-9 && (back.v - f64::from(y)).abs() < 1e-9);
                    }
                }
                prop_assert_eq!(part.read(usize::from(part.height()) * usize::from(part.width())), 0);
            }
            prop_assert!(seen.iter().all(|n| *n == 1));
        }
    }
}
