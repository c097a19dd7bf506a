//! What an error of the lens bends: the residuals of a cone that is fitted together with the parameters of the lens.
//!
//! A lens that is not known exactly moves the points of a limb off their cone, along smooth curves. The gates compare
//! the residuals with those of shapes of the picture, for which the lens does not matter. The residuals r are therefore
//! fitted by H δ + X a, where δ changes the cone and a are the 1-sigma modes of the lens
//! (`Camera::intrinsic_modes`), each with the prior 0 ± 1. The expected half-angle is one more row. The fit minimises
//! Σ w (r − H δ − X a)²/σ² + Σ a² + (c + δc − c₀)²/σ_c².
//!
//! An edge that is no limb is a circle of the picture, for example. A lens of unknown shape may make a limb look like
//! this. The residuals then tell the shape of the lens, with which the half-angle must be the expected one.

use super::case::Case;
use super::shape::{Curve, Place, RIVAL_FLOOR_PX, Residuals, Shape, rms};
use crate::base::linalg::{Triangle, V3, basis, dot};
use crate::base::real::Real;
use crate::geometry::block::{LANES, LEAST_GRADIENT2};
use crate::geometry::camera::INTRINSICS;
use crate::model::edge_noise::LENGTHS_PER_EDGE;

/// Number of parameters of a cone.
const CONE: usize = 3;
/// Length of a row: the cone, the modes of the lens, and the residual.
const ROW: usize = CONE + INTRINSICS + 1;
/// Number of independent errors along an edge. A correlation length counts twice: to both sides of a point.
pub(super) const INDEPENDENT: f64 = 0.5 * LENGTHS_PER_EDGE;
/// Place of the residual.
const LAST: usize = ROW - 1;

/// What the stated errors of the lens explain of an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend<T> {
    /// χ² of the values that the fit needs: Σ a² of the modes, and the square of the half-angle's difference in sigmas.
    /// It counts against the cone as much as the residuals do.
    pub(super) chi2: T,
    /// χ² of the expected half-angle, with what the residuals say about the lens; 0 without an expected half-angle.
    pub(super) half_angle_chi2: T,
}

/// Returns whether the half-angle agrees with the expected one only because the lens is uncertain. Without a floor of
/// the residuals, they are not asked.
pub(super) fn explains_half_angle<T: Real>(case: &Case<'_, T>) -> bool {
    let chi = T::from_f64(case.config.max_half_angle_sigma);
    case.camera.intrinsic_modes().is_some()
        && case.config.residual_floor_px > 0.0
        && half_angle_difference(case)
            .is_some_and(|(difference, variance)| difference * difference > variance * chi * chi)
}

/// Returns the expected minus the fitted cos α, and the variance of this difference without the lens. `None` without
/// an expected half-angle.
fn half_angle_difference<T: Real>(case: &Case<'_, T>) -> Option<(T, T)> {
    let Case { fit, fused, expected, config, .. } = *case;
    let var_free = fused.var_free_cos.filter(|_| fused.located.is_none() && fused.chi2 > T::ZERO)?;
    let prior = expected.variance_towards(fit.c, T::from_f64(config.max_half_angle_sigma))?;
    Some((expected.cos - fit.c, (var_free - fused.edge.lens_var_cos).max(T::ZERO) + prior))
}

/// Calls a function with the residuals of a cone that is fitted together with the uncertain parameters of the lens.
/// `None` if the lens is known exactly, or if the points do not determine this fit.
// The residuals are replaced and measured again, because a second list would be the largest thing on the stack.
#[inline(never)]
pub(super) fn without_lens<T: Real, R>(
    case: &Case<'_, T>,
    residuals: &mut Residuals<'_, T>,
    call: impl FnOnce(&Bend<T>, Residuals<'_, T>) -> R,
) -> Option<R> {
    case.camera.intrinsic_modes()?;
    let bend = unbend(case, residuals);
    let result = bend.map(|bend| call(&bend, Residuals::new(residuals.curve, residuals.shape, case.config)));
    for place in residuals.shape.iter_mut() {
        let (number, lane) = (usize::from(place.number) / LANES, usize::from(place.number) % LANES);
        if let Some(block) = case.blocks.get(number) {
            place.r = residuals.curve.distance(block, lane);
        }
    }
    result
}

/// Fits the cone with the modes of the lens, and replaces the residuals of the points by those of this fit. `None` if
/// the lens is known exactly, or if the points do not determine the fit.
// There are two fits, because the weight of the prior needs the residuals that are left, and the first fit has only the
// noise from point to point.
#[inline(never)]
fn unbend<T: Real>(case: &Case<'_, T>, residuals: &mut Residuals<'_, T>) -> Option<Bend<T>> {
    let rows = Rows::new(case, residuals.curve)?;
    let shape = &mut *residuals.shape;
    let floor_px = T::from_f64(case.config.residual_floor_px.max(RIVAL_FLOOR_PX));
    let points = T::from_i32(shape.len() as i32) / T::from_f64(INDEPENDENT);
    let variance = |sigma_px: T| sigma_px.max(floor_px) * sigma_px.max(floor_px) * points;
    rows.fit(shape, variance(residuals.noise_px))?;
    rows.fit(shape, variance(rms(shape)))
}

/// Makes the rows of the fit.
struct Rows<'a, T> {
    case: &'a Case<'a, T>,
    curve: &'a Curve<T>,
    modes: &'a [[T; INTRINSICS]],
    b1: V3<T>,
    b2: V3<T>,
    /// Scale of the unknowns of the cone, 1/px, so that all columns are in pixels.
    cos_per_px: T,
}

