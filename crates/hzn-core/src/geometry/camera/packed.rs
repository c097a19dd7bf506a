//! A camera and its calibration as bytes.

use super::Camera;
use super::intrinsic::{Covariance, Intrinsic};
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::parts::packed;

packed!(Covariance { order, rows });
// A sensor's camera does not turn, and its rays are not scaled: both belong to one picture.
packed!(Camera<T> {
    width, height, fx, fy, inv_fx, inv_fy, cx, cy, rho_max, theta_max, circle, rho_min, lens, modes, temperature, row_s,
    middle_row; turning = None, scaling = None
});

impl Packed for Intrinsic {
    fn pack(&self, to: &mut Packer<'_>) {
        (*self as u8).pack(to);
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let number = u8::unpack(from);
        let intrinsic = Self::ALL.into_iter().find(|intrinsic| *intrinsic as u8 == number);
        from.require(intrinsic.is_some());
        intrinsic.unwrap_or(Self::FxPx)
    }
}
