//! Edge points of drawn edges.

use super::*;
use crate::image::region::Region;
use crate::image::{Grey, Layout};
use crate::model::observer::Unobserved;
use crate::model::tone::Tone;
use std::format;
use std::vec::Vec;

/// Makes a picture of a straight edge between two plateaus, blurred over `width_px` and lit where
/// (x, y)·n > offset.
fn picture(n: [f64; 2], offset: f64, width_px: f64, dim: f64, bright: f64) -> Vec<u8> {
    (0..100 * 100)
        .map(|i| {
            let d = f64::from(i % 100) * n[0] + f64::from(i / 100) * n[1] - offset;
            let part = 0.5 + 0.5 * (d / width_px).clamp(-1.0, 1.0);
            (dim + (bright - dim) * part + 0.5) as u8
        })
        .collect()
}

fn points(data: &[u8], config: &Config, level: u16) -> Vec<(f64, f64)> {
    points_of_tone(data, config, level, None)
}

fn points_of_tone(data: &[u8], config: &Config, level: u16, tone: Option<Tone>) -> Vec<(f64, f64)> {
    let grey = Grey::try_new(data, Layout::packed(100, 100, 1, 8)).unwrap();
    let region = Region::<f64>::whole(100, 100);
    let binary = BinaryPicture::new(&grey, &region, level, &Unobserved).with_tone(tone);
    let border: Vec<Pixel> = (0..100u16)
        .flat_map(|y| (0..100u16).map(move |x| Pixel { x, y }))
        .filter(|p| (20..80).contains(&p.x) && (20..80).contains(&p.y))
        .filter(|p| binary.lit(p.x, p.y))
        .filter(|p| {
            [(1, 0), (-1, 0), (0, 1), (0, -1)]
                .iter()
                .any(|(dx, dy)| !binary.lit((i32::from(p.x) + dx) as u16, (i32::from(p.y) + dy) as u16))
        })
        .collect();
    let mut blocks = [Block::default(); 64];
    let made = locate_edge_points(&binary, config, &border, 0, &mut blocks, u32::MAX);
    assert!(made.count > 30, "{made:?}");
    blocks
        .iter()
        .flat_map(|b| (0..LANES).filter(|&l| b.weight[l] > 0.0).map(|l| (b.point(l).u, b.point(l).v)))
        .collect()
}

#[test]
fn linear_finds_the_local_mid_level_whatever_the_level() {
    // The edges have four directions and other angles, and are narrow or wide.
    for (nx, ny) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.8, 0.6), (-0.6, 0.8)] {
        for width in [1.0, 2.5, 5.0] {
            let offset = 50.3 * nx + 49.8 * ny;
            let data = picture([nx, ny], offset, width, 20.0, 220.0);
            for level in [70, 120, 170] {
                for (u, v) in points(&data, &Config::default(), level) {
                    let off = u * nx + v * ny - offset;
                    assert!(off.abs() < 0.13, "normal {nx} {ny} width {width} level {level}: {off}");
                }
            }
        }
    }
}

/// Makes the picture of an edge that is blurred by `sigma_px`, in sRGB counts.
fn in_srgb(n: [f64; 2], offset: f64, sigma_px: f64, dim: f64, bright: f64) -> Vec<u8> {
    (0..100 * 100)
        .map(|i| {
            let d = f64::from(i % 100) * n[0] + f64::from(i / 100) * n[1] - offset;
            let light = dim + (bright - dim) * 0.5 * (1.0 + libm::erf(d / (sigma_px * core::f64::consts::SQRT_2)));
            let counts = if light > 0.003_130_8 { 1.055 * light.powf(1.0 / 2.4) - 0.055 } else { 12.92 * light };
            (255.0 * counts + 0.5) as u8
        })
        .collect()
}

/// Blur mixes the light of both sides, so the true edge is at half of the light, however wide the blur is. Half of the
/// counts is 0.79 standard deviations of the blur farther out, before a dark sky.
#[test]
fn the_edge_of_a_known_tone_is_at_half_of_the_light() {
    let methods = [
        (SubPixel::Linear, 0.3, true),
        (SubPixel::Erf, 0.1, cfg!(feature = "erf")),
        (SubPixel::Zernike, 0.2, cfg!(feature = "zju")),
    ];
    for (sub_pixel, most, _) in methods.into_iter().filter(|(.., is_built)| *is_built) {
        let config = Config { sub_pixel, ..Config::default() };
        for (nx, ny) in [(1.0, 0.0), (0.0, -1.0), (0.8, 0.6), (-0.6, 0.8)] {
            for (sigma_px, dim, bright) in [(0.8, 0.0, 0.9), (1.5, 0.01, 0.5), (3.0, 0.0, 0.7)] {
                // The moments of a small window are those of a sharp edge.
                if sub_pixel == SubPixel::Zernike && sigma_px > 1.0 {
                    continue;
                }
                let offset = 50.3 * nx + 49.8 * ny;
                let data = in_srgb([nx, ny], offset, sigma_px, dim, bright);
                // Towards the dark is negative.
                let [known, unknown] = [Some(Tone::Srgb), None].map(|tone| {
                    let all = points_of_tone(&data, &config, 60, tone);
                    all.iter().map(|(u, v)| u * nx + v * ny - offset).sum::<f64>() / all.len() as f64
                });
                let what = format!("{sub_pixel:?} {nx} {ny} blur {sigma_px}: {known:.3}, in counts {unknown:.3}");
                std::println!("{what}");
                assert!(known.abs() < most * sigma_px, "{what}");
                assert!(unknown < known - 0.3 * sigma_px, "{what}");
            }
        }
    }
}

