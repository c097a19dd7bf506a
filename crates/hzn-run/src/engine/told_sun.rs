//! Whether a body becomes brighter towards the Sun that was told.
//!
//! A Sun with the wrong sign, or in other axes, lights the terminator instead of the limb. The terminator may then be
//! answered as the limb: the dark space beyond the true limb passes for the dark part of a crescent. Between the
//! terminator and the limb the picture tells them apart, because each surface becomes brighter where the Sun stands
//! higher.

use hzn_core::Solution;
use hzn_core::camera::Camera;
use hzn_core::pixel::ImagePoint;

use crate::source::Picture;

/// Places across and down that are looked at.
const GRID: [u32; 2] = [64, 48];
/// Part of the half-angle that counts: the blurred edge does not.
const INSIDE: f64 = 0.97;
/// Cosine of the Sun's zenith angle that is neither lit nor dark, to both sides of zero.
const TWILIGHT: f64 = 0.05;
/// Fewest places that the told Sun lights: the correlation of as many is known to 0.16.
const FEWEST_LIT: usize = 40;
/// Fewest places that it leaves dark. Without a terminator, the spots of a surface change its brightness more than the
/// Sun does.
const FEWEST_DARK: usize = 10;

/// Returns the correlation of the brightness with the height of the told Sun over the surface, from -1 to 1, in the
/// part that the Sun lights; `None` if the told Sun lights all or nothing of what is seen of the body.
pub(super) fn brightness_by_sun(
    picture: &Picture,
    camera: &Camera<f64>,
    limb: &Solution<f64>,
    sun: [f64; 3],
) -> Option<f64> {
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let axis = limb.axis.xyz();
    // A sphere in the distance 1.
    let radius = limb.half_angle_rad.sin();
    let within = (INSIDE * limb.half_angle_rad).cos();
    let length = dot(sun, sun).sqrt();
    let (mut lit, mut dark) = (Vec::new(), 0);
    for (i, j) in (0..GRID[1]).flat_map(|j| (0..GRID[0]).map(move |i| (i, j))) {
        let at = |i: u32, n: u32, size: u32| ((2 * i + 1) * size) / (2 * n);
        let (x, y) = (at(i, GRID[0], picture.layout.width), at(j, GRID[1], picture.layout.height));
        let Some(ray) = camera.unproject(ImagePoint { u: x.into(), v: y.into() }) else { continue };
        let ray = ray.xyz();
        let cos = dot(ray, axis);
        if cos <= within {
            continue;
        }
        let distance = cos - (radius * radius - (1.0 - cos * cos)).max(0.0).sqrt();
        let outward = [0, 1, 2].map(|k| (distance * ray[k] - axis[k]) / radius);
        let height = dot(outward, sun) / length;
        if height > TWILIGHT {
            lit.push((height, picture.brightness(x, y)));
        }
        dark += usize::from(height < -TWILIGHT);
    }
    (lit.len() >= FEWEST_LIT && dark >= FEWEST_DARK).then(|| correlation(&lit)).flatten()
}

/// Returns the correlation of pairs; `None` if one of the two values is always the same.
fn correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let n = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum = |of: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|pair| of(pair.0 - x, pair.1 - y)).sum::<f64>();
    let both = (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt();
    (both > 0.0).then(|| sum(&|x, y| x * y) / both)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_correlation_is_that_of_the_textbooks() {
        let line = |slope: f64| (0..50).map(|i| (f64::from(i), 3.0 + slope * f64::from(i))).collect::<Vec<_>>();
        assert!((correlation(&line(2.0)).unwrap() - 1.0).abs() < 1e-12);
        assert!((correlation(&line(-0.1)).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(correlation(&line(0.0)), None);
    }
}
