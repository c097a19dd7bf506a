//! Flipped bits in the memory of a sensor and of its expected limb. The flight software keeps both twice and compares
//! them before and after every picture, so only a flip that the comparison does not see can reach an answer.
//!
//! `cargo xtask campaign flips` runs this test, without debug assertions: the length of a list is compared first, as in
//! the images, and an assertion about it would end the test.

use hzn_core::body::Expected;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::{Config, FlightWorkspace, Prior, Sensor, camera};

const WIDTH: usize = 160;
const HEIGHT: usize = 120;

/// Flips a bit of a value in memory, as radiation does.
fn flip<T>(value: &mut T, bit: usize) {
    let byte = (value as *mut T).cast::<u8>().wrapping_add(bit / 8);
    // SAFETY: the byte is within the value. From now on it is compared, and used if it equals its copy.
    unsafe { byte.write(byte.read() ^ 1 << (bit % 8)) };
}

/// Flips bits of copies of `value`. Returns how many flips a comparison does not see, and calls `use_it` with each.
fn flip_bits<T: Clone + PartialEq>(value: &T, trials: usize, mut use_it: impl FnMut(&T)) -> usize {
    let mut state = 5u64;
    let mut unseen = 0;
    for _ in 0..trials {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut damaged = std::mem::ManuallyDrop::new(value.clone());
        flip(&mut *damaged, (state >> 20) as usize % (8 * size_of::<T>()));
        if *std::hint::black_box(&damaged) == std::mem::ManuallyDrop::new(value.clone()) {
            unseen += 1;
            use_it(&damaged);
        }
    }
    unseen
}

#[test]
#[ignore = "needs a build without debug assertions: cargo xtask campaign flips"]
fn what_a_comparison_does_not_see_changes_no_answer() {
    let trials = std::env::var("HZN_FLIPS").ok().and_then(|n| n.parse().ok()).unwrap_or(2000);
    let mut config = Config::new(camera::Config::ideal(camera::Model::Pinhole, WIDTH as u16, HEIGHT as u16, 150.0));
    config.body.altitude_km = Some(230.0);
    let sensor = Sensor::<f32>::new(&config).unwrap();
    let expected = sensor.expect(&Prior::default()).unwrap();
    let pixel = |i: usize| {
        let (x, y) = (((i % WIDTH) as f64 - 79.5) / 150.0, ((i / WIDTH) as f64 - 59.5) / 150.0);
        let (sin, cos) = 75f64.to_radians().sin_cos();
        let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
        (100.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * 150.0).clamp(-1.0, 1.0)) as u8
    };
    let pixels: Vec<u8> = (0..WIDTH * HEIGHT).map(pixel).collect();
    let picture = Grey::try_new(&pixels, Layout::packed(WIDTH as u32, HEIGHT as u32, 1, 8)).unwrap();
    let mut workspace = Box::new(FlightWorkspace::new());
    let mut axis = |sensor: &Sensor<f32>, expected: &Expected<f32>| {
        sensor.process(&mut workspace, &picture, expected, &Unobserved).solution.map(|s| s.axis.xyz())
    };
    let right = axis(&sensor, &expected);
    assert!(right.is_some());
    let in_sensor = flip_bits(&sensor, trials, |damaged| assert_eq!(axis(damaged, &expected), right));
    let in_expected = flip_bits(&expected, trials, |damaged| assert_eq!(axis(&sensor, damaged), right));
    println!("sensor, {} bytes: {trials} flips, {in_sensor} not seen, none with another answer", size_of_val(&sensor));
    println!(
        "expected, {} bytes: {trials} flips, {in_expected} not seen, none with another answer",
        size_of_val(&expected)
    );
}
