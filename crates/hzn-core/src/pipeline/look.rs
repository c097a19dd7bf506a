//! What every step from a picture to its report works on.

use super::workspace::Lists;
use crate::model::body::Expected;
use crate::model::found_limb::FoundLimb;
use crate::model::report::Report;

/// One look at a picture: what is searched, with which lists, and the report that the search fills.
pub(super) struct Look<'a, T, P, O> {
    pub(super) lists: Lists<'a, T>,
    pub(super) picture: &'a P,
    /// The body that is searched for.
    pub(super) expected: &'a Expected<T>,
    /// Limbs of other bodies that were found before in this picture.
    pub(super) taken: &'a [FoundLimb<T>],
    pub(super) observer: &'a O,
    pub(super) report: &'a mut Report<T>,
}

impl<T, P, O> Look<'_, T, P, O> {
    /// Borrows the same for one of several looks.
    pub(super) fn reborrow(&mut self) -> Look<'_, T, P, O> {
        Look { lists: self.lists.reborrow(), report: self.report, ..*self }
    }
}
