//! Edge points of drawn edges.

use super::*;
use crate::image::region::Region;
use crate::image::{Grey, Layout};
use crate::model::observer::Unobserved;
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
    let grey = Grey::try_new(data, Layout::packed(100, 100, 1, 8)).unwrap();
    let region = Region::<f64>::whole(100, 100);
    let binary = BinaryPicture::new(&grey, &region, level, &Unobserved);
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
    assert_eq!(
        locate_edge_points(&binary, &config, &border, 0, &mut blocks, u32::MAX),
        Points { count: 15, ..Points::default() }
    );
    let (first, last) = (blocks[0].point(0).u, blocks[1].point(6).u);
    assert_eq!((first, last), (22.0, 78.0));
}
