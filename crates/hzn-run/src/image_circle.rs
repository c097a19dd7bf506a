//! Finds the image circle of a fisheye in several pictures of a flight. Its rim is a sharp, round edge before a dark
//! ground, so that it looks like the limb of a large body.
//!
//! The circle shows itself by what changes: beyond it every picture is dark, and within it the sky, which is dark, lies
//! in another place in each picture. A camera that always looks at the nadir and sees the whole Earth has the same dark
//! surroundings, but the Earth fills its circle.

use crate::source::Picture;

/// Number of directions from the picture's centre.
const DIRECTIONS: usize = 120;
/// Share of the contrast at which the rim is, between the dark ground and the bright parts of all pictures.
const RIM: f64 = 0.25;
/// The ground is dark if its level and its noise stay below this share of the contrast.
const DARK: f64 = 0.1;
/// Share of the directions in which the rim must lie on one circle.
const MIN_SHARE: f64 = 0.6;
/// Largest distance of a place of the rim from the circle, and of its centre from the picture's, as a share of the
/// radius. A rim is as round as the tube of the lens; sensors are mounted to a few percent.
const ROUND: f64 = 0.015;
const MAX_OFFSET: f64 = 0.06;
/// Smallest share of the rim, on average over the pictures, at which the sky is dark.
const MIN_SKY: f64 = 0.15;
/// Rounds of the fit.
const SWEEPS: usize = 20;
/// Fewer pictures do not show what changes.
const MIN_PICTURES: usize = 3;

/// Returns the radius of a circle about the picture's centre within which light arrives, in pixels; `None` if the
/// pictures do not show an image circle.
pub(crate) fn find_image_circle(pictures: &[Picture]) -> Option<f64> {
    let first = pictures.first().filter(|_| pictures.len() >= MIN_PICTURES)?;
    let size = |p: &Picture| (p.layout.width, p.layout.height);
    if pictures.iter().any(|p| size(p) != size(first)) {
        return None;
    }
    let stars: Vec<Star> = pictures.iter().map(Star::new).collect();
    let brightest = Star::brightest(&stars)?;
    let threshold = rim_threshold(pictures, &brightest)?;
    let rim = brightest.last_above(threshold);
    let circle = Circle::fit(&rim)?;
    let at_rim = |star: &Star| {
        let own = star.last_above(threshold);
        own.iter().filter(|(angle, r)| circle.misses(*angle, *r).abs() <= 2.0 * ROUND * circle.radius).count() as f64
    };
    let lit = stars.iter().map(at_rim).sum::<f64>() / (stars.len() * rim.len().max(1)) as f64;
    let offset = circle.offset[0].hypot(circle.offset[1]);
    let is_central = offset <= MAX_OFFSET * circle.radius;
    (is_central && 1.0 - lit >= MIN_SKY).then_some((circle.radius - offset) * (1.0 - ROUND))
}

/// Returns the level of the rim between the dark ground and the bright parts; `None` if the corners are not dark.
fn rim_threshold(pictures: &[Picture], brightest: &Star) -> Option<f64> {
    let mut ground: Vec<f64> = Vec::new();
    for picture in pictures {
        let (width, height) = (picture.layout.width, picture.layout.height);
        let side = (width.min(height) / 24).max(2);
        for (x0, y0) in [(0, 0), (width - side, 0), (0, height - side), (width - side, height - side)] {
            ground.extend((0..side * side).map(|i| level(picture, x0 + i % side, y0 + i / side)));
        }
    }
    let mut bright: Vec<f64> = brightest.levels.iter().flatten().copied().collect();
    let quantile = |values: &mut Vec<f64>, share: f64| {
        values.sort_by(f64::total_cmp);
        values.get((share * values.len().saturating_sub(1) as f64) as usize).copied()
    };
    let (dark, noisy) = (quantile(&mut ground, 0.5)?, quantile(&mut ground, 0.99)?);
    let contrast = quantile(&mut bright, 0.9)? - dark;
    (contrast > 0.0 && noisy - dark <= DARK * contrast).then_some(dark + RIM * contrast)
}

/// Returns the mean over a pixel and its eight neighbours, against noise. A border pixel has fewer.
fn level(picture: &Picture, x: u32, y: u32) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for y in y.saturating_sub(1)..(y + 2).min(picture.layout.height) {
        for x in x.saturating_sub(1)..(x + 2).min(picture.layout.width) {
            sum += picture.brightness(x, y);
            count += 1.0;
        }
    }
    sum / count
}

/// The levels of a picture along lines from its centre to its border, a pixel apart.
struct Star {
    levels: Vec<Vec<f64>>,
}

impl Star {
    fn new(picture: &Picture) -> Self {
        let (w, h) = (f64::from(picture.layout.width), f64::from(picture.layout.height));
        let line = |k: usize| {
            let (sin, cos) = angle(k).sin_cos();
            let at = |r: f64| {
                let (x, y) = (0.5 * (w - 1.0) + r * cos, 0.5 * (h - 1.0) + r * sin);
                let is_inside = x >= 0.0 && y >= 0.0 && x <= w - 1.0 && y <= h - 1.0;
                is_inside.then(|| level(picture, x.round() as u32, y.round() as u32))
            };
            (0..).map_while(|r| at(f64::from(r))).collect()
        };
        Self { levels: (0..DIRECTIONS).map(line).collect() }
    }
    /// Returns the largest level of all pictures at each place.
    fn brightest(stars: &[Self]) -> Option<Self> {
        let mut most = stars.first()?.levels.clone();
        for star in stars {
            for (a, b) in most.iter_mut().flatten().zip(star.levels.iter().flatten()) {
                *a = a.max(*b);
            }
        }
        Some(Self { levels: most })
    }
    /// Returns angle and radius of the last place above the threshold in each direction in which it is not the border.
    fn last_above(&self, threshold: f64) -> Vec<(f64, f64)> {
        let last = |(k, line): (usize, &Vec<f64>)| {
            let r = line.iter().rposition(|level| *level > threshold)?;
            (r + 2 < line.len()).then_some((angle(k), r as f64 + 0.5))
        };
        self.levels.iter().enumerate().filter_map(last).collect()
    }
}

