//! The line in the plots that marks the shown picture. It can be dragged.

use egui::Ui;

/// Distance from the line in points within which a press takes it.
const REACH: f32 = 6.0;

/// Where the line is, and whether it is dragged.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct PlotCursor {
    /// Its place on the screen; `None` if it is not in view.
    pub(super) x: Option<f32>,
    /// The user drags it.
    pub(super) is_dragged: bool,
}

impl PlotCursor {
    /// Notices that the button is pressed at the line, or released.
    pub(super) fn notice(&mut self, ui: &Ui) {
        let (is_down, pressed) = ui.input(|i| {
            let pressed = i.pointer.press_origin().filter(|_| i.pointer.primary_pressed());
            (i.pointer.primary_down(), pressed)
        });
        self.is_dragged = is_down && (self.is_dragged || pressed.is_some_and(|at| self.is_near(at.x)));
    }
    /// Returns true if a place on the screen is near enough to take the line.
    pub(super) fn is_near(&self, x: f32) -> bool {
        self.x.is_some_and(|cursor| (x - cursor).abs() <= REACH)
    }
}
