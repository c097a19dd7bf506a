//! The cost of a filter with memory for one, two or three bodies on each of four cameras: 58, 70 or 82 errors.

use std::time::Instant;

use hzn_nav::filter::Filter;
use hzn_nav::frames::{Rotation, Vector};
use hzn_nav::options::{CameraOptions, Options};
use hzn_nav::strapdown::{Imu, Nominal};

fn filter<const N: usize>() -> Filter<N> {
    let start = Nominal {
        time_s: 0.0,
        attitude: Rotation::identity(),
        velocity_m_s: Vector::zeros(),
        position_m: Vector::new(6.6e6, 0.0, 0.0),
    };
    Filter::new(start, &Options::default(), &[CameraOptions::default(); 2]).unwrap()
}

/// Returns the time of a prediction in microseconds, the least of some turns.
fn step_us<const N: usize>() -> f64 {
    let mut filter = filter::<N>();
    let mut least = f64::INFINITY;
    for turn in 0..50 {
        let begin = Instant::now();
        for i in 1..=200 {
            let time_s = f64::from(200 * turn + i) * 0.01;
            let imu = Imu { time_s, gyro_rad_s: Vector::new(0.01, 0.0, 0.02), accel_m_s2: Vector::new(0.0, 0.1, 9.0) };
            filter.predict(&imu, false);
        }
        least = least.min(begin.elapsed().as_secs_f64() * 1e6 / 200.0);
    }
    least
}

#[test]
fn the_memory_is_mostly_the_covariance() {
    let sizes = [size_of::<Filter<58>>(), size_of::<Filter<70>>(), size_of::<Filter<82>>()];
    for (states, bytes) in [58, 70, 82].into_iter().zip(sizes) {
        let covariance = states * states * size_of::<f64>();
        assert!(bytes > covariance && bytes < covariance + 8192, "{states}: {bytes} bytes");
    }
}

#[test]
#[ignore = "prints times; `cargo test --test nav sizes:: -- --ignored --nocapture`"]
fn the_time_of_a_step() {
    let sizes = [size_of::<Filter<58>>(), size_of::<Filter<70>>(), size_of::<Filter<82>>()];
    let times = [step_us::<58>(), step_us::<70>(), step_us::<82>()];
    for ((errors, bytes), us) in [58, 70, 82].into_iter().zip(sizes).zip(times) {
        println!("{errors} errors: {bytes} bytes, {us:.1} us a step");
    }
    assert!(times.iter().all(|us| us.is_finite()));
}
