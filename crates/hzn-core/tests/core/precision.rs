//! Single and double precision give the same answer: the difference is far below the answer's own sigma.

use hzn_core::body::{Kind, Prior};
use hzn_core::camera::{self, Model};
use hzn_core::image::{Grey, Layout};
use hzn_core::real::Real;
use hzn_core::status::Status;
use hzn_core::{Config, FlightHorizon, HostHorizon, Solution};
use proptest::prelude::*;

const W: u32 = 320;
const H: u32 = 240;
const FOCAL_PX: f64 = 300.0;
/// Focal length for the Sun, whose disc then has a radius of 37 px.
const SUN_FOCAL_PX: f64 = 8000.0;
/// Largest difference in units of the answer's sigma. An eighth adds less than 1 % to the total error.
const MOST_SIGMAS: f64 = 0.125;

/// Draws a smooth limb with noise. The axis of the body is `below_rad` below the optical axis, turned by `roll_rad`.
fn limb(focal_px: f64, half_angle_rad: f64, below_rad: f64, roll_rad: f64, noise: u8, seed: u64) -> Vec<u8> {
    let mut state = seed | 1;
    let (sin, cos) = below_rad.sin_cos();
    let axis = [sin * roll_rad.sin(), sin * roll_rad.cos(), cos];
    (0..W * H)
        .map(|i| {
            let (u, v) = ((f64::from(i % W) - 159.5) / focal_px, (f64::from(i / W) - 119.5) / focal_px);
            let along = (axis[0] * u + axis[1] * v + axis[2]) / (1.0 + u * u + v * v).sqrt();
            let inside_px = (half_angle_rad - along.clamp(-1.0, 1.0).acos()) * focal_px;
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let random = (state >> 40) as f64 / f64::from(1u32 << 24) * f64::from(noise);
            (20.0 + 170.0 * (0.5 + inside_px / 2.0).clamp(0.0, 1.0) + random) as u8
        })
        .collect()
}

/// Returns axis, half-angle and sigma of an answer in double precision.
fn numbers<T: Real>(s: &Solution<T>) -> ([f64; 3], f64, f64) {
    (s.axis.xyz().map(|x| x.to_f64()), s.half_angle_rad.to_f64(), s.covariance.sigma_max_rad().to_f64())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn single_precision_is_far_below_sigma(
        altitude_km in 60.0..2000.0f64, offset_deg in -14.0..14.0f64, roll_deg in 0.0..360.0f64, noise in 0u8..12,
        seed in any::<u64>(),
    ) {
        let mut config = Config::new(camera::Config::ideal(Model::Pinhole, W as u16, H as u16, FOCAL_PX));
        config.body.kind = Kind::EarthSphere;
        config.body.altitude_km = Some(altitude_km);
        let radius_km = config.body.mean_radius_km();
        let half_angle_rad = ((radius_km + config.body.limb_height_km) / (radius_km + altitude_km)).asin();
        let below_rad = half_angle_rad + offset_deg.to_radians();
        let data = limb(FOCAL_PX, half_angle_rad, below_rad, roll_deg.to_radians(), noise, seed);
        compare(&config, &data)?;
    }
}

/// A disc of the Sun has few points, so that one point on the other side of a limit matters: for a few discs the
/// precisions differ by more than an eighth of sigma, or one of them refuses the answer.
#[test]
fn single_precision_is_far_below_sigma_for_almost_every_sun() {
    const DISCS: u64 = 400;
    let mut config = Config::new(camera::Config::ideal(Model::Pinhole, W as u16, H as u16, SUN_FOCAL_PX));
    config.body.kind = Kind::Sun;
    let half_angle_rad = HostHorizon::boxed(&config).unwrap().expect(&Prior::default()).unwrap().half_angle_rad();
    let mut apart = Vec::new();
    for seed in 0..DISCS {
        let draw = |k: u64| ((7919 * seed + 104_729 * k) % 1009) as f64 / 1009.0;
        let (below_rad, roll_rad) = ((0.6 * draw(1)).to_radians(), core::f64::consts::TAU * draw(2));
        let data = limb(SUN_FOCAL_PX, half_angle_rad, below_rad, roll_rad, (seed % 12) as u8, seed * 2_654_435_761);
        if let Err(TestCaseError::Fail(why)) = compare(&config, &data) {
            apart.push(why);
        }
    }
    assert!(apart.len() <= 2, "{} of {DISCS} discs: {apart:?}", apart.len());
}

/// Asserts that both precisions give the same status and, within a part of sigma, the same direction and sigma.
fn compare(config: &Config, data: &[u8]) -> Result<(), TestCaseError> {
    let picture = Grey::try_new(data, Layout::packed(W, H, 1, 8)).unwrap();
    let mut host = HostHorizon::boxed(config).unwrap();
    let mut flight = FlightHorizon::boxed(config).unwrap();
    let double = host.process(&picture, &host.expect(&Prior::default()).unwrap());
    let single = flight.process(&picture, &flight.expect(&Prior::default()).unwrap());
    prop_assert_eq!(double.status, single.status);
    prop_assume!(double.status == Status::Ok);
    let (a, b) = (numbers(&double.solution.unwrap()), numbers(&single.solution.unwrap()));
    let difference_rad = (0..3).map(|i| (a.0[i] - b.0[i]).powi(2)).sum::<f64>().sqrt();
    prop_assert!(difference_rad < MOST_SIGMAS * a.2, "{} sigma", difference_rad / a.2);
    prop_assert!((a.2 / b.2 - 1.0).abs() < MOST_SIGMAS, "sigma {} and {}", a.2, b.2);
    Ok(())
}