impl<'a, T: Real> Rows<'a, T> {
    fn new(case: &'a Case<'a, T>, curve: &'a Curve<T>) -> Option<Self> {
        let (b1, b2) = basis(curve.axis());
        let modes = case.camera.intrinsic_modes()?;
        Some(Self { case, curve, modes, b1, b2, cos_per_px: case.fit.sums.cos_per_px() })
    }

    /// Returns the row of a point, in pixels.
    fn point(&self, place: &Place<T>) -> Option<[T; ROW]> {
        let (number, lane) = (usize::from(place.number) / LANES, usize::from(place.number) % LANES);
        let block = self.case.blocks.get(number)?;
        let (s, [m1, m2]) = (block.ray(lane), self.case.fit.mean);
        let [gu, gv] = block.gradient_at(lane, self.curve.axis());
        let per = T::one() / (gu * gu + gv * gv).max(T::from_f64(LEAST_GRADIENT2)).sqrt();
        let scale = per * self.cos_per_px;
        let mut row = [T::ZERO; ROW];
        [row[0], row[1], row[2]] = [(s.dot(&self.b1) - m1) * scale, (s.dot(&self.b2) - m2) * scale, -scale];
        let moved = self.case.camera.shift_by_intrinsics(&s).map(|[du, dv]| (gu * du + gv * dv) * per);
        for (cell, mode) in row.iter_mut().skip(CONE).zip(self.modes) {
            *cell = dot(mode, &moved);
        }
        row[LAST] = -self.curve.distance(block, lane);
        Some(row)
    }

    /// Returns the row of a value that is 0 ± `sigma_px`: a mode of the lens.
    fn mode(mode: usize, sigma_px: T) -> [T; ROW] {
        core::array::from_fn(|column| if column == CONE + mode { sigma_px } else { T::ZERO })
    }

    /// Returns the row of the expected half-angle.
    fn half_angle(&self, sigma_px: T) -> Option<[T; ROW]> {
        let (difference, variance) = half_angle_difference(self.case)?;
        let per = sigma_px / variance.max(T::from_f64(1e-30)).sqrt();
        let [m1, m2] = self.case.fit.mean;
        let mut row = [T::ZERO; ROW];
        [row[0], row[1], row[2]] = [m1, m2, T::one()].map(|x| x * self.cos_per_px * per);
        row[LAST] = -difference * per;
        Some(row)
    }

    /// Fits the residuals of the cone with the variance of a point in px², and stores what is left of them.
    fn fit(&self, shape: &mut Shape<T>, variance: T) -> Option<Bend<T>> {
        let mut triangle = Triangle::<T, ROW>::new();
        for place in shape.iter() {
            let root = place.w.sqrt();
            triangle.push(self.point(place)?.map(|x| x * root));
        }
        let sigma_px = variance.sqrt();
        (0..INTRINSICS).for_each(|mode| triangle.push(Self::mode(mode, sigma_px)));
        // The last element of the diagonal is the root of the least cost.
        let cost = |triangle: &Triangle<T, ROW>| triangle.rows()[LAST][LAST] * triangle.rows()[LAST][LAST];
        let without = cost(&triangle);
        let half_angle = self.half_angle(sigma_px);
        half_angle.iter().for_each(|row| triangle.push(*row));
        let x = triangle.solve_with_unit_last()?;
        for place in shape.iter_mut() {
            place.r = -dot(&self.point(place)?, &x);
        }
        let off = half_angle.map_or(T::ZERO, |row| dot(&row, &x) / sigma_px);
        let lens = x.iter().skip(CONE).take(INTRINSICS).fold(T::ZERO, |sum, a| sum + *a * *a);
        Some(Bend { chi2: lens + off * off, half_angle_chi2: (cost(&triangle) - without) / variance })
    }
}
