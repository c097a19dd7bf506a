//! Limits of the size of a picture.

use crate::unread;

/// Longest side of a picture that is read, in pixels.
pub const MAX_SIDE_PX: u32 = 20_000;
/// Largest decoded picture, in bytes.
pub const MAX_BYTES: u64 = 512 << 20;

/// Refuses sizes that are zero, above the limit, or not the camera's size.
pub(crate) fn check_size(width: u32, height: u32, expected: Option<(u32, u32)>) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("picture of {width}x{height} has no pixels"));
    }
    if width > MAX_SIDE_PX || height > MAX_SIDE_PX {
        return Err(format!("picture of {width}x{height} is larger than the limit of {MAX_SIDE_PX} px a side"));
    }
    match expected {
        Some((w, h)) if (w, h) != (width, height) => Err(unread::other_size([width, height], [w, h])),
        _ => Ok(()),
    }
}
