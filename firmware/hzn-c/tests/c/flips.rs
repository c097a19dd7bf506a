//! Flips bits in the memory of a sensor between two calls, as radiation does. Either every call that follows refuses
//! the sensor, or the bit has no effect.
//!
//! `HZN_FLIPS=1000000` makes this number of trials.

use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::ptr;

use hzn::rows::{HZN_ROWS_SIZE, hzn_process_rows};
use hzn::types::{HznAnswer, HznPicture};
use hzn::{HZN_INTERFACE, HZN_NOT_OPEN, HZN_OK, HZN_REFUSED, HZN_ROWS_ENDED, HZN_WORKSPACE_SIZE, HznSensor};
use hzn::{hzn_apply, hzn_get, hzn_open, hzn_process, hzn_refused, hzn_set, hzn_workspace_size};

const WIDTH: usize = 96;
const HEIGHT: usize = 72;
const ALTITUDE_KM: u16 = 32;
const FX_PX: u16 = 4;
/// Parameters of the sensor, by their numbers.
const PARAMETERS: [(u16, f64); 9] = [
    (1, WIDTH as f64),
    (2, HEIGHT as f64),
    (FX_PX, 90.0),
    (5, 90.0),
    (6, 47.5),
    (7, 35.5),
    (ALTITUDE_KM, 230.0),
    (50, 1.0), // the threshold is fixed, as rows need it
    (51, 110.0),
];

/// Number of trials.
fn trials() -> u64 {
    std::env::var("HZN_FLIPS").ok().and_then(|n| n.parse().ok()).unwrap_or(20_000)
}

/// Draws a number below `end`: SplitMix64.
fn draw(state: &mut u64, end: usize) -> usize {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) % end as u64) as usize
}

#[repr(align(16))]
struct Memory<const BYTES: usize>([MaybeUninit<u8>; BYTES]);

impl<const BYTES: usize> Memory<BYTES> {
    fn new() -> Box<Self> {
        Box::new(Self([MaybeUninit::zeroed(); BYTES]))
    }
    fn start(&mut self) -> *mut u8 {
        self.0.as_mut_ptr().cast()
    }
}

/// What a caller sees of a sensor, by every function that takes one.
#[derive(Debug, Clone, PartialEq)]
struct Seen {
    codes: Vec<i32>,
    answers: Vec<String>,
    values: Vec<u64>,
    refused: u16,
}

/// The memory of a program that uses one sensor.
struct Program {
    sensor: Box<Memory<HZN_WORKSPACE_SIZE>>,
    rows: Box<Memory<HZN_ROWS_SIZE>>,
    pixels: Vec<u8>,
}

impl Program {
    /// Makes a sensor. A parameter was refused, and the altitude was set and waits for `hzn_apply`.
    fn new() -> Self {
        // The limb of a body as wide as the Earth at 230 km, 75 degrees below the optical axis.
        let pixel = |i: usize| {
            let (x, y) = (((i % WIDTH) as f64 - 47.5) / 90.0, ((i / WIDTH) as f64 - 35.5) / 90.0);
            let (sin, cos) = 75f64.to_radians().sin_cos();
            let along = (y * sin + cos) / (x * x + y * y + 1.0).sqrt();
            (110.0 + 90.0 * ((along - 74.8f64.to_radians().cos()) * 90.0).clamp(-1.0, 1.0)) as u8
        };
        let pixels = (0..WIDTH * HEIGHT).map(pixel).collect();
        let mut program = Self { sensor: Memory::new(), rows: Memory::new(), pixels };
        let mut sensor = ptr::null_mut();
        // SAFETY: the memory has the size and the alignment that a sensor needs.
        unsafe {
            assert_eq!(hzn_open(program.sensor.start(), HZN_WORKSPACE_SIZE, HZN_INTERFACE, &mut sensor), 0);
            PARAMETERS.iter().for_each(|&(number, value)| assert_eq!(hzn_set(sensor, number, value), 0));
            assert_eq!((hzn_apply(sensor), hzn_set(sensor, FX_PX, -1.0)), (0, 0));
            assert_eq!((hzn_apply(sensor), hzn_set(sensor, ALTITUDE_KM, 240.0)), (HZN_REFUSED, 0));
        }
        program
    }

    /// Calls every function that takes a sensor.
    fn call_everything(&mut self) -> Seen {
        let sensor = self.sensor.start().cast::<HznSensor>();
        let mut seen = Seen { codes: Vec::new(), answers: Vec::new(), values: Vec::new(), refused: 0 };
        // SAFETY: a sensor was opened in this memory. The other pointers have the stated sizes.
        unsafe {
            seen.refused = hzn_refused(sensor);
            for (number, _) in PARAMETERS {
                let mut value = 0.0;
                seen.codes.push(hzn_get(sensor, number, &mut value));
                seen.values.push(value.to_bits());
            }
            self.process(sensor, &mut seen);
            self.process_rows(sensor, &mut seen);
            seen.codes.extend([hzn_set(sensor, FX_PX, 91.0), hzn_apply(sensor)]);
            self.process(sensor, &mut seen);
        }
        seen
    }