#[test]
fn linear_counts_and_an_unknown_tone_have_the_same_points() {
    let data = picture([0.8, 0.6], 70.3, 3.0, 20.0, 220.0);
    let of = |tone| points_of_tone(&data, &Config::default(), 100, tone);
    for tone in [Tone::Linear, Tone::Unknown] {
        assert_eq!(of(Some(tone)), of(None));
    }
    // A gamma of 1 is linear, too.
    for (one, other) in of(Some(Tone::Gamma(1.0))).into_iter().zip(of(None)) {
        assert!((one.0 - other.0).hypot(one.1 - other.1) < 1e-2, "{one:?} {other:?}");
    }
}

#[test]
fn the_edge_of_a_glare_is_at_the_threshold() {
    // The light falls from 220 to 20 counts over 10 px, and is 70 counts 2.5 px outside of the middle.
    let data = picture([0.0, 1.0], 49.8, 5.0, 20.0, 220.0);
    let grey = Grey::try_new(&data, Layout::packed(100, 100, 1, 8)).unwrap();
    let region = Region::<f64>::whole(100, 100);
    let binary = BinaryPicture::new(&grey, &region, 70, &Unobserved).with_blooming(true);
    let row = (0..100).find(|&y| binary.lit(50, y)).unwrap();
    let border: Vec<Pixel> = (20..80).map(|x| Pixel { x, y: row }).collect();
    let mut blocks = [Block::default(); 8];
    let made = locate_edge_points(&binary, &Config::default(), &border, 0, &mut blocks, u32::MAX);
    assert_eq!(made.count, 60);
    let v = blocks[0].point(0).v;
    assert!((v - (49.8 - 2.5)).abs() < 0.1, "{v}");
}

#[test]
fn without_sub_pixel_points_stand_half_a_pixel_out() {
    let data = picture([0.0, 1.0], 49.8, 0.1, 20.0, 220.0);
    let config = Config { sub_pixel: SubPixel::None, ..Config::default() };
    for (_, v) in points(&data, &config, 120) {
        // Row 50 is the first lit one.
        assert_eq!(v, 49.5);
    }
}

/// If the light exceeds full scale, half of full scale is not half of the light.
#[test]
fn points_before_a_clipped_side_are_counted() {
    let border: Vec<Pixel> = (20..80).map(|x| Pixel { x, y: 50 }).collect();
    for width in [1.0, 4.0] {
        for (bright, all) in [(255.0, true), (254.0, true), (240.0, false), (120.0, false)] {
            let data = picture([0.0, 1.0], 49.8, width, 20.0, bright);
            let grey = Grey::try_new(&data, Layout::packed(100, 100, 1, 8)).unwrap();
            let region = Region::<f64>::whole(100, 100);
            let binary = BinaryPicture::new(&grey, &region, 70, &Unobserved);
            let mut blocks = [Block::default(); 8];
            let made = locate_edge_points(&binary, &Config::default(), &border, 0, &mut blocks, u32::MAX);
            assert_eq!((made.count, made.clipped), (60, if all { 60 } else { 0 }), "{width} {bright}");
        }
    }
}

#[test]
fn thinning_keeps_the_whole_edge() {
    let data = picture([0.0, 1.0], 49.8, 1.0, 20.0, 220.0);
    let config = Config { keep_points: 16, ..Config::default() };
    let grey = Grey::try_new(&data, Layout::packed(100, 100, 1, 8)).unwrap();
    let region = Region::<f32>::whole(100, 100);
    let binary = BinaryPicture::new(&grey, &region, 120, &Unobserved);
    let border: Vec<Pixel> = (20..80).map(|x| Pixel { x, y: 50 }).collect();
    let mut blocks = [Block::default(); 2];
    let made = locate_edge_points(&binary, &config, &border, 0, &mut blocks, u32::MAX);
    assert_eq!(made, Points { count: 15, profiles: made.profiles, ..Points::default() });
    // The edge falls by 200 counts over two pixels.
    for (part, place) in made.profiles.means::<f64>().unwrap().into_iter().zip([2.0, 7.0, 12.0]) {
        assert_eq!(part.place, place);
        assert!((part.ln_width.exp() - 2.0).abs() < 0.3 && (part.ln_contrast.exp() - 200.0).abs() < 20.0, "{part:?}");
    }
    let (first, last) = (blocks[0].point(0).u, blocks[1].point(6).u);
    assert_eq!((first, last), (22.0, 78.0));
}
