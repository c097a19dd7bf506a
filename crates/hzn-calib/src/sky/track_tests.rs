//! Tests with tracks of the Sun whose lens, mount and noise are known.

use hzn_core::camera::{Camera, Config, Intrinsic, Model};

use nalgebra::{Rotation3, Vector3};

use super::{Sight, TrackRefusal, Unknowns, estimate_track};
use crate::draws::Draws;

const NOISE_PX: f64 = 0.1;

fn lens() -> Config {
    let mut lens = Config::ideal(Model::KannalaBrandt, 960, 720, 600.0);
    lens.k.extend_from_slice(&[-0.05, 0.01]).unwrap();
    lens
}

fn turn() -> Rotation3<f64> {
    Rotation3::new(Vector3::new(0.01, -0.02, 0.015))
}

/// Returns discs all over a part of the picture (1 is the whole one). The nominal camera is turned against the real
/// one.
fn sights(part: f64, seed: u64) -> Vec<Sight> {
    let camera = Camera::<f64>::try_new(&lens()).unwrap();
    let mut draws = Draws(seed);
    let each = (0..60).map(|k| {
        let u = 480.0 + part * 440.0 * (2.0 * draws.uniform() - 1.0);
        let v = 360.0 + part * 330.0 * (2.0 * draws.uniform() - 1.0);
        let ray = camera.unproject(hzn_core::pixel::ImagePoint { u, v }).unwrap();
        let direction = turn() * Vector3::from(ray.xyz());
        let point_px = [u + NOISE_PX * draws.normal(), v + NOISE_PX * draws.normal()];
        Sight { name: k.to_string(), point_px, direction: direction.into() }
    });
    each.collect()
}

fn told() -> Config {
    Config { fx_px: 588.0, fy_px: 588.0, cx_px: 475.5, cy_px: 363.5, ..lens() }
}

#[test]
fn the_lens_and_the_mount_come_back() {
    let mut within = 0;
    let mut all = 0;
    for seed in 1..=20 {
        let mut sights = sights(1.0, seed);
        // A wrong answer.
        sights[7].point_px[0] += 40.0;
        let found = estimate_track(&Unknowns::new(&told(), &[]), &sights).unwrap();
        assert!(found.undetermined().is_none() && found.left_out == ["7"], "{:?}", found.left_out);
        assert!((found.sigma_px / NOISE_PX - 1.0).abs() < 0.5, "{}", found.sigma_px);
        for p in &found.parameters {
            let real = lens().intrinsic(p.which).unwrap();
            assert!(p.determined && (p.value - real).abs() < 4.5 * p.sigma, "{p:?}");
            all += 1;
            within += usize::from((p.value - real).abs() < 2.0 * p.sigma);
        }
        let real = turn().scaled_axis();
        for ([deg, sigma], real) in found.correction_deg.iter().zip(real.iter()) {
            assert!((deg - real.to_degrees()).abs() < 4.5 * sigma, "{deg} ± {sigma}");
        }
    }
    assert!(within * 100 >= all * 88, "{within} of {all} within two sigmas");
}

#[test]
fn a_short_track_determines_no_lens() {
    let found = estimate_track(&Unknowns::new(&told(), &[]), &sights(0.0003, 5)).unwrap();
    assert!(matches!(found.undetermined(), Some(TrackRefusal::Undetermined { .. })), "{:?}", found.focal_percent);
    assert_eq!(found.camera.intrinsic(Intrinsic::FxPx), Some(588.0));
    let few = estimate_track(&Unknowns::new(&told(), &[]), &sights(1.0, 5)[..5]).unwrap_err().to_string();
    assert!(few.contains("5 pictures have an answer and a direction of the body, but at least 8"), "{few}");
}

#[test]
fn attitudes_of_other_pictures_are_noticed() {
    let mut sights = sights(1.0, 6);
    let directions: Vec<_> = sights.iter().map(|s| s.direction).collect();
    for (sight, other) in sights.iter_mut().zip(directions.iter().rev()) {
        sight.direction = *other;
    }
    match estimate_track(&Unknowns::new(&told(), &[]), &sights) {
        Err(_) => {}
        Ok(found) => assert!(found.sigma_px > 50.0 || found.undetermined().is_some(), "{found:?}"),
    }
}
