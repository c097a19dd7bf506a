//! hzn for C: one sensor in memory that the caller owns. There is no heap, no callback and no global state.
//!
//! Functions return 0 to 7 or a negative number. 0 to 7 is the status of a picture, as everywhere in hzn; 0 is success.
//! A negative number means an error of the caller, after which nothing has changed. Parameters have the numbers of
//! book/reference/telemetry.md.

#![no_std]

use core::mem::{align_of, size_of};
use core::ptr::{self, NonNull};

use hzn_core::image::{Grey, Layout};
use hzn_core::observer::Unobserved;
use hzn_core::{FlightWorkspace, Prior, Sensor};
use hzn_flight::Parameters;
use hzn_flight::answer::PictureAnswer;
use hzn_flight::parameters::Refused;

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
/// The picture has no pixels, an impossible size or stride, or fewer bytes than its size needs.
pub const HZN_PICTURE: i32 = -5;
/// The altitude or the position in `HznKnown` is impossible.
pub const HZN_KNOWN: i32 = -6;

/// A sensor. Its content is hidden: only pointers to it are passed.
#[derive(Debug)]
pub struct HznSensor {
    /// The parameters from [`hzn_set`]; they are in use after [`hzn_apply`].
    pending: Parameters,
    sensor: Sensor<f32>,
    workspace: FlightWorkspace,
}

/// A picture: one byte per pixel, row by row.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznPicture {
    /// The first pixel of the first row.
    pub pixels: *const u8,
    /// Readable bytes from `pixels` on.
    pub bytes: usize,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from the start of a row to the start of the next.
    pub stride: usize,
}

/// The prior of a picture. NaN means that a value is not known.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznKnown {
    /// Altitude in metres: geodetic for the Earth, above the radius for other bodies.
    pub altitude_m: f32,
    /// Position of the camera in ECEF, metres. If it is known, the altitude is not used.
    pub position_m: [f32; 3],
    /// Rate of rotation of the camera in the camera frame, rad/s; it has an effect only with a rolling shutter.
    pub rate_rad_s: [f32; 3],
}

/// The answer to a picture. Without a direction (status not 0) the values from `axis` to `rms_px` are NaN and `inliers`
/// is 0.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct HznAnswer {
    /// Unit vector to the body, camera frame (x right, y down, z forward).
    pub axis: [f32; 3],
    /// Covariance of `axis`: xx, xy, xz, yy, yz, zz, rad².
    pub cov_rad2: [f32; 6],
    /// The same direction in ECEF; NaN without a position.
    pub axis_ecef: [f32; 3],
    /// Half-angle of the free fit, rad.
    pub half_angle_rad: f32,
    /// Altitude from the free fit, m; NaN for Sun and Moon.
    pub altitude_m: f32,
    /// 1-sigma of the altitude, m.
    pub altitude_sigma_m: f32,
    /// RMS distance of the inliers from the limb, px.
    pub rms_px: f32,
    /// Number of edge points that carry the answer.
    pub inliers: u32,
    /// Number of edge points of the chosen edge.
    pub edge_points: u32,
    /// Number of edges that were candidates.
    pub candidates: u32,
    /// Number of border pixels left out because lists were full.
    pub dropped: u32,
    /// Threshold between dark and lit, counts.
    pub level: u16,
    /// Status: the value that `hzn_process` returned.
    pub status: u8,
    /// The last stage that was entered.
    pub stage: u8,
}

/// Returns the number of bytes that a sensor needs.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_workspace_size() -> usize {
    size_of::<HznSensor>()
}

/// Returns the alignment that a sensor needs, in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn hzn_workspace_align() -> usize {
    align_of::<HznSensor>()
}

/// Makes a sensor in `memory`, with every parameter at its default, and writes a pointer to it to `out`.
///
/// # Safety
/// `memory` is null or has `bytes` writable bytes that nothing else uses as long as the sensor is used. `out` is null
/// or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_open(memory: *mut u8, bytes: usize, out: *mut *mut HznSensor) -> i32 {
    let place = memory.cast::<HznSensor>();
    let (Some(_), false) = (NonNull::new(place), out.is_null()) else { return HZN_NULL };
    if bytes < size_of::<HznSensor>() || !place.is_aligned() {
        return HZN_MEMORY;
    }
    let pending = Parameters::defaults();
    let Ok(sensor) = Sensor::new(&pending.sensor) else { return HZN_REFUSED };
    // SAFETY: `place` is aligned and has room, as checked. Nothing there is dropped, because there is no sensor yet. A
    // workspace consists of arrays of numbers: all bytes are valid, and zeros are an empty workspace.
    unsafe {
        (&raw mut (*place).pending).write(pending);
        (&raw mut (*place).sensor).write(sensor);
        ptr::write_bytes(&raw mut (*place).workspace, 0, 1);
        out.write(place);
    }
    0
}

