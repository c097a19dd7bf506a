//! A part of a picture, or a smaller copy of it, read from the picture itself: nothing is stored.

use super::Pixels;
use crate::pixel::{ImagePoint, Pixel};
use crate::real::Real;

/// A rectangle of the picture's smaller copy, and how much smaller that is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    /// First column and row in the copy.
    pub(crate) x0: u16,
    pub(crate) y0: u16,
    /// Columns and rows.
    pub(crate) width: u16,
    pub(crate) height: u16,
    /// The picture's columns and rows, and the copy's.
    full: [u16; 2],
    copy: [u16; 2],
}

impl Window {
    /// All of a copy of `height` rows (all of the picture itself, when it has no more).
    pub(crate) fn whole(picture: [u16; 2], height: Option<u16>) -> Self {
        let copy = match height {
            Some(h) if h < picture[1] => {
                let (w, h, full) = (u32::from(picture[0]), u32::from(h), u32::from(picture[1]));
                [((w * h + full / 2) / full).min(w).max(1) as u16, h.max(1) as u16]
            }
            _ => picture,
        };
        Self { x0: 0, y0: 0, width: copy[0], height: copy[1], full: picture, copy }
    }

    /// Whether it is the picture itself.
    pub(crate) fn is_all(&self) -> bool {
        [self.width, self.height] == self.full
    }

    /// Pixels.
    pub(crate) fn area(&self) -> u32 {
        u32::from(self.width) * u32::from(self.height)
    }

    /// Its halves across the longer side; `None` when there is only a pixel.
    pub(crate) fn halves(&self) -> Option<[Self; 2]> {
        let (mut a, mut b) = (*self, *self);
        if self.width >= self.height {
            a.width = self.width / 2;
            b.width = self.width - a.width;
            b.x0 = self.x0 + a.width;
        } else {
            a.height = self.height / 2;
            b.height = self.height - a.height;
            b.y0 = self.y0 + a.height;
        }
        (a.area() > 0).then_some([a, b])
    }

    /// Pixels of the picture a pixel of the window, in x and y.
    pub(crate) fn scale<T: Real>(&self) -> [T; 2] {
        [0, 1].map(|k| T::of(f64::from(self.full[k]) / f64::from(self.copy[k])))
    }

    /// A place of the window in the picture.
    pub(crate) fn in_picture<T: Real>(&self, p: ImagePoint<T>) -> ImagePoint<T> {
        let ([sx, sy], half) = (self.scale(), T::of(0.5));
        ImagePoint {
            u: (p.u + half + T::of(f64::from(self.x0))) * sx - half,
            v: (p.v + half + T::of(f64::from(self.y0))) * sy - half,
        }
    }

    /// A place of the picture in the window.
    pub(crate) fn of_picture<T: Real>(&self, p: ImagePoint<T>) -> ImagePoint<T> {
        let ([sx, sy], half) = (self.scale(), T::of(0.5));
        ImagePoint {
            u: (p.u + half) / sx - half - T::of(f64::from(self.x0)),
            v: (p.v + half) / sy - half - T::of(f64::from(self.y0)),
        }
    }

    /// The picture's pixel in which the centre of a pixel of the window lies.
    pub(crate) fn pixel(&self, x: u16, y: u16) -> Pixel {
        let place = |at: u16, first: u16, k: usize| {
            let at = 2 * (u64::from(at) + u64::from(first)) + 1;
            let last = u64::from(self.full[k]).saturating_sub(1);
            (at * u64::from(self.full[k]) / (2 * u64::from(self.copy[k].max(1)))).min(last) as u16
        };
        Pixel { x: place(x, self.x0, 0), y: place(y, self.y0, 1) }
    }
}

/// A picture seen through a window: four pixels are interpolated on reading, unless the window is of the same scale.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part<'a, P> {
    picture: &'a P,
    window: Window,
}

impl<'a, P: Pixels> Part<'a, P> {
    pub(crate) fn new(picture: &'a P, window: Window) -> Self {
        Self { picture, window }
    }

    /// Bilinear: the centre of the window's pixel (x, y) in the picture, in 1/65536 of a pixel, from the four around.
    fn between(&self, x: u16, y: u16) -> u16 {
        let place = |at: u16, first: u16, k: usize| -> (u16, u16, u64) {
            let (full, copy) = (i64::from(self.window.full[k]), i64::from(self.window.copy[k].max(1)));
            let centre = (2 * (i64::from(at) + i64::from(first)) + 1) * (full << 16) / (2 * copy) - (1 << 15);
            let centre = centre.min((full - 1) << 16).max(0);
            let low = centre >> 16;
            (low as u16, (low + 1).min(full - 1) as u16, (centre & 0xFFFF) as u64)
        };
        let (x0, x1, fx) = place(x, self.window.x0, 0);
        let (y0, y1, fy) = place(y, self.window.y0, 1);
        let at = |x: u16, y: u16| u64::from(self.picture.at(x, y));
        let across = |y: u16| at(x0, y) * (65536 - fx) + at(x1, y) * fx;
        ((across(y0) * (65536 - fy) + across(y1) * fy + (1 << 31)) >> 32) as u16
    }
}