    unsafe fn process(&self, sensor: *mut HznSensor, seen: &mut Seen) {
        let (width, height) = (WIDTH as u32, HEIGHT as u32);
        let picture =
            HznPicture { pixels: self.pixels.as_ptr(), bytes: self.pixels.len(), width, height, stride: WIDTH };
        // SAFETY: an answer consists of numbers.
        let mut answer: HznAnswer = unsafe { std::mem::zeroed() };
        // SAFETY: the caller guarantees that a sensor was opened here.
        seen.codes.push(unsafe { hzn_process(sensor, &picture, ptr::null(), &mut answer) });
        // A NaN differs from itself, so the answers are compared as text.
        seen.answers.push(format!("{answer:?}"));
    }

    unsafe fn process_rows(&mut self, sensor: *mut HznSensor, seen: &mut Seen) {
        unsafe extern "C" fn next_row(context: *mut c_void, row: *mut u8, width: usize) -> i32 {
            // SAFETY: the context is the rest of the picture; the sensor has its size.
            let (rest, row) = unsafe { (&mut *context.cast::<&[u8]>(), std::slice::from_raw_parts_mut(row, width)) };
            let Some((first, after)) = rest.split_at_checked(width) else { return 99 };
            row.copy_from_slice(first);
            *rest = after;
            0
        }
        let mut rest: &[u8] = &self.pixels;
        let context = (&raw mut rest).cast();
        // SAFETY: an answer consists of numbers.
        let mut answer: HznAnswer = unsafe { std::mem::zeroed() };
        let (rows, out) = (self.rows.start(), &raw mut answer);
        // SAFETY: the caller guarantees that a sensor was opened here.
        let code = unsafe { hzn_process_rows(sensor, rows, HZN_ROWS_SIZE, Some(next_row), context, ptr::null(), out) };
        seen.codes.push(code);
        seen.answers.push(format!("{answer:?}"));
    }
}

#[test]
fn a_flipped_bit_is_refused_or_has_no_effect() {
    let mut program = Program::new();
    let before = program.sensor.0;
    let right = program.call_everything();
    assert!(right.codes.iter().all(|&code| code == HZN_OK) && right.refused == FX_PX, "{right:?}");
    assert!(right.answers[0] != right.answers[2], "the altitude that was set is in use after hzn_apply");
    let is_refused = |seen: &Seen| seen.codes.iter().all(|&code| code == HZN_NOT_OPEN) && seen.refused == 0;
    let (mut state, mut refused) = (2027, 0);
    for _ in 0..trials() {
        program.sensor.0 = before;
        let bit = draw(&mut state, 8 * hzn_workspace_size());
        let byte = program.sensor.start().wrapping_add(bit / 8);
        // SAFETY: the byte lies in the memory of the sensor.
        unsafe { byte.write_volatile(byte.read_volatile() ^ 1 << (bit % 8)) };
        let seen = program.call_everything();
        refused += u64::from(is_refused(&seen));
        assert!(is_refused(&seen) || seen == right, "bit {bit} changes the answer, with the codes {:?}", seen.codes);
    }
    println!("{} flips: {refused} are refused, the others have no effect", trials());
    // More than a tenth of the memory outlives a call.
    assert!(refused > trials() / 10);
}

/// A camera that fails returns the numbers of statuses and of errors. All of them end the picture in the same way.
#[test]
fn an_error_of_the_camera_is_no_status() {
    unsafe extern "C" fn fail(context: *mut c_void, _: *mut u8, _: usize) -> i32 {
        // SAFETY: the context is the number that the camera returns.
        unsafe { *context.cast::<i32>() }
    }
    let mut program = Program::new();
    let (sensor, rows) = (program.sensor.start().cast::<HznSensor>(), program.rows.start());
    for mut number in [1, 2, 6, 99, -1, -7, i32::MIN, i32::MAX] {
        // SAFETY: an answer consists of numbers.
        let mut answer: HznAnswer = unsafe { std::mem::zeroed() };
        let context = (&raw mut number).cast();
        // SAFETY: a sensor was opened in this memory, and the rows have the stated size.
        let code =
            unsafe { hzn_process_rows(sensor, rows, HZN_ROWS_SIZE, Some(fail), context, ptr::null(), &raw mut answer) };
        assert_eq!((code, answer.status), (HZN_ROWS_ENDED, 255), "{number}");
    }
}
