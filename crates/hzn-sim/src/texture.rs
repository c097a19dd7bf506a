//! Clouds: fractal value noise over the globe, cut at a threshold. They have many sharp edges.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Bright clouds over a darker surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Clouds {
    /// Approximate share of the ground under clouds, 0 to 1.
    pub cover: f64,
    /// Size of the largest cloud fields in kilometres.
    pub largest_km: f64,
    /// Size of the smallest detail in kilometres. Each halving from `largest_km` costs one more octave.
    pub smallest_km: f64,
    /// Softness of a cloud's edge, 0 (a step) to 1 (veils).
    pub softness: f64,
    /// Brightness of the thickest clouds, fraction of full scale.
    pub brightness: f64,
    /// Seed of the clouds; another seed gives other clouds.
    pub seed: u64,
}

impl Default for Clouds {
    fn default() -> Self {
        Self { cover: 0.5, largest_km: 400.0, smallest_km: 2.0, softness: 0.12, brightness: 0.85, seed: 1 }
    }
}

/// Number of octaves that are computed at once.
const LANES: usize = 4;
type Lanes<T> = [T; LANES];

/// Fractal value noise on the unit sphere.
#[derive(Debug, Clone)]
struct Fractal {
    groups: Vec<Octaves>,
}

/// A group of neighbouring octaves, from the larger to the smaller. Octaves beyond the last one have size 0.
#[derive(Debug, Clone, Copy, Default)]
struct Octaves {
    size_km: Lanes<f32>,
    /// Number of cells across the unit sphere's radius.
    frequency: Lanes<f32>,
    amplitude: Lanes<f32>,
    salt: Lanes<u32>,
}

/// Random values that were drawn for the last point, one entry per [`Octaves`]. The next point is usually in the same
/// cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct CellCache(Vec<Cells>);

/// The cells of one [`Octaves`], by axis, and the random values at their corners. The corner index counts x fastest and
/// z slowest.
#[derive(Debug, Clone, Copy, Default)]
struct Cells {
    is_drawn: bool,
    floor: [Lanes<i32>; 3],
    corner: [Lanes<f32>; 8],
}

impl Fractal {
    /// Makes octaves from the largest to the smallest size. Each octave has half the size and `rough` times the
    /// amplitude of the octave before. The root of the sum of their squared amplitudes is 1/`unit`.
    fn new([largest_km, smallest_km]: [f64; 2], rough: f32, unit: f32, radius_m: f64, seed: u64, salt: u32) -> Self {
        let count = (1 + libm::log2((largest_km / smallest_km).max(1.0)).round() as usize).min(16);
        let amplitude = |i: usize| rough.powi(i as i32);
        // The variances of the octaves add up.
        let root = (0..count).map(|i| amplitude(i) * amplitude(i)).sum::<f32>().sqrt();
        let mut groups = vec![Octaves::default(); count.div_ceil(LANES)];
        for i in 0..count {
            let size_km = largest_km / f64::from(1u32 << i);
            let (group, lane) = (&mut groups[i / LANES], i % LANES);
            group.size_km[lane] = size_km as f32;
            group.frequency[lane] = (radius_m / 1e3 / size_km) as f32;
            group.amplitude[lane] = amplitude(i) * (1.0 / (unit * root));
            group.salt[lane] = hash3([i as i32, seed as i32, (seed >> 32) as i32], salt);
        }
        Self { groups }
    }

    /// Returns the amplitudes, from the largest octave on.
    fn amplitudes(&self) -> impl DoubleEndedIterator<Item = f32> {
        self.groups.iter().flat_map(|group| group.amplitude)
    }

    /// Calls `each` with the number and the value of one octave after the other at a point. It stops when `each`
    /// returns false, or when the octaves are finer than `footprint_km`.
    #[inline(always)]
    fn visit_octaves(
        &self,
        point: &Vector3<f64>,
        footprint_km: f32,
        cache: &mut CellCache,
        mut each: impl FnMut(usize, f32) -> bool,
    ) {
        let p = [point.x as f32, point.y as f32, point.z as f32];
        if cache.0.len() != self.groups.len() {
            cache.0 = vec![Cells::default(); self.groups.len()];
        }
        for (n, (group, cells)) in self.groups.iter().zip(&mut cache.0).enumerate() {
            let keep = group.size_km.map(|size| (size / footprint_km - 1.0).clamp(0.0, 1.0));
            if keep[0] <= 0.0 {
                return;
            }
            let noise = group.noise(p, cells);
            for i in 0..LANES {
                if keep[i] <= 0.0 || !each(LANES * n + i, keep[i] * group.amplitude[i] * (noise[i] - 0.5)) {
                    return;
                }
            }
        }
    }
}

