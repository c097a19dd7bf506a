//! Paints discs of Sun and Moon with a blurred edge at known positions.

use hzn_core::Config;
use hzn_core::camera::Camera;
use hzn_core::frames::UnitVec3;
use hzn_core::pixel::ImagePoint;
use nalgebra::Vector3;

/// Disc in a dark sky.
#[derive(Debug, Clone, Copy)]
pub struct Disc {
    /// Direction of the centre in the camera frame, unit vector.
    pub axis: [f64; 3],
    /// Apparent half-angle in radians, with bloom.
    pub half_angle_rad: f64,
    /// Direction to the Sun in the camera frame. The Sun lights the disc from there by the law of Lommel and Seeliger,
    /// as it lights dust. With `None` the disc is evenly bright.
    pub sun: Option<[f64; 3]>,
    /// Brightness of the full disc in counts; pixels above 255 saturate.
    pub brightness: f64,
    /// Brightness of the halo at the edge of the disc, in counts. It falls with the square of the distance from the
    /// centre.
    pub halo: f64,
    /// Standard deviation of the blur, pixels.
    pub blur_px: f64,
    /// Standard deviation of the noise in counts.
    pub noise: f64,
}

/// Number of samples per pixel along each side.
const FINE: usize = 4;

impl Disc {
    /// Returns the picture with 8 bits, row by row; `seed` is for the noise.
    ///
    /// # Panics
    /// Panics if the lens is refused.
    pub fn paint(&self, config: &Config, seed: u32) -> Vec<u8> {
        let camera = Camera::<f64>::try_new(&config.camera).expect("the lens is valid");
        let (w, h) = (usize::from(config.camera.width), usize::from(config.camera.height));
        let plane = (0..w * h).map(|i| self.pixel(&camera, (i % w) as f64, (i / w) as f64)).collect();
        self.add_noise(&self.blur(plane, w, h), seed)
    }

    /// Returns the brightness at a place in the picture, without blur and noise.
    fn brightness_at(&self, camera: &Camera<f64>, u: f64, v: f64) -> f64 {
        let e = Vector3::from(self.axis);
        let Some(s) = camera.unproject(ImagePoint { u, v }) else { return 0.0 };
        let s = Vector3::from(s.xyz());
        let off = s.cross(&e).norm().atan2(s.dot(&e));
        let ratio = off / self.half_angle_rad;
        let halo = self.halo / ratio.max(1.0).powi(2);
        if ratio >= 1.0 {
            return halo;
        }
        let Some(sun) = self.sun else { return self.brightness };
        // Normal at the visible point of the sphere: it is −e at the centre of the disc and turns outwards to the
        // limb.
        let outwards = (s - e * s.dot(&e)).try_normalize(1e-12).unwrap_or_default();
        let normal = outwards * ratio - e * (1.0 - ratio * ratio).sqrt();
        // Lommel and Seeliger: the disc is bright up to the limb, as the Moon is, and a full disc is even.
        let (lit, seen) = (normal.dot(&Vector3::from(sun)).max(0.0), -normal.dot(&s));
        halo.max(self.brightness * 2.0 * lit / (lit + seen.max(0.0)).max(1e-9))
    }

    /// Returns the mean brightness of a pixel.
    fn pixel(&self, camera: &Camera<f64>, x: f64, y: f64) -> f64 {
        let brightness = |u, v| self.brightness_at(camera, u, v);
        let sample = |k: usize| (k as f64 + 0.5) / FINE as f64 - 0.5;
        let centre = brightness(x, y);
        // One sample is enough where the brightness is even.
        let flat = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)]
            .iter()
            .all(|(dx, dy)| (brightness(x + dx, y + dy) - centre).abs() < 0.5);
        if flat {
            return centre;
        }
        let all = (0..FINE * FINE).map(|k| brightness(x + sample(k % FINE), y + sample(k / FINE)));
        all.sum::<f64>() / (FINE * FINE) as f64
    }

    /// Blurs the picture, first along the rows and then along the columns.
    fn blur(&self, mut plane: Vec<f64>, w: usize, h: usize) -> Vec<f64> {
        let reach = (4.0 * self.blur_px).ceil() as isize;
        let kernel: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / self.blur_px).powi(2)).exp()).collect();
        let total: f64 = kernel.iter().sum();
        for (dx, dy) in [(1isize, 0isize), (0, 1)] {
            let old = plane.clone();
            let value_at =
                |x: isize, y: isize| old[y.clamp(0, h as isize - 1) as usize * w + x.clamp(0, w as isize - 1) as usize];
            for (i, p) in plane.iter_mut().enumerate() {
                let (x, y) = ((i % w) as isize, (i / w) as isize);
                let blurred =
                    kernel.iter().zip(-reach..).map(|(k, o)| k * value_at(x + o * dx, y + o * dy)).sum::<f64>();
                *p = blurred / total;
            }
        }
        plane
    }

    /// Adds the brightness of the sky (8 counts) and the noise, and rounds to counts.
    fn add_noise(&self, plane: &[f64], seed: u32) -> Vec<u8> {
        let mut state = seed | 1;
        let mut uniform = move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            f64::from((word >> 22) ^ word) / 4_294_967_296.0
        };
        plane
            .iter()
            .map(|p| {
                // The sum of twelve uniform numbers is nearly normal with variance 1.
                let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                (p + 8.0 + self.noise * normal + 0.5).clamp(0.0, 255.0) as u8
            })
            .collect()
    }
}

/// Returns the direction of a place in the picture (pixels) as a unit vector in the camera frame.
///
/// # Panics
/// Panics if the lens is refused or the place lies outside the lens.
pub fn direction(config: &Config, u: f64, v: f64) -> [f64; 3] {
    let camera = Camera::<f64>::try_new(&config.camera).expect("the lens is valid");
    camera.unproject(ImagePoint { u, v }).expect("within the lens").xyz()
}

/// Returns the distance of two directions in the picture, in pixels; NaN if one of them is not in the lens.
///
/// # Panics
/// Panics if the lens is refused.
pub fn distance_px(config: &Config, a: [f64; 3], b: [f64; 3]) -> f64 {
    let camera = Camera::<f64>::try_new(&config.camera).expect("the lens is valid");
    let place = |d| UnitVec3::try_new(d).and_then(|d| camera.project(&d));
    match (place(a), place(b)) {
        (Some(a), Some(b)) => (a.u - b.u).hypot(a.v - b.v),
        _ => f64::NAN,
    }
}
