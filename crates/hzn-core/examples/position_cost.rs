//! The cost of a position: the time of one clean picture with `fit.position`, divided by the time without it.
//!
//! Run it with `cargo run --release --example position_cost -p hzn-core --features _programs,position`. The pictures
//! take turns, and each ratio is of two neighbouring times, so that other programs on the machine disturb it little.

use std::hint::black_box;
use std::time::{Duration, Instant};

use hzn_core::body::Kind;
use hzn_core::camera::{self, Camera, Model};
use hzn_core::frames::Rotation;
use hzn_core::image::{Grey, Layout};
use hzn_core::pixel::ImagePoint;
use hzn_core::real::Real;
use hzn_core::{Config, Horizon, Prior};

type Error = Box<dyn std::error::Error>;

const SIZE: [u16; 2] = [1920, 1080];
const FOCAL_PX: f64 = 1233.0;
const ALTITUDE_KM: f64 = 200.0;
const LIMB_KM: f64 = 17.0;
/// Direction to the centre of the Earth in the camera; the axes of the camera are those of the Earth.
const DOWN: [f64; 3] = [0.0905, 0.9053, 0.4150];
const TURNS: usize = 400;

fn main() -> Result<(), Error> {
    for (kind, radii_km) in [(Kind::Earth, [6378.137, 6356.752]), (Kind::EarthSphere, [6371.0088; 2])] {
        let [equator_km, pole_km] = radii_km;
        let k = [-0.055, 0.011, -0.0035, 0.0002].into_iter().collect();
        let lens = camera::Config { k, ..camera::Config::ideal(Model::KannalaBrandt, SIZE[0], SIZE[1], FOCAL_PX) };
        let mut config = Config::new(lens);
        config.body.kind = kind;
        config.body.altitude_km = Some(ALTITUDE_KM);
        let centre_km = DOWN.map(|x| x * (equator_km + ALTITUDE_KM));
        let data = draw(&config.camera, [equator_km, equator_km, pole_km], centre_km)?;
        let single = median_ratio::<f32, 2048, 256, 512>(&config, centre_km, &data)?;
        let double = median_ratio::<f64, 16384, 2048, 65536>(&config, centre_km, &data)?;
        println!("{}: {single:.3} in f32, {double:.3} in f64", kind.name());
    }
    Ok(())
}

/// Returns a picture of an ellipsoid: 12 counts of sky, 180 of ground, an edge three pixels wide, ±3 counts of noise.
fn draw(lens: &camera::Config, radii_km: [f64; 3], centre_km: [f64; 3]) -> Result<Vec<u8>, Error> {
    let camera = Camera::<f64>::try_new(lens)?;
    let scaled = |v: [f64; 3]| [0, 1, 2].map(|i| v[i] / (radii_km[i] + LIMB_KM));
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let axis = scaled(centre_km);
    let half_angle = (1.0 / dot(axis, axis).sqrt()).asin();
    let [width, height] = SIZE.map(usize::from);
    let mut noise = 1u64;
    let mut brightness = |i: usize| {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let point = ImagePoint { u: (i % width) as f64, v: (i / width) as f64 };
        let Some(ray) = camera.unproject(point).map(|ray| scaled(ray.xyz())) else { return 0 };
        let angle = (dot(ray, axis) / (dot(ray, ray) * dot(axis, axis)).sqrt()).acos();
        let lit = (0.5 - (angle - half_angle) * FOCAL_PX / 3.0).clamp(0.0, 1.0);
        (9.0 + 180.0 * lit + 6.0 * (noise >> 40) as f64 / f64::from(1 << 24)) as u8
    };
    Ok((0..width * height).map(&mut brightness).collect())
}

/// Returns the median of the ratio of times.
fn median_ratio<T: Real, const POINTS: usize, const BLOCKS: usize, const WORDS: usize>(
    config: &Config,
    centre_km: [f64; 3],
    data: &[u8],
) -> Result<f64, Error> {
    let prior = Prior {
        position_m: Some(centre_km.map(|x| T::from_f64(-x * 1e3))),
        fixed_from_camera: Rotation::assume_from_quaternion([T::from_f64(1.0), T::ZERO, T::ZERO, T::ZERO]),
        attitude_sigma_rad: Some(T::from_f64(1e-3)),
        ..Prior::default()
    };
    let picture = Grey::try_new(data, Layout::packed(SIZE[0].into(), SIZE[1].into(), 1, 8))?;
    let mut sensors = Vec::new();
    for position in [false, true] {
        let mut config = config.clone();
        config.fit.position = Some(position);
        sensors.push(Horizon::<T, POINTS, BLOCKS, WORDS>::boxed(&config)?);
    }
    let mut ratios = Vec::new();
    for _ in 0..TURNS {
        let mut times = [Duration::ZERO; 2];
        for (i, (sensor, time)) in sensors.iter_mut().zip(&mut times).enumerate() {
            let expected = sensor.expect(&prior)?;
            let start = Instant::now();
            let report = black_box(sensor.process(black_box(&picture), &expected));
            *time = start.elapsed();
            let position = report.solution.ok_or("no answer")?.position;
            assert_eq!(position.is_some(), i == 1);
        }
        ratios.push(times[1].as_secs_f64() / times[0].as_secs_f64());
    }
    ratios.sort_by(f64::total_cmp);
    Ok(ratios[TURNS / 2])
}
