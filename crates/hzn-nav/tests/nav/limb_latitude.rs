//! The limb height as a function of latitude.

use crate::common::Draws;
use hzn_nav::filter::{DirectionMeasurement, Filter, predict_direction};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::layout::Layout;
use hzn_nav::options::{Block, CameraOptions, Mode, Options, StartSigmas};
use hzn_nav::strapdown::{Imu, Nominal};
use nalgebra::UnitQuaternion;

const OFF: Block = Block { mode: Mode::Off, sigma: 0.0 };
/// Time between two limbs, s.
const STEP_S: f64 = 9.6;
/// Sigma of a direction, rad.
const WHITE_RAD: f64 = 5e-4;

fn start() -> Nominal {
    Nominal {
        time_s: 0.0,
        attitude: UnitQuaternion::from_euler_angles(0.2, -0.5, 1.0).into(),
        velocity_m_s: Vector::new(0.0, 0.0, 7.5e3),
        position_m: Vector::new(6.9e6, 1.0e6, 0.0),
    }
}

fn filter(limb_latitude: Block, attitude_rad: f64) -> Filter<20> {
    let options = Options {
        limb_height: Block::estimated(7.0),
        limb_latitude,
        start: StartSigmas { attitude_rad, velocity_m_s: 1e-3, position_m: 1.0 },
        imu: hzn_nav::options::ImuOptions {
            accel_bias: OFF,
            accel_scale: OFF,
            accel_misalignment: OFF,
            gyro_bias: OFF,
            gyro_scale: OFF,
            gyro_misalignment: OFF,
            accel_noise: [0.0, 0.0],
            gyro_noise: [0.0, 0.0],
            max_step_s: 1.1 * STEP_S,
            ..Default::default()
        },
        ..Options::default()
    };
    let camera = CameraOptions {
        misalignment: OFF,
        slow_error: Mode::Off,
        clock: OFF,
        white_rad: WHITE_RAD,
        ..CameraOptions::default()
    };
    Filter::new(start(), &options, &[camera]).unwrap()
}

/// The true height: 3 km, 4 km more at the north pole and less at the south pole, and 2 km less at both poles.
fn height_km(latitude_rad: f64) -> f64 {
    let sine = latitude_rad.sin();
    3.0 + 4.0 * sine - 2.0 * (3.0 * sine * sine - 1.0) / 2.0
}

/// What an instrument at a position makes of a limb with the height [`height_km`] above the told one.
struct Limb {
    /// Error of the fitted axis, rad.
    tilt_rad: Vector<Fixed>,
    /// Error of the fitted half-angle, rad.
    half_angle_rad: f64,
}

/// Fits axis and half-angle to the errors of the lines of sight around the whole limb.
fn fit(position_m: &Vector<Fixed>, height_km: impl Fn(f64) -> f64) -> Limb {
    const RADIUS_M: f64 = 6.371e6;
    let (up, distance_m) = (position_m.normalize(), position_m.norm());
    let x = Vector::new(1.0, 0.0, 0.0);
    let (a, b) = (up.cross(&x).normalize(), up.cross(&up.cross(&x)).normalize());
    let half_angle_rad = (RADIUS_M / distance_m).asin();
    let mut limb = Limb { tilt_rad: Vector::zeros(), half_angle_rad: 0.0 };
    let count = 720;
    for k in 0..count {
        let (sin, cos) = (f64::from(k) / f64::from(count) * std::f64::consts::TAU).sin_cos();
        let out = a * cos + b * sin;
        let touched = up * half_angle_rad.sin() + out * half_angle_rad.cos();
        // The line of sight that touches a larger sphere there.
        let larger = ((RADIUS_M + 1e3 * height_km(touched.xyz()[2].asin())) / distance_m).asin() - half_angle_rad;
        limb.tilt_rad += out * (larger * 2.0 / f64::from(count));
        limb.half_angle_rad += larger / f64::from(count);
    }
    limb
}

