//! The 7×7 pixels about an edge, for the methods that use all of them at once.

use crate::base::real::Real;
use crate::image::Pixels;
use crate::model::observer::Observer;
use crate::stages::contour::BinaryPicture;

/// Number of pixels from the centre to each side.
pub(super) const HALF: i32 = 3;
/// Number of pixels on each side of the patch.
pub(super) const SIDE: usize = 7;

/// Brightness of the pixels about a pixel, as [`light`] gives it.
pub(super) struct Patch<T> {
    /// Rows from the top, each from the left.
    // The pixels are copied, because the fit reads each of them up to six times.
    pub(super) rows: [[T; SIDE]; SIDE],
}

impl<T: Real> Patch<T> {
    /// Reads the patch; `None` if it leaves the region or touches a mask.
    pub(super) fn read<P: Pixels, O: Observer<T>>(binary: &BinaryPicture<'_, T, P, O>, x: i32, y: i32) -> Option<Self> {
        let mut rows = [[T::ZERO; SIDE]; SIDE];
        for (row, dy) in rows.iter_mut().zip(-HALF..) {
            for (value, dx) in row.iter_mut().zip(-HALF..) {
                *value = light(binary, x + dx, y + dy)?;
            }
        }
        Some(Self { rows })
    }
}

/// Reads the light of a pixel, in counts of a linear picture in which the threshold of the picture has the same value;
/// or its counts, if the tone of the picture is unknown. `None` beyond the region and under a mask.
// A blurred step is a step of light. In other counts it is not symmetric, and its middle lies elsewhere.
pub(super) fn light<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
) -> Option<T> {
    let counts = T::from_i32(brightness(binary, x, y)?);
    let Some(curve) = &binary.curve else { return Some(counts) };
    let (full, level) = (T::from_i32(binary.picture.full_scale().into()), T::from_i32(binary.level.into()));
    Some(curve.light_over(counts / full, level / full) * level)
}

/// Reads the brightness of a pixel, in counts; `None` beyond the region and under a mask.
pub(super) fn brightness<T: Real, P: Pixels, O: Observer<T>>(
    binary: &BinaryPicture<'_, T, P, O>,
    x: i32,
    y: i32,
) -> Option<i32> {
    let (Ok(x), Ok(y)) = (u16::try_from(x), u16::try_from(y)) else { return None };
    if !binary.region.contains(x, y) || binary.region.masked(x, y) {
        return None;
    }
    binary.observer.pixel(x, y);
    Some(i32::from(binary.picture.at(x, y)))
}
