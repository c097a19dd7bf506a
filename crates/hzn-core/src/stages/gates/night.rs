//! Gate: at night no part of the limb is seen in sunlight. Airglow, aurora and the lights of cities have edges, too.

use super::case::{Case, refuse_if};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses every limb if the Sun lights none of it. The airglow has no Sun, so it is not refused here.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    // With `max_unlit` at 1 no gate asks for light.
    refuse_if(case.config.max_unlit < 1.0 && case.expected.is_night(), Verdict::Night)
}
