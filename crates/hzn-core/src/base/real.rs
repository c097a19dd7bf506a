//! The scalar type of every computation: `f32` or `f64`.
//!
//! Functions that IEEE 754 does not round correctly come from the `libm` crate on every target, so that a desktop and a
//! flight computer give the same bits. The square root is correctly rounded everywhere, so it may use the hardware
//! (feature `std`).

use core::fmt::{Debug, Display};
use core::ops::Neg;

use super::packed::Packed;

// The trait is sealed so that no other number type can be used: the limits of the stages are derived for these two.
mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// `f32` or `f64`, with the functions that the pipeline needs.
pub trait Real:
    sealed::Sealed
    + nalgebra::Scalar
    + Copy
    + Send
    + Sync
    + Default
    + Debug
    + Display
    + PartialOrd
    + Neg<Output = Self>
    + num_traits::NumAssign
    + Packed
{
    /// Converts `x` to the nearest value of this type.
    fn from_f64(x: f64) -> Self;
    /// Converts an integer; exact for small integers, for example pixel coordinates.
    fn from_i32(x: i32) -> Self;
    /// Converts to `f64`, exactly.
    fn to_f64(self) -> f64;
    /// Returns the correctly rounded square root; NaN below zero.
    fn sqrt(self) -> Self;
    /// Returns sine and cosine of an angle in radians.
    fn sin_cos(self) -> (Self, Self);
    /// Returns the sine alone, with the bits of [`Self::sin_cos`]. Without a double-precision unit it costs half.
    fn sin(self) -> Self;
    /// Returns the angle of the point `(x, self)` in radians, -π to π.
    fn atan2(self, x: Self) -> Self;
    /// Returns the arc sine in radians.
    fn asin(self) -> Self;
    /// Returns the arc cosine in radians.
    fn acos(self) -> Self;
    /// Returns the tangent of an angle in radians.
    fn tan(self) -> Self;
    /// Returns the exponential function.
    fn exp(self) -> Self;
    /// Returns the natural logarithm.
    fn ln(self) -> Self;
    /// Returns the error function.
    fn erf(self) -> Self;
    /// Returns the largest integer that is not above the number.
    fn floor(self) -> Self;
    /// Returns the absolute value.
    fn abs(self) -> Self;
    /// Returns whether the number is neither NaN nor infinite.
    fn is_finite(self) -> bool;
    /// Truncates to an integer; it saturates, and NaN gives 0.
    fn to_i32(self) -> i32;
    /// The distance from 1 to the next larger number.
    const EPSILON: Self;
    /// 0.
    const ZERO: Self;
    /// Largest x for which [`Self::exp_neg_series`] is accurate.
    const EXP_SERIES: Self;

    /// Returns the smaller of two numbers; `other` when `self` is NaN.
    #[inline(always)]
    // On x86-64 this comparison is one instruction. A minimum in which NaN always loses would need several.
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    /// Returns the larger of two numbers; `other` when `self` is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    /// Returns `exp(-x)` for `x >= 0`.
    #[inline]
    // Neighbouring points of an edge are close, so x is nearly always small. The series is some products; the function
    // of libm would be a call with a table and branches for each point.
    fn exp_neg(self) -> Self {
        if self > Self::EXP_SERIES { (-self).exp() } else { self.exp_neg_series() }
    }
    /// Returns `exp(-x)` for `0 <= x <= EXP_SERIES`.
    #[inline(always)]
    fn exp_neg_series(self) -> Self {
        // Taylor series to the ninth power: the relative error is below 3e-16 at 1/8 and below 3e-8 at 3/4.
        let y = -self;
        let mut sum = Self::from_f64(1.0 / 362_880.0);
        for c in [1.0 / 40_320.0, 1.0 / 5040.0, 1.0 / 720.0, 1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
            sum = sum * y + Self::from_f64(c);
        }
        sum
    }
}

/// The square root of the floating-point unit, where there is one. It is correctly rounded, so it gives the same bits.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
use hzn_fpu::sqrt_f32;
#[cfg(not(any(feature = "std", all(target_arch = "arm", target_abi = "eabihf"))))]
// The root of libm is slower, but it is also correctly rounded. Therefore the bits are the same.
use libm::sqrtf as sqrt_f32;

macro_rules! real {
    (
        $t:ty, $sqrt:path, $sincos:ident, $sin:ident, $atan2:ident, $asin:ident, $acos:ident, $tan:ident, $exp:ident,
        $ln:ident, $erf:ident, $floor:ident, $series:literal
    ) => {
        impl Real for $t {
            const EPSILON: Self = <$t>::EPSILON;
            const ZERO: Self = 0.0;
            const EXP_SERIES: Self = $series;
            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn from_i32(x: i32) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                #[cfg(feature = "std")]
                {
                    <$t>::sqrt(self)
                }
                #[cfg(not(feature = "std"))]
                {
                    $sqrt(self)
                }
            }
            fn sin_cos(self) -> (Self, Self) {
                // The functions of the standard library are those of the platform, so that the last bit would differ
                // between targets.
                libm::$sincos(self)
            }
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            fn atan2(self, x: Self) -> Self {
                libm::$atan2(self, x)
            }
            fn asin(self) -> Self {
                libm::$asin(self)
            }
            fn acos(self) -> Self {
                libm::$acos(self)
            }
            fn tan(self) -> Self {
                libm::$tan(self)
            }
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            fn erf(self) -> Self {
                libm::$erf(self)
            }
            #[inline(always)]
            fn floor(self) -> Self {
                libm::$floor(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                if self < 0.0 { -self } else { self }
            }
            #[inline(always)]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }
            #[inline(always)]
            fn to_i32(self) -> i32 {
                self as i32
            }
        }
    };
}
// The series ends at another x for each type: at 3/4 its error reaches the rounding of f32, at 1/8 that of f64.
real!(f32, sqrt_f32, sincosf, sinf, atan2f, asinf, acosf, tanf, expf, logf, erff, floorf, 0.75);
real!(f64, libm::sqrt, sincos, sin, atan2, asin, acos, tan, exp, log, erf, floor, 0.125);

#[cfg(test)]
mod tests {
    use super::Real;

    #[test]
    fn the_sine_alone_has_the_bits_of_the_pair() {
        for i in -200_000..200_000 {
            let x = f64::from(i) * 1e-4;
            assert_eq!(Real::sin_cos(x).0.to_bits(), Real::sin(x).to_bits(), "{x}");
            let y = x as f32;
            assert_eq!(Real::sin_cos(y).0.to_bits(), Real::sin(y).to_bits(), "{y}");
        }
    }

    #[test]
    fn short_exponential_equals_the_long_one() {
        for i in 0..400 {
            let x = f64::from(i) * 1e-3;
            assert!((x.exp_neg() / libm::exp(-x) - 1.0).abs() < 1e-15, "{x}");
            let y = x as f32;
            assert!((y.exp_neg() / libm::expf(-y) - 1.0).abs() < 3e-7, "{y}");
        }
    }
}
