//! Thresholds of drawn pictures.

use super::histogram::{BINS, Histogram};
use super::small_body::split_small_body;
use super::*;
use crate::base::rng::Rng;
use crate::image::{Grey, Layout};
use crate::model::observer::Unobserved;
use std::vec::Vec;

fn level(data: &[u16], bits: u8, brightness: Brightness, config: Config) -> Result<Level<f64>, Status> {
    let picture = Grey::try_new(data, Layout::packed(64, 64, 1, bits)).unwrap();
    split(&picture, &Region::whole(64, 64), &brightness, &config, None, 1, &Unobserved)
}

/// The upper part is dark, the lower part is lit.
fn halves(dark: u16, lit: u16) -> Vec<u16> {
    (0..64 * 64).map(|i| if i < 64 * 24 { dark } else { lit }).collect()
}

#[test]
fn otsu_stands_half_way_between_two_values() {
    let found = level(&halves(10, 210), 8, Brightness::default(), Config::default()).unwrap();
    assert_eq!((found.level, found.samples), (110, 256));
    // With 12 bits, the threshold is in the counts of the picture.
    let found = level(&halves(100, 3900), 12, Brightness::default(), Config::default()).unwrap();
    assert!(found.level.abs_diff(2000) <= 16, "{}", found.level);
}

#[test]
fn fixed_and_dynamic_follow_the_configuration() {
    let data = halves(10, 210);
    let fixed = Config { method: Method::Fixed, level: 77.0, ..Config::default() };
    assert_eq!(level(&data, 8, Brightness::default(), fixed).unwrap().level, 77);
    let part = Config { level: 0.9, ..fixed };
    assert_eq!(level(&data, 8, Brightness::default(), part).unwrap().level, 229);
    assert_eq!(level(&data, 12, Brightness::default(), part).unwrap().level, 3685);
    let dynamic = Config { method: Method::Dynamic, factor: 0.5, ..Config::default() };
    let found = level(&data, 8, Brightness::default(), dynamic).unwrap();
    assert_eq!(f64::from(found.level), (found.mean * 0.5).floor());
    assert!((found.mean - 135.0).abs() < 10.0);
}

#[test]
fn gates_and_flat_pictures_have_their_status() {
    let brightness = Brightness { min_mean: 0.1, max_mean: 0.9 };
    assert_eq!(level(&halves(1, 2), 8, brightness, Config::default()).unwrap_err(), Status::TooDark);
    assert_eq!(level(&halves(250, 255), 8, brightness, Config::default()).unwrap_err(), Status::TooBright);
    assert_eq!(level(&halves(100, 100), 8, brightness, Config::default()).unwrap_err(), Status::NoLimb);
}

#[test]
fn a_thermal_camera_uses_a_small_part_of_its_words() {
    // The contrast is 1200 of 65536 counts, which is 1.8 % of full scale or 60 standard deviations. The noise is 10
    // counts on both sides.
    let noise = |i: usize| (i * 7919 % 41) as u16;
    for sky in [0, 7000, 30_000] {
        let data: Vec<u16> = halves(sky, sky + 1200).iter().enumerate().map(|(i, v)| v + noise(i)).collect();
        let found = level(&data, 16, Brightness::default(), Config::default()).unwrap();
        assert!(found.level.abs_diff(sky + 620) < 40, "{sky}: {found:?}");
        assert!((found.contrast - 1200.0).abs() < 40.0 && (found.dark - f64::from(sky) - 20.0).abs() < 40.0);
        // Half of the light is found at every brightness of the sky.
        assert!(found.at_fraction(0.5).abs_diff(sky + 320) < 40, "{sky}: {}", found.at_fraction(0.5));
        // Noise alone does not form two classes.
        let flat: Vec<u16> = (0..64 * 64).map(|i| sky + noise(i)).collect();
        assert_eq!(level(&flat, 16, Brightness::default(), Config::default()).unwrap_err(), Status::NoLimb);
    }
}

