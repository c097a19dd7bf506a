//! Simulated flights through the filter: its covariance must be that of its errors.

use crate::common::Draws;
use hzn_nav::filter::{DirectionMeasurement, Filter, Innovation, Step};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::gravity;
use hzn_nav::layout::Layout;
use hzn_nav::options::{Block, CameraOptions, Mode, Options};
use hzn_nav::strapdown::{Imu, Nominal};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

const STATES: usize = 44;
const DT_S: f64 = 0.05;
const DEG: f64 = core::f64::consts::PI / 180.0;
/// 1-sigma of the slow errors of nadir and Sun, rad.
const SLOW: [f64; 2] = [0.15 * DEG, 0.10 * DEG];
const WHITE: f64 = 2e-4;
const GNSS: [f64; 2] = [5.0, 0.1];

fn cameras() -> [CameraOptions; 2] {
    let mount = |roll: f64, pitch: f64, yaw: f64| UnitQuaternion::from_euler_angles(roll, pitch, yaw).into();
    let camera = |mount| CameraOptions { mount, white_rad: WHITE, ..CameraOptions::default() };
    [camera(mount(1.9, 0.1, -0.4)), camera(mount(-0.3, 1.2, 0.7))]
}

/// Options whose noise is that of the simulation.
fn options() -> Options {
    let mut options = Options { limb_height: Block::considered(0.5), ..Options::default() };
    (options.imu.accel_noise[1], options.imu.gyro_noise[1]) = (0.0, 0.0);
    options
}

/// A flight with errors that are drawn from the options.
struct Flight {
    draws: Draws,
    truth: Nominal,
    told: Nominal,
    sun: Vector<Fixed>,
    mounts: [Rotation<Cam, Vehicle>; 2],
    slow: [Vector<Cam>; 2],
    /// 1-sigma of white noise that the covariance of a direction contains, rad.
    rest: f64,
    /// Whether a direction tells the part of its covariance that is common.
    tells_common: bool,
    height_km: f64,
    /// Time that the cameras' clocks are late, s.
    clock_s: [f64; 2],
    errors: [Vector<Vehicle>; 6],
    options: Options,
    last: Option<Imu>,
}

impl Flight {
    fn new(seed: u64) -> Self {
        let options = options();
        let mut draws = Draws(seed);
        let truth = Nominal {
            time_s: 0.0,
            attitude: Rotation::<Vehicle, Fixed>::identity() * Rotation::from_scaled_axis(draws.vector(2.0)),
            velocity_m_s: Vector::new(1500.0, 300.0, 800.0),
            position_m: Vector::new(2.4e6, 1.0e6, 6.0e6),
        };
        let start = options.start;
        let told = Nominal {
            time_s: 0.0,
            attitude: Rotation::from_scaled_axis(draws.vector(start.attitude_rad)).inverse() * truth.attitude,
            velocity_m_s: truth.velocity_m_s - draws.vector(start.velocity_m_s),
            position_m: truth.position_m - draws.vector(start.position_m),
        };
        let imu = options.imu;
        let blocks = [
            imu.accel_bias,
            imu.accel_scale,
            imu.accel_misalignment,
            imu.gyro_bias,
            imu.gyro_scale,
            imu.gyro_misalignment,
        ];
        let errors = blocks.map(|b| draws.vector(b.sigma));
        let mounts = cameras().map(|c| c.mount * Rotation::from_scaled_axis(draws.vector(c.misalignment.sigma)));
        let slow = SLOW.map(|sigma| draws.vector(sigma));
        let sun = Vector::new(0.3, -0.8, 0.5).normalize();
        let height_km = options.limb_height.sigma * draws.normal();
        let clock_s = [0.0; 2];
        let (rest, tells_common) = (0.0, false);
        Self {
            draws,
            truth,
            told,
            sun,
            mounts,
            slow,
            rest,
            tells_common,
            height_km,
            clock_s,
            errors,
            options,
            last: None,
        }
    }