impl Octaves {
    /// Returns the random values at the corners of cubic lattices, blended smoothly: 0 to 1.
    #[inline(always)]
    fn noise(&self, p: [f32; 3], cells: &mut Cells) -> Lanes<f32> {
        let x: [Lanes<f32>; 3] = p.map(|p| self.frequency.map(|f| p * f));
        let floor = x.map(|x| {
            // The truncation is corrected below zero. It costs half as much as the library's floor on targets without a
            // floor instruction.
            x.map(|x| {
                let t = x as i32;
                t - i32::from((t as f32) > x)
            })
        });
        // The comparison works in lanes, because a comparison of arrays would call the library.
        let changed = floor.iter().flatten().zip(cells.floor.iter().flatten()).fold(0, |all, (a, b)| all | (a ^ b));
        if changed != 0 || !cells.is_drawn {
            cells.draw(floor, &self.salt);
        }
        let t: [Lanes<f32>; 3] =
            core::array::from_fn(|axis| core::array::from_fn(|i| smoothstep(x[axis][i] - floor[axis][i] as f32)));
        let mix = |a: Lanes<f32>, b: Lanes<f32>, t: &Lanes<f32>| -> Lanes<f32> {
            core::array::from_fn(|i| a[i] + (b[i] - a[i]) * t[i])
        };
        let row = |i: usize| mix(cells.corner[i], cells.corner[i + 1], &t[0]);
        let plane = |i: usize| mix(row(i), row(i + 2), &t[1]);
        mix(plane(0), plane(4), &t[2]).map(|n| n * (1.0 / 16_777_216.0))
    }
}

impl Cells {
    /// Draws the corners of the cells that changed.
    #[inline(never)]
    fn draw(&mut self, floor: [Lanes<i32>; 3], salt: &Lanes<u32>) {
        for (i, &salt) in salt.iter().enumerate() {
            let [x, y, z] = floor.map(|f| f[i]);
            if self.is_drawn && self.floor.map(|f| f[i]) == [x, y, z] {
                continue;
            }
            for (corner, value) in self.corner.iter_mut().enumerate() {
                let [dx, dy, dz] = [0, 1, 2].map(|axis| (corner >> axis & 1) as i32);
                value[i] = (hash3([x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)], salt) >> 8) as f32;
            }
        }
        (self.is_drawn, self.floor) = (true, floor);
    }
}

/// Approximate standard deviation of value noise in 3-D.
const SIGMA: f64 = 0.17;

/// [`Clouds`], prepared for rendering.
#[derive(Debug, Clone)]
pub(crate) struct CloudField {
    fractal: Fractal,
    /// Largest sum that each octave and all finer ones can add.
    rest: Vec<f32>,
    threshold: f32,
    edge: f32,
    brightness: f32,
}

impl CloudField {
    pub(crate) fn new(clouds: &Clouds, radius_m: f64) -> Self {
        let sizes_km = [clouds.largest_km, clouds.smallest_km].map(|km| km.max(1e-3));
        // Amplitudes fall more slowly than by 1/2 per octave, because clouds have much detail.
        let fractal = Fractal::new(sizes_km, 0.7, 1.0, radius_m, clouds.seed, 0x5EED);
        let mut rest: Vec<f32> = fractal
            .amplitudes()
            .rev()
            .scan(0.0, |sum, a| {
                *sum += 0.5 * a;
                Some(*sum)
            })
            .collect();
        rest.reverse();
        // A logistic curve approximates the distribution function; this is its inverse.
        let cover = clouds.cover.clamp(0.001, 0.999);
        let threshold = SIGMA / 1.7 * libm::log((1.0 - cover) / cover);
        Self {
            fractal,
            rest,
            threshold: threshold as f32,
            edge: (clouds.softness.max(1e-4) * SIGMA * 2.0) as f32,
            brightness: clouds.brightness as f32,
        }
    }

