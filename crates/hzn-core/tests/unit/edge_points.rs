//! Tests the accuracy of each method on blurred steps that are integrated over the pixels, with noise.

use super::*;
use crate::geometry::pixel::ImagePoint;
use crate::image::region::Region;
use crate::image::{Grey, Layout};
use crate::model::observer::Unobserved;
use std::vec::Vec;

const SIZE: i32 = 41;
const DIM: f64 = 8000.0;
const CONTRAST: f64 = 20000.0;
const EDGES: u32 = 400;

/// Repeatable normal deviates: sums of twelve uniform numbers from a linear congruential generator.
struct Noise(u64);
impl Noise {
    fn even(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.even()).sum::<f64>() - 6.0
    }
}

/// One noisy edge: the picture, the unit normal `n` of the edge towards the light, and the value of x·n on the edge.
struct Drawn {
    data: Vec<u16>,
    n: [f64; 2],
    offset: f64,
}

fn draw(noise: &mut Noise, sigma_px: f64, snr: f64) -> Drawn {
    // The normal is within ±45° of one of the four directions. The edge is anywhere between pixels.
    let angle = (noise.even() - 0.5) * core::f64::consts::FRAC_PI_2
        + core::f64::consts::FRAC_PI_2 * (noise.even() * 4.0).floor();
    let (ny, nx) = libm::sincos(angle);
    let offset = f64::from(SIZE / 2) * (nx + ny) + noise.even() - 0.5;
    let data = (0..SIZE * SIZE)
        .map(|i| {
            // Mean over the pixel, from 4×4 points.
            let (x, y) = (f64::from(i % SIZE), f64::from(i / SIZE));
            let middle = x * nx + y * ny - offset;
            if middle.abs() > 4.5 * sigma_px + 1.0 {
                let share = f64::from(u8::from(middle > 0.0));
                return (DIM + CONTRAST * (share + noise.normal() / snr) + 0.5) as u16;
            }
            let share: f64 = (0..16)
                .map(|k| {
                    let at = |k: i32| (f64::from(k) - 1.5) / 4.0;
                    let d = (x + at(k % 4)) * nx + (y + at(k / 4)) * ny - offset;
                    0.5 * (1.0 + libm::erf(d / (sigma_px * core::f64::consts::SQRT_2))) / 16.0
                })
                .sum();
            (DIM + CONTRAST * (share + noise.normal() / snr) + 0.5) as u16
        })
        .collect();
    Drawn { data, n: [nx, ny], offset }
}

/// Calls `find` with the scene and a border pixel of `EDGES` edges. Returns the root mean square distance of the points
/// from the true edge along its normal, in pixels. At least 99 % of the edges must be found.
fn rmse(
    sigma_px: f64,
    snr: f64,
    find: impl Fn(&BinaryPicture<'_, f64, Grey<'_, u16>, Unobserved>, Pixel) -> Option<ImagePoint<f64>>,
) -> f64 {
    let mut noise = Noise(7);
    let (mut sum, mut found) = (0.0, 0);
    for _ in 0..EDGES {
        let Drawn { data, n, offset } = draw(&mut noise, sigma_px, snr);
        let grey = Grey::try_new(&data, Layout::packed(SIZE as u32, SIZE as u32, 1, 16)).unwrap();
        let region = Region::whole(SIZE as u16, SIZE as u16);
        let level = (DIM + CONTRAST / 2.0) as u16;
        let binary = BinaryPicture::new(&grey, &region, level, &Unobserved);
        let dark = |x: i32, y: i32| !binary.lit(x as u16, y as u16);
        let beside = |x: i32, y: i32| f64::from(x) * n[0] + f64::from(y) * n[1] - offset;
        // Use the border pixel nearest to the middle; noise makes others far from the edge.
        let (x, y) = (0..SIZE * SIZE)
            .map(|i| (i % SIZE, i / SIZE))
            .filter(|&(x, y)| (10..31).contains(&x) && (10..31).contains(&y) && !dark(x, y))
            .filter(|&(x, y)| dark(x - 1, y) || dark(x + 1, y) || dark(x, y - 1) || dark(x, y + 1))
            .filter(|&(x, y)| beside(x, y).abs() < 1.5)
            .min_by_key(|&(x, y)| (x - SIZE / 2).pow(2) + (y - SIZE / 2).pow(2))
            .unwrap();
        if let Some(p) = find(&binary, Pixel { x: x as u16, y: y as u16 }) {
            sum += (p.u * n[0] + p.v * n[1] - offset).powi(2);
            found += 1;
        }
    }
    assert!(found * 100 >= EDGES * 99, "{found} of {EDGES} edges at blur {sigma_px} px, SNR {snr}");
    (sum / f64::from(found)).sqrt()
}

