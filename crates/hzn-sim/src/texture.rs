//! Clouds: fractal value noise over the globe, cut at a threshold, so that the edges are many and sharp.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Bright clouds over a darker surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Clouds {
    /// Share of the ground under clouds, 0 to 1, roughly.
    pub cover: f64,
    /// Size of the largest cloud fields in kilometres.
    pub largest_km: f64,
    /// Size of the smallest detail in kilometres; each halving from `largest_km` costs one more octave.
    pub smallest_km: f64,
    /// Softness of a cloud's edge, 0 (a step) to 1 (veils).
    pub softness: f64,
    /// Brightness of the thickest clouds, fraction of full scale.
    pub brightness: f64,
    /// Which clouds.
    pub seed: u64,
}

impl Default for Clouds {
    fn default() -> Self {
        Self { cover: 0.5, largest_km: 400.0, smallest_km: 2.0, softness: 0.12, brightness: 0.85, seed: 1 }
    }
}

/// [`Clouds`], prepared.
#[derive(Debug, Clone)]
pub(crate) struct CloudField {
    octaves: Vec<Octave>,
    threshold: f32,
    edge: f32,
    brightness: f32,
}

#[derive(Debug, Clone, Copy)]
struct Octave {
    size_km: f32,
    /// Cells across the unit sphere's radius.
    frequency: f32,
    amplitude: f32,
    salt: u32,
    /// The most this octave and all finer ones can add.
    rest: f32,
}

/// Octaves from the largest to the smallest size, each half as large and `rough` times as strong as the one before, and
/// the root of the sum of their squares.
fn octaves([largest_km, smallest_km]: [f64; 2], rough: f32, radius_m: f64, seed: u64, salt: u32) -> (Vec<Octave>, f32) {
    let count = 1 + libm::log2((largest_km / smallest_km).max(1.0)).round() as u32;
    let octaves: Vec<Octave> = (0..count.min(16))
        .map(|i| {
            let size_km = largest_km / f64::from(1u32 << i);
            Octave {
                size_km: size_km as f32,
                frequency: (radius_m / 1e3 / size_km) as f32,
                amplitude: rough.powi(i as i32),
                salt: hash3([i as i32, seed as i32, (seed >> 32) as i32], salt),
                rest: 0.0,
            }
        })
        .collect();
    let sum2: f32 = octaves.iter().map(|o| o.amplitude * o.amplitude).sum();
    (octaves, sum2.sqrt())
}

impl CloudField {
    pub(crate) fn new(clouds: &Clouds, radius_m: f64) -> Self {
        let sizes_km = [clouds.largest_km, clouds.smallest_km].map(|km| km.max(1e-3));
        // Slightly rougher than 1/2 an octave: clouds have detail.
        let (mut octaves, root) = octaves(sizes_km, 0.7, radius_m, clouds.seed, 0x5EED);
        // Value noise in 3-D has a standard deviation of about 0.17; the octaves add as squares.
        for o in &mut octaves {
            o.amplitude *= 1.0 / root;
        }
        let mut rest = 0.0;
        for o in octaves.iter_mut().rev() {
            rest += 0.5 * o.amplitude;
            o.rest = rest;
        }
        let sigma = 0.17;
        // Inverse of the logistic curve that stands for the distribution function.
        let cover = clouds.cover.clamp(0.001, 0.999);
        let threshold = sigma / 1.7 * libm::log((1.0 - cover) / cover);
        Self {
            octaves,
            threshold: threshold as f32,
            edge: (clouds.softness.max(1e-4) * sigma * 2.0) as f32,
            brightness: clouds.brightness as f32,
        }
    }

    /// Brightness at a point of the unit sphere over a ground of brightness `ground`; `footprint_km` is what one
    /// pixel covers: finer detail is left out, as it would only flicker.
    pub(crate) fn over(&self, ground: f32, point: &Vector3<f64>, footprint_km: f32) -> f32 {
        match self.at(point, footprint_km) {
            Some((cover, bright)) => ground + cover * (bright - ground),
            None => ground,
        }
    }

