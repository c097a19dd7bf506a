//! What is known about a picture: attitude, Sun and last answer.

use std::mem::MaybeUninit;
use std::ptr;

use hzn::types::{HznAnswer, HznKnown, HznPicture};
use hzn::{HZN_INTERFACE, HZN_KNOWN, HZN_MEMORY, HZN_OK, HZN_REJECTED};
use hzn::{HZN_WORKSPACE_SIZE, HZN_WORKSPACE_SIZE_608, HznSensor};
use hzn::{hzn_apply, hzn_nothing_known, hzn_open, hzn_process, hzn_set};
use hzn_core::verdict::Verdict;

const WIDTH: usize = 96;
const HEIGHT: usize = 72;
/// Angle from the optical axis down to the body, degrees.
const DOWN_DEG: f64 = 75.0;

#[repr(align(16))]
struct Memory([MaybeUninit<u8>; HZN_WORKSPACE_SIZE]);

struct Program {
    memory: Box<Memory>,
    sensor: *mut HznSensor,
    pixels: Vec<u8>,
}

impl Program {
    /// Makes a sensor, and the picture of a limb of a body as wide as the Earth at 230 km.
    fn new() -> Self {
        Self::with_bytes(HZN_WORKSPACE_SIZE)
    }

    /// Makes the same in memory of this size. The rest of the memory is not touched.
    fn with_bytes(bytes: usize) -> Self {
        let pixel = |i: usize| {
            let (x, y) = (((i % WIDTH) as f64 - 47.5) / 90.0, ((i / WIDTH) as f64 - 35.5) / 90.0);
            let (sin, cos) = DOWN_DEG.to_radians().sin_cos();
            let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
            (110.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * 90.0).clamp(-1.0, 1.0)) as u8
        };
        let mut memory = Box::new(Memory([MaybeUninit::zeroed(); HZN_WORKSPACE_SIZE]));
        let mut sensor = ptr::null_mut();
        // SAFETY: the memory has the size and the alignment that a sensor needs.
        unsafe {
            assert_eq!(hzn_open(memory.0.as_mut_ptr().cast(), bytes, HZN_INTERFACE, &mut sensor), 0);
            let (width, height) = (WIDTH as f64, HEIGHT as f64);
            for (number, value) in [(1, width), (2, height), (4, 90.0), (5, 90.0), (6, 47.5), (7, 35.5), (132, 10.0)] {
                assert_eq!(hzn_set(sensor, number, value), 0);
            }
            assert_eq!(hzn_apply(sensor), 0);
        }
        Self { memory, sensor, pixels: (0..WIDTH * HEIGHT).map(pixel).collect() }
    }

    /// Processes the picture; the camera is at +x of ECEF, and `fill` adds what else is known.
    fn process(&self, fill: impl FnOnce(&mut HznKnown)) -> (i32, HznAnswer) {
        let (width, height) = (WIDTH as u32, HEIGHT as u32);
        let picture =
            HznPicture { pixels: self.pixels.as_ptr(), bytes: self.pixels.len(), width, height, stride: WIDTH };
        // SAFETY: both consist of numbers. The pointers are valid, and the sensor was opened.
        unsafe {
            let mut known: HznKnown = std::mem::zeroed();
            assert_eq!(hzn_nothing_known(&mut known), 0);
            known.position_m = [6_608_137.0, 0.0, 0.0];
            fill(&mut known);
            let mut answer: HznAnswer = std::mem::zeroed();
            let code = hzn_process(self.sensor, &picture, &known, &mut answer);
            (code, answer)
        }
    }
}

/// Returns the attitude of a camera at +x of ECEF whose optical axis is this angle above the body's centre: the
/// shortest rotation from that direction to −x.
fn attitude(down_deg: f64) -> [f32; 4] {
    let (y, z) = down_deg.to_radians().sin_cos();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    [half, 0.0, -z * half, y * half].map(|v| v as f32)
}

