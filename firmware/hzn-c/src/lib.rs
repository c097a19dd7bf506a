//! hzn for C: one sensor in memory that the caller owns. There is no heap and no global state, and only
//! [`rows::hzn_process_rows`] calls back.
//!
//! Functions return 0 to 7 or a negative number. 0 to 7 is the status of a picture, as everywhere in hzn; 0 is success.
//! A negative number means an error of the caller, after which nothing has changed. Parameters have the numbers of
//! book/reference/telemetry.md.

#![no_std]

use core::mem::{align_of, size_of};
use core::ptr::{self, NonNull};

use hzn_core::body::Expected;
use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::pipeline::Workspace;
use hzn_core::{Prior, Report, Sensor};
use hzn_flight::Parameters;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::parameters::Refused;
use hzn_twice::KeptTwice;

pub mod rig;
pub mod rows;
pub mod types;

use types::{HznAnswer, HznKnown, HznPicture, NO_ANSWER, to_answer, to_prior};

#[cfg(feature = "standalone")]
mod standalone {
    unsafe extern "C" {
        /// Is not defined anywhere: a library that can panic does not link.
        safe fn panic_path_is_linked() -> !;
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        panic_path_is_linked()
    }
}

/// A pointer is null.
pub const HZN_NULL: i32 = -1;
/// The memory is too small or not aligned.
pub const HZN_MEMORY: i32 = -2;
/// No parameter has this number.
pub const HZN_UNKNOWN_PARAMETER: i32 = -3;
/// A parameter cannot have this value, or the combination of the parameters is refused.
pub const HZN_REFUSED: i32 = -4;
/// The picture has no pixels, another size than the camera, an impossible stride, or fewer bytes than its size needs.
pub const HZN_PICTURE: i32 = -5;
/// A value in `HznKnown` is impossible, or a part of a vector is NaN.
pub const HZN_KNOWN: i32 = -6;
/// There is no sensor at this pointer: it was not opened, or bits of its memory have changed since the last call. It
/// must be opened again.
pub const HZN_NOT_OPEN: i32 = -7;
/// The program was compiled with the header of another version of this library.
pub const HZN_OTHER_INTERFACE: i32 = -8;
/// The parameters need the whole picture in memory, or the camera has more than 1920 columns or 1080 rows.
pub const HZN_NO_ROWS: i32 = -9;
/// `next_row` ended the picture.
pub const HZN_ROWS_ENDED: i32 = -10;

/// Status: a direction was found.
pub const HZN_OK: i32 = 0;
/// Status: no edge in the picture is a limb of the body.
pub const HZN_NO_LIMB: i32 = 1;
/// Status: the picture is too dark.
pub const HZN_TOO_DARK: i32 = 2;
/// Status: the picture is too bright.
pub const HZN_TOO_BRIGHT: i32 = 3;
/// Status: no edge has enough points.
pub const HZN_TOO_FEW_POINTS: i32 = 4;
/// Status: two different directions fit about equally well.
pub const HZN_AMBIGUOUS: i32 = 5;
/// Status: a direction was found and refused.
pub const HZN_REJECTED: i32 = 6;
/// Status: lists were full or the work budget was used up.
pub const HZN_TRUNCATED: i32 = 7;

/// Version of the structures and functions of this header. `hzn_open` compares it with that of the library.
pub const HZN_INTERFACE: u32 = 4;
/// Bytes that a sensor needs which fits 2048 points of an edge, on every machine.
pub const HZN_WORKSPACE_SIZE: usize = 114688;
/// Bytes that a sensor needs which fits 608 points of an edge: enough for the default of `edge_points.keep_points`,
/// 600. Of a longer list, `dropped` in the answer counts the border pixels that are left out.
pub const HZN_WORKSPACE_SIZE_608: usize = 61440;
/// Alignment that a sensor needs, bytes.
pub const HZN_WORKSPACE_ALIGN: usize = 16;

/// Blocks of eight points.
const ALL_POINTS: usize = 256;
const FEWER_POINTS: usize = 76;
const _: () = {
    assert!(size_of::<Memory<ALL_POINTS>>() <= HZN_WORKSPACE_SIZE);
    assert!(size_of::<Memory<FEWER_POINTS>>() <= HZN_WORKSPACE_SIZE_608);
    assert!(align_of::<Memory<ALL_POINTS>>() <= HZN_WORKSPACE_ALIGN);
};

