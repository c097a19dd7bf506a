//! Gate: all evidence together must make it probable enough that the edge is the limb.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::evidence::Evidence;
use crate::model::verdict::Verdict;

/// Returns the probability that the edge is the limb, if there is evidence. Refuses an edge whose probability is too
/// small.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>, evidence: Option<&Evidence<T>>) -> Result<Option<T>, Verdict> {
    let p_limb = evidence.map(|evidence| evidence.p_limb(T::from_f64(case.config.prior_odds)));
    let least = T::from_f64(case.config.min_p_limb);
    refuse_if(p_limb.is_some_and(|p| p < least), Verdict::Unlikely)?;
    Ok(p_limb)
}
