//! What each source of error adds to an answer's covariance, for those who ask.

use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, Cov3};
use crate::model::body::Expected;

/// A source of error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Term {
    /// Errors of the edge points, correlated along the edge.
    EdgeNoise = 0,
    /// What shifts every point of the edge alike.
    CommonShift = 1,
    /// What tilts the whole edge.
    CommonTilt = 2,
    /// The limb's azimuthal harmonics, whose direction or size is unknown.
    UnknownAzimuth = 3,
    /// The calibration of the lens.
    Lens = 4,
    /// The height of the limb, through the expected half-angle.
    LimbHeight = 5,
    /// The altitude, likewise.
    Altitude = 6,
    /// The local radius of the body, likewise.
    Radius = 7,
    /// The height of a limb that is clipped at full scale, likewise.
    Clipping = 8,
}

impl Term {
    /// Every term in the order of its number.
    pub const ALL: [Self; 9] = [
        Self::EdgeNoise,
        Self::CommonShift,
        Self::CommonTilt,
        Self::UnknownAzimuth,
        Self::Lens,
        Self::LimbHeight,
        Self::Altitude,
        Self::Radius,
        Self::Clipping,
    ];
}

/// Terms that are known before the expected half-angle is fused; the rest come through it.
const OF_THE_FIT: usize = 5;

/// The covariance of an answer's axis, term by term. The terms add up to the whole.
#[derive(Debug, Clone, Copy)]
pub struct ErrorBudget<T> {
    /// Of (δ₁₂, δc) before the expected half-angle is fused.
    fit: [M3<T>; OF_THE_FIT],
    /// Of the axis, rad², by term.
    axis: [Cov3<Cam, T>; Term::ALL.len()],
    /// The part of the axis' error along the vertical that the expected half-angle takes away or adds: how far the axis
    /// moves, rad, for a change of 1 in the difference of the cosines.
    pub axis_by_cos: [T; 3],
}

impl<T: Real> ErrorBudget<T> {
    /// Of nothing yet.
    pub(crate) fn new() -> Self {
        Self {
            fit: [M3::zeros(); OF_THE_FIT],
            axis: [Cov3::from_upper([T::ZERO; 6]); Term::ALL.len()],
            axis_by_cos: [T::ZERO; 3],
        }
    }

    /// Notes what a term adds to the covariance of (δ₁₂, δc).
    pub(crate) fn record(&mut self, term: Term, p: &M3<T>) {
        if let Some(place) = self.fit.get_mut(term as usize) {
            *place = *p;
        }
    }

    /// Carries the terms over to the axis, δ₁₂ − k δc, and divides the expected half-angle's part, `prior` σ_c, by its
    /// sources.
    pub(crate) fn project(&mut self, b1: &V3<T>, b2: &V3<T>, [k1, k2]: [T; 2], prior: [T; 2], expected: &Expected<T>) {
        for (axis, p) in self.axis.iter_mut().zip(&self.fit) {
            let p13 = p.m13 - k1 * p.m33;
            let p23 = p.m23 - k2 * p.m33;
            let p11 = p.m11 - k1 * p.m13 - k1 * p13;
            let p12 = p.m12 - k2 * p.m13 - k1 * p23;
            let p22 = p.m22 - k2 * p.m23 - k2 * p23;
            *axis = Cov3::from_tangent(b1, b2, [p11, p12, p22]);
        }
        let total = expected.sigma_parts.iter().fold(T::ZERO, |sum, s| sum + *s * *s).max(T::from_f64(1e-30));
        for (axis, sigma) in self.axis.iter_mut().skip(OF_THE_FIT).zip(expected.sigma_parts) {
            let part = sigma * sigma / total;
            *axis = Cov3::from_tangent(
                b1,
                b2,
                [prior[0] * prior[0] * part, prior[0] * prior[1] * part, prior[1] * prior[1] * part],
            );
        }
        self.axis_by_cos = (b1 * k1 + b2 * k2).into();
    }

    /// What a term adds to the covariance of (δ₁₂, δc) before the expected half-angle is fused.
    #[cfg(test)]
    pub(crate) fn of_fit(&self, term: Term) -> &M3<T> {
        &self.fit[term as usize]
    }

    /// What a term adds to the covariance of the axis, rad².
    pub fn of(&self, term: Term) -> Cov3<Cam, T> {
        self.axis.get(term as usize).copied().unwrap_or(Cov3::from_upper([T::ZERO; 6]))
    }
}
