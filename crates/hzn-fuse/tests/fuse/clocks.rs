//! The clock of a receiver against the positions that the pictures were processed with.

use hzn_core::ellipsoid::{LimbCone, WGS84_A_M, WGS84_B_M, geodetic};
use hzn_fuse::finding::{Cause, Level, Verdict};
use hzn_fuse::flight::Wanted;
use hzn_fuse::input::{Attitude, Body, Fix, Inputs, Recording, Sample, Seen};
use hzn_fuse::{Settings, fuse};
use hzn_nav::frames::{Cam, Covariance, Fixed, Rotation, Vector, Vehicle};
use hzn_nav::gravity::EARTH_RATE_RAD_S;
use hzn_nav::strapdown::Imu;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

const RADIUS_M: f64 = 6.86e6;
const RATE_RAD_S: f64 = 1.1112e-3;
/// Duration of the flight, s.
const SPAN_S: i32 = 240;
const SIGMA_RAD: f64 = 1e-3;

/// How far a satellite nods about its y axis, rad, and how fast, rad/s.
const NOD: [f64; 2] = [0.2, 0.1];

/// Returns position, velocity and attitude of a satellite that looks down, in ECEF.
fn motion(time_s: f64) -> (Vector<Fixed>, Vector<Fixed>, Rotation<Vehicle, Fixed>) {
    let (sin, cos) = (RATE_RAD_S * time_s).sin_cos();
    let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), 1.0);
    let to_fixed = Rotation3::from_axis_angle(&Vector3::z_axis(), -EARTH_RATE_RAD_S * time_s) * tilt;
    let [up, along, across] =
        [Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z()].map(|axis| to_fixed * axis);
    let position_m = up * RADIUS_M;
    let velocity_m_s = along * (RADIUS_M * RATE_RAD_S) - Vector3::new(0.0, 0.0, EARTH_RATE_RAD_S).cross(&position_m);
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[along, -across, -up]));
    (position_m.into(), velocity_m_s.into(), UnitQuaternion::from_rotation_matrix(&axes).into())
}

fn seen(row: usize) -> Seen {
    let time_s = 3.5 * row as f64 + 10.0;
    let (position_m, _, attitude) = motion(time_s);
    let cone = LimbCone::try_new(position_m.xyz(), WGS84_A_M, WGS84_B_M).unwrap();
    let reference: Vector<Fixed> = Vector3::from(cone.axis.xyz()).into();
    // The camera looks along the vehicle's z.
    let camera: Rotation<Cam, Vehicle> = Rotation::identity();
    let axis: Vector<Cam> = camera.inverse() * (attitude.inverse() * reference);
    Seen {
        time_s,
        body: Body::Limb,
        axis,
        covariance_rad2: Covariance::across(&axis, SIGMA_RAD * SIGMA_RAD),
        common_rad2: None,
        reference: Some(reference),
        altitude_km: Some(geodetic(position_m.xyz(), WGS84_A_M, WGS84_B_M).0 * 1e-3),
        by_limb_height: Vector::zeros(),
        centre: None,
        cone: None,
        row,
    }
}

/// Returns an error of a position that looks like noise, m.
fn noise_m(i: i32, sigma_m: f64) -> Vector<Fixed> {
    // Sums of three even parts are nearly Gaussian.
    let part = |k: i32| f64::from((i * 7919 + k * 104_729).rem_euclid(1009)) / 1009.0 - 0.5;
    let axis = |k: i32| 2.0 * sigma_m * (part(3 * k) + part(3 * k + 1) + part(3 * k + 2));
    Vector::new(axis(0), axis(1), axis(2))
}

/// Returns the verdict with a receiver whose times are late.
fn verdict(late_s: f64) -> Verdict {
    verdict_of(late_s, SPAN_S, 0.0)
}

/// Returns the verdict of a flight with a receiver whose times are late and whose positions have an error.
fn verdict_of(late_s: f64, span_s: i32, sigma_m: f64) -> Verdict {
    fuse(&flight(late_s, span_s, sigma_m), &Settings::default(), Wanted::default()).unwrap().verdict
}

/// Returns what such a flight recorded.
fn flight(late_s: f64, span_s: i32, sigma_m: f64) -> Inputs {
    let imu = |i: i32| {
        let (gyro_rad_s, accel_m_s2) = (Vector::new(0.0, -RATE_RAD_S, 0.0), Vector::zeros());
        Sample { imu: Imu { time_s: f64::from(i) * 0.1, gyro_rad_s, accel_m_s2 }, saturated: false }
    };
    let fix = |i: i32| {
        let (exact_m, velocity_m_s, _) = motion(f64::from(i));
        let position_m = exact_m + noise_m(i, sigma_m);
        let (position_sigma_m, velocity_sigma_m_s) = (5.0, 0.1);
        Fix { time_s: f64::from(i) + late_s, position_m, velocity_m_s, position_sigma_m, velocity_sigma_m_s }
    };
    let recording = Recording {
        name: "cam".into(),
        mount: Some(Rotation::identity()),
        seen: (0..span_s as usize / 4).map(seen).collect(),
        ..Recording::default()
    };
    let attitude = |i: i32| {
        let time_s = f64::from(i) * 5.0 + 1.0;
        Attitude { time_s, fixed_from_vehicle: Some(motion(time_s).2), sigma_rad: 1e-4 }
    };
    Inputs {
        imu: (0..span_s * 10).map(imu).collect(),
        gnss: (0..span_s).map(fix).collect(),
        attitudes: (0..span_s / 5 - 1).map(attitude).collect(),
        recordings: vec![recording],
    }
}

