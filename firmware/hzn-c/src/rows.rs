//! Pictures that come row by row, for computers without memory for a whole picture.

use core::ffi::c_void;
use core::mem::size_of;
use core::ptr;

use hzn_core::observer::Unobserved;
use hzn_core::pipeline::{ROWS_HELD, RowBuffers};
use hzn_flight::answer::PictureAnswer;

use crate::types::{HznAnswer, HznKnown, NO_ANSWER, to_answer};
use crate::{ALL_POINTS, FEWER_POINTS, HznSensor, expect, lists, open_sensor};
use crate::{HZN_KNOWN, HZN_MEMORY, HZN_NO_ROWS, HZN_NULL, HZN_ROWS_ENDED};

const WIDTH: usize = 1920;
const HEIGHT: usize = 1080;

/// Memory for the rows of a picture of up to 1920×1080 pixels.
struct Rows {
    buffers: RowBuffers<u8, { ROWS_HELD as usize * WIDTH }, HEIGHT, 16384, 5120>,
    row: [u8; WIDTH],
}

/// Bytes that the rows of a picture need, on every machine; they have the alignment of a sensor.
pub const HZN_ROWS_SIZE: usize = 147456;
const _: () = assert!(size_of::<Rows>() <= HZN_ROWS_SIZE);

/// Finds the limb in a picture that comes row by row. `next_row` writes the next row, `width` bytes, and returns 0; any
/// other number ends the picture, and `hzn_process_rows` returns `HZN_ROWS_ENDED`. `context` can take the number, which
/// would look like a status here. The threshold must be `fixed`, or that of the picture before.
///
/// # Safety
/// `sensor` is null or from `hzn_open`. `memory` is null or has `bytes` writable bytes, which have no other use during
/// the call. `known` is null (nothing is known) or readable. `out` is null or writable. `next_row` writes `width`
/// bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_process_rows(
    sensor: *mut HznSensor,
    memory: *mut u8,
    bytes: usize,
    next_row: Option<unsafe extern "C" fn(context: *mut c_void, row: *mut u8, width: usize) -> i32>,
    context: *mut c_void,
    known: *const HznKnown,
    out: *mut HznAnswer,
) -> i32 {
    let place = memory.cast::<Rows>();
    let (Some(next_row), false, false) = (next_row, place.is_null(), out.is_null()) else { return HZN_NULL };
    if bytes < size_of::<Rows>() || !place.is_aligned() || !out.is_aligned() || !known.is_aligned() {
        return HZN_MEMORY;
    }
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    let out = unsafe { &mut *out };
    *out = NO_ANSWER;
    // SAFETY: the caller guarantees it.
    let kept = match unsafe { open_sensor(sensor) } {
        Ok(opened) => opened.kept.get(),
        Err(code) => return code,
    };
    // SAFETY: the caller guarantees it.
    let Some((expected, attitude)) = (unsafe { expect(&kept.sensor, known) }) else { return HZN_KNOWN };
    // SAFETY: the memory is aligned and has room. It consists of arrays of numbers, and zeros are empty ones.
    let rows = unsafe {
        ptr::write_bytes(place, 0, 1);
        &mut *place
    };
    let camera = kept.sensor.camera();
    let (width, height) = (usize::from(camera.width()), camera.height());
    let Some(row) = rows.row.get_mut(..width) else { return HZN_NO_ROWS };
    let Ok(mut stream) = kept.sensor.rows(&mut rows.buffers, 8, &expected) else { return HZN_NO_ROWS };
    for _ in 0..height {
        // SAFETY: the caller guarantees it.
        let ended = unsafe { next_row(context, row.as_mut_ptr(), width) };
        if ended != 0 {
            return HZN_ROWS_ENDED;
        }
        if stream.push_row(row).is_err() {
            return HZN_NO_ROWS;
        }
    }
    // SAFETY: the sensor is open, and says how much room there is. The caller guarantees that nothing else uses it.
    let report = unsafe {
        if kept.has_all_points {
            stream.finish(lists::<ALL_POINTS>(sensor), &Unobserved)
        } else {
            stream.finish(lists::<FEWER_POINTS>(sensor), &Unobserved)
        }
    };
    *out = to_answer(&PictureAnswer::from_report(&report, kept.sensor.config()), attitude);
    i32::from(out.status)
}