#[test]
fn dark_noise_is_measured_on_any_background() {
    // The noise is the sum of twelve numbers: nearly normal, with a sigma of 4 counts. It lies on a sky and on dim
    // ground.
    let mut rng = Rng::new(5);
    let mut noise = || (0..12).map(|_| f64::from(rng.below(1000)) / 1000.0).sum::<f64>() * 4.0;
    let ground = |i: usize| if i < 64 * 12 { 30 } else { 0 };
    let data: Vec<u16> =
        halves(10, 190).iter().enumerate().map(|(i, &v)| v.min(190 - ground(i)) + noise() as u16 + ground(i)).collect();
    let picture = Grey::try_new(&data, Layout::packed(64, 64, 1, 8)).unwrap();
    let of = |level| dark_noise::<f64, _, _>(&picture, &Region::whole(64, 64), level, 7, &Unobserved);
    assert!((of(120) - 4.0).abs() < 0.8, "{}", of(120));
    assert_eq!(of(1), 0.0, "nothing is below");
}

/// Tests Otsu's threshold against its definition, on all samples of six pixels from seven brightnesses.
#[test]
fn an_edge_is_no_dark_noise() {
    // Every second column is lit, so that each pair of neighbours has a lit pixel.
    let data: Vec<u16> = (0..64 * 64).map(|i| if i % 2 == 0 { 10 } else { 210 }).collect();
    let picture = Grey::try_new(&data[..], Layout::packed(64, 64, 1, 8)).unwrap();
    assert_eq!(dark_noise::<f64, _, _>(&picture, &Region::whole(64, 64), 110, 7, &Unobserved), 0.0);
}

#[test]
fn every_small_sample_has_the_threshold_of_the_definition() {
    const VALUES: [u16; 7] = [0, 3, 4, 60, 61, 200, 255];
    let mut found = 0;
    for number in 0..7u32.pow(6) {
        let sample: [u16; 6] = core::array::from_fn(|k| VALUES[(number / 7u32.pow(k as u32) % 7) as usize]);
        if !sample.is_sorted() {
            continue;
        }
        let mut histogram = Histogram { bins: [0; BINS], sum: 0, count: 0, shift: 0, first: 0 };
        sample.iter().for_each(|&v| histogram.count(v));
        let Some(level) = histogram.otsu::<f64>(255) else { continue };
        found += 1;
        // Variance between the pixels below a threshold and the others, times the square of the number of pixels.
        let between = |level: f64| {
            let dark: Vec<f64> = sample.iter().map(|&v| f64::from(v)).filter(|&v| v < level).collect();
            let lit: Vec<f64> = sample.iter().map(|&v| f64::from(v)).filter(|&v| v >= level).collect();
            let (n, m) = (dark.len() as f64, lit.len() as f64);
            let difference = dark.iter().sum::<f64>() / n.max(1.0) - lit.iter().sum::<f64>() / m.max(1.0);
            n * m * difference * difference
        };
        let best = (0..=256).map(|k| between(f64::from(k))).fold(0.0, f64::max);
        assert!(between(level) >= best * (1.0 - 1e-12), "{sample:?}: {level}");
        // It lies in the middle between the two classes.
        let below = sample.iter().rfind(|&&v| f64::from(v) < level).unwrap();
        let above = sample.iter().find(|&&v| f64::from(v) >= level).unwrap();
        assert_eq!(level, f64::from(below + above + 1) / 2.0, "{sample:?}");
    }
    assert!(found > 800, "{found} samples have a threshold");
}