#[test]
fn memory_for_fewer_points_gives_the_same_answer() {
    let answer = |program: &Program| {
        let (code, answer) = program.process(|_| ());
        (code, answer.axis.map(f32::to_bits), answer.cov_rad2.map(f32::to_bits), answer.edge_points, answer.dropped)
    };
    let all = answer(&Program::new());
    assert_eq!(all.0, HZN_OK);
    let fewer = Program::with_bytes(HZN_WORKSPACE_SIZE_608);
    assert_eq!(answer(&fewer), all);
    // Nothing behind the memory was written.
    // SAFETY: the memory began as zeros.
    let is_zero = |byte: &MaybeUninit<u8>| unsafe { byte.assume_init() } == 0;
    assert!(fewer.memory.0[HZN_WORKSPACE_SIZE_608..].iter().all(is_zero));
    assert!(!fewer.memory.0[HZN_WORKSPACE_SIZE_608 / 2..HZN_WORKSPACE_SIZE_608].iter().all(is_zero));
    let mut memory = Box::new(Memory([MaybeUninit::zeroed(); HZN_WORKSPACE_SIZE]));
    let mut sensor = ptr::null_mut();
    // SAFETY: the memory has more bytes than the call says.
    let code = unsafe { hzn_open(memory.0.as_mut_ptr().cast(), 32_768, HZN_INTERFACE, &mut sensor) };
    assert_eq!((code, sensor.is_null()), (HZN_MEMORY, true));
}

#[test]
fn an_edge_that_contradicts_the_attitude_is_refused() {
    let program = Program::new();
    let see = |down_deg: f64, fill: fn(&mut HznKnown)| {
        let (code, answer) = program.process(|known| {
            (known.attitude_wxyz, known.attitude_sigma_rad) = (attitude(down_deg), 0.05);
            fill(known);
        });
        (code, answer.attitude, answer.edges[0].verdict)
    };
    let (code, answer) = program.process(|_| ());
    assert_eq!((code, answer.attitude), (HZN_OK, 0));
    let refused = (HZN_REJECTED, 1, Verdict::Attitude as u8);
    assert_eq!(see(DOWN_DEG, |_| ()), (HZN_OK, 1, 0));
    assert_eq!(see(-DOWN_DEG, |_| ()), refused);
    // It is not used after its expiry, and it turns on with the rate.
    assert_eq!(see(-DOWN_DEG, |k| (k.attitude_age_s, k.attitude_expires_s) = (5.0, 4.0)), (HZN_OK, 2, 0));
    assert_eq!(see(-DOWN_DEG, |k| (k.attitude_age_s, k.attitude_expires_s) = (5.0, 6.0)), refused);
    let turning = |k: &mut HznKnown| (k.rate_rad_s, k.attitude_age_s) = ([0.1, 0.0, 0.0], 5.0);
    assert_eq!(see(DOWN_DEG - 0.5f64.to_degrees(), turning), (HZN_OK, 1, 0));
    assert_eq!(see(DOWN_DEG, turning), refused);
}

#[test]
fn an_unlit_limb_and_a_fast_turn_are_refused() {
    let program = Program::new();
    let (y, z) = DOWN_DEG.to_radians().sin_cos();
    let (y, z) = (y as f32, z as f32);
    let (code, answer) = program.process(|known| known.sun = [0.0, y, z]);
    assert_eq!((code, answer.edges[0].verdict), (HZN_REJECTED, Verdict::Sun as u8));
    assert_eq!(program.process(|known| known.sun = [0.0, -y, -z]).0, HZN_OK);
    // Parameter 132 allows ten degrees a second.
    let (_, first) = program.process(|_| ());
    let after = |turn: f32, age_s: f32| {
        let (code, answer) = program.process(|known| {
            let (sin, cos) = turn.to_radians().sin_cos();
            let [x, y, z] = first.axis;
            known.last_axis = [x, y * cos - z * sin, y * sin + z * cos];
            (known.last_cov_rad2, known.last_age_s) = (first.cov_rad2, age_s);
        });
        (code, answer.edges[0].verdict)
    };
    assert_eq!(after(30.0, 1.0), (HZN_REJECTED, Verdict::Rate as u8));
    assert_eq!(after(30.0, 4.0), (HZN_OK, 0));
}