/// Is in an open sensor.
const MAGIC: u64 = 0x687A_6E20_6F70_656E;

/// A sensor. Its content is hidden: only pointers to it are passed.
// Any bytes are a valid sensor, so a bit that flips between two calls makes none invalid.
#[derive(Debug)]
pub struct HznSensor {
    magic: u64,
    kept: KeptTwice<Kept>,
}

/// The caller's memory.
#[repr(C)]
struct Memory<const BLOCKS: usize> {
    sensor: HznSensor,
    /// Each picture fills it anew.
    workspace: Lists<BLOCKS>,
}

/// The lists of a picture, with so many blocks of eight points.
type Lists<const BLOCKS: usize> = Workspace<f32, 2048, BLOCKS, 512>;

/// What outlives a call.
#[derive(Debug)]
struct Kept {
    /// Number of the parameter that was refused last; 0: none.
    refused: u16,
    /// Whether the memory has room for all points, or for fewer.
    has_all_points: bool,
    /// The parameters from [`hzn_set`]; they are in use after [`hzn_apply`].
    pending: Parameters,
    sensor: Sensor<f32>,
}

/// Returns the number of bytes that a sensor needs which fits 2048 points of an edge.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_workspace_size() -> usize {
    size_of::<Memory<ALL_POINTS>>()
}

/// Returns the alignment that a sensor needs, in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_workspace_align() -> usize {
    align_of::<Memory<ALL_POINTS>>()
}

/// Returns the version of the library: major, minor and patch in one byte each, from the second byte on.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_version() -> u32 {
    hzn_flight::VERSION
}

/// Returns the sensor at a pointer, or the error. Compares what outlives a call with its copy.
///
/// # Safety
/// `sensor` is null or points to readable and writable memory of the size of a sensor.
unsafe fn open_sensor<'a>(sensor: *mut HznSensor) -> Result<&'a mut HznSensor, i32> {
    if sensor.is_null() {
        return Err(HZN_NULL);
    }
    if !sensor.is_aligned() {
        return Err(HZN_MEMORY);
    }
    // SAFETY: the caller guarantees that the memory is readable; a number may have any value.
    if unsafe { (&raw const (*sensor).magic).read() } != MAGIC {
        return Err(HZN_NOT_OPEN);
    }
    // SAFETY: `hzn_open` has made a sensor here, and any bytes are one.
    let sensor = unsafe { &mut *sensor };
    if sensor.kept.is_intact() { Ok(sensor) } else { Err(HZN_NOT_OPEN) }
}

/// Returns the lists behind a sensor.
///
/// # Safety
/// [`hzn_open`] made the sensor at this pointer, in memory with room for so many blocks, and nothing else uses the
/// lists.
unsafe fn lists<'a, const BLOCKS: usize>(sensor: *mut HznSensor) -> &'a mut Lists<BLOCKS> {
    // SAFETY: the caller guarantees it. Lists consist of numbers, so that any bytes are valid ones.
    unsafe { &mut (*sensor.cast::<Memory<BLOCKS>>()).workspace }
}

/// Makes a sensor in `memory`, with every parameter at its default, and writes a pointer to it to `out`. `interface`
/// is [`HZN_INTERFACE`]. The sensor fits 2048 points of an edge if `bytes` is [`HZN_WORKSPACE_SIZE`] or more, and 608
/// points if it is less, but at least [`HZN_WORKSPACE_SIZE_608`].
///
/// # Safety
/// `memory` is null or has `bytes` writable bytes that nothing else uses as long as the sensor is used. `out` is null
/// or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_open(memory: *mut u8, bytes: usize, interface: u32, out: *mut *mut HznSensor) -> i32 {
    let place = memory.cast::<HznSensor>();
    let (Some(_), false) = (NonNull::new(place), out.is_null()) else { return HZN_NULL };
    let has_all_points = bytes >= size_of::<Memory<ALL_POINTS>>();
    let used = if has_all_points { size_of::<Memory<ALL_POINTS>>() } else { size_of::<Memory<FEWER_POINTS>>() };
    if bytes < used || !place.is_aligned() {
        return HZN_MEMORY;
    }
    if interface != HZN_INTERFACE {
        return HZN_OTHER_INTERFACE;
    }
    let pending = Parameters::defaults();
    let Ok(sensor) = Sensor::new(&pending.sensor) else { return HZN_REFUSED };
    // SAFETY: `memory` is aligned and has room, as checked. A sensor consists of numbers and of bytes that are not read
    // before they are written: all bytes are valid, and zeros are an empty workspace.
    let opened = unsafe {
        ptr::write_bytes(memory, 0, used);
        &mut *place
    };
    opened.kept.set(Kept { refused: 0, has_all_points, pending, sensor });
    opened.kept.complete();
    opened.magic = MAGIC;
    // SAFETY: `out` is not null, and the caller guarantees the rest.
    unsafe { out.write(place) };
    0
}

