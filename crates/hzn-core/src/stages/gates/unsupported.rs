//! Gate: a limb goes on where the edge of a mast or of a cloud ends, so edge points cover most of it.

use super::case::{Case, refuse_if};
use super::size::{lit_share, min_support};
use crate::base::real::Real;
use crate::model::verdict::Verdict;

/// Refuses a limb that goes on where the picture has no edge.
pub(super) fn refuse<T: Real>(case: &Case<'_, T>) -> Result<(), Verdict> {
    let least = T::from_f64(min_support(case.config, case.expected)) * T::from_f64(lit_share(case.expected));
    refuse_if(case.cover.share < least, Verdict::Unsupported)
}
