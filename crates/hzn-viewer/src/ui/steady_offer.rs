//! The area of a steady edge that the window offers to mask.

use crate::model::steady_edge::SteadyArea;

/// The area that is offered, and the state of the results that it follows from.
#[derive(Debug, Default)]
pub(super) struct SteadyOffer {
    pub(super) seen: Option<u64>,
    pub(super) area: Option<SteadyArea>,
}
