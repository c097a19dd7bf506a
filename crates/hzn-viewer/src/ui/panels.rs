//! Which panels are shown, by the size of the window.

use egui::Vec2;

use super::plot_cursor::PlotCursor;
use super::space_eye::SpaceEye;
use crate::model::Settings;

/// Width in points below which the stages lie over the picture.
const NARROW: f32 = 1000.0;
/// Height in points below which the plots are hidden until the user shows them.
const LOW: f32 = 640.0;
/// Width in points below which the column with the answer is hidden until the user shows it.
const TINY: f32 = 640.0;

/// A panel that can be hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Panel {
    Answer,
    Plots,
    Stages,
}

/// The panels of a small window. A large window uses the settings, which are kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Panels {
    size: Vec2,
    answer: bool,
    plots: bool,
    stages: bool,
    /// Number of times that the panel of the plots was made higher for a new plot.
    pub(super) grown: u32,
    /// The user has dragged the border of the plots.
    pub(super) plots_dragged: bool,
    /// The line in the plots that marks the shown picture.
    pub(super) cursor: PlotCursor,
    /// The view from space, while it is open.
    pub(super) space: Option<SpaceEye>,
}

impl Default for Panels {
    fn default() -> Self {
        Self {
            size: Vec2::INFINITY,
            answer: false,
            plots: false,
            stages: false,
            grown: 0,
            plots_dragged: false,
            cursor: PlotCursor::default(),
            space: None,
        }
    }
}

impl Panels {
    /// Takes the size of the window in points.
    pub(super) fn set_size(&mut self, size: Vec2) {
        self.size = size;
    }
    /// Returns true if the stages lie over the picture.
    pub(super) fn stages_float(&self) -> bool {
        self.size.x < NARROW
    }
    fn is_small(&self, panel: Panel) -> bool {
        match panel {
            Panel::Answer => self.size.x < TINY,
            Panel::Plots => self.size.y < LOW,
            Panel::Stages => self.stages_float(),
        }
    }
    /// Returns true if a panel is shown.
    pub(super) fn shows(&self, panel: Panel, settings: &Settings) -> bool {
        match (panel, self.is_small(panel)) {
            (Panel::Answer, true) => self.answer,
            (Panel::Plots, true) => self.plots,
            (Panel::Stages, true) => self.stages,
            (Panel::Answer, false) => settings.answer,
            (Panel::Plots, false) => settings.plots,
            (Panel::Stages, false) => settings.stages,
        }
    }
    /// Shows or hides a panel.
    pub(super) fn toggle(&mut self, panel: Panel, settings: &mut Settings) {
        let shown = match (panel, self.is_small(panel)) {
            (Panel::Answer, true) => &mut self.answer,
            (Panel::Plots, true) => &mut self.plots,
            (Panel::Stages, true) => &mut self.stages,
            (Panel::Answer, false) => &mut settings.answer,
            (Panel::Plots, false) => &mut settings.plots,
            (Panel::Stages, false) => &mut settings.stages,
        };
        *shown = !*shown;
    }
    /// Shows or hides the view from space.
    pub(super) fn toggle_space(&mut self) {
        self.space = if self.space.is_none() { Some(SpaceEye::default()) } else { None };
    }
    /// Shows a panel.
    pub(super) fn open(&mut self, panel: Panel, settings: &mut Settings) {
        if !self.shows(panel, settings) {
            self.toggle(panel, settings);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_window_begins_with_the_picture_and_a_large_one_keeps_its_settings() {
        let (mut panels, mut settings) = (Panels::default(), Settings::default());
        panels.set_size(Vec2::new(1440.0, 900.0));
        assert!([Panel::Answer, Panel::Plots, Panel::Stages].iter().all(|p| panels.shows(*p, &settings)));
        panels.set_size(Vec2::new(720.0, 480.0));
        assert!(panels.shows(Panel::Answer, &settings) && panels.stages_float());
        assert!(!panels.shows(Panel::Plots, &settings) && !panels.shows(Panel::Stages, &settings));
        panels.open(Panel::Stages, &mut settings);
        panels.open(Panel::Stages, &mut settings);
        assert!(panels.shows(Panel::Stages, &settings));
        panels.toggle(Panel::Plots, &mut settings);
        panels.set_size(Vec2::new(1440.0, 900.0));
        panels.toggle(Panel::Plots, &mut settings);
        assert_eq!(settings, Settings { plots: false, ..Settings::default() });
    }
}
