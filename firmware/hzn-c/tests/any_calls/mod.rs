//! Calls of the C interface with arbitrary memory, numbers and pictures. libFuzzer runs them with the address sanitizer
//! (`fuzz/`), and the test `corpus` without it.

use std::alloc::{Layout, alloc, dealloc};
use std::ffi::c_void;
use std::ptr;

use hzn::rows::{HZN_ROWS_SIZE, hzn_process_rows};
use hzn::types::{HznAnswer, HznKnown, HznPicture};
use hzn::{HZN_INTERFACE, HZN_NULL, HZN_ROWS_ENDED, HznSensor};
use hzn::{hzn_apply, hzn_get, hzn_nothing_known, hzn_open, hzn_process, hzn_refused, hzn_set};
use hzn::{hzn_workspace_align, hzn_workspace_size};

/// Calls every function with values from the bytes.
pub(crate) fn call(data: &[u8]) {
    let mut bytes = data.iter().copied().chain(std::iter::repeat(0));
    let mut byte = || bytes.next().unwrap_or(0);
    let short = usize::from(byte() == 1);
    let layout = Layout::from_size_align(hzn_workspace_size(), hzn_workspace_align()).expect("a valid layout");
    // SAFETY: the layout is not empty. Every pointer that is passed is null or points to memory of the stated size.
    unsafe {
        let memory = alloc(layout);
        let mut sensor = ptr::null_mut();
        assert_eq!(
            hzn_open(ptr::null_mut(), layout.size(), HZN_INTERFACE, &mut sensor),
            hzn_open(memory, layout.size(), HZN_INTERFACE, ptr::null_mut())
        );
        if hzn_open(memory, layout.size() - short, HZN_INTERFACE, &mut sensor) == 0 {
            for _ in 0..byte() % 8 {
                let number = u16::from_le_bytes([byte(), byte() % 2]);
                let value = if byte() % 2 == 0 {
                    f64::from(byte())
                } else {
                    f64::from_le_bytes(std::array::from_fn(|_| byte()))
                };
                if hzn_set(sensor, number, value) == 0 {
                    let mut found = f64::NAN;
                    assert_eq!(hzn_get(sensor, number, &mut found), 0);
                }
                hzn_get(sensor, number, ptr::null_mut());
            }
            if hzn_apply(sensor) != 0 {
                let _ = hzn_refused(sensor);
            }
            let pixels: Vec<u8> =
                data.iter().cycle().take(if data.is_empty() { 0 } else { 640 * 480 }).copied().collect();
            let less = usize::from(byte() % 3);
            let picture = HznPicture {
                pixels: pixels.as_ptr(),
                bytes: pixels.len().saturating_sub(less),
                width: if byte() == 0 { u32::from(byte()) } else { 640 },
                height: if byte() == 0 { u32::from(byte()) } else { 480 },
                stride: if byte() == 0 { usize::from(byte()) } else { 640 },
            };
            let known = any_known(|| f32::from_le_bytes(std::array::from_fn(|_| byte())));
            let mut answer: HznAnswer = std::mem::zeroed();
            hzn_process(sensor, &picture, &known, &mut answer);
            hzn_process(sensor, &picture, ptr::null(), &mut answer);
            hzn_process(sensor, ptr::null(), ptr::null(), &mut answer);
            hzn_process(ptr::null_mut(), &picture, ptr::null(), &mut answer);
            // The camera ends the picture with this number in one of its first 256 rows, or not at all.
            let number = i32::from(byte()) - 128;
            call_by_rows(sensor, Camera { bytes: data, rows: usize::from(byte()), number, seen: 0 }, &known);
        }
        dealloc(memory, layout);
    }
}

/// Returns what is known about a picture, from any numbers.
fn any_known(mut number: impl FnMut() -> f32) -> HznKnown {
    // SAFETY: every field is a number, and the function takes null or a writable place.
    let mut known: HznKnown = unsafe { std::mem::zeroed() };
    // SAFETY: as above.
    let codes = unsafe { [hzn_nothing_known(&mut known), hzn_nothing_known(ptr::null_mut())] };
    assert_eq!(codes, [0, HZN_NULL]);
    known.altitude_m = number();
    known.position_m = std::array::from_fn(|_| number());
    known.rate_rad_s = std::array::from_fn(|_| number());
    known.attitude_wxyz = std::array::from_fn(|_| number());
    known.attitude_sigma_rad = number();
    known.sun = std::array::from_fn(|_| number());
    known.attitude_age_s = number();
    known.attitude_expires_s = number();
    known.last_axis = std::array::from_fn(|_| number());
    known.last_cov_rad2 = std::array::from_fn(|_| number());
    known.last_age_s = number();
    known.camera_temperature_c = number();
    known
}

/// A camera that gives rows of arbitrary bytes.
struct Camera<'a> {
    bytes: &'a [u8],
    /// After this number of rows the camera returns `number`.
    rows: usize,
    number: i32,
    seen: usize,
}

/// # Safety
/// `context` is a [`Camera`], and `row` has `width` bytes.
unsafe extern "C" fn next_row(context: *mut c_void, row: *mut u8, width: usize) -> i32 {
    // SAFETY: the caller guarantees it.
    let (camera, row) = unsafe { (&mut *context.cast::<Camera<'_>>(), std::slice::from_raw_parts_mut(row, width)) };
    if camera.seen == camera.rows && camera.number != 0 {
        return camera.number;
    }
    let bytes = camera.bytes.iter().cycle().skip(camera.seen % camera.bytes.len().max(1));
    row.iter_mut().zip(bytes).for_each(|(pixel, byte)| *pixel = *byte);
    camera.seen += 1;
    0
}

/// Calls `hzn_process_rows` with enough memory, too little memory, and without a callback.
///
/// # Safety
/// `sensor` is from `hzn_open`.
unsafe fn call_by_rows(sensor: *mut HznSensor, mut camera: Camera<'_>, known: &HznKnown) {
    let layout = Layout::from_size_align(HZN_ROWS_SIZE, hzn_workspace_align()).expect("a valid layout");
    // SAFETY: the memory has the stated size, and the other pointers are valid or null.
    unsafe {
        let memory = alloc(layout);
        let mut answer: HznAnswer = std::mem::zeroed();
        let context = ptr::from_mut(&mut camera).cast();
        let mut call = |bytes, callback: Option<unsafe extern "C" fn(*mut c_void, *mut u8, usize) -> i32>| {
            hzn_process_rows(sensor, memory, bytes, callback, context, known, &mut answer)
        };
        assert!(call(0, Some(next_row)) < 0);
        assert!(call(layout.size(), None) < 0);
        let ended = call(layout.size(), Some(next_row));
        // A number of the camera never looks like a status.
        let camera = &*context.cast::<Camera<'_>>();
        let was_ended = camera.seen == camera.rows && camera.number != 0 && camera.seen < 480;
        assert!(!was_ended || ended < 0, "{ended}");
        assert!(ended != HZN_ROWS_ENDED || was_ended);
        dealloc(memory, layout);
    }
}
