//! The step from light to numbers: blur of the optics, noise, quantisation.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::counter::{Counter, Stream};
use crate::picture::{Picture, Samples};

/// The detector, and the blur of the optics in front of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Detector {
    /// Standard deviation of the Gaussian point spread function in pixels; 0 means no blur.
    pub psf_sigma_px: f64,
    /// Standard deviation of the noise that does not depend on the light, as a fraction of full scale.
    pub read_noise: f64,
    /// Electrons at full scale; the shot noise is √electrons. Without a value there is no shot noise.
    pub full_well_electrons: Option<f64>,
    /// Share of hot pixels. A hot pixel shows at least its own random value, up to full scale, in every picture.
    pub hot_pixels: f64,
    /// Seed of the hot pixels and of the fixed patterns.
    pub hot_pixel_seed: u64,
    /// Standard deviation of the pixels' offsets, as a fraction of full scale. They are the same in every picture.
    pub offset_pattern: f64,
    /// Standard deviation of the pixels' gains around 1.
    pub gain_pattern: f64,
    /// Curve from light to brightness. Pixel gains and shot noise come before it, everything else after it.
    pub tone: Tone,
    /// True for three samples per pixel (red, green, blue), false for their mean. In a grey world the three differ only
    /// by their noise.
    pub colour: bool,
    /// Bits per sample, 8 to 16.
    pub bits: u8,
}

/// Curve from light to brightness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// Brightness is proportional to light.
    #[default]
    Linear,
    /// The curve of sRGB, as in pictures for the eye; it lifts dark values.
    Srgb,
}

impl From<Tone> for hzn_core::tone::Tone {
    fn from(tone: Tone) -> Self {
        match tone {
            Tone::Linear => Self::Linear,
            Tone::Srgb => Self::Srgb,
        }
    }
}

/// Table of the sRGB curve and its slope in steps of light, because powers are slow to compute.
struct Curve(Vec<[f32; 2]>);

impl Curve {
    const STEPS: usize = 4096;

    fn srgb() -> Self {
        let value = |light: f32| {
            if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * libm::powf(light, 1.0 / 2.4) - 0.055 }
        };
        let step_value = |i: usize| value(i as f32 / Self::STEPS as f32);
        Self(
            (0..=Self::STEPS)
                .map(|i| [step_value(i), (step_value(i + 1) - step_value(i)) * Self::STEPS as f32])
                .collect(),
        )
    }

    /// Returns the brightness and its slope.
    #[inline(always)]
    fn brightness(&self, light: f32) -> [f32; 2] {
        let x = light.clamp(0.0, 1.0) * Self::STEPS as f32;
        let [value, slope] = self.0.get(x as usize).copied().unwrap_or([1.0, 0.0]);
        [value + slope * (x - x.trunc()) * (1.0 / Self::STEPS as f32), slope]
    }
}

impl Default for Detector {
    fn default() -> Self {
        Self {
            psf_sigma_px: 0.7,
            read_noise: 0.0,
            full_well_electrons: None,
            hot_pixels: 0.0,
            hot_pixel_seed: 1,
            offset_pattern: 0.0,
            gain_pattern: 0.0,
            tone: Tone::Linear,
            colour: false,
            bits: 8,
        }
    }
}

/// Light on the detector as fractions of full scale, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// Number of columns.
    pub width: usize,
    /// The pixels, row by row.
    pub data: Vec<f32>,
}