impl<P: Pixels> Pixels for Part<'_, P> {
    fn width(&self) -> u16 {
        self.window.width
    }
    fn height(&self) -> u16 {
        self.window.height
    }
    fn full_scale(&self) -> u16 {
        self.picture.full_scale()
    }
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * usize::from(self.window.width) + usize::from(x)
    }
    fn across(&self) -> usize {
        1
    }
    fn down(&self) -> usize {
        usize::from(self.window.width)
    }
    fn read(&self, index: usize) -> u16 {
        let w = usize::from(self.window.width).max(1);
        let (x, y) = ((index % w) as u16, index / w);
        if y >= usize::from(self.window.height) {
            return 0;
        }
        if self.window.copy == self.window.full {
            return self.picture.at(self.window.x0 + x, self.window.y0 + y as u16);
        }
        self.between(x, y as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{Grey, Layout};
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn a_smaller_copy_of_a_ramp_is_a_ramp() {
        let data: Vec<u16> = (0..120 * 90).map(|i| (100 * (i % 120) + 3 * (i / 120)) as u16).collect();
        let picture = Grey::try_new(&data, Layout::packed(120, 90, 1, 16)).unwrap();
        for height in [10, 30, 45, 60, 89] {
            let window = Window::whole([120, 90], Some(height));
            let part = Part::new(&picture, window);
            assert_eq!((part.height(), part.width()), (height, (120.0 * f64::from(height) / 90.0_f64).round() as u16));
            for y in 0..part.height() {
                for x in 0..part.width() {
                    let p = window.in_picture(ImagePoint { u: f64::from(x), v: f64::from(y) });
                    let want = 100.0 * p.u.clamp(0.0, 119.0) + 3.0 * p.v.clamp(0.0, 89.0);
                    assert!((f64::from(part.at(x, y)) - want).abs() <= 1.0, "{height}: {x} {y}");
                    let near = window.pixel(x, y);
                    assert!((f64::from(near.x) - p.u).abs() <= 0.51 && (f64::from(near.y) - p.v).abs() <= 0.51);
                }
            }
        }
        // A half is not a whole pixel beside: four pixels' mean.
        let four: [u8; 16] = [0, 40, 80, 120, 8, 48, 88, 128, 0, 0, 0, 0, 0, 0, 0, 0];
        let picture = Grey::try_new(&four, Layout::packed(4, 4, 1, 8)).unwrap();
        let part = Part::new(&picture, Window::whole([4, 4], Some(2)));
        assert_eq!([part.at(0, 0), part.at(1, 0)], [24, 104]);
    }

    proptest! {
        /// Halves down to the smallest cover the picture once, and read the same pixels.
        #[test]
        fn halves_cover_the_picture_once(w in 1u16..70, h in 1u16..70) {
            let data: Vec<u16> = (0..u32::from(w) * u32::from(h)).map(|i| i as u16).collect();
            let picture = Grey::try_new(&data, Layout::packed(w.into(), h.into(), 1, 16)).unwrap();
            let mut seen = std::vec![0u8; data.len()];
            let mut parts = std::vec![Window::whole([w, h], None)];
            prop_assert!(parts[0].is_all());
            while let Some(window) = parts.pop() {
                if window.area() > 20 && let Some(halves) = window.halves() {
                    parts.extend(halves);
                    continue;
                }
                let part = Part::new(&picture, window);
                for y in 0..part.height() {
                    for x in 0..part.width() {
                        let at = window.pixel(x, y);
                        prop_assert_eq!(part.at(x, y), picture.at(at.x, at.y));
                        seen[usize::from(at.y) * usize::from(w) + usize::from(at.x)] += 1;
                        let back = window.of_picture(ImagePoint { u: f64::from(at.x), v: f64::from(at.y) });
                        prop_assert!((back.u - f64::from(x)).abs() < 1e-9 && (back.v - f64::from(y)).abs() < 1e-9);
                    }
                }
                prop_assert_eq!(part.read(usize::from(part.height()) * usize::from(part.width())), 0);
            }
            prop_assert!(seen.iter().all(|n| *n == 1));
        }
    }
}