/// The path of a satellite hardly bends in four minutes, so that a lag looks like a place that is ahead.
#[test]
fn a_second_of_a_clock_is_found_on_a_short_arc() {
    let right = verdict(0.0);
    assert_eq!(right.level(), Level::Consistent, "{right:?}");
    for late_s in [-1.0, 1.0, 2.0] {
        let wrong = verdict(late_s);
        let first = wrong.likeliest().unwrap();
        assert!(wrong.level() == Level::Contradicts && first.cause == Cause::ReceiverClock, "{late_s}: {wrong:?}");
        assert!(first.what.contains(&format!("{:.1} s", late_s.abs())), "{first:?}");
    }
}

/// The noise of the receiver is larger than what a second of the clock adds to the vertical.
#[test]
fn a_second_of_a_clock_is_found_in_the_noise_of_a_receiver() {
    for span_s in [60, 90, 120, 180] {
        for sigma_m in [5.0, 10.0] {
            let right = verdict_of(0.0, span_s, sigma_m);
            assert_eq!(right.level(), Level::Consistent, "{span_s} s, {sigma_m} m: {right:?}");
            for late_s in [-1.0, 1.0] {
                let wrong = verdict_of(late_s, span_s, sigma_m);
                let first = wrong.likeliest().map(|finding| finding.cause);
                assert_eq!(first, Some(Cause::ReceiverClock), "{late_s} s of {span_s} s, {sigma_m} m: {wrong:?}");
                assert_eq!(wrong.level(), Level::Contradicts, "{wrong:?}");
            }
        }
    }
}

/// The cameras' clocks may be 0.2 s off, but nothing estimates the receiver's, and the position is the receiver's.
#[test]
fn a_receiver_that_is_less_late_than_a_camera_may_be_is_not_consistent() {
    for span_s in [40, 120, 240] {
        for late_s in [-0.7, -0.05, 0.2, 0.5] {
            let mut inputs = flight(late_s, span_s, 5.0);
            // The altitude's sigma of a sensor.toml says nothing about positions that agree but for a lag.
            inputs.recordings[0].altitude_sigma_km = Some(15.0);
            let fused = fuse(&inputs, &Settings::default(), Wanted::default()).unwrap();
            let first = fused.verdict.likeliest().unwrap_or_else(|| panic!("{late_s} s of {span_s} s: consistent"));
            assert_eq!((fused.verdict.level(), first.cause), (Level::Doubtful, Cause::ReceiverClock), "{first:?}");
            let [lag] = fused.receiver_lags.as_slice() else { panic!("{:?}", fused.receiver_lags) };
            assert!((lag.lag_s - late_s).abs() < 3.0 * lag.sigma_s && lag.sigma_s < 0.01, "{late_s}: {lag:?}");
        }
    }
}

/// A camera whose clock is late has the positions of the true times if they came with the pictures. If the vehicle
/// turns enough, the filter finds the clock; otherwise nobody knows which clock is wrong.
#[test]
fn a_camera_whose_clock_the_filter_finds_says_nothing_against_the_receiver() {
    for (nods, level) in [(true, Level::Consistent), (false, Level::Doubtful)] {
        let mut inputs = flight(0.0, SPAN_S, 5.0);
        let nod = |time_s: f64| NOD[0] * (NOD[1] * time_s).sin();
        let turn = |time_s: f64| Rotation::from_scaled_axis(Vector::new(0.0, nod(time_s), 0.0));
        if nods {
            for sample in &mut inputs.imu {
                sample.imu.gyro_rad_s += Vector::new(0.0, NOD[0] * NOD[1] * (NOD[1] * sample.imu.time_s).cos(), 0.0);
            }
            for attitude in &mut inputs.attitudes {
                attitude.fixed_from_vehicle = Some(motion(attitude.time_s).2 * turn(attitude.time_s));
            }
        }
        for seen in &mut inputs.recordings[0].seen {
            if nods {
                let turn: Rotation<Cam, Cam> = Rotation::from_scaled_axis(Vector::new(0.0, nod(seen.time_s), 0.0));
                seen.axis = turn.inverse() * seen.axis;
            }
            seen.time_s += 0.3;
        }
        let fused = fuse(&inputs, &Settings::default(), Wanted::default()).unwrap();
        assert_eq!(
            fused.verdict.level(),
            level,
            "{nods}: {:?} {:?}",
            fused.verdict,
            fused.epochs.last().unwrap().cameras
        );
    }
}
