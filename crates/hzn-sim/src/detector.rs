//! From light to numbers: the optics' blur, noise, quantisation.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::counter::{Counter, Stream};
use crate::picture::{Picture, Samples};

/// The detector and the blur of the optics before it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Detector {
    /// Standard deviation of the Gaussian point spread function in pixels; 0 is none.
    pub psf_sigma_px: f64,
    /// Standard deviation of the noise that does not depend on the light, fraction of full scale.
    pub read_noise: f64,
    /// Electrons at full scale, for shot noise of √electrons; none without it.
    pub full_well_electrons: Option<f64>,
    /// Share of pixels that are hot, and show anything up to full scale in every picture.
    pub hot_pixels: f64,
    /// Which pixels are hot.
    pub hot_pixel_seed: u64,
    /// Bits of a sample, 8 to 16.
    pub bits: u8,
}

impl Default for Detector {
    fn default() -> Self {
        Self {
            psf_sigma_px: 0.7,
            read_noise: 0.0,
            full_well_electrons: None,
            hot_pixels: 0.0,
            hot_pixel_seed: 1,
            bits: 8,
        }
    }
}

/// Light on the detector: fractions of full scale, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plane {
    pub(crate) width: usize,
    pub(crate) data: Vec<f32>,
}

/// One side of the Gaussian's weights, the centre first; the whole sums to one.
fn kernel(sigma: f64) -> Vec<f32> {
    if !(sigma > 0.0) {
        return vec![1.0];
    }
    // Beyond four sigma there is less than 1e-4 of the light.
    let reach = (4.0 * sigma).ceil().min(200.0) as usize;
    let weights: Vec<f64> = (0..=reach).map(|i| libm::exp(-0.5 * (i as f64 / sigma) * (i as f64 / sigma))).collect();
    let sum: f64 = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

impl Plane {
    pub(crate) fn height(&self) -> usize {
        self.data.len() / self.width
    }

    /// Blurred by a Gaussian; beyond the border the picture goes on with its outermost pixels.
    pub(crate) fn blurred(mut self, sigma_px: f64) -> Self {
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
        let at = |y: isize| &source[y.clamp(0, h as isize - 1) as usize * w..][..w];
        let mut data = vec![0.0f32; w * h];
        data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (p, s) in row.iter_mut().zip(at(y as isize)) {
                *p = k[0] * s;
            }
            for (i, &weight) in k.iter().enumerate().skip(1) {
                let (above, below) = (at(y as isize - i as isize), at(y as isize + i as isize));
                for ((p, a), b) in row.iter_mut().zip(above).zip(below) {
                    *p += weight * (a + b);
                }
            }
        });
        Self { width: w, data }
    }
}

impl Detector {
    /// Noise, hot pixels and quantisation.
    pub(crate) fn expose(&self, light: &Plane, seed: u64) -> Picture {
        let bits = self.bits.clamp(8, 16);
        let samples = if bits == 8 {
            let mut data = vec![0u8; light.data.len()];
            self.fill(light, seed, bits, &mut data, |v| v as u8);
            Samples::Bytes(data)
        } else {
            let mut data = vec![0u16; light.data.len()];
            self.fill(light, seed, bits, &mut data, |v| v as u16);
            Samples::Words(data)
        };
        Picture { width: light.width as u16, height: light.height() as u16, bits, samples }
    }

    fn fill<S: Send>(&self, light: &Plane, seed: u64, bits: u8, out: &mut [S], to: impl Fn(u32) -> S + Sync) {
        let w = light.width;
        let full = ((1u32 << bits) - 1) as f32;
        let noise = Counter::new(seed, Stream::Detector);
        let hot = Counter::new(self.hot_pixel_seed, Stream::HotPixels);
        let read2 = (self.read_noise * self.read_noise) as f32;
        let shot = self.full_well_electrons.map_or(0.0, |e| 1.0 / e.max(1.0)) as f32;
        let noisy = read2 > 0.0 || shot > 0.0;
        out.par_chunks_mut(w).zip(light.data.par_chunks(w)).enumerate().for_each(|(y, (out, light))| {
            // Pixels share a draw in pairs; an odd width leaves half a draw unused.
            let first = (y * w.div_ceil(2)) as u64;
            for (pair, (out, light)) in out.chunks_mut(2).zip(light.chunks(2)).enumerate() {
                let normal = if noisy { noise.normal_pair(first + pair as u64) } else { [0.0; 2] };
                for (i, (out, &light)) in out.iter_mut().zip(light).enumerate() {
                    let mut v = light + normal[i] * (read2 + shot * light.max(0.0)).sqrt();
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
            let Samples::Words(data) = d.expose(&flat(401, 300, level), 3).samples else { panic!("16 bits are words") };
            let n = data.len() as f64;
            let mean = data.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
            (data.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n).sqrt() / 65535.0
        };
        assert!((sigma(d, 0.5) / 0.02 - 1.0).abs() < 0.02);
        // √(0.02² + 0.5/1000)
        let shot = Detector { full_well_electrons: Some(1000.0), ..d };
        assert!((sigma(shot, 0.5) / 0.03 - 1.0).abs() < 0.02);
    }

    #[test]
    fn hot_pixels_stay_where_they_are() {
        let d = Detector { hot_pixels: 0.01, ..Detector::default() };
        let a = d.expose(&flat(200, 100, 0.0), 1);
        assert_eq!(a, d.expose(&flat(200, 100, 0.0), 2));
        let Samples::Bytes(data) = a.samples else { panic!("8 bits are bytes") };
        let hot = data.iter().filter(|&&v| v > 0).count();
        assert!((150..250).contains(&hot), "{hot}");
    }
}
