//! Draws lines and points with smooth edges on an RGB picture.

use std::collections::HashMap;

use image::RgbImage;

/// A colour: red, green, blue.
pub type Colour = [u8; 3];

/// An RGB picture to draw on, with round pens. Everything is clipped at the picture's border.
pub struct Canvas {
    /// The picture.
    pub image: RgbImage,
}

/// Mixes a colour into a pixel, by the part of it that is covered, from 0 to 1. A place outside of the picture has no
/// pixel.
pub(super) fn blend(image: &mut RgbImage, [x, y]: [i64; 2], colour: Colour, covered: f64) {
    let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
    let Some(pixel) = image.get_pixel_mut_checked(x, y) else { return };
    for (channel, to) in pixel.0.iter_mut().zip(colour) {
        *channel = (f64::from(*channel) * (1.0 - covered) + f64::from(to) * covered).round() as u8;
    }
}

/// Returns the part of a pixel that a round pen covers. `distance` is that of the pixel's centre from the middle of the
/// pen.
fn coverage(distance: f64, radius: f64) -> f64 {
    (radius.max(0.5) + 0.5 - distance).clamp(0.0, 1.0)
}

/// Returns the distance of a point from a segment, in pixels.
pub(super) fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let square = along[0] * along[0] + along[1] * along[1];
    let part = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / square;
    let part = if square > 0.0 { part.clamp(0.0, 1.0) } else { 0.0 };
    (p[0] - a[0] - part * along[0]).hypot(p[1] - a[1] - part * along[1])
}

impl Canvas {
    /// Draws a filled disc; centre and radius are in pixels.
    pub fn disc(&mut self, [u, v]: [f64; 2], radius_px: f64, colour: Colour) {
        let reach = radius_px.max(0.5) + 0.5;
        let size = [self.image.width(), self.image.height()];
        for y in span(v - reach, v + reach, size[1]) {
            for x in span(u - reach, u + reach, size[0]) {
                let from_centre = (f64::from(x) - u).hypot(f64::from(y) - v);
                blend(&mut self.image, [x.into(), y.into()], colour, coverage(from_centre, radius_px));
            }
        }
    }

    /// Draws a straight line with round ends; all lengths are in pixels.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], width_px: f64, colour: Colour) {
        self.polyline(&[a, b], width_px, colour);
    }

    /// Draws a line through several points.
    pub fn polyline(&mut self, points: &[[f64; 2]], width_px: f64, colour: Colour) {
        // A pixel where two parts of the line meet is covered once: mixing it twice would show the joints.
        let mut covered = HashMap::new();
        for pair in points.windows(2) {
            self.cover(pair[0], pair[1], width_px / 2.0, &mut covered);
        }
        for ([x, y], part) in covered {
            blend(&mut self.image, [x.into(), y.into()], colour, part);
        }
    }

    /// Adds the pixels next to a segment, with the part of each that the pen covers.
    fn cover(&self, a: [f64; 2], b: [f64; 2], radius: f64, covered: &mut HashMap<[u32; 2], f64>) {
        // A line far outside the picture would cost many steps without effect; limbs are clipped to the picture before.
        if !((b[0] - a[0]).hypot(b[1] - a[1]) <= 1e5) {
            return;
        }
        // One step for each column of a flat line, and for each row of a steep one.
        let (long, wide) = if (b[0] - a[0]).abs() >= (b[1] - a[1]).abs() { (0, 1) } else { (1, 0) };
        let size = [self.image.width(), self.image.height()];
        // The slope is at most 1, so across the line its width is at most √2 times as long.
        let reach = radius.max(0.5) + 0.5;
        for i in span(a[long].min(b[long]) - reach, a[long].max(b[long]) + reach, size[long]) {
            let length = b[long] - a[long];
            let part = if length == 0.0 { 0.0 } else { ((f64::from(i) - a[long]) / length).clamp(0.0, 1.0) };
            let middle = a[wide] + part * (b[wide] - a[wide]);
            for j in span(middle - 1.5 * reach, middle + 1.5 * reach, size[wide]) {
                let place = if long == 0 { [i, j] } else { [j, i] };
                let part = coverage(distance(place.map(f64::from), a, b), radius);
                if part > 0.0 {
                    let most = covered.entry(place).or_insert(0.0);
                    *most = part.max(*most);
                }
            }
        }
    }

    /// Darkens a rectangle; the picture remains visible in it.
    pub fn shade(&mut self, x: u32, y: u32, width: u32, height: u32) {
        for y in y..(y + height).min(self.image.height()) {
            for x in x..(x + width).min(self.image.width()) {
                let p = self.image.get_pixel_mut(x, y);
                p.0 = p.0.map(|c| c / 4);
            }
        }
    }
}

/// Returns the pixels of a row or column of `size` pixels from `low` to `high`; none if one of them is not finite.
fn span(low: f64, high: f64, size: u32) -> std::ops::Range<u32> {
    if !(low <= high) {
        return 0..0;
    }
    let last = f64::from(size);
    low.ceil().clamp(0.0, last) as u32..(high.floor() + 1.0).clamp(0.0, last) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(draw: impl Fn(&mut Canvas)) -> RgbImage {
        let mut canvas = Canvas { image: RgbImage::new(60, 40) };
        draw(&mut canvas);
        canvas.image
    }

    /// The brightness of a line is its length times its width, whatever its direction, also over joints.
    #[test]
    fn lines_are_as_wide_as_told_and_smooth() {
        let sum = |image: &RgbImage| image.pixels().map(|p| f64::from(p.0[0])).sum::<f64>() / 255.0;
        let white = [255; 3];
        for end in [[50.0, 10.3], [42.0, 33.0], [12.2, 35.0]] {
            let begin = [10.0, 10.0];
            let length = f64::hypot(end[0] - begin[0], end[1] - begin[1]);
            for width in [1.0, 2.0, 3.5] {
                let one = drawn(|c| c.line(begin, end, width, white));
                let expected = length * width + std::f64::consts::PI * (width / 2.0).powi(2);
                assert!((sum(&one) / expected - 1.0).abs() < 0.06, "{end:?} {width}: {} {expected}", sum(&one));
                let middle = [0, 1].map(|i| 0.5 * (begin[i] + end[i]));
                let two = drawn(|c| c.polyline(&[begin, middle, end], width, white));
                assert!((sum(&two) / sum(&one) - 1.0).abs() < 0.01, "a joint is not seen");
            }
        }
        let slanted = drawn(|c| c.line([10.0, 10.0], [50.0, 17.0], 2.0, white));
        assert!(slanted.pixels().filter(|p| p.0[0] > 20 && p.0[0] < 235).count() > 30, "smooth edges");
    }

    #[test]
    fn what_is_outside_or_no_number_draws_nothing() {
        let nothing = drawn(|_| {});
        for far in [f64::NAN, f64::INFINITY, -1e9, 1e9] {
            assert_eq!(nothing, drawn(|c| c.disc([far, 5.0], 3.0, [255; 3])));
            assert_eq!(nothing, drawn(|c| c.line([far, 5.0], [far, 9.0], 3.0, [255; 3])));
            assert_eq!(nothing, drawn(|c| c.line([5.0, 5.0], [far, 9.0], 3.0, [255; 3])));
        }
        assert_ne!(nothing, drawn(|c| c.disc([-1.0, 5.0], 3.0, [255; 3])), "a part is inside");
    }
}