/// Returns one side of the Gaussian's weights, the centre first. The weights of both sides sum to one.
fn kernel(sigma: f64) -> Vec<f32> {
    if !(sigma > 0.0) {
        return vec![1.0];
    }
    // Less than 1e-4 of the light is beyond four sigma.
    let reach = (4.0 * sigma).ceil().min(200.0) as usize;
    let weights: Vec<f64> = (0..=reach).map(|i| libm::exp(-0.5 * (i as f64 / sigma) * (i as f64 / sigma))).collect();
    let sum: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

impl Plane {
    /// Returns the number of rows.
    pub fn height(&self) -> usize {
        self.data.len() / self.width
    }

    /// Blurs the plane by a Gaussian. Beyond the border the outermost pixels are repeated.
    pub fn blurred(mut self, sigma_px: f64) -> Self {
        let k = kernel(sigma_px);
        let reach = k.len() - 1;
        if reach == 0 {
            return self;
        }
        let (w, h) = (self.width, self.height());
        self.data.par_chunks_mut(w).for_each_init(Vec::new, |wide: &mut Vec<f32>, row| {
            wide.clear();
            wide.extend(core::iter::repeat_n(row[0], reach));
            wide.extend_from_slice(row);
            wide.extend(core::iter::repeat_n(row[w - 1], reach));
            for (x, p) in row.iter_mut().enumerate() {
                *p = k[0] * wide[x + reach];
            }
            for (i, &weight) in k.iter().enumerate().skip(1) {
                let (before, after) = (&wide[reach - i..][..w], &wide[reach + i..][..w]);
                for ((p, a), b) in row.iter_mut().zip(before).zip(after) {
                    *p += weight * (a + b);
                }
            }
        });
        let source = &self.data;
        let source_row = |y: isize| &source[y.clamp(0, h as isize - 1) as usize * w..][..w];
        let mut data = vec![0.0f32; w * h];
        data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (p, s) in row.iter_mut().zip(source_row(y as isize)) {
                *p = k[0] * s;
            }
            for (i, &weight) in k.iter().enumerate().skip(1) {
                let (above, below) = (source_row(y as isize - i as isize), source_row(y as isize + i as isize));
                for ((p, a), b) in row.iter_mut().zip(above).zip(below) {
                    *p += weight * (a + b);
                }
            }
        });
        Self { width: w, data }
    }
}

impl Detector {
    /// Adds noise and hot pixels to one plane, or to three planes for colours, and quantises them.
    pub fn expose(&self, light: &[Plane], seed: u64) -> Picture {
        let bits = self.bits.clamp(8, 16);
        let (width, height) = light.first().map_or((0, 0), |p| (p.width as u16, p.height() as u16));
        let samples = if bits == 8 {
            Samples::Bytes(self.samples(light, seed, bits, |v| v as u8))
        } else {
            Samples::Words(self.samples(light, seed, bits, |v| v as u16))
        };
        Picture { width, height, channels: light.len() as u8, bits, samples }
    }

    fn samples<S: Send + Copy + Default>(&self, light: &[Plane], seed: u64, bits: u8, to: fn(u32) -> S) -> Vec<S> {
        let mut planes = light.iter().enumerate().map(|(channel, light)| {
            let mut data = vec![S::default(); light.data.len()];
            // Each colour has separate noise.
            self.fill(light, seed.wrapping_add((channel as u64) << 40), channel, bits, &mut data, to);
            data
        });
        match (planes.next(), planes.next(), planes.next()) {
            (Some(r), Some(g), Some(b)) => r.iter().zip(&g).zip(&b).flat_map(|((&r, &g), &b)| [r, g, b]).collect(),
            (one, ..) => one.unwrap_or_default(),
        }
    }

