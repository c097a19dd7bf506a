//! Gate of Braun & Barf 2022, (25) to (28) and 7.3: the points lie on the conic section of the expected limb.

use super::case::{Case, refuse_if};
use crate::base::linalg::V3;
use crate::base::real::Real;
use crate::geometry::block::{Block, LANES};
use crate::geometry::frames::UnitVec3;
use crate::geometry::section::Section;
use crate::model::verdict::Verdict;

/// Refuses an edge whose points are too far from the section.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let Some(limit) = case.config.max_section_residual.filter(|_| cfg!(feature = "dlr")) else { return Ok(()) };
    let is_close = residual(case).is_some_and(|mean| mean <= T::from_f64(limit));
    refuse_if(!is_close, Verdict::Residuals)
}

/// Returns the residual (28) of the edge. It also decides which of several edges is the limb (7.3).
pub(super) fn residual<T: Real>(case: &Case<'_, T>) -> Option<T> {
    section_residual(&case.fit.e, case.expected_cos(), case.blocks)
}

/// Returns the mean square of the points' distances from the conic section of the cone (e, c), along its principal x
/// axis, in focal lengths squared. This is (28) as a mean, so that it does not grow with the edge. `None` if there is
/// no section or no point.
fn section_residual<T: Real>(e: &V3<T>, c: T, blocks: &[Block<T>]) -> Option<T> {
    let section = Section::new(&UnitVec3::assume_unit(*e), c)?;
    let (mut total, mut count) = (T::ZERO, T::ZERO);
    for b in blocks {
        for l in 0..LANES {
            if b.weight[l] > T::ZERO && b.s[2][l] > T::from_f64(0.03) {
                let d = section.distance([b.s[0][l] / b.s[2][l], b.s[1][l] / b.s[2][l]]);
                total += d * d;
                count += T::one();
            }
        }
    }
    (count > T::ZERO).then(|| total / count)
}
