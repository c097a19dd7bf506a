//! The error budget: the contribution of each source of error to the covariance of an answer. It is computed on
//! request.

use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Cov3};
use crate::model::body::Expected;

/// A source of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
// The numbers are fixed because they are the indices of the arrays below.
#[repr(u8)]
pub enum Term {
    /// Errors of the edge points, correlated along the edge.
    EdgeNoise = 0,
    /// An equal shift of all points of the edge.
    CommonShift = 1,
    /// A tilt of the whole edge.
    CommonTilt = 2,
    /// A bend of the whole edge, which the weights of the fusion leave out.
    CommonBend = 3,
    /// The limb's azimuthal harmonics, whose direction or size is unknown.
    UnknownAzimuth = 4,
    /// The calibration of the lens.
    Lens = 5,
    /// A tilt of the limb: its height changes with latitude. The weights of the fusion leave it out.
    LimbTilt = 6,
    /// A Sun that is low over a part of the limb, which raises the edge there. The weights of the fusion leave it out.
    LowSun = 7,
    /// The weather of a thermal band, which changes the height along the limb.
    Weather = 8,
    /// The height of the limb, through the expected half-angle.
    LimbHeight = 9,
    /// The altitude, through the expected half-angle.
    Altitude = 10,
    /// The local radius of the body, through the expected half-angle.
    Radius = 11,
    /// The height of a limb that is clipped at full scale, through the expected half-angle.
    Clipping = 12,
}

impl Term {
    /// All terms in the order of their numbers.
    pub const ALL: [Self; 13] = [
        Self::EdgeNoise,
        Self::CommonShift,
        Self::CommonTilt,
        Self::CommonBend,
        Self::UnknownAzimuth,
        Self::Lens,
        Self::LimbTilt,
        Self::LowSun,
        Self::Weather,
        Self::LimbHeight,
        Self::Altitude,
        Self::Radius,
        Self::Clipping,
    ];
}

/// Number of terms that are known before the expected half-angle is fused. The other terms come from the fusion.
const FIT_TERMS: usize = 9;

/// The covariance of an answer's axis, term by term. The sum of the terms is the whole covariance.
#[derive(Debug, Clone, Copy)]
pub struct ErrorBudget<T> {
    /// Covariances of (δ₁₂, δc) by term, before the expected half-angle is fused.
    fit: [M3<T>; FIT_TERMS],
    /// Covariances of the axis in the camera frame by term, rad².
    axis: [Cov3<Cam, T>; Term::ALL.len()],
    /// Gain of the fusion with the expected half-angle: the shift of the axis in the camera frame, rad, for a change of
    /// 1 in the difference of the cosines, expected − fitted. It is 0 when the half-angle is not fused.
    pub axis_by_cos: [T; 3],
}

impl<T: Real> ErrorBudget<T> {
    /// Makes an empty error budget.
    pub(crate) fn new() -> Self {
        Self {
            fit: [M3::zeros(); FIT_TERMS],
            axis: [Cov3::from_upper([T::ZERO; 6]); Term::ALL.len()],
            axis_by_cos: [T::ZERO; 3],
        }
    }

    /// Records the contribution of a term to the covariance of (δ₁₂, δc).
    pub(crate) fn record(&mut self, term: Term, p: &M3<T>) {
        if let Some(place) = self.fit.get_mut(term as usize) {
            *place = *p;
        }
    }

    /// Converts the terms to the axis, δ₁₂ − k δc. The part of the expected half-angle, `prior` (a gain times σ_c), is
    /// divided among its sources.
    pub(crate) fn project(&mut self, b1: &V3<T>, b2: &V3<T>, [k1, k2]: [T; 2], prior: [T; 2], expected: &Expected<T>) {
        for (axis, p) in self.axis.iter_mut().zip(&self.fit) {
            // The gain is applied to each term alone, because the update is linear: the terms add up to the whole
            // covariance.
            let p13 = p.m13 - k1 * p.m33;
            let p23 = p.m23 - k2 * p.m33;
            let p11 = p.m11 - k1 * p.m13 - k1 * p13;
            let p12 = p.m12 - k2 * p.m13 - k1 * p23;
            let p22 = p.m22 - k2 * p.m23 - k2 * p23;
            *axis = Cov3::from_tangent(b1, b2, [p11, p12, p22]);
        }
        // Without any sigma of the half-angle the parts would be 0/0.
        let total = expected.limb_sigma_parts_m.iter().fold(T::ZERO, |sum, s| sum + *s * *s).max(T::from_f64(1e-30));
        for (axis, sigma) in self.axis.iter_mut().skip(FIT_TERMS).zip(expected.limb_sigma_parts_m) {
            let part = sigma * sigma / total;
            *axis = Cov3::from_tangent(
                b1,
                b2,
                [prior[0] * prior[0] * part, prior[0] * prior[1] * part, prior[1] * prior[1] * part],
            );
        }
        self.axis_by_cos = (b1 * k1 + b2 * k2).into();
    }

    /// Returns the contribution of a term to the covariance of (δ₁₂, δc) before the expected half-angle is fused.
    #[cfg(test)]
    pub(crate) fn fit_term(&self, term: Term) -> &M3<T> {
        &self.fit[term as usize]
    }

    /// Returns the contribution of a term to the covariance of the axis in the camera frame, rad².
    pub fn covariance(&self, term: Term) -> Cov3<Cam, T> {
        self.axis.get(term as usize).copied().unwrap_or(Cov3::from_upper([T::ZERO; 6]))
    }
}
