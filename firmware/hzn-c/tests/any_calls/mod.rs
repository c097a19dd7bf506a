//! Calls of the C interface with arbitrary memory, numbers and pictures. libFuzzer runs them with the address sanitizer
//! (`fuzz/`), and the test `corpus` without it.

use std::alloc::{Layout, alloc, dealloc};
use std::ptr;

use hzn::types::{HznAnswer, HznKnown, HznPicture};
use hzn::{HZN_INTERFACE, hzn_apply, hzn_get, hzn_open, hzn_process, hzn_refused, hzn_set};
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
            let mut number = || f32::from_le_bytes(std::array::from_fn(|_| byte()));
            let known = HznKnown {
                altitude_m: number(),
                position_m: std::array::from_fn(|_| number()),
                rate_rad_s: std::array::from_fn(|_| number()),
            };
            let mut answer: HznAnswer = std::mem::zeroed();
            hzn_process(sensor, &picture, &known, &mut answer);
            hzn_process(sensor, &picture, ptr::null(), &mut answer);
            hzn_process(sensor, ptr::null(), ptr::null(), &mut answer);
            hzn_process(ptr::null_mut(), &picture, ptr::null(), &mut answer);
        }
        dealloc(memory, layout);
    }
}
