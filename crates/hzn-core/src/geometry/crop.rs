//! A rectangle of a picture or of a smaller copy of it. The division of a picture examines these rectangles.

use crate::base::real::Real;
use crate::geometry::pixel::{ImagePoint, Pixel};

/// A rectangle of a smaller copy of the picture, with the scale of the copy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Crop {
    /// First column and row in the copy.
    pub(crate) x0: u16,
    pub(crate) y0: u16,
    /// Number of columns and rows.
    pub(crate) width: u16,
    pub(crate) height: u16,
    /// Columns and rows of the picture, and those of the copy.
    pub(crate) full: [u16; 2],
    pub(crate) copy: [u16; 2],
}

impl Crop {
    /// Returns the whole of a copy with `height` rows, or the whole picture if it has at most `height` rows.
    pub(crate) fn whole(picture: [u16; 2], height: Option<u16>) -> Self {
        let copy = match height {
            Some(h) if h < picture[1] => {
                let (w, h, full) = (u32::from(picture[0]), u32::from(h), u32::from(picture[1]));
                // The width is rounded and not cut off, so that the copy keeps the shape of the picture as well as
                // whole pixels allow.
                [((w * h + full / 2) / full).min(w).max(1) as u16, h.max(1) as u16]
            }
            _ => picture,
        };
        Self { x0: 0, y0: 0, width: copy[0], height: copy[1], full: picture, copy }
    }

    /// Returns whether the rectangle is the picture itself.
    pub(crate) fn is_all(&self) -> bool {
        [self.width, self.height] == self.full
    }

    /// Returns the number of pixels.
    pub(crate) fn area(&self) -> u32 {
        u32::from(self.width) * u32::from(self.height)
    }

    /// Cuts the rectangle into halves across the longer side; `None` when it is a single pixel.
    pub(crate) fn halves(&self) -> Option<[Self; 2]> {
        let (mut a, mut b) = (*self, *self);
        // The longer side is cut, so that parts stay compact and a piece of limb is not cut more often than necessary.
        if self.width >= self.height {
            a.width = self.width / 2;
            // The second half takes the odd pixel; with two equal halves a column would belong to no part.
            b.width = self.width - a.width;
            b.x0 = self.x0 + a.width;
        } else {
            a.height = self.height / 2;
            b.height = self.height - a.height;
            b.y0 = self.y0 + a.height;
        }
        (a.area() > 0).then_some([a, b])
    }

    /// Returns the number of picture pixels per pixel of the crop, in x and y.
    pub(crate) fn scale<T: Real>(&self) -> [T; 2] {
        [0, 1].map(|k| T::from_f64(f64::from(self.full[k]) / f64::from(self.copy[k])))
    }

    /// Converts a point of the crop to a point of the picture.
    pub(crate) fn picture_point<T: Real>(&self, p: ImagePoint<T>) -> ImagePoint<T> {
        let ([sx, sy], half) = (self.scale(), T::from_f64(0.5));
        ImagePoint {
            // Half a pixel is added before and taken away after the scale, because pixel centres are at integers and
            // the corner of the picture at −½.
            u: (p.u + half + T::from_f64(f64::from(self.x0))) * sx - half,
            v: (p.v + half + T::from_f64(f64::from(self.y0))) * sy - half,
        }
    }

    /// Converts a point of the picture to a point of the crop.
    pub(crate) fn crop_point<T: Real>(&self, p: ImagePoint<T>) -> ImagePoint<T> {
        let ([sx, sy], half) = (self.scale(), T::from_f64(0.5));
        ImagePoint {
            u: (p.u + half) / sx - half - T::from_f64(f64::from(self.x0)),
            v: (p.v + half) / sy - half - T::from_f64(f64::from(self.y0)),
        }
    }

    /// Returns the pixel of the picture that contains the centre of a pixel of the crop.
    pub(crate) fn pixel(&self, x: u16, y: u16) -> Pixel {
        // The place is computed in integers, so that the same pixel is found on every machine.
        let place = |at: u16, first: u16, k: usize| {
            let at = 2 * (u64::from(at) + u64::from(first)) + 1;
            let last = u64::from(self.full[k]).saturating_sub(1);
            (at * u64::from(self.full[k]) / (2 * u64::from(self.copy[k].max(1)))).min(last) as u16
        };
        Pixel { x: place(x, self.x0, 0), y: place(y, self.y0, 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Halves a rectangle down to its pixels, and counts how often each of them occurs.
    fn count(crop: Crop, seen: &mut [[u8; 12]; 12]) {
        match crop.halves() {
            Some([a, b]) => {
                assert_eq!(a.area() + b.area(), crop.area());
                assert!(a.area() > 0 && b.area() > 0);
                count(a, seen);
                count(b, seen);
            }
            None => {
                assert_eq!(crop.area(), 1);
                seen[usize::from(crop.y0)][usize::from(crop.x0)] += 1;
            }
        }
    }

    #[test]
    fn every_small_rectangle_is_halved_into_each_of_its_pixels_once() {
        for (width, height) in (1..=12u16).flat_map(|w| (1..=12u16).map(move |h| (w, h))) {
            let mut seen = [[0; 12]; 12];
            count(Crop::whole([width, height], None), &mut seen);
            for (y, row) in seen.iter().enumerate() {
                for (x, &n) in row.iter().enumerate() {
                    assert_eq!(n == 1, x < width.into() && y < height.into(), "{width}×{height} at ({x}, {y})");
                    assert!(n <= 1);
                }
            }
        }
    }

    #[test]
    fn every_small_copy_keeps_its_pixels_within_the_picture() {
        for (width, height, rows) in
            (1..=12u16).flat_map(|w| (1..=12u16).flat_map(move |h| (0..=13u16).map(move |r| (w, h, r))))
        {
            let crop = Crop::whole([width, height], Some(rows));
            assert!(crop.width >= 1 && crop.width <= width && crop.height >= 1 && crop.height <= height);
            for (x, y) in (0..crop.width).flat_map(|x| (0..crop.height).map(move |y| (x, y))) {
                let Pixel { x: u, y: v } = crop.pixel(x, y);
                assert!(u < width && v < height, "{width}×{height} in {rows} rows: ({x}, {y}) is ({u}, {v})");
                // The pixel of the picture contains the centre of the pixel of the copy.
                let centre = crop.picture_point(ImagePoint { u: f64::from(x), v: f64::from(y) });
                assert!((centre.u - f64::from(u)).abs() <= 0.5 + 1e-9 && (centre.v - f64::from(v)).abs() <= 0.5 + 1e-9);
                let back = crop.crop_point(centre);
                assert!((back.u - f64::from(x)).abs() < 1e-9 && (back.v - f64::from(y)).abs() < 1e-9);
            }
        }
    }
}
