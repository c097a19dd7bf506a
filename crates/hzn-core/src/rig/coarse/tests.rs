use std::vec::Vec;

use super::*;
use crate::base::rng::Rng;
use crate::geometry::camera::{self, Model};
use crate::geometry::pixel::ImagePoint;
use crate::image::Pixels;
use crate::image::region::Region;
use crate::model::body::LOWEST_SUN_DEG;

const WIDTH: u16 = 64;
const HEIGHT: u16 = 48;
/// Half-angle of the limb from 500 km.
const HALF_ANGLE_RAD: f64 = 1.19;
const LEVEL: u16 = 100;

/// What a head sees of a body.
struct Scene<'a> {
    camera: &'a Camera<f64>,
    /// The direction to the body, camera frame.
    body: V3<f64>,
    /// The Sun, camera frame.
    sun: Option<V3<f64>>,
}

impl Pixels for Scene<'_> {
    fn width(&self) -> u16 {
        WIDTH
    }
    fn height(&self) -> u16 {
        HEIGHT
    }
    fn full_scale(&self) -> u16 {
        255
    }
    fn index(&self, x: u16, y: u16) -> usize {
        usize::from(y) * usize::from(WIDTH) + usize::from(x)
    }
    fn across(&self) -> usize {
        1
    }
    fn down(&self) -> usize {
        WIDTH.into()
    }
    fn read(&self, index: usize) -> u16 {
        let at = |i: usize| i as f64;
        let point = ImagePoint { u: at(index % usize::from(WIDTH)), v: at(index / usize::from(WIDTH)) };
        let ray = *self.camera.unproject(point).unwrap().v();
        let along = ray.dot(&self.body);
        let is_body = along > HALF_ANGLE_RAD.cos();
        let is_sunny = |sun| sun_elevation_sine(&ray, &self.body, along, HALF_ANGLE_RAD.sin(), sun) > 0.0;
        if is_body && self.sun.as_ref().is_none_or(is_sunny) { 180 } else { 5 }
    }
}

fn camera() -> Camera<f64> {
    Camera::try_new(&camera::Config::ideal(Model::Pinhole, WIDTH, HEIGHT, 60.0)).unwrap()
}

