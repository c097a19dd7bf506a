//! The gates that fit other shapes to the inliers, and the second chance of a limb that an uncertain lens bends.

use super::case::{Case, refuse_if};
use super::shape::Residuals;
use super::{any_cone, circle, lens, polyline, straight};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses an edge whose points fit another shape better than the cone. If the lens is uncertain, the cone is first
/// fitted together with the parameters of the lens; the half-angle must then be the expected one, too.
// The second fit is done only if its result matters, so that other edges do not pay for it.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>, residuals: &mut Residuals<'_, T>) -> Result<(), Verdict> {
    let [floor_px, chi] = [case.config.residual_floor_px, case.config.max_half_angle_sigma].map(T::from_f64);
    let exact = compare(case, residuals, floor_px);
    if exact.is_ok() && !lens::explains_half_angle(case) {
        return Ok(());
    }
    let second = lens::without_lens(case, residuals, |bend, bent| {
        if exact.is_err() {
            compare(case, &bent.with_bend(bend.chi2, floor_px, T::from_f64(lens::INDEPENDENT)), floor_px)?;
        }
        refuse_if(bend.half_angle_chi2 > chi * chi, Verdict::HalfAngle)
    });
    second.unwrap_or(exact)
}

#[inline(never)]
fn compare<T: Real>(case: &Case<'_, T>, residuals: &Residuals<'_, T>, floor_px: T) -> Result<(), Verdict> {
    straight::refuse(residuals)?;
    any_cone::refuse(case, residuals)?;
    circle::refuse(case, residuals, floor_px)?;
    polyline::refuse(residuals)
}