/// Sets a parameter by its number. The value is in use after the next `hzn_apply`.
///
/// # Safety
/// `sensor` is null or from `hzn_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_set(sensor: *mut HznSensor, number: u16, value: f64) -> i32 {
    // SAFETY: the caller guarantees it.
    let sensor = match unsafe { open_sensor(sensor) } {
        Ok(sensor) => sensor,
        Err(code) => return code,
    };
    sensor.kept.change(|kept| match kept.pending.set(number, value) {
        Ok(()) => 0,
        Err(refused) => kept.refuse(&refused),
    })
}

/// Writes the value of a parameter, as it was set last, to `value`.
///
/// # Safety
/// `sensor` is null or from `hzn_open`. `value` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_get(sensor: *const HznSensor, number: u16, value: *mut f64) -> i32 {
    if value.is_null() {
        return HZN_NULL;
    }
    if !value.is_aligned() {
        return HZN_MEMORY;
    }
    // SAFETY: the caller guarantees it. The sensor is only read.
    let sensor = match unsafe { open_sensor(sensor.cast_mut()) } {
        Ok(sensor) => sensor,
        Err(code) => return code,
    };
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    let value = unsafe { &mut *value };
    match sensor.kept.get().pending.get(number) {
        Some(found) => {
            *value = found;
            0
        }
        None => HZN_UNKNOWN_PARAMETER,
    }
}

/// Puts the parameters that were set into use, all or none. If they are refused, the sensor does not change and the
/// values that were set are lost.
///
/// # Safety
/// `sensor` is null or from `hzn_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_apply(sensor: *mut HznSensor) -> i32 {
    // SAFETY: the caller guarantees it.
    let sensor = match unsafe { open_sensor(sensor) } {
        Ok(sensor) => sensor,
        Err(code) => return code,
    };
    sensor.kept.change(Kept::apply)
}

/// Returns the number of the parameter that `hzn_set` or `hzn_apply` refused last; 0: none, or the sensor is not open.
/// Of a parameter with several numbers, such as the corners of a mask, this is the first.
///
/// # Safety
/// `sensor` is null or from `hzn_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_refused(sensor: *const HznSensor) -> u16 {
    // SAFETY: the caller guarantees it. The sensor is only read.
    unsafe { open_sensor(sensor.cast_mut()) }.map_or(0, |sensor| sensor.kept.get().refused)
}

/// Sets every value to NaN: nothing is known. Fill in what is known afterwards.
///
/// # Safety
/// `known` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_nothing_known(known: *mut HznKnown) -> i32 {
    if known.is_null() {
        return HZN_NULL;
    }
    if !known.is_aligned() {
        return HZN_MEMORY;
    }
    // SAFETY: the pointer is neither null nor unaligned, and the caller guarantees the rest.
    unsafe { known.write(HznKnown::NOTHING) };
    0
}

/// Finds the limb. Every valid picture gets a status, which is returned, and an answer in `out`.
///
/// # Safety
/// `sensor` is null or from `hzn_open`. `picture` is null, or its `pixels` have `bytes` readable bytes. `known` is null
/// (nothing is known) or readable. `out` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_process(
    sensor: *mut HznSensor,
    picture: *const HznPicture,
    known: *const HznKnown,
    out: *mut HznAnswer,
) -> i32 {
    // SAFETY: the caller guarantees it.
    match unsafe { find_limb(sensor, picture, known, out) } {
        Ok((report, _)) => report.status as i32,
        Err(code) => code,
    }
}

