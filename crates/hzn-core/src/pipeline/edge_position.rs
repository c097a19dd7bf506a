//! The fit of a position on edge points: the points of a body in its scaled space, and the closed forms for comparison.
//! Feature `_edges`.

use super::edges::{Edges, Fitted};
use super::sensor::Sensor;
use crate::base::linalg::{M3, V3};
use crate::base::real::Real;
use crate::geometry::frames::{Cam, UnitVec3};
use crate::geometry::pixel::ImagePoint;
use crate::model::body::Expected;
use crate::stages::fit;

/// A position by a closed form, without gates and priors.
#[derive(Debug, Clone, Copy)]
pub struct PlainPosition<T> {
    /// From the camera to the centre of the body in the camera frame, metres.
    pub centre_m: [T; 3],
    /// Covariance for white noise of one pixel on each axis of every point: rows, m².
    pub covariance_m2: [[T; 3]; 3],
}

impl<T: Real> Edges<T> {
    /// Makes edge points of the body of `expected`, as [`Edges::new`]. If the position of the body is fitted, the rays
    /// are those of its scaled space.
    pub fn for_body(
        sensor: &Sensor<T>,
        expected: &Expected<T>,
        points: &[ImagePoint<T>],
        lit: &UnitVec3<Cam, T>,
    ) -> Self {
        let Some(camera) = sensor.camera_for(expected) else { return Self::new(sensor.camera(), points, lit) };
        let lit = expected.target().map_or(*lit, |t| UnitVec3::assume_unit(t.scaling.scale(lit.v())));
        Self::new(&camera, points, &lit)
    }

    /// Returns the position by plain least squares (Christian & Robinson 2016) with its covariance, (13.7). It is
    /// biased on short arcs. `None` if the points do not determine a position, or if no position is fitted.
    pub fn least_squares(&self, expected: &Expected<T>) -> Option<PlainPosition<T>> {
        let target = expected.target()?;
        let (e, k) = fit::closed::least_squares(&self.blocks)?;
        let one = T::one();
        // k = 1 − cos is given instead of the cosine, because for a small disc the cosine is 1 in single precision.
        let (cos, sin) = (one - k, (k * (one + one - k)).sqrt());
        let (n, kappa) = (e / cos, sin * sin / (cos * cos));
        let by_n = fit::closed::least_squares_covariance(&self.blocks, &n)?;
        // F = U⁻¹ (I − n nᵀ/κ)/√κ.
        let f = target.scaling.from * (M3::identity() - n * n.transpose() / kappa) / kappa.sqrt();
        let covariance = f * by_n * f.transpose() * (target.unit_m * target.unit_m);
        let centre: V3<T> = target.scaling.from * e * (target.unit_m / sin);
        let row = |i: usize| [covariance[(i, 0)], covariance[(i, 1)], covariance[(i, 2)]];
        Some(PlainPosition { centre_m: centre.into(), covariance_m2: [row(0), row(1), row(2)] })
    }

    /// Fits the position to all points by generalised total least squares and Gauss-Newton, without rejecting any.
    pub fn fit_position(&mut self, expected: &Expected<T>) -> Option<Fitted<T>> {
        let scaling = expected.target()?.scaling;
        let start = fit::closed::generalised_tls(&self.blocks)?;
        fit::fit_position_from(&mut self.blocks, start, &scaling).map(Fitted)
    }
}
