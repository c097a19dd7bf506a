//! Image radius of a radially symmetric lens: r(θ) in focal lengths, with its derivative.
//!
//! Each lens of this kind has a variant of `Curve` and a file with its equations. Everything else (the inverse, its
//! series, the check that the lens is monotone, rays, projection) is the same for all of them.

#[cfg(feature = "kalibr")]
use super::{double_sphere, eucm};
use crate::base::real::Real;
use crate::geometry::camera::Config;
use crate::geometry::camera::Model;

/// r(θ) of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Curve<T> {
    /// θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸).
    KannalaBrandt([T; 4]),
    /// ξ, α.
    #[cfg(feature = "kalibr")]
    DoubleSphere([T; 2]),
    /// α, β.
    #[cfg(feature = "kalibr")]
    Eucm([T; 2]),
}

impl Curve<f64> {
    /// Makes the curve of a calibration.
    pub(super) fn new(config: &Config) -> Self {
        let k = |i| config.coefficient(i);
        match config.model {
            #[cfg(feature = "kalibr")]
            Model::DoubleSphere => Self::DoubleSphere([k(0), k(1)]),
            #[cfg(feature = "kalibr")]
            Model::Eucm => Self::Eucm([k(0), k(1)]),
            // `Config::check` refuses a model that is not built in, and lenses of the plane have code of their own.
            #[cfg(not(feature = "kalibr"))]
            Model::DoubleSphere | Model::Eucm => Self::KannalaBrandt([0.0; 4]),
            Model::KannalaBrandt | Model::Equidistant | Model::Pinhole | Model::BrownConrady => {
                Self::KannalaBrandt([k(0), k(1), k(2), k(3)])
            }
        }
    }

    /// Converts the curve to another precision.
    pub(super) fn cast<T: Real>(&self) -> Curve<T> {
        match self {
            Self::KannalaBrandt(k) => Curve::KannalaBrandt(k.map(T::from_f64)),
            #[cfg(feature = "kalibr")]
            Self::DoubleSphere(k) => Curve::DoubleSphere(k.map(T::from_f64)),
            #[cfg(feature = "kalibr")]
            Self::Eucm(k) => Curve::Eucm(k.map(T::from_f64)),
        }
    }
}

impl<T: Real> Curve<T> {
    /// Returns r(θ) and r'(θ).
    #[inline(always)]
    pub(super) fn radius_and_slope(&self, theta: T) -> (T, T) {
        match self {
            Self::KannalaBrandt(k) => kannala_brandt(k, theta),
            #[cfg(feature = "kalibr")]
            Self::DoubleSphere(k) => double_sphere::radius_and_slope(k, theta),
            #[cfg(feature = "kalibr")]
            Self::Eucm(k) => eucm::radius_and_slope(k, theta),
        }
    }

    /// Returns ∂r/∂k at θ for every coefficient, times `per`.
    pub(super) fn by_coefficients(&self, theta: T, per: T) -> [T; 5] {
        let mut by = [T::ZERO; 5];
        match self {
            Self::KannalaBrandt(_) => {
                let q = theta * theta;
                let mut power = theta * q * per;
                for by in &mut by {
                    *by = power;
                    power *= q;
                }
            }
            #[cfg(feature = "kalibr")]
            Self::DoubleSphere(k) => {
                [by[0], by[1]] = double_sphere::by_coefficients(k, theta).map(|by| by * per);
            }
            #[cfg(feature = "kalibr")]
            Self::Eucm(k) => [by[0], by[1]] = eucm::by_coefficients(k, theta).map(|by| by * per),
        }
        by
    }
}

fn kannala_brandt<T: Real>(k: &[T; 4], theta: T) -> (T, T) {
    let t2 = theta * theta;
    let [k1, k2, k3, k4] = *k;
    let one = T::one();
    let r = theta * (one + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))));
    let d = one
        + t2 * (T::from_f64(3.0) * k1
            + t2 * (T::from_f64(5.0) * k2 + t2 * (T::from_f64(7.0) * k3 + t2 * T::from_f64(9.0) * k4)));
    (r, d)
}
