//! Image radius of a radially symmetric lens: r(θ) in focal lengths, with its derivative.
//!
//! Each lens of this kind has a variant of `Family` and a file with its equations. Everything else (the inverse, its
//! series, the check that the lens is monotone, rays, projection) is the same for all of them.

use super::{double_sphere, eucm};
use crate::base::packed::{Packed, Packer, Unpacker};
use crate::base::parts::packed;
use crate::base::real::Real;
use crate::geometry::camera::Config;
use crate::geometry::camera::Model;

/// r(θ) of a lens. The family stands apart from its coefficients: a build with one family then never looks at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Curve<T> {
    family: Family,
    k: [T; 4],
}

/// The equation of r(θ), with its coefficients in order.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Family {
    /// θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
    KannalaBrandt,
    /// ξ, α.
    DoubleSphere,
    /// α, β.
    Eucm,
}

impl Curve<f64> {
    /// Makes the curve of a calibration.
    pub(super) fn new(config: &Config) -> Self {
        let family = match config.model {
            Model::DoubleSphere => Family::DoubleSphere,
            Model::Eucm => Family::Eucm,
            // Lenses of the plane have code of their own.
            // An equidistant lens has no code of its own, because it is this polynomial with all coefficients 0.
            Model::KannalaBrandt | Model::Equidistant | Model::Pinhole | Model::BrownConrady => Family::KannalaBrandt,
        };
        Self { family, k: core::array::from_fn(|i| config.coefficient(i)) }
    }

    /// Converts the curve to another precision.
    pub(super) fn cast<T: Real>(&self) -> Curve<T> {
        Curve { family: self.family, k: self.k.map(T::from_f64) }
    }
}

impl<T: Real> Curve<T> {
    /// Returns r(θ) and r'(θ).
    #[inline(always)]
    pub(super) fn radius_and_slope(&self, theta: T) -> (T, T) {
        let [a, b, ..] = self.k;
        match self.family {
            // The guard is a constant, so that a build without the feature has no code of these lenses, although the
            // type is the same.
            Family::DoubleSphere if cfg!(feature = "kalibr") => double_sphere::radius_and_slope(&[a, b], theta),
            Family::Eucm if cfg!(feature = "kalibr") => eucm::radius_and_slope(&[a, b], theta),
            // `Config::check` refuses a family that is not built in.
            _ => kannala_brandt(&self.k, theta),
        }
    }

    /// Returns ∂r/∂k at θ for every coefficient, times `per`.
    pub(super) fn by_coefficients(&self, theta: T, per: T) -> [T; 5] {
        let [a, b, ..] = self.k;
        let mut by = [T::ZERO; 5];
        match self.family {
            Family::DoubleSphere if cfg!(feature = "kalibr") => {
                [by[0], by[1]] = double_sphere::by_coefficients(&[a, b], theta).map(|by| by * per);
            }
            Family::Eucm if cfg!(feature = "kalibr") => {
                [by[0], by[1]] = eucm::by_coefficients(&[a, b], theta).map(|by| by * per);
            }
            _ => {
                let q = theta * theta;
                // Each power follows from the one before by one product, instead of a call of `pow`.
                let mut power = theta * q * per;
                for by in &mut by {
                    *by = power;
                    power *= q;
                }
            }
        }
        by
    }
}

fn kannala_brandt<T: Real>(k: &[T; 4], theta: T) -> (T, T) {
    let t2 = theta * theta;
    let [k1, k2, k3, k4] = *k;
    let one = T::one();
    // Horner's form has the fewest products and the smallest rounding.
    let r = theta * (one + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
    let d = one
        + t2 * (T::from_f64(3.0) * k1
            + t2 * (T::from_f64(5.0) * k2 + t2 * (T::from_f64(7.0) * k3 + t2 * T::from_f64(9.0) * k4)));
    (r, d)
}

packed!(Curve<T> { family, k });

impl Packed for Family {
    fn pack(&self, to: &mut Packer<'_>) {
        (*self as u8).pack(to);
    }
    fn unpack(from: &mut Unpacker<'_>) -> Self {
        let number = u8::unpack(from);
        let is_built = |family: &Self| cfg!(feature = "kalibr") || *family == Self::KannalaBrandt;
        let families = [Self::KannalaBrandt, Self::DoubleSphere, Self::Eucm];
        let family = families.into_iter().filter(is_built).find(|family| *family as u8 == number);
        from.require(family.is_some());
        family.unwrap_or(Self::KannalaBrandt)
    }
}