#[test]
fn bins_widen_without_losing_a_pixel() {
    let mut histogram = Histogram { bins: [0; BINS], sum: 0, count: 0, shift: 0, first: 0 };
    let values = [30_000u16, 30_100, 29_000, 31_500, 12, 65_535, 30_000];
    for (n, v) in (1u32..).zip(values) {
        histogram.count(v);
        assert_eq!(histogram.bins.iter().map(|&b| u32::from(b)).sum::<u32>(), n);
        assert!(histogram.bin(v.into()).is_some_and(|k| histogram.bins[k] > 0));
    }
    assert_eq!((histogram.shift, histogram.first), (8, 0));
    // The first value is in the middle of the bins, so that noise about it keeps bins of one count.
    let mut histogram = Histogram::new();
    [30_000, 29_900, 30_100].into_iter().for_each(|v| histogram.count(v));
    assert_eq!(histogram.shift, 0);
}

#[test]
fn a_small_body_is_found_by_the_finer_sample() {
    // 5×5 of 4096 pixels: the first sample expects 1.6 of them, the second all.
    let data: Vec<u16> = (0..64 * 64)
        .map(|i| if (29..34).contains(&(i % 64)) && (29..34).contains(&(i / 64)) { 200 } else { 0 })
        .collect();
    let found = level(&data, 8, Brightness::default(), Config::default()).unwrap();
    assert!((90..=110).contains(&found.level), "{}", found.level);
    let lower = level(&data, 8, Brightness::default(), Config { scale: 0.5, ..Config::default() }).unwrap();
    assert!((45..=55).contains(&lower.level), "{}", lower.level);
}

/// Collects the pixels that are read.
#[derive(Default)]
struct Reads(core::cell::RefCell<Vec<(u16, u16)>>);
impl crate::model::observer::Observer<f64> for Reads {
    fn pixel(&self, x: u16, y: u16) {
        self.0.borrow_mut().push((x, y));
    }
}

/// Draws a disc of 4 px with a hot pixel beside it. The third sample takes the grid, then the window about the
/// brightest place.
#[test]
fn a_body_between_the_places_of_both_samples_has_a_window_of_its_own() {
    let (width, height) = (640u16, 480u16);
    let data: Vec<u8> = (0..480i32 * 640)
        .map(|i| match ((i % 640 - 301).pow(2) + (i / 640 - 203).pow(2) <= 16, i == 10 * 640 + 10) {
            (_, true) => 255,
            (true, _) => 200,
            _ => 20,
        })
        .collect();
    let picture = Grey::try_new(&data[..], Layout::packed(640, 480, 1, 8)).unwrap();
    let find = |scale: f64, radius_px: f64| {
        let (reads, region) = (Reads::default(), Region::whole(width, height));
        let config = Config { scale, ..Config::default() };
        let (places, level) = split_small_body(&picture, &region, &config, radius_px, &reads);
        (places, level, reads.0.into_inner())
    };
    let (places, level, reads) = find(1.0, 4.0);
    let level = level.unwrap();
    assert_eq!(places, 160 * 120);
    assert_eq!((reads[0], reads[1], reads[160]), ((2, 2), (6, 2), (2, 6)));
    // The window reaches two radii to each side of a place on the disc, and has all of its 17 rows and columns.
    let window = &reads[19_200..];
    assert_eq!((window.len(), level.samples), (17 * 17, 19_200 + 17 * 17));
    let (first, last) = (window[0], window[17 * 17 - 1]);
    assert_eq!((last.0 - first.0, last.1 - first.1), (16, 16));
    assert!((first.0 + 8).abs_diff(301) <= 4 && (first.1 + 8).abs_diff(203) <= 4);
    assert_eq!(level.level, 110);
    assert_eq!(find(0.5, 4.0).1.unwrap().level, 55);
    // The first places lie half of the spacing inside; a large body is none for this sample.
    assert_eq!(find(1.0, 6.9).2[0], (3, 3));
    assert_eq!((find(1.0, 7.0).0, find(1.0, 7.0).2.len()), (0, 0));
    // A radius below a pixel has as many places as the limit allows: every second pixel or so.
    assert!((65_000..=77_000).contains(&find(1.0, 0.1).0), "{}", find(1.0, 0.1).0);
}