    /// Moves the truth by a step, and returns the measured sample.
    fn sample(&mut self, step: u32) -> Imu {
        let time_s = DT_S * f64::from(step);
        let (s, c) = (0.3 * time_s).sin_cos();
        let thrust = if time_s < 40.0 { 30.0 } else { 0.0 };
        let real = Imu {
            time_s,
            gyro_rad_s: Vector::new(0.10 * s, 0.08 * c, 0.15),
            accel_m_s2: Vector::new(thrust, 0.3 * c, 0.2 * s),
        };
        if let Some(last) = self.last {
            self.truth = self.truth.step(&last, &real);
        }
        self.last = Some(real);
        let [ba, sa, ma, bg, sg, mg] = self.errors;
        let root = DT_S.sqrt();
        let noise = [self.options.imu.gyro_noise[0] / root, self.options.imu.accel_noise[0] / root];
        let (gyro, accel) = (real.gyro_rad_s, real.accel_m_s2);
        Imu {
            time_s,
            gyro_rad_s: gyro + bg + sg.component_mul(&gyro) + mg.cross(&gyro) + self.draws.vector(noise[0]),
            accel_m_s2: accel + ba + sa.component_mul(&accel) + ma.cross(&accel) + self.draws.vector(noise[1]),
        }
    }

    /// Returns a direction of camera 0 (nadir) or 1 (Sun) after `dt_s` since the last one.
    fn direction(&mut self, camera: usize, dt_s: f64) -> DirectionMeasurement {
        let keep = (-dt_s / 20.0f64).exp();
        let fresh = self.draws.vector(SLOW[camera] * (1.0 - keep * keep).sqrt());
        self.slow[camera] = self.slow[camera] * keep + fresh;
        let reference = if camera == 0 { -self.truth.position_m.normalize() } else { self.sun };
        // The picture was taken when the vehicle had turned further by the rate during the clock's error.
        let rate = self.last.map_or_else(Vector::zeros, |imu| imu.gyro_rad_s);
        let later = Rotation::from_scaled_axis(rate * self.clock_s[camera]);
        let seen = (self.truth.attitude * later * self.mounts[camera]).inverse() * reference;
        // The limb height tilts the axis about a fixed direction of the camera.
        let by_limb_height = if camera == 0 { seen.cross(&Vector::new(1.0, 0.0, 0.0)) * 3e-4 } else { Vector::zeros() };
        let white = self.draws.vector(WHITE.hypot(self.rest));
        let measured = (seen + self.slow[camera] + by_limb_height * self.height_km + white).normalize();
        let covariance_rad2 = Covariance::across(&measured, SLOW[camera].powi(2) + self.rest.powi(2));
        let common_rad2 = self.tells_common.then(|| Covariance::across(&measured, SLOW[camera].powi(2)));
        DirectionMeasurement {
            camera,
            body: 0,
            measured,
            reference,
            covariance_rad2,
            common_rad2,
            by_limb_height,
            is_limb: true,
        }
    }
}

/// Results of one flight.
#[derive(Default)]
struct Flown {
    error_rad: f64,
    nees: f64,
    position_nees: f64,
    misalignment_nees: f64,
    /// Error of the first camera's clock over its sigma.
    clock_sigmas: f64,
    directions: Vec<f64>,
    gnss: Vec<f64>,
    refused: usize,
}

