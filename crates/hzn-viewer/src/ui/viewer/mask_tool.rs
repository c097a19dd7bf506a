//! The tools that change the mask and the image circle with the mouse, and undo across them.

use super::Viewer;
use crate::model::{CircleEdit, MaskEdit, Session};

impl Viewer {
    /// Starts or ends the drawing of the mask.
    pub(in crate::ui) fn toggle_mask(&mut self) {
        let starts = self.mask.is_none() && self.session.is_some();
        self.set_polygon_aside();
        self.mask = starts.then(MaskEdit::default);
        self.circle = None;
    }

    /// Starts or ends the dragging of the image circle, which is a circle only in the camera's own picture.
    pub(in crate::ui) fn toggle_circle(&mut self) {
        let starts = self.circle.is_none() && self.session.as_ref().is_some_and(|s| s.config().is_some());
        self.circle = starts.then(CircleEdit::default);
        self.set_polygon_aside();
        self.mask = None;
        self.settings.undistorted &= !starts;
    }

    /// Ends the polygon that is being drawn, or else the tool.
    pub(in crate::ui) fn leave_tool(&mut self) {
        if !self.set_polygon_aside() {
            (self.mask, self.circle) = (None, None);
        }
    }

    /// Keeps the corners of a polygon that is not closed, so that undo brings them back. Returns false if there are
    /// none.
    fn set_polygon_aside(&mut self) -> bool {
        let (Some(tool), Some(session)) = (&mut self.mask, &self.session) else { return false };
        let corners = tool.take_open();
        let has_corners = !corners.is_empty();
        if has_corners {
            self.changes.dropped_corners = Some((corners, session.sheet().clone()));
            self.add_note("The mask area was not closed. Undo brings its corners back.");
        }
        has_corners
    }

    /// Returns true if there is a step to undo.
    pub(in crate::ui) fn can_undo(&self) -> bool {
        let has_corners = self.mask.as_ref().is_some_and(|tool| !tool.open.is_empty());
        has_corners || self.has_dropped_corners() || self.session.as_ref().is_some_and(Session::can_undo)
    }

    /// Returns true if there is a step to make again.
    pub(in crate::ui) fn can_redo(&self) -> bool {
        self.mask.as_ref().is_some_and(MaskEdit::can_redo) || self.session.as_ref().is_some_and(Session::can_redo)
    }

    /// Returns true if the corners of a polygon that was not closed are the last change.
    fn has_dropped_corners(&self) -> bool {
        let dropped = self.changes.dropped_corners.as_ref();
        dropped.zip(self.session.as_ref()).is_some_and(|((_, sheet), session)| sheet == session.sheet())
    }

    /// Undoes the last step: a corner that was clicked, a polygon that was not closed, or a change of the sensor.toml.
    pub(super) fn undo(&mut self) {
        if self.mask.as_mut().is_some_and(MaskEdit::undo_corner) {
            return;
        }
        if self.has_dropped_corners()
            && let Some((corners, _)) = self.changes.dropped_corners.take()
        {
            self.circle = None;
            self.mask.get_or_insert_default().open = corners;
            return;
        }
        self.session.iter_mut().for_each(Session::undo);
    }

    /// Makes the step again that was undone last.
    pub(super) fn redo(&mut self) {
        if !self.mask.as_mut().is_some_and(MaskEdit::redo_corner) {
            self.session.iter_mut().for_each(Session::redo);
        }
    }
}