/// Does the same as [`hzn_process`]. Returns the report with the rate that was known, or the error.
///
/// # Safety
/// As for [`hzn_process`].
unsafe fn find_limb(
    sensor: *mut HznSensor,
    picture: *const HznPicture,
    known: *const HznKnown,
    out: *mut HznAnswer,
) -> Result<(Report<f32>, Option<[f32; 3]>), i32> {
    if picture.is_null() || out.is_null() {
        return Err(HZN_NULL);
    }
    if !picture.is_aligned() || !out.is_aligned() || !known.is_aligned() {
        return Err(HZN_MEMORY);
    }
    // SAFETY: the pointers are neither null nor unaligned, and the caller guarantees the rest.
    let (picture, out) = unsafe { (&*picture, &mut *out) };
    *out = NO_ANSWER;
    // SAFETY: the caller guarantees it.
    let kept = unsafe { open_sensor(sensor) }?.kept.get();
    let camera = kept.sensor.camera();
    if (picture.width, picture.height) != (camera.width().into(), camera.height().into()) {
        return Err(HZN_PICTURE);
    }
    if picture.pixels.is_null() || picture.bytes > isize::MAX as usize {
        return Err(HZN_PICTURE);
    }
    // SAFETY: the caller guarantees it; the pointer is not null, and the length is possible for a slice.
    let pixels = unsafe { core::slice::from_raw_parts(picture.pixels, picture.bytes) };
    let layout = Layout { width: picture.width, height: picture.height, stride: picture.stride, channels: 1, bits: 8 };
    let Ok(grey) = Grey::try_new(pixels, layout) else { return Err(HZN_PICTURE) };
    // SAFETY: the caller guarantees it.
    let Some((expected, attitude)) = (unsafe { expect(&kept.sensor, known) }) else { return Err(HZN_KNOWN) };
    // SAFETY: the sensor is open, and says how much room there is. The caller guarantees that nothing else uses it.
    let report = unsafe {
        if kept.has_all_points {
            kept.sensor.process(lists::<ALL_POINTS>(sensor), &grey, &expected, &Unobserved)
        } else {
            kept.sensor.process(lists::<FEWER_POINTS>(sensor), &grey, &expected, &Unobserved)
        }
    };
    *out = to_answer(&PictureAnswer::from_report(&report, kept.sensor.config()), attitude);
    // SAFETY: the caller guarantees it. The rate was accepted above, so that all of its numbers are known, or none.
    let rate_rad_s = unsafe { known.as_ref() }.map(|known| known.rate_rad_s).filter(|[x, ..]| !x.is_nan());
    Ok((report, rate_rad_s))
}

/// Returns the expected limb, and what became of the attitude and the Sun; `None` if the values are impossible.
///
/// # Safety
/// `known` is null or readable and aligned.
unsafe fn expect(sensor: &Sensor<f32>, known: *const HznKnown) -> Option<(Expected<f32>, u8)> {
    // SAFETY: the caller guarantees it.
    let (prior, attitude) = match unsafe { known.as_ref() } {
        Some(values) => to_prior(values, sensor.config().body.kind)?,
        None => (Prior::default(), types::NOT_GIVEN),
    };
    Some((sensor.expect(&prior).ok()?, attitude))
}

impl Kept {
    /// Makes the sensor of the parameters that were set, and returns the code.
    fn apply(&mut self) -> i32 {
        let new = self.pending.check().and_then(|()| Sensor::new(&self.pending.sensor).map_err(Refused::Config));
        match new {
            Ok(new) => {
                (self.sensor, self.refused) = (new, 0);
                0
            }
            Err(refused) => {
                self.pending = Parameters::new(self.sensor.config().clone());
                self.refuse(&refused);
                HZN_REFUSED
            }
        }
    }
    /// Keeps what was refused, and returns the code.
    fn refuse(&mut self, refused: &Refused) -> i32 {
        self.refused = refused.number();
        if matches!(refused, Refused::Unknown(_)) { HZN_UNKNOWN_PARAMETER } else { HZN_REFUSED }
    }
}
