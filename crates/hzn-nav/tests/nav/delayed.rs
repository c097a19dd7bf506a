//! Late, early, repeated and broken samples and measurements.

use crate::common::Draws;
use hzn_nav::delayed::{Delayed, Measurement, Outcome, Refused};
use hzn_nav::filter::{DirectionMeasurement, Filter, FilterError, Unusable};
use hzn_nav::frames::{Covariance, Rotation, Vector};
use hzn_nav::gravity::gravity;
use hzn_nav::options::{CameraOptions, ImuOptions, Options};
use hzn_nav::start::{Seen, first_attitude, propagate_back};
use hzn_nav::strapdown::{Imu, Nominal};
use nalgebra::UnitQuaternion;

const DEG: f64 = core::f64::consts::PI / 180.0;

fn start() -> Nominal {
    Nominal {
        time_s: 0.0,
        attitude: UnitQuaternion::from_euler_angles(0.2, -0.5, 1.0).into(),
        velocity_m_s: Vector::new(100.0, -30.0, 900.0),
        position_m: Vector::new(2.4e6, 1.0e6, 6.0e6),
    }
}

fn imu(time_s: f64) -> Imu {
    let (s, c) = (0.7 * time_s).sin_cos();
    Imu { time_s, gyro_rad_s: Vector::new(0.2 * s, 0.1 * c, 0.3), accel_m_s2: Vector::new(5.0, s, c) }
}

/// Returns the true states at the samples.
fn flight(count: u32, dt: f64) -> Vec<(Imu, Nominal)> {
    let mut state = start();
    let mut all = vec![(imu(0.0), state)];
    for k in 1..=count {
        let (from, to) = (imu(dt * f64::from(k - 1)), imu(dt * f64::from(k)));
        state = state.step(&from, &to);
        all.push((to, state));
    }
    all
}

fn direction(truth: &Nominal, sun: bool) -> Measurement {
    let reference = if sun { Vector::new(0.3, -0.8, 0.5).normalize() } else { -truth.position_m.normalize() };
    // The cameras have the axes of the vehicle.
    let measured = CameraOptions::default().mount.inverse() * (truth.attitude.inverse() * reference);
    let covariance_rad2 = Covariance::across(&measured, (0.1 * DEG).powi(2));
    Measurement::Direction(DirectionMeasurement {
        camera: usize::from(sun),
        body: 0,
        measured,
        reference,
        covariance_rad2,
        common_rad2: None,
        by_limb_height: Vector::zeros(),
        is_limb: true,
    })
}

fn filter() -> Filter<44> {
    let told =
        Nominal { attitude: Rotation::from_scaled_axis(Vector::new(0.02, -0.02, 0.03)) * start().attitude, ..start() };
    Filter::new(told, &Options::default(), &[CameraOptions::default(); 2]).unwrap()
}

#[test]
fn late_measurements_are_the_same_as_those_in_time() {
    let all = flight(3050, 0.01);
    let mut in_time = Delayed::<44, 64, 16>::new(filter(), 0.0);
    let mut late = Delayed::<44, 64, 16>::new(filter(), 0.4);
    let ignore = |_: f64, _: &Measurement, outcome: Outcome| assert_eq!(outcome, Outcome::Taken);
    for (k, (sample, truth)) in all.iter().enumerate() {
        if k > 0 && k % 100 == 0 {
            in_time.push(truth.time_s, direction(truth, k % 200 == 0)).unwrap();
            in_time.push(truth.time_s, Measurement::Position(truth.position_m, 5.0)).unwrap();
        }
        in_time.push_sample(sample, false, ignore);
        late.push_sample(sample, false, ignore);
        // The same measurements 0.3 s later, in another order.
        if let Some(then) = k.checked_sub(30).filter(|then| *then > 0 && then % 100 == 0) {
            let truth = &all[then].1;
            late.push(truth.time_s, direction(truth, then % 200 == 0)).unwrap();
            late.push(truth.time_s, Measurement::Position(truth.position_m, 5.0)).unwrap();
        }
    }
    late.finish(ignore);
    let (a, b) = (in_time.filter(), late.filter());
    assert!(a.nominal().attitude.angle_to(&b.nominal().attitude) < 1e-9);
    assert!((a.covariance() - b.covariance()).amax() < 1e-9 * a.covariance().amax());
    assert_eq!(late.counts().taken, in_time.counts().taken);
    assert!(a.nominal().attitude.angle_to(&all[3050].1.attitude) < 1.0 * DEG);
}

#[test]
fn the_solution_of_now_has_no_lag() {
    let all = flight(500, 0.01);
    let exact = Filter::<44>::new(start(), &Options::default(), &[]).unwrap();
    let mut delayed = Delayed::<44, 64, 16>::new(exact, 0.5);
    for (sample, truth) in &all {
        delayed.push_sample(sample, false, |_, _, _| ());
        let now = delayed.now();
        assert!(now.time_s == truth.time_s || truth.time_s == 0.0);
        assert!(now.attitude.angle_to(&truth.attitude) < 1e-9 && (now.position_m - truth.position_m).norm() < 1e-3);
    }
    assert!(delayed.filter().nominal().time_s < all[500].0.time_s - 0.4);
}