fn angle(direction: usize) -> f64 {
    core::f64::consts::TAU * direction as f64 / DIRECTIONS as f64
}

/// A circle near the picture's centre: r = radius + x cos φ + y sin φ, for a small offset (x, y).
struct Circle {
    radius: f64,
    offset: [f64; 2],
}

impl Circle {
    /// Fits most of the places; `None` if they do not lie on one circle.
    fn fit(rim: &[(f64, f64)]) -> Option<Self> {
        let mut radii: Vec<f64> = rim.iter().map(|(_, r)| *r).collect();
        radii.sort_by(f64::total_cmp);
        let mut circle = Self { radius: *radii.get(radii.len() / 2)?, offset: [0.0; 2] };
        // From a coarse ring to a narrow one.
        for limit in [0.1, 0.05, ROUND, ROUND] {
            let near = rim.iter().filter(|(angle, r)| circle.misses(*angle, *r).abs() <= limit * circle.radius);
            let near: Vec<(f64, f64)> = near.copied().collect();
            if (near.len() as f64) < MIN_SHARE * DIRECTIONS as f64 {
                return None;
            }
            circle.improve(&near);
        }
        Some(circle)
    }
    /// Fits the places by least squares, one unknown after the other: the three are nearly independent.
    fn improve(&mut self, places: &[(f64, f64)]) {
        for _ in 0..SWEEPS {
            self.radius += places.iter().map(|(a, r)| self.misses(*a, *r)).sum::<f64>() / places.len() as f64;
            for (axis, of) in [f64::cos, f64::sin].into_iter().enumerate() {
                let along: f64 = places.iter().map(|(a, r)| self.misses(*a, *r) * of(*a)).sum();
                self.offset[axis] += along / places.iter().map(|(a, _)| of(*a).powi(2)).sum::<f64>();
            }
        }
    }
    fn misses(&self, angle: f64, r: f64) -> f64 {
        r - self.radius - self.offset[0] * angle.cos() - self.offset[1] * angle.sin()
    }
}

#[cfg(test)]
mod tests {
    use hzn_core::image::Layout;

    use super::*;
    use crate::source::picture::Samples;

    const SIZE: u32 = 320;

    /// A picture in which a half-plane is bright inside a circle; `angle` is the direction of its middle.
    fn flight(radius: f64, centre: [f64; 2], angles: &[f64], covered: f64) -> Vec<Picture> {
        let draw = |angle: &f64| {
            let mut samples = Vec::new();
            for i in 0..SIZE * SIZE {
                let (x, y) = (f64::from(i % SIZE) - centre[0], f64::from(i / SIZE) - centre[1]);
                let is_ground = x * angle.cos() + y * angle.sin() > covered * radius;
                let noise = (i.wrapping_mul(2_654_435_761) >> 29) as u8;
                samples.push(if x.hypot(y) < radius && is_ground { 150 + noise } else { noise });
            }
            Picture::new(Samples::Bytes(samples), Layout::packed(SIZE, SIZE, 1, 8))
        };
        angles.iter().map(draw).collect()
    }

    #[test]
    fn an_image_circle_is_found_where_the_sky_moves_in_it() {
        let turning = [0.3, 1.5, 2.8, 4.0, 5.2];
        let found = find_image_circle(&flight(140.0, [159.5, 159.5], &turning, -0.3)).unwrap();
        assert!((found - 140.0 * (1.0 - ROUND)).abs() < 1.0, "{found}");
        // What is returned lies within a circle that is off centre.
        let found = find_image_circle(&flight(140.0, [164.0, 157.0], &turning, -0.3)).unwrap();
        assert!((130.0..134.5).contains(&found), "{found}");
    }

    #[test]
    fn no_image_circle_is_found_where_there_is_none() {
        let turning = [0.3, 1.5, 2.8, 4.0, 5.2];
        // The whole body in every picture, as a camera that looks at the nadir has it.
        assert_eq!(find_image_circle(&flight(100.0, [159.5, 159.5], &turning, -2.0)), None);
        // A limb that moves, in a picture that is lit up to its corners.
        assert_eq!(find_image_circle(&flight(1000.0, [159.5, 159.5], &turning, -0.1)), None);
        // Light comes from one side only, so most of the rim is never seen.
        assert_eq!(find_image_circle(&flight(140.0, [159.5, 159.5], &[0.2, 0.3, 0.4], 0.1)), None);
        // A circle beside the centre is a window.
        assert_eq!(find_image_circle(&flight(100.0, [180.0, 159.5], &turning, -0.3)), None);
        // Two pictures.
        assert_eq!(find_image_circle(&flight(140.0, [159.5, 159.5], &turning[..2], -0.3)), None);
    }
}