fn product([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 4] {
    let [a, b] = [V3::new(ax, ay, az), V3::new(bx, by, bz)];
    let v = b * aw + a * bw + a.cross(&b);
    [aw * bw - a.dot(&b), v.x, v.y, v.z]
}

/// Heads that look at the limb all around the vehicle's z axis.
fn ring(heads: u8) -> Vec<Mount<f64>> {
    let turn = |half: f64, [x, y, z]: [f64; 3]| [half.cos(), half.sin() * x, half.sin() * y, half.sin() * z];
    let mount = |k: u8| {
        let azimuth = turn(std::f64::consts::PI * f64::from(k) / f64::from(heads), [0.0, 0.0, 1.0]);
        let q = product(azimuth, turn(0.5 * HALF_ANGLE_RAD, [0.0, 1.0, 0.0]));
        Mount::new([1.0, 0.0, 0.0, 0.0], q, &[0.0; 6]).unwrap()
    };
    (0..heads).map(mount).collect()
}

fn drawn(rng: &mut Rng) -> V3<f64> {
    loop {
        let v = V3::from_fn(|_, _| f64::from(rng.below(2_000_001)) / 1e6 - 1.0);
        if let Some(unit) = unit(&v).filter(|_| v.norm() < 1.0) {
            return unit;
        }
    }
}

/// Returns error and sigma in degrees.
fn found(
    mounts: &[Mount<f64>],
    body: V3<f64>,
    sun: Option<V3<f64>>,
    light: &Light<f64>,
    half_angle_rad: Option<[f64; 2]>,
) -> Option<[f64; 2]> {
    let camera = camera();
    let glimpses: Vec<_> = mounts
        .iter()
        .map(|mount| {
            let back = mount.after(0.0, None).unwrap().inverse();
            let seen = |v: V3<f64>| *back.apply(&UnitVec3::<Vehicle, f64>::assume_unit(v)).v();
            let scene = Scene { camera: &camera, body: seen(body), sun: sun.map(seen) };
            Glimpse::take(&scene, &Region::<f64>::whole(WIDTH, HEIGHT))
        })
        .collect();
    let heads = glimpses.iter().zip(mounts);
    let heads = heads.map(|(glimpse, mount)| GlimpsedHead { glimpse, level: LEVEL, camera: &camera, mount });
    let coarse = coarse(heads, half_angle_rad, light)?;
    Some([coarse.axis.angle_rad(&UnitVec3::assume_unit(body)), coarse.sigma_rad].map(f64::to_degrees))
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

#[test]
fn a_body_in_its_own_light_is_found_within_its_sigma_from_any_attitude() {
    let mut rng = Rng::new(7);
    let known = Some([HALF_ANGLE_RAD; 2]);
    for (heads, half_angle, most_deg) in [(4, known, 5.0), (4, None, 15.0), (2, known, 20.0), (1, known, 50.0)] {
        let mounts = ring(heads);
        let all: Vec<_> = (0..40)
            .map(|_| found(&mounts, drawn(&mut rng), None, &Light::Own, half_angle).unwrap_or([0.0, 90.0]))
            .collect();
        let outside = all.iter().filter(|[error, sigma]| *error > 3.0 * sigma).count();
        let middle = median(all.iter().map(|[error, _]| *error));
        assert!(outside == 0 && middle < most_deg, "{heads} heads: {outside} beyond 3 sigma, median {middle}");
    }
}

#[test]
fn a_dark_picture_in_visible_light_says_little_unless_the_sun_is_known() {
    let (mut rng, mounts, known) = (Rng::new(8), ring(4), Some([HALF_ANGLE_RAD; 2]));
    let (mut sigmas, mut outside) = ([Vec::new(), Vec::new()], 0);
    for _ in 0..40 {
        let (body, sun) = (drawn(&mut rng), drawn(&mut rng));
        let lights = [Light::Sun(None), Light::Sun(Some(UnitVec3::assume_unit(sun)))];
        for (light, sigmas) in lights.iter().zip(&mut sigmas) {
            let [error, sigma] = found(&mounts, body, Some(sun), light, known).unwrap_or([0.0, 90.0]);
            outside += usize::from(error > 3.0 * sigma);
            sigmas.push(sigma);
        }
    }
    let [unknown, told] = sigmas.map(|sigmas| median(sigmas.into_iter()));
    assert!(outside <= 1 && told < 0.7 * unknown, "{outside} beyond 3 sigma, medians {unknown} and {told}");
    // Only dark pictures: the body is in none of them, or it is night.
    let night = || found(&mounts, V3::new(0.0, 0.0, 1.0), Some(V3::new(0.0, 0.0, 1.0)), &Light::Sun(None), known);
    assert!(night().is_none_or(|[_, sigma]| sigma > 60.0));
}

#[test]
fn a_limb_that_was_found_separates_sky_and_body() {
    let (camera, body) = (camera(), V3::new(0.0, HALF_ANGLE_RAD.sin(), HALF_ANGLE_RAD.cos()));
    let scene = Scene { camera: &camera, body, sun: None };
    let glimpse = Glimpse::take(&scene, &Region::<f64>::whole(WIDTH, HEIGHT));
    let level = |cos: f64| glimpse.level_at_limb(&camera, &UnitVec3::assume_unit(body), cos);
    // A quarter of the way from 5 to 180 counts.
    assert_eq!(level(HALF_ANGLE_RAD.cos()), Some(49));
    // All of the picture would be sky, or all body.
    assert_eq!((level(1.0), level(-1.0)), (None, None));
}

#[test]
fn the_constant_is_the_end_of_twilight() {
    assert!((DARKEST - LOWEST_SUN_DEG.to_radians().sin()).abs() < 1e-15);
}