/// Sets a parameter by its number. The value is in use after the next `hzn_apply`.
///
/// # Safety
/// `sensor` is null or from `hzn_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_set(sensor: *mut HznSensor, number: u16, value: f64) -> i32 {
    // SAFETY: the caller guarantees it.
    let Some(sensor) = (unsafe { sensor.as_mut() }) else { return HZN_NULL };
    to_code(sensor.pending.set(number, value))
}

/// Writes the value of a parameter, as it was set last, to `value`.
///
/// # Safety
/// `sensor` is null or from `hzn_open`. `value` is null or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hzn_get(sensor: *const HznSensor, number: u16, value: *mut f64) -> i32 {
    // SAFETY: the caller guarantees it.
    let (Some(sensor), Some(value)) = (unsafe { sensor.as_ref() }, unsafe { value.as_mut() }) else { return HZN_NULL };
    match sensor.pending.get(number) {
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
    let Some(sensor) = (unsafe { sensor.as_mut() }) else { return HZN_NULL };
    match (sensor.pending.check(), Sensor::new(&sensor.pending.sensor)) {
        (Ok(()), Ok(new)) => {
            sensor.sensor = new;
            0
        }
        _ => {
            sensor.pending = Parameters::new(sensor.sensor.config().clone());
            HZN_REFUSED
        }
    }
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
    let (Some(sensor), Some(picture), Some(out)) =
        (unsafe { sensor.as_mut() }, unsafe { picture.as_ref() }, unsafe { out.as_mut() })
    else {
        return HZN_NULL;
    };
    if picture.pixels.is_null() || picture.bytes > isize::MAX as usize {
        return HZN_PICTURE;
    }
    // SAFETY: the caller guarantees it; the pointer is not null, and the length is possible for a slice.
    let pixels = unsafe { core::slice::from_raw_parts(picture.pixels, picture.bytes) };
    let layout = Layout { width: picture.width, height: picture.height, stride: picture.stride, channels: 1, bits: 8 };
    let Ok(grey) = Grey::try_new(pixels, layout) else { return HZN_PICTURE };
    // SAFETY: the caller guarantees it.
    let prior = unsafe { known.as_ref() }.map_or_else(Prior::default, to_prior);
    let Ok(expected) = sensor.sensor.expect(&prior) else { return HZN_KNOWN };
    let report = sensor.sensor.process(&mut sensor.workspace, &grey, &expected, &Unobserved);
    *out = to_answer(&PictureAnswer::from_report(&report));
    i32::from(out.status)
}

fn to_prior(values: &HznKnown) -> Prior<f32> {
    let known = |v: [f32; 3]| (!v.iter().any(|x| x.is_nan())).then_some(v);
    Prior {
        altitude_m: (!values.altitude_m.is_nan()).then_some(values.altitude_m),
        position_m: known(values.position_m),
        rate_rad_s: known(values.rate_rad_s),
        ..Prior::default()
    }
}

fn to_answer(a: &PictureAnswer) -> HznAnswer {
    let nan = f32::NAN;
    let d = a.direction.as_ref();
    HznAnswer {
        axis: d.map_or([nan; 3], |d| d.axis),
        cov_rad2: d.map_or([nan; 6], |d| d.cov),
        axis_ecef: d.map_or([nan; 3], |d| d.axis_ecef),
        half_angle_rad: d.map_or(nan, |d| d.half_angle_rad),
        altitude_m: d.map_or(nan, |d| d.altitude_est_m),
        altitude_sigma_m: d.map_or(nan, |d| d.altitude_est_sigma_m),
        rms_px: d.map_or(nan, |d| d.rms_px),
        inliers: d.map_or(0, |d| d.inliers),
        edge_points: a.edge_points,
        candidates: a.candidates,
        dropped: a.dropped,
        level: a.level,
        status: a.status,
        stage: a.stage,
    }
}

fn to_code(result: Result<(), Refused>) -> i32 {
    match result {
        Ok(()) => 0,
        Err(Refused::Unknown(_)) => HZN_UNKNOWN_PARAMETER,
        Err(_) => HZN_REFUSED,
    }
}