    /// Returns the brightness at a point of the unit sphere over ground of brightness `ground`. `footprint_km` is the
    /// size of a pixel on the ground. Finer detail is left out, because it would only flicker.
    pub(crate) fn blend_over(
        &self,
        ground: f32,
        point: &Vector3<f64>,
        footprint_km: f32,
        cache: &mut CellCache,
    ) -> f32 {
        match self.sample(point, footprint_km, cache) {
            Some((cover, bright)) => ground + cover * (bright - ground),
            None => ground,
        }
    }

    /// Returns the hidden share of the ground, 0 to 1, and the brightness of the cloud there; `None` under a clear sky.
    pub(crate) fn sample(&self, point: &Vector3<f64>, footprint_km: f32, cache: &mut CellCache) -> Option<(f32, f32)> {
        let (mut sum, mut fine, mut clear) = (0.0f32, 0.0f32, false);
        self.fractal.visit_octaves(point, footprint_km, cache, |i, share| {
            clear = self.rest.get(i).is_some_and(|rest| sum + rest < self.threshold - self.edge);
            sum += share;
            if i >= 2 {
                fine += share;
            }
            !clear
        });
        if clear {
            return None;
        }
        let cover = smoothstep(((sum - self.threshold) / self.edge).clamp(-1.0, 1.0) * 0.5 + 0.5);
        // Thick clouds are brighter than their rims, and they are not smooth.
        let thick = (0.8 + (sum - self.threshold) * 0.6 + fine * 0.5).clamp(0.5, 1.0);
        Some((cover, self.brightness * thick))
    }
}

/// Fractal noise on the unit sphere, with a mean of about 0 and a standard deviation of about 1.
#[derive(Debug, Clone)]
pub(crate) struct Relief(Fractal);

impl Relief {
    /// Makes noise with detail from the largest to the smallest size, `detail_km`. `rough` is the amplitude of an
    /// octave divided by the amplitude of the octave before.
    pub(crate) fn new(detail_km: [f64; 2], rough: f32, radius_m: f64, seed: u64) -> Self {
        Self(Fractal::new(detail_km, rough, SIGMA as f32, radius_m, seed, 0x6E0D))
    }

    /// Returns the value at a point, without detail finer than `footprint_km`.
    #[inline]
    pub(crate) fn sample(&self, point: &Vector3<f64>, footprint_km: f32, cache: &mut CellCache) -> f32 {
        let mut sum = 0.0;
        self.0.visit_octaves(point, footprint_km, cache, |_, share| {
            sum += share;
            true
        });
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
                    // The points lie on a spiral over the sphere.
                    let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
                    let (s, c) = libm::sincos(f64::from(i) * 2.399_963);
                    let r = (1.0 - z * z).sqrt();
                    field.blend_over(0.0, &Vector3::new(r * c, r * s, z), 1.0, &mut CellCache::default()) > 0.25
                })
                .count();
            let share = lit as f64 / f64::from(n);
            assert!((share - cover).abs() < 0.1, "{cover}: {share}");
        }
    }

    #[test]
    fn noise_is_continuous_across_cells() {
        let group = Octaves { frequency: [1.0; LANES], salt: [1, 2, 3, 4], ..Octaves::default() };
        let noise = |x: f32| group.noise([x, 0.3, 0.7], &mut Cells::default());
        for x in [-2.0f32, -1.0, 0.0, 3.0] {
            let (a, b) = (noise(x - 1e-4), noise(x + 1e-4));
            assert!((0..LANES).all(|i| (a[i] - b[i]).abs() < 1e-3));
        }
    }

    #[test]
    fn what_was_drawn_before_does_not_matter() {
        let relief = Relief::new([700.0, 3.0], 0.7, 6.371e6, 5);
        let mut cache = CellCache::default();
        for i in 0..3000 {
            let (s, c) = libm::sincos(2e-4 * f64::from(i));
            let p = Vector3::new(0.6 * c, 0.6 * s, 0.8);
            let footprint_km = 0.3 + 0.01 * i as f32;
            assert_eq!(
                relief.sample(&p, footprint_km, &mut cache),
                relief.sample(&p, footprint_km, &mut CellCache::default())
            );
        }
    }
}
