//! One frame of the window: takes the input and the messages of the threads, then draws every panel.

use std::path::PathBuf;

use super::viewer::Viewer;
use super::{command, compare, dialogs, help, picture, plots, side, stages, theme, timeline, top};

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
        for command in command::pressed(&ctx) {
            self.run(command, &ctx);
        }
        let dropped: Vec<PathBuf> = ctx.input(|i| i.raw.dropped_files.iter().map(|f| f.path().to_owned()).collect());
        if !dropped.is_empty() {
            self.open_paths(dropped);
        }
        // The answer is computed while the panels are laid out.
        self.request_frame();
        top::show(self, ui);
        timeline::show(self, ui);
        if self.settings.plots {
            plots::show(self, ui);
        }
        side::show(self, ui);
        if self.settings.stages {
            stages::show(self, ui);
        }
        // A quick answer to a change in the panels is shown in this frame of the window.
        self.request_frame();
        self.wait(&ctx);
        compare::show(self, ui);
        picture::show(self, ui);
        dialogs::show(self, &ctx);
        help::show(self, &ctx);
        self.advance(&ctx);
        self.request_frame();
    }
}
