//! Gate: the sky is beyond a limb, except where an object is in front of it.

use super::case::{Case, refuse_if};
use super::sky::Sky;
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a limb beyond which too much of the picture is lit.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>, sky: &Sky<T>) -> Result<(), Verdict> {
    refuse_if(sky.lit > T::from_f64(case.config.max_lit_sky), Verdict::NoSky)
}