    fn fill<S: Send>(
        &self,
        light: &Plane,
        seed: u64,
        channel: usize,
        bits: u8,
        out: &mut [S],
        to: impl Fn(u32) -> S + Sync,
    ) {
        let w = light.width;
        let full = ((1u32 << bits) - 1) as f32;
        let noise = Counter::new(seed, Stream::Detector);
        let channel_seed = self.hot_pixel_seed.wrapping_add((channel as u64) << 40);
        let hot = Counter::new(channel_seed, Stream::HotPixels);
        let (offsets, gains) =
            (Counter::new(channel_seed, Stream::FixedPattern), Counter::new(channel_seed, Stream::GainPattern));
        let (offset, gain) = (self.offset_pattern as f32, self.gain_pattern as f32);
        let read2 = (self.read_noise * self.read_noise) as f32;
        let shot = self.full_well_electrons.map_or(0.0, |e| 1.0 / e.max(1.0)) as f32;
        let noisy = read2 > 0.0 || shot > 0.0;
        let (tone, curve) = (self.tone, Curve::srgb());
        out.par_chunks_mut(w).zip(light.data.par_chunks(w)).enumerate().for_each(|(y, (out, light))| {
            // Two neighbouring pixels share one draw. At an odd width, half of a row's last draw is unused.
            let first = (y * w.div_ceil(2)) as u64;
            for (pair, (out, light)) in out.chunks_mut(2).zip(light.chunks(2)).enumerate() {
                let index = first + pair as u64;
                let normal = if noisy { noise.normal_pair(index) } else { [0.0; 2] };
                let offsets = if offset > 0.0 { offsets.normal_pair(index) } else { [0.0; 2] };
                let gains = if gain > 0.0 { gains.normal_pair(index) } else { [0.0; 2] };
                for (i, (out, &light)) in out.iter_mut().zip(light).enumerate() {
                    let light = light * (1.0 + gain * gains[i]);
                    let mut v = match tone {
                        // One draw covers read noise and shot noise, because their variances add.
                        Tone::Linear => light + normal[i] * (read2 + shot * light.max(0.0)).sqrt(),
                        // The shot noise passes through the curve to first order, so one draw is enough.
                        Tone::Srgb => {
                            let [bright, slope] = curve.brightness(light);
                            bright + normal[i] * (read2 + shot * light.clamp(0.0, 1.0) * slope * slope).sqrt()
                        }
                    };
                    v += offset * offsets[i];
                    if self.hot_pixels > 0.0 {
                        let index = 2 * (y * w + 2 * pair + i) as u64;
                        if hot.uniform(index) < self.hot_pixels {
                            v = v.max(hot.uniform(index + 1) as f32);
                        }
                    }
                    *out = to((v.clamp(0.0, 1.0) * full + 0.5) as u32);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(width: usize, height: usize, value: f32) -> Plane {
        Plane { width, data: vec![value; width * height] }
    }

    #[test]
    fn blur_keeps_light_and_spreads_it_by_sigma() {
        let mut plane = flat(41, 41, 0.0);
        plane.data[20 * 41 + 20] = 1.0;
        let b = plane.blurred(1.3);
        let sum: f32 = b.data.iter().sum();
        let second: f32 = b.data.iter().enumerate().map(|(i, v)| v * ((i % 41) as f32 - 20.0).powi(2)).sum();
        assert!((sum - 1.0).abs() < 1e-5 && (second.sqrt() - 1.3).abs() < 0.01);
        assert!(flat(7, 5, 0.3).blurred(0.9).data.iter().all(|v| (v - 0.3).abs() < 1e-6));
    }

    #[test]
    fn noise_has_the_stated_sigma() {
        let d = Detector { read_noise: 0.02, bits: 16, ..Detector::default() };
        let sigma = |d: Detector, level: f32| {
            let Samples::Words(data) = d.expose(&[flat(401, 300, level)], 3).samples else {
                panic!("16 bits are words")
            };
            let n = data.len() as f64;
            let mean = data.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
            (data.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n).sqrt() / 65535.0
        };
        assert!((sigma(d, 0.5) / 0.02 - 1.0).abs() < 0.02);
        // The sigma is √(0.02² + 0.5/1000).
        let shot = Detector { full_well_electrons: Some(1000.0), ..d };
        assert!((sigma(shot, 0.5) / 0.03 - 1.0).abs() < 0.02);
    }

    #[test]
    fn tone_is_that_of_srgb() {
        let d = Detector { tone: Tone::Srgb, bits: 16, ..Detector::default() };
        for (light, want) in [(0.0, 0.0), (0.002, 0.02584), (0.2140, 0.5), (0.5, 0.73536), (1.0, 1.0), (7.0, 1.0)] {
            let got = f64::from(d.expose(&[flat(2, 1, light)], 0).at(0, 0)) / 65535.0;
            assert!((got - want).abs() < 2e-4, "{light}: {got}");
        }
    }

    #[test]
    fn patterns_are_the_same_in_every_picture() {
        let d = Detector { offset_pattern: 0.01, gain_pattern: 0.05, bits: 16, ..Detector::default() };
        let shot = |light: f32, seed| d.expose(&[flat(64, 64, light)], seed);
        assert_eq!(shot(0.5, 1), shot(0.5, 2));
        assert_ne!(shot(0.5, 1), Detector { hot_pixel_seed: 2, ..d }.expose(&[flat(64, 64, 0.5)], 1));
    }

    #[test]
    fn hot_pixels_stay_where_they_are() {
        let d = Detector { hot_pixels: 0.01, ..Detector::default() };
        let a = d.expose(&[flat(200, 100, 0.0)], 1);
        assert_eq!(a, d.expose(&[flat(200, 100, 0.0)], 2));
        let Samples::Bytes(data) = a.samples else { panic!("8 bits are bytes") };
        let hot = data.iter().filter(|&&v| v > 0).count();
        assert!((150..250).contains(&hot), "{hot}");
    }
}