#[test]
fn the_lens_follows_the_temperature() {
    let program = Program::new();
    let told = |c: f32| program.process(|known| known.camera_temperature_c = c);
    let (_, plain) = told(f32::NAN);
    assert_eq!(told(-10.0).1.axis, plain.axis);
    // SAFETY: the sensor was opened.
    unsafe {
        for (number, value) in [(24, 20.0), (25, 300.0), (27, 0.005)] {
            assert_eq!(hzn_set(program.sensor, number, value), 0);
        }
        assert_eq!(hzn_apply(program.sensor), 0);
    }
    assert_eq!(told(20.0).1.axis, plain.axis);
    let (code, cold) = told(-10.0);
    assert!(code == HZN_OK && cold.axis != plain.axis);
    // The lens would change by 8.8 %.
    assert_ne!(told(-273.0).0, HZN_OK);
}

#[test]
fn impossible_values_are_refused() {
    let program = Program::new();
    let refused: [fn(&mut HznKnown); 8] = [
        |k| k.attitude_wxyz = [1.0, 1.0, 0.0, 0.0],
        |k| k.attitude_wxyz[0] = 1.0,
        |k| k.attitude_sigma_rad = 0.1,
        |k| (k.attitude_wxyz, k.attitude_sigma_rad) = ([1.0, 0.0, 0.0, 0.0], -1.0),
        |k| (k.sun, k.attitude_age_s) = ([0.0, 0.0, 1.0], f32::INFINITY),
        |k| k.sun = [0.0; 3],
        |k| (k.last_axis, k.last_cov_rad2, k.last_age_s) = ([0.0, 0.0, 1.0], [0.0; 6], -1.0),
        |k| k.last_axis[1] = 1.0,
    ];
    for (i, fill) in refused.into_iter().enumerate() {
        assert_eq!(program.process(fill).0, HZN_KNOWN, "{i}");
    }
}

#[test]
fn an_answer_says_how_far_it_can_be_trusted() {
    let program = Program::new();
    let with = |values: &[(u16, f64)]| {
        // SAFETY: the sensor was opened.
        unsafe {
            for &(number, value) in values {
                assert_eq!(hzn_set(program.sensor, number, value), 0);
            }
            assert_eq!(hzn_apply(program.sensor), 0);
        }
        program.process(|_| ())
    };
    let (code, first) = with(&[]);
    assert!(code == HZN_OK && (0.0..=1.0).contains(&first.p_limb), "{code} {}", first.p_limb);
    let trace = |cov: [f32; 6]| cov[0] + cov[3] + cov[5];
    assert!(trace(first.cov_common_rad2) > 0.0 && trace(first.cov_common_rad2) < trace(first.cov_rad2));
    // The level is 6.15 sigma by default, and 2.95 sigma for a probability of 0.01.
    let (_, likelier) = with(&[(105, 0.01)]);
    assert!((first.protection_rad / likelier.protection_rad - 6.15 / 2.95).abs() < 1e-4);
    assert!(first.protection_rad > 6.15 * (trace(first.cov_rad2) / 2.0).sqrt());
    // Parameter 135 refuses what is less probable, and a refused answer has none of these numbers.
    let (code, refused) = with(&[(136, 1e-9), (135, 0.5)]);
    assert_eq!((code, refused.edges[0].verdict), (HZN_REJECTED, Verdict::Unlikely as u8));
    assert!(refused.p_limb.is_nan() && refused.protection_rad.is_nan() && refused.cov_common_rad2[0].is_nan());
}
