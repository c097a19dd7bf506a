//! The lens models behind one interface.

use super::{brown, radial};
use crate::base::linalg::V3;
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::real::Real;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Lens<T> {
    Radial(radial::Radial<T>),
    // A pinhole is not a Brown lens with zeros, because its inverse is one square root and Brown's is an iteration.
    Pinhole,
    Brown(brown::Brown<T>),
}

impl<T: Real> Lens<T> {
    /// Returns the image point of the ray `s` (camera frame) in focal lengths from the principal point, and its
    /// derivatives by the coefficients of the lens.
    #[inline(always)]
    pub(super) fn by_coefficients(&self, s: &V3<T>) -> (T, T, [[T; 2]; 5]) {
        let (one, zero) = (T::one(), T::ZERO);
        match self {
            Self::Radial(lens) => {
                let h = (s.x * s.x + s.y * s.y).sqrt();
                let theta = h.atan2(s.z);
                // On the axis the direction of (x, y) does not matter, and h would be a divisor of 0.
                let per = if h > zero { one / h } else { zero };
                let radius = if h > zero { lens.radius(theta) * per } else { one };
                let by_k = lens.by_coefficients(theta, per).map(|by| [s.x * by, s.y * by]);
                (s.x * radius, s.y * radius, by_k)
            }
            Self::Pinhole => (s.x / s.z, s.y / s.z, [[zero; 2]; 5]),
            Self::Brown(lens) => {
                let (x, y) = (s.x / s.z, s.y / s.z);
                let (dx, dy) = lens.distort(x, y);
                (dx, dy, brown::Brown::by_coefficients(x, y))
            }
        }
    }
}

impl<T: Real> Packed for Lens<T> {
    fn pack(&self, to: &mut Packer<'_>) {
        match self {
            Self::Radial(lens) => {
                0u8.pack(to);
                lens.pack(to);
            }
            Self::Pinhole => 1u8.pack(to),
            Self::Brown(lens) => {
                2u8.pack(to);
                lens.pack(to);
            }
        }
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        match u8::unpack(from) {
            0 => Self::Radial(Packed::unpack(from)),
            2 => Self::Brown(Packed::unpack(from)),
            other => {
                from.require(other == 1);
                Self::Pinhole
            }
        }
    }
}