    /// How much of the ground is hidden, 0 to 1, and how bright the cloud is there; `None` under a clear sky.
    pub(crate) fn at(&self, point: &Vector3<f64>, footprint_km: f32) -> Option<(f32, f32)> {
        let p = [point.x as f32, point.y as f32, point.z as f32];
        let (mut sum, mut fine) = (0.0f32, 0.0f32);
        for (i, o) in self.octaves.iter().enumerate() {
            let keep = (o.size_km / footprint_km - 1.0).clamp(0.0, 1.0);
            if keep <= 0.0 {
                break;
            }
            if sum + o.rest < self.threshold - self.edge {
                return None;
            }
            let n = keep * o.amplitude * (value_noise(p.map(|x| x * o.frequency), o.salt) - 0.5);
            sum += n;
            if i >= 2 {
                fine += n;
            }
        }
        let cover = smoothstep(((sum - self.threshold) / self.edge).clamp(-1.0, 1.0) * 0.5 + 0.5);
        // Thick clouds are brighter than their rims, and not smooth.
        let thick = (0.8 + (sum - self.threshold) * 0.6 + fine * 0.5).clamp(0.5, 1.0);
        Some((cover, self.brightness * thick))
    }
}

/// Fractal noise on the unit sphere: about 0 on average, with a standard deviation of 1.
#[derive(Debug, Clone)]
pub(crate) struct Relief {
    octaves: Vec<Octave>,
}

impl Relief {
    /// `detail_km` from the largest to the smallest size; `rough` is the amplitude of an octave over the one before.
    pub(crate) fn new(detail_km: [f64; 2], rough: f32, radius_m: f64, seed: u64) -> Self {
        let (mut octaves, root) = octaves(detail_km, rough, radius_m, seed, 0x6E0D);
        for o in &mut octaves {
            o.amplitude /= 0.17 * root;
        }
        Self { octaves }
    }

    /// The value at a point, without what is finer than `footprint_km`.
    pub(crate) fn at(&self, point: &Vector3<f64>, footprint_km: f32) -> f32 {
        let p = [point.x as f32, point.y as f32, point.z as f32];
        let mut sum = 0.0;
        for o in &self.octaves {
            let keep = (o.size_km / footprint_km - 1.0).clamp(0.0, 1.0);
            if keep <= 0.0 {
                break;
            }
            sum += keep * o.amplitude * (value_noise(p.map(|x| x * o.frequency), o.salt) - 0.5);
        }
        sum
    }
}

pub(crate) fn smoothstep(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}

#[inline(always)]
fn hash3([x, y, z]: [i32; 3], salt: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x8DA6_B343)
        ^ (y as u32).wrapping_mul(0xD816_3841)
        ^ (z as u32).wrapping_mul(0xCB1A_B31F)
        ^ salt;
    h = (h ^ (h >> 15)).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ (h >> 12)).wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

/// Random values at the corners of a cubic lattice, blended smoothly: 0 to 1.
#[inline(always)]
fn value_noise(p: [f32; 3], salt: u32) -> f32 {
    let floor = p.map(|x| {
        // Truncation corrected below zero: half the cost of the library's floor on targets without its instruction.
        let t = x as i32;
        t - i32::from((t as f32) > x)
    });
    let f: [f32; 3] = core::array::from_fn(|i| smoothstep(p[i] - floor[i] as f32));
    let at = |dx: i32, dy: i32, dz: i32| {
        (hash3([floor[0].wrapping_add(dx), floor[1].wrapping_add(dy), floor[2].wrapping_add(dz)], salt) >> 8) as f32
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |dy: i32, dz: i32| mix(at(0, dy, dz), at(1, dy, dz), f[0]);
    let plane = |dz: i32| mix(row(0, dz), row(1, dz), f[1]);
    mix(plane(0), plane(1), f[2]) * (1.0 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cover_is_about_what_was_asked_for() {
        for cover in [0.2, 0.5, 0.8] {
            let clouds = Clouds { cover, softness: 0.0, brightness: 1.0, ..Clouds::default() };
            let field = CloudField::new(&clouds, 6.371e6);
            let n = 20_000;
            let lit = (0..n)
                .filter(|&i| {
                    // A spiral over the sphere.
                    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
                    let (s, c) = libm::sincos(f64::from(i) * 2.399_963);
                    let r = (1.0 - z * z).sqrt();
                    field.over(0.0, &Vector3::new(r * c, r * s, z), 1.0) > 0.25
                })
                .count();
            let share = lit as f64 / f64::from(n);
            assert!((share - cover).abs() < 0.1, "{cover}: {share}");
        }
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        for x in [-2.0f32, -1.0, 0.0, 3.0] {
            let (a, b) = (value_noise([x - 1e-4, 0.3, 0.7], 1), value_noise([x + 1e-4, 0.3, 0.7], 1));
            assert!((a - b).abs() < 1e-3);
        }
    }
}