/// Gives the filter limbs from an orbit over the poles. They show a part of the limb, so that its half-angle moves the
/// direction, too.
fn watch(filter: &mut Filter<20>, seed: u64, limbs: usize) {
    let mut draws = Draws(seed);
    let mut truth = filter.clone();
    for k in 0..limbs {
        let imu = Imu { time_s: STEP_S * k as f64, gyro_rad_s: Vector::zeros(), accel_m_s2: Vector::zeros() };
        filter.predict(&imu, false);
        truth.predict(&imu, false);
        let Nominal { attitude, position_m, .. } = *truth.nominal();
        let reference = -position_m.normalize();
        let mount = Rotation::<Cam, Vehicle>::identity();
        let (seen, ..) = predict_direction(&attitude, &mount, &reference);
        let limb = fit(&position_m, height_km);
        let azimuth = 2.4 * k as f64;
        let x = Vector::new(1.0, 0.0, 0.0);
        let (a, b) = (seen.cross(&x).normalize(), seen.cross(&seen.cross(&x)).normalize());
        let by_half_angle = (a * azimuth.cos() + b * azimuth.sin()) * 0.8;
        let noise = draws.vector(WHITE_RAD);
        let error = (attitude * mount).inverse() * limb.tilt_rad + by_half_angle * limb.half_angle_rad;
        let measurement = DirectionMeasurement {
            camera: 0,
            body: 0,
            measured: (seen + error + noise).normalize(),
            reference,
            covariance_rad2: Covariance::isotropic(0.0),
            common_rad2: None,
            by_limb_height: by_half_angle * fit(&position_m, |_| 1.0).half_angle_rad,
            is_limb: true,
        };
        filter.update_direction(&measurement).unwrap();
    }
}

#[test]
fn the_height_at_every_latitude_is_found() {
    let mut beyond = 0;
    for seed in 0..10 {
        let mut filter = filter(Block::estimated(5.0), 1e-6);
        watch(&mut filter, 40 + seed, 600);
        let place = filter.layout().limb_latitude.unwrap();
        for latitude_deg in [-80.0f64, -30.0, 0.0, 45.0, 80.0] {
            let latitude_rad = latitude_deg.to_radians();
            let sine = latitude_rad.sin();
            let terms = [1.0, sine, (3.0 * sine * sine - 1.0) / 2.0];
            let first = filter.layout().limb_height.unwrap().first;
            let places = [first, place.first, place.first + 1];
            let variance: f64 = (0..9)
                .map(|i| (i / 3, i % 3))
                .fold(0.0, |sum, (i, j)| sum + terms[i] * terms[j] * filter.covariance()[(places[i], places[j])]);
            let error_km = filter.corrections().limb_height_at_km(latitude_rad) - height_km(latitude_rad);
            assert!(variance.sqrt() < 0.4, "{}", variance.sqrt());
            beyond += usize::from(error_km.abs() > 3.0 * variance.sqrt());
        }
    }
    // Of 50 heights, chance puts 0.14 beyond 3 sigma.
    assert!(beyond <= 2, "{beyond}");
}

#[test]
fn a_considered_height_by_latitude_widens_the_attitude_only() {
    let sigma = |latitude: Block| {
        let mut filter = filter(latitude, 0.02);
        watch(&mut filter, 7, 1);
        // The rotation about nadir is not seen.
        let nadir = -start().position_m.normalize().into_inner();
        let attitude = filter.covariance().fixed_view::<3, 3>(Layout::ATTITUDE, Layout::ATTITUDE).into_owned();
        let across = attitude.trace() - nadir.dot(&(attitude * nadir));
        (across.sqrt(), filter.corrections().limb_latitude_km)
    };
    let (without, _) = sigma(OFF);
    let (with, moved) = sigma(Block::considered(5.0));
    // One coefficient of 5 km tilts the axis by 5 km over the distance from the Earth's centre.
    let tilt_rad = 5e3 / start().position_m.norm();
    assert!(with > without.hypot(0.9 * tilt_rad) && with < 0.02, "{with} {without}");
    assert_eq!(moved, [0.0, 0.0]);
    assert!(filter(OFF, 0.02).layout().limb_latitude.is_none());
}