fn fly(flight: &mut Flight, options: &Options, cameras: &[CameraOptions], false_every: Option<u32>) -> Flown {
    let mut filter = Filter::<STATES>::new(flight.told, options, cameras).unwrap();
    let mut flown = Flown::default();
    for step in 0..=(300.0 / DT_S) as u32 {
        let imu = flight.sample(step);
        assert!(matches!(filter.predict(&imu, false), Step::First | Step::Taken));
        if step > 0 && step % 20 == 0 {
            for camera in 0..2 {
                let mut seen = flight.direction(camera, 1.0);
                if let [both] = cameras {
                    // One camera sees limb and Sun.
                    (seen.camera, seen.body) = (0, camera.min(both.bodies - 1));
                }
                let is_false = false_every.is_some_and(|n| camera == 0 && (step / 20) % n == 0);
                if is_false {
                    seen.measured = Rotation::from_scaled_axis(Vector::new(0.0, 52.0 * DEG, 0.0)) * seen.measured;
                }
                let innovation = filter.update_direction(&seen).unwrap();
                assert!(!(is_false && innovation.taken), "a false answer was taken");
                flown.refused += usize::from(!innovation.taken && !is_false);
                if !is_false {
                    flown.directions.push(innovation.nis);
                }
            }
            let truth = flight.truth;
            let position = truth.position_m + flight.draws.vector(GNSS[0]);
            let velocity = truth.velocity_m_s + flight.draws.vector(GNSS[1]);
            let mut keep = |i: Innovation<3>| flown.gnss.push(i.nis);
            keep(filter.update_position(&position, GNSS[0]).unwrap());
            keep(filter.update_velocity(&velocity, GNSS[1]).unwrap());
        }
    }
    let nominal = filter.nominal();
    let nees = |error: Vector3<f64>, first: usize| {
        let block: Matrix3<f64> = filter.covariance().fixed_view::<3, 3>(first, first).into_owned();
        (error.transpose() * block.try_inverse().unwrap() * error)[(0, 0)]
    };
    let error = (flight.truth.attitude * nominal.attitude.inverse()).scaled_axis();
    flown.error_rad = error.norm();
    flown.nees = nees(error.into_inner(), Layout::ATTITUDE);
    flown.position_nees = nees((flight.truth.position_m - nominal.position_m).into_inner(), Layout::POSITION);
    if let (Some(place), Some(camera)) = (filter.layout().cameras[0].misalignment, filter.camera(0)) {
        let error = (camera.mount.inverse() * flight.mounts[0]).scaled_axis();
        flown.misalignment_nees = nees(error.into_inner(), place.first);
    }
    if let (Some(place), Some(camera)) = (filter.layout().cameras[0].clock, filter.camera(0)) {
        let sigma = filter.covariance()[(place.first, place.first)].sqrt();
        assert!(sigma < 0.05, "{sigma}");
        flown.clock_sigmas = (flight.clock_s[0] - camera.clock_s) / sigma;
    }
    flown
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn the_covariance_is_that_of_the_errors() {
    let runs: Vec<Flown> = (0..40).map(|k| fly(&mut Flight::new(9000 + k), &options(), &cameras(), None)).collect();
    let rmse = mean(runs.iter().map(|r| r.error_rad.powi(2))).sqrt() / DEG;
    let nees = mean(runs.iter().map(|r| r.nees));
    let (position, mount) =
        (mean(runs.iter().map(|r| r.position_nees)), mean(runs.iter().map(|r| r.misalignment_nees)));
    let directions = mean(runs.iter().flat_map(|r| r.directions.iter().copied()));
    let gnss = mean(runs.iter().flat_map(|r| r.gnss.iter().copied()));
    println!(
        "RMSE {rmse:.3}°, NEES {nees:.2}, position {position:.2}, mount {mount:.2}, NIS {directions:.2} and {gnss:.2}"
    );
    for nees in [nees, position, mount] {
        assert!((2.2..3.9).contains(&nees), "{nees}");
    }
    assert!(rmse < 0.3, "{rmse}");
    // The innovations are correlated by the slow error, so the bounds are wide.
    assert!((1.6..2.4).contains(&directions), "{directions}");
    assert!((2.9..3.1).contains(&gnss), "{gnss}");
    // A right direction is refused once in 10 000 times; the first ones, with 2° of error, a little more often.
    let refused = runs.iter().map(|r| r.refused).sum::<usize>();
    assert!(refused < 24, "{refused} of 24 000 directions");
}

#[test]
fn white_errors_instead_of_slow_ones_are_over_confident() {
    let white = cameras().map(|c| CameraOptions { slow_error: Mode::Off, ..c });
    let runs: Vec<Flown> = (0..20).map(|k| fly(&mut Flight::new(9100 + k), &options(), &white, None)).collect();
    let nees = mean(runs.iter().map(|r| r.nees));
    assert!(nees > 4.5, "{nees}");
}

/// Directions whose covariance is half slow and half white. If they tell which part is common, the covariance of the
/// filter is right; otherwise the slow error has all of it.
#[test]
fn the_rest_of_the_covariance_is_white_noise() {
    let run = |k: u64, tells_common: bool| {
        let mut flight = Flight::new(9700 + k);
        (flight.rest, flight.tells_common) = (0.12 * DEG, tells_common);
        fly(&mut flight, &options(), &cameras(), None)
    };
    let [told, untold] = [true, false].map(|tells_common| {
        let runs: Vec<Flown> = (0..60).map(|k| run(k, tells_common)).collect();
        let rmse = mean(runs.iter().map(|r| r.error_rad.powi(2))).sqrt() / DEG;
        let directions = mean(runs.iter().flat_map(|r| r.directions.iter().copied()));
        println!("NEES {:.2}, RMSE {rmse:.3}°, NIS {directions:.2}", mean(runs.iter().map(|r| r.nees)));
        (mean(runs.iter().map(|r| r.nees)), rmse, directions)
    });
    assert!((2.2..3.9).contains(&told.0) && (1.6..2.4).contains(&told.2), "{told:?}");
    assert!(told.1 < 1.02 * untold.1 && (told.2 - 2.0).abs() < (untold.2 - 2.0).abs(), "{told:?} {untold:?}");
}

/// Limb and Sun in one camera do not share their slow errors. A filter that takes one for both is over-confident.
#[test]
fn limb_and_sun_in_one_camera() {
    let nees = [2, 1].map(|bodies| {
        let both = cameras().map(|c| CameraOptions { bodies, ..c });
        mean((0..20).map(|k| {
            let mut flight = Flight::new(9600 + k);
            flight.mounts[1] = flight.mounts[0];
            fly(&mut flight, &options(), &both[..1], None).nees
        }))
    });
    println!("NEES {:.2} with two slow errors, {:.2} with one", nees[0], nees[1]);
    assert!((1.5..5.0).contains(&nees[0]) && nees[1] > 1.2 * nees[0], "{nees:?}");
}

#[test]
fn false_answers_are_refused() {
    let runs: Vec<Flown> = (0..20).map(|k| fly(&mut Flight::new(9200 + k), &options(), &cameras(), Some(50))).collect();
    assert!(runs.iter().all(|r| r.error_rad < 1.0 * DEG), "{:?}", runs.iter().map(|r| r.error_rad).fold(0.0, f64::max));
    let nees = mean(runs.iter().map(|r| r.nees));
    assert!((1.8..4.5).contains(&nees), "{nees}");
}

/// Cameras without a common clock: their offsets are found, and the attitude stays honest.
#[test]
fn clock_offsets_are_found() {
    let with_clock = cameras().map(|c| CameraOptions { clock: Block::estimated(0.15), ..c });
    let run = |k: u64, cameras: &[CameraOptions]| {
        let mut flight = Flight::new(9300 + k);
        flight.clock_s = [0.15 * flight.draws.normal(), 0.15 * flight.draws.normal()];
        fly(&mut flight, &options(), cameras, None)
    };
    let runs: Vec<Flown> = (0..30).map(|k| run(k, &with_clock)).collect();
    let nees = mean(runs.iter().map(|r| r.nees));
    let clocks = mean(runs.iter().map(|r| r.clock_sigmas.powi(2)));
    assert!((2.0..4.0).contains(&nees), "{nees}");
    assert!((0.4..1.8).contains(&clocks), "{clocks}");
    let blind = mean((0..30).map(|k| run(k, &cameras()).nees));
    assert!(blind > 1.5 * nees, "{blind} without clock states, {nees} with them");
}

/// A first attitude that is 8° wrong about each axis (1σ) converges.
#[test]
fn a_large_first_error_converges() {
    let mut options = options();
    options.start.attitude_rad = 10.0 * DEG;
    for k in 0..10 {
        let mut flight = Flight::new(9400 + k);
        let turn = Rotation::from_scaled_axis(flight.draws.vector(8.0 * DEG));
        flight.told.attitude = turn * flight.truth.attitude;
        let flown = fly(&mut flight, &options, &cameras(), None);
        assert!(flown.error_rad < 1.0 * DEG, "{k}: {}°", flown.error_rad / DEG);
    }
}

/// The covariance stays symmetric and positive definite over predictions, with three updates for each twenty.
fn assert_positive_definite(predictions: u32) {
    let mut flight = Flight::new(5);
    let options = options();
    let mut filter = Filter::<STATES>::new(flight.told, &options, &cameras()).unwrap();
    let n = filter.layout().len;
    let at = flight.truth.position_m;
    for step in 0..predictions {
        let imu = Imu {
            time_s: DT_S * f64::from(step),
            gyro_rad_s: Vector::new(0.01, -0.02, 0.3),
            accel_m_s2: filter.nominal().attitude.inverse() * -gravity(&at),
        };
        filter.predict(&imu, false);
        if step % 20 == 0 {
            flight.truth.attitude = filter.nominal().attitude;
            for camera in 0..2 {
                let seen = flight.direction(camera, 1.0);
                filter.update_direction(&seen).unwrap();
            }
            let position = filter.nominal().position_m;
            filter.update_position(&position, 5.0).unwrap();
        }
        if step % 50_000 == 49_999 {
            let p = filter.covariance().view((0, 0), (n, n)).into_owned();
            assert_eq!(p, p.transpose());
            let scale = p.map_diagonal(|d| 1.0 / d.sqrt());
            let correlation = nalgebra::DMatrix::from_fn(n, n, |i, j| p[(i, j)] * scale[i] * scale[j]);
            let smallest = correlation.symmetric_eigenvalues().min();
            assert!(smallest > -1e-9, "step {step}: {smallest}");
        }
    }
}

#[test]
fn the_covariance_stays_positive_definite() {
    assert_positive_definite(100_000);
}

#[test]
#[ignore = "takes half a minute: cargo xtask test --all"]
fn the_covariance_stays_positive_definite_over_a_million_predictions() {
    assert_positive_definite(1_000_000);
}