#[test]
fn broken_input_is_counted() {
    let mut delayed = Delayed::<44, 8, 2>::new(filter(), 0.05);
    let none = |_: f64, _: &Measurement, _: Outcome| ();
    for k in 0..100 {
        delayed.push_sample(&imu(0.01 * f64::from(k)), false, none);
    }
    delayed.push_sample(&imu(0.99), false, none);
    delayed.push_sample(&imu(0.5), false, none);
    delayed.push_sample(&Imu { time_s: f64::NAN, ..imu(1.0) }, false, none);
    delayed.push_sample(&Imu { gyro_rad_s: Vector::new(f64::INFINITY, 0.0, 0.0), ..imu(1.0) }, false, none);
    let position = Measurement::Position(start().position_m, 5.0);
    assert_eq!(delayed.push(0.1, position), Err(Refused::TooLate));
    assert_eq!(delayed.push(1e9, position), Err(Refused::FromTheFuture));
    assert_eq!(delayed.push(f64::NAN, position), Err(Refused::NotFinite));
    let broken = Measurement::Position(Vector::new(f64::NAN, 0.0, 0.0), 5.0);
    let far = Measurement::Position(start().position_m + Vector::new(0.0, 5e4, 0.0), 5.0);
    delayed.push(0.98, broken).unwrap();
    delayed.push(0.985, far).unwrap();
    assert_eq!(delayed.push(0.99, position), Err(Refused::Full));
    let mut outcomes = Vec::new();
    delayed.finish(|_, _, outcome| outcomes.push(outcome));
    assert_eq!(outcomes, [Outcome::Unusable(Unusable::NotFinite), Outcome::Gated]);
    // A gap of 20 s, and saturation: the sigma of the attitude grows.
    let before = delayed.filter().sigmas(0).norm();
    delayed.push_sample(&imu(21.0), false, none);
    delayed.push_sample(&imu(21.01), true, none);
    delayed.finish(none);
    assert!(delayed.filter().sigmas(0).norm() > 5.0 * before.max(0.1));
    let c = delayed.counts();
    assert_eq!((c.duplicates, c.out_of_order, c.not_finite, c.gaps), (1, 1, 2, 2), "{c:?}");
    assert_eq!((c.too_late, c.future, c.full, c.gated, c.unusable), (1, 1, 1, 1, 2), "{c:?}");
    assert!(delayed.filter().covariance().iter().all(|x| x.is_finite()));
}

#[test]
fn what_does_not_fit_is_refused() {
    let cameras = [CameraOptions::default(); 4];
    let error = Filter::<40>::new(start(), &Options::default(), &cameras).unwrap_err();
    assert_eq!(error, FilterError::TooManyStates { needed: 52, memory: 40 });
    let five = [CameraOptions::default(); 5];
    assert_eq!(Filter::<60>::new(start(), &Options::default(), &five).unwrap_err(), FilterError::TooManyCameras);
    let broken = Nominal { velocity_m_s: Vector::new(f64::NAN, 0.0, 0.0), ..start() };
    assert_eq!(Filter::<40>::new(broken, &Options::default(), &[]).unwrap_err(), FilterError::NotFinite);
    let mut options = Options::default();
    options.imu.gyro_bias.sigma = -1.0;
    assert_eq!(Filter::<40>::new(start(), &options, &[]).unwrap_err(), FilterError::NotFinite);
    let mut filter = filter();
    let Measurement::Direction(mut m) = direction(&start(), false) else { unreachable!() };
    m.camera = 3;
    assert_eq!(filter.update_direction(&m).unwrap_err(), Unusable::NoCamera);
    m.camera = 0;
    m.covariance_rad2 = (-m.covariance_rad2.into_inner()).into();
    assert_eq!(filter.update_direction(&m).unwrap_err(), Unusable::NegativeVariance);
    m.covariance_rad2 = Covariance::isotropic(f64::NAN);
    assert_eq!(filter.update_direction(&m).unwrap_err(), Unusable::NotFinite);
    m.covariance_rad2 = Covariance::isotropic(1e-6);
    m.measured = Vector::zeros();
    assert_eq!(filter.update_direction(&m).unwrap_err(), Unusable::NoDirection);
}

#[test]
fn the_first_attitude_and_the_way_back() {
    let all = flight(2000, 0.01);
    let truth = &all[2000].1;
    let cameras = [CameraOptions::default(); 2];
    let mut draws = Draws(3);
    let mut nees = 0.0;
    for _ in 0..500 {
        let seen = [false, true].map(|sun| {
            let Measurement::Direction(m) = direction(truth, sun) else { unreachable!() };
            let camera = &cameras[usize::from(sun)];
            let sigma = (camera.misalignment.sigma.powi(2) + camera.white_rad.powi(2) + (0.1 * DEG).powi(2)).sqrt();
            let measured = Rotation::from_scaled_axis(draws.vector(sigma)) * m.measured;
            Seen { camera, measured, reference: m.reference, sigma_rad: 0.1 * DEG }
        });
        let first = first_attitude(&seen).unwrap();
        let error = (truth.attitude * first.attitude.inverse()).scaled_axis().into_inner();
        let covariance = first.covariance_rad2.as_inner();
        nees += (error.transpose() * covariance.try_inverse().unwrap() * error)[(0, 0)] / 500.0;
        let mut filter = filter();
        filter.set_attitude(&first.attitude, &first.covariance_rad2);
        assert!((filter.sigmas(0).x.powi(2) / covariance[(0, 0)] - 1.0).abs() < 1e-12);
    }
    assert!((2.6..3.4).contains(&nees), "{nees}");
    let samples: Vec<Imu> = all.iter().map(|(sample, _)| *sample).collect();
    let back = propagate_back(truth, &samples);
    assert!(back.attitude.angle_to(&start().attitude) < 1e-8 && (back.position_m - start().position_m).norm() < 1e-3);
    assert!(gravity(&back.position_m).norm() > 9.0 && ImuOptions::default().max_step_s > 0.0);
}