fn by(
    method: SubPixel,
    blur_px: f64,
) -> impl Fn(&BinaryPicture<'_, f64, Grey<'_, u16>, Unobserved>, Pixel) -> Option<ImagePoint<f64>> {
    move |binary, pixel| {
        let mut blocks = [Block::default(); 1];
        let config = Config { sub_pixel: method, blur_px, keep_points: 0, ..Config::default() };
        (locate_edge_points(binary, &config, &[pixel], 0, &mut blocks, u32::MAX).count == 1).then(|| blocks[0].point(0))
    }
}

/// Blur in pixels, ratio of contrast to noise, and three expected errors in pixels: the Cramér-Rao bound, `linear` and
/// `zernike`. The errors come from simulations with known levels.
const TABLE: [(f64, f64, f64, f64, f64); 7] = [
    (0.5, 5.0, 0.103, 0.196, 0.29),
    (0.5, 20.0, 0.026, 0.051, 0.077),
    (0.5, 50.0, 0.010, 0.028, 0.042),
    (1.0, 20.0, 0.035, 0.071, 0.115),
    (1.0, 50.0, 0.014, 0.029, 0.087),
    (2.0, 20.0, 0.050, 0.131, 0.209),
    (2.0, 50.0, 0.020, 0.051, 0.191),
];

fn all(method: SubPixel, expected: impl Fn(&(f64, f64, f64, f64, f64)) -> Option<f64>) {
    for row in &TABLE {
        let error = rmse(row.0, row.1, by(method, 0.0));
        std::println!("{method:?}, blur {} px, SNR {}: {error:.3} px", row.0, row.1);
        let Some(limit) = expected(row) else { continue };
        assert!(error < limit, "{method:?}, blur {} px, SNR {}: {error:.3} px, not below {limit:.3}", row.0, row.1);
    }
}

#[cfg(feature = "erf")]
#[test]
fn erf_reaches_the_bound() {
    for &(sigma_px, snr, bound, ..) in &TABLE {
        let error = rmse(sigma_px, snr, |binary, pixel| {
            let (x, y) = (i32::from(pixel.x), i32::from(pixel.y));
            let start = erf::start(binary, x, y)?;
            let found =
                erf::fit(&patch::Patch::read(binary, x, y)?, start, &erf::Levels { dim: DIM, bright: DIM + CONTRAST })?;
            Some(found.point(x, y))
        });
        assert!(error < 1.15 * bound, "blur {sigma_px} px, SNR {snr}: {error:.3} px, bound {bound}");
    }
}

/// The levels are estimated here, which increases the error by up to a third.
#[cfg(feature = "erf")]
#[test]
fn erf_with_its_own_levels_stays_near_the_bound() {
    all(SubPixel::Erf, |row| Some(row.2 * 1.35));
}

/// The levels come from a single row here, which increases the error.
#[test]
fn linear_is_within_its_table() {
    all(SubPixel::Linear, |row| Some(row.3 * if row.0 < 2.0 { 1.7 } else { 2.5 }));
}

/// The point is half a pixel from the border pixel: the error is a quarter of a pixel by rounding, and the noise.
#[test]
fn none_is_within_a_pixel_of_its_table() {
    all(SubPixel::None, |_| Some(0.45));
}

/// A step across a disc is no blurred edge. With a blur of more than 1 px, the pixels of the table were chosen with
/// knowledge of the truth.
#[cfg(feature = "zju")]
#[test]
fn zernike_is_within_its_table() {
    all(SubPixel::Zernike, |row| (row.0 < 2.0).then_some(row.4 * 1.2));
}

/// With the width of the blur known. The goal is 0.05 px at 1 px and 2 % of noise. With 20 % of noise, where the noise
/// is the error, the correction makes it a tenth larger.
#[cfg(feature = "zju")]
#[test]
fn zernike_with_a_known_blur_has_no_pull() {
    for &(sigma_px, snr, ..) in TABLE.iter().filter(|row| row.1 > 10.0) {
        let [ideal, blurred] = [0.0, sigma_px].map(|blur_px| rmse(sigma_px, snr, by(SubPixel::Zernike, blur_px)));
        std::println!("blur {sigma_px} px, SNR {snr}: {ideal:.3} px as a step, {blurred:.3} px with the blur known");
        assert!(blurred < ideal * 1.02, "blur {sigma_px} px, SNR {snr}: {ideal:.3} px, {blurred:.3} px");
        assert!(blurred < 0.05 || (sigma_px, snr) != (1.0, 50.0), "{blurred:.3} px");
    }
}
