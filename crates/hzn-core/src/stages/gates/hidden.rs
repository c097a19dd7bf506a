//! Gate: a planet hides the Sun and the Moon behind it.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a Sun or Moon in the disc of a body that was found before in the same picture.
#[inline(always)]
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let is_hidden = case.expected.free && case.taken.iter().any(|limb| limb.hides(&case.fused.e));
    refuse_if(is_hidden, Verdict::NoSky)
}
