//! Draws into a picture by runs of pixels in its rows, and makes it smaller.
//!
//! A drawing for paper has tens of millions of pixels, so that no pixel is looked at that is not drawn.

use image::RgbImage;

use super::canvas::Colour;

/// A colour with its opacity, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ink {
    /// The colour.
    pub colour: Colour,
    /// The opacity.
    pub opacity: f64,
}

/// What rounding may take from a distance that is a whole number of pixels.
const ROUNDING: f64 = 1e-6;

/// Colours the pixels of a row from `left` to `right`, as far as they lie in the picture.
pub fn fill_row(image: &mut RgbImage, y: i64, [left, right]: [i64; 2], ink: Ink) {
    let (width, height) = image.dimensions();
    let (from, to) = (left.max(0), right.min(i64::from(width) - 1));
    if y < 0 || y >= i64::from(height) || from > to {
        return;
    }
    let row = y as usize * width as usize;
    let [first, end] = [from, to + 1].map(|x| 3 * (row + x as usize));
    let Some(pixels) = image.get_mut(first..end) else { return };
    let (own, other) = (ink.opacity, 1.0 - ink.opacity);
    for pixel in pixels.chunks_exact_mut(3) {
        if other <= 0.0 {
            pixel.copy_from_slice(&ink.colour);
            continue;
        }
        for (channel, to) in pixel.iter_mut().zip(ink.colour) {
            *channel = (f64::from(*channel) * other + f64::from(to) * own).round() as u8;
        }
    }
}

/// Draws all pixels whose distance from a segment is at most `radius`. The shape is convex, so that each row of pixels
/// has one part of it.
pub fn stroke(image: &mut RgbImage, [a, b]: [[f64; 2]; 2], radius: f64, ink: Ink) {
    let size = f64::from(image.height());
    let top = (a[1].min(b[1]) - radius).ceil().max(0.0) as i64;
    let bottom = (a[1].max(b[1]) + radius).floor().min(size) as i64;
    for y in top..=bottom {
        if let Some([left, right]) = part_of_row(a, b, radius, y as f64) {
            fill_row(image, y, [(left - ROUNDING).ceil() as i64, (right + ROUNDING).floor() as i64], ink);
        }
    }
}

/// Returns the part of the row `y` that is at most `radius` from the segment between `a` and `b`.
fn part_of_row(a: [f64; 2], b: [f64; 2], radius: f64, y: f64) -> Option<[f64; 2]> {
    let of_end = |p: [f64; 2]| {
        let half = radius * radius - (y - p[1]) * (y - p[1]);
        let half = (half > -ROUNDING).then(|| half.max(0.0).sqrt())?;
        Some([p[0] - half, p[0] + half])
    };
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    let between = || {
        let [u, v] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
        // The distance from the line is at most the radius, and the place along it lies between the ends.
        let across = solve(v, (y - a[1]) * u, [-radius, radius])?;
        let along = solve(u, -(y - a[1]) * v, [0.0, length])?;
        let both = [across[0].max(along[0]) + a[0], across[1].min(along[1]) + a[0]];
        (both[0] <= both[1] && both.iter().all(|x| x.is_finite())).then_some(both)
    };
    let parts = [of_end(a), of_end(b), if length > 0.0 { between() } else { None }];
    parts.into_iter().flatten().reduce(|p, q| [p[0].min(q[0]), p[1].max(q[1])])
}

/// Returns the range of `x` for which `slope * x - by` lies within a range; it is endless if the slope is zero.
fn solve(slope: f64, by: f64, [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    if slope.abs() < 1e-9 {
        return (low..=high).contains(&-by).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let [p, q] = [(low + by) / slope, (high + by) / slope];
    Some([p.min(q), p.max(q)])
}

/// Returns the picture in half its size: each pixel is the mean of four. An odd last row or column is left out.
pub fn halve(large: &RgbImage) -> RgbImage {
    let (width, height) = (large.width() / 2, large.height() / 2);
    let mut out = RgbImage::new(width, height);
    let (row, small) = (3 * large.width() as usize, 3 * width as usize);
    if small == 0 {
        return out;
    }
    for (rows, to) in large.chunks_exact(2 * row).zip(out.chunks_exact_mut(small)) {
        let (upper, lower) = rows.split_at(row);
        let pairs = upper.chunks_exact(6).zip(lower.chunks_exact(6));
        for (pixel, (above, below)) in to.chunks_exact_mut(3).zip(pairs) {
            let all = above.iter().zip(below).map(|(a, b)| u32::from(*a) + u32::from(*b));
            let mut sums = [2; 3];
            all.enumerate().for_each(|(n, sum)| sums[n % 3] += sum);
            pixel.iter_mut().zip(sums).for_each(|(channel, sum)| *channel = (sum / 4) as u8);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stroke_has_the_pixels_within_its_radius() {
        let ink = Ink { colour: [255; 3], opacity: 1.0 };
        for (a, b, radius) in [
            ([20.0, 30.0], [70.0, 30.0], 3.0),
            ([20.0, 30.0], [20.0, 80.0], 2.5),
            ([10.0, 10.0], [90.0, 77.0], 4.0),
            ([90.0, 5.0], [12.0, 60.0], 1.0),
            ([50.0, 50.0], [50.0, 50.0], 6.0),
            ([-30.0, 40.0], [140.0, 55.0], 2.0),
            ([15.0, 15.0], [16.0, 15.0], 0.5),
        ] {
            let mut image = RgbImage::new(100, 100);
            stroke(&mut image, [a, b], radius, ink);
            let along = [b[0] - a[0], b[1] - a[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            for (x, y, pixel) in image.enumerate_pixels() {
                let p = [f64::from(x) - a[0], f64::from(y) - a[1]];
                let part =
                    if square > 0.0 { ((p[0] * along[0] + p[1] * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                let distance = (p[0] - part * along[0]).hypot(p[1] - part * along[1]);
                if (distance - radius).abs() > 1e-3 {
                    assert_eq!(pixel.0[0] > 0, distance < radius, "{a:?} {b:?} at {x} {y}: {distance}");
                }
            }
        }
    }

    #[test]
    fn a_picture_is_halved_by_means_of_four() {
        let large = RgbImage::from_fn(5, 4, |x, y| image::Rgb([(10 * x + y) as u8, 255, 0]));
        let small = halve(&large);
        assert_eq!((small.dimensions(), small.get_pixel(1, 1).0), ((2, 2), [28, 255, 0]));
    }
}
