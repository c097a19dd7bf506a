//! One frame of the window: takes the input and the messages of the threads, then draws every panel.

use std::path::PathBuf;

use super::command::Command;
use super::panels::Panel;
use super::viewer::Viewer;
use super::{
    calibration, command, compare, dialogs, help, kept_sensor, live, number, palette, picture, plots, questions, rig,
    side, space_view, stages, study, theme, timeline, toasts, top, wizard,
};

impl Viewer {
    /// Draws the window.
    pub fn show(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        if !self.styled {
            theme::apply(&ctx);
            self.styled = true;
        }
        ctx.set_theme(if self.settings.dark { egui::Theme::Dark } else { egui::Theme::Light });
        self.poll(&ctx);
        self.watch_close(&ctx);
        for command in command::pressed(&ctx) {
            // While a question is open, only the question gets keys.
            if self.takes(command, &ctx) {
                self.run(command, &ctx);
            }
        }
        let dropped: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if !dropped.is_empty() {
            self.open_paths(dropped);
        }
        if dialogs::escape(&ctx) {
            self.leave_tool();
        }
        let is_next = self.advance(&ctx);
        // The answer is computed while the panels are laid out.
        self.request_frame();
        if is_next {
            self.wait_for_next(&ctx);
        }
        self.panels.set_size(ctx.content_rect().size());
        top::show(self, ui);
        if self.live.is_some() || self.rig.is_some() {
            return self.show_other(ui);
        }
        // The welcome page has nothing to play, to plot or to tune.
        let is_open = !self.sequence.title.is_empty();
        if is_open {
            self.show_panels(ui);
        }
        // A quick answer to a change in the panels is shown in this frame of the window.
        self.request_frame();
        self.wait(&ctx);
        kept_sensor::show(self, ui);
        compare::show(self, ui);
        let rect = picture::show(self, ui);
        if is_open && self.panels.stages_float() && self.panels.shows(Panel::Stages, &self.settings) {
            stages::show_over(self, &ctx, rect);
        }
        self.show_windows(&ctx, rect);
        self.drive_background(&ctx);
        self.autosave(&ctx);
        self.keep_settings(&ctx);
        if let Some(text) = number::take_unread(&ctx) {
            self.add_problem(format!("“{text}” is no number, so the value stays as it was."));
        }
        self.close_if_due(&ctx);
        self.focus_ring.draw(&ctx);
        self.request_frame();
    }

    /// Draws what lies over the picture.
    fn show_windows(&mut self, ctx: &egui::Context, rect: egui::Rect) {
        toasts::show(self, ctx, rect);
        dialogs::show(self, ctx, rect);
        questions::show(self, ctx);
        wizard::show(self, ctx);
        study::show(self, ctx, rect);
        space_view::show(self, ctx, rect);
        calibration::show(self, ctx, rect);
        help::show(self, ctx);
        palette::show(self, ctx);
    }

    /// Returns true if a key may start a command: no question, form or dialog is open. The key of the help also closes
    /// the help.
    fn takes(&self, command: Command, ctx: &egui::Context) -> bool {
        let asks = self.changes.is_asking() || self.path_dialog.is_some() || self.wizard.is_some();
        let is_covered = ctx.memory(|m| m.top_modal_layer().is_some());
        !asks && (!is_covered || (self.showing_help && command == Command::Help))
    }

    /// Draws the window on a flight computer or on a rig, which have no sequence of pictures.
    fn show_other(&mut self, ui: &mut egui::Ui) {
        let ctx = ui.ctx().clone();
        let rect = ui.available_rect_before_wrap();
        live::show(self, ui);
        rig::show(self, ui);
        toasts::show(self, &ctx, rect);
        dialogs::show(self, &ctx, rect);
        help::show(self, &ctx);
        palette::show(self, &ctx);
        self.keep_settings(&ctx);
        self.close_if_due(&ctx);
        self.focus_ring.draw(&ctx);
    }

    /// Draws the panels around the picture.
    fn show_panels(&mut self, ui: &mut egui::Ui) {
        timeline::show(self, ui);
        if self.panels.shows(Panel::Plots, &self.settings) {
            plots::show(self, ui);
        }
        if self.panels.shows(Panel::Answer, &self.settings) {
            side::show(self, ui);
        }
        if !self.panels.stages_float() && self.panels.shows(Panel::Stages, &self.settings) {
            stages::show(self, ui);
        }
    }
}
