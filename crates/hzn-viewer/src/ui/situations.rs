//! Situations of the window for screenshots: what a user would reach with some clicks.

use clap::ValueEnum;

use super::command::Command;
use super::panels::Panel;
use super::path_dialog::{PathDialog, Purpose};
use super::viewer::Viewer;
use crate::model::navigation::{INNOVATIONS, NAV_QUANTITIES};
use crate::model::settings::Layer;
use crate::model::{FileChange, Session};
use crate::work::calibration::Kind;

/// A situation of the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Situation {
    /// The stages are shown, also in a narrow window.
    Stages,
    /// The sequence is compared with another preset.
    Compare,
    /// The parameters of the threshold are unfolded.
    Parameters,
    /// The form for a first sensor.toml is open.
    Wizard,
    /// The results of `hzn fuse` are plotted.
    Navigation,
    /// The image circle is being dragged.
    Circle,
    /// Latitudes and longitudes, and the local vertical, are drawn.
    Ground,
    /// The palette is open.
    Palette,
    /// The window asks before it replaces a sensor.toml.
    Replace,
    /// Another program changed the sensor.toml that is saved.
    Changed,
    /// The view from space is open.
    Space,
    /// The sources of sigma, and errors over their sigmas, are plotted.
    Sigmas,
    /// The form about the board whose pictures calibrate the lens is open.
    Board,
    /// The limb height and the noise of the edges were measured on the flight.
    Calibrated,
}

impl Viewer {
    /// Brings the window into a situation.
    pub fn arrange(&mut self, situation: Situation, ctx: &egui::Context) {
        match situation {
            Situation::Stages => self.panels.open(Panel::Stages, &mut self.settings),
            Situation::Compare => self.run(Command::Compare, ctx),
            Situation::Parameters => {
                self.panels.open(Panel::Stages, &mut self.settings);
                self.focus_key = Some("threshold.scale");
            }
            Situation::Wizard => self.open_wizard(),
            Situation::Navigation => {
                let names = NAV_QUANTITIES.iter().take(2).map(|q| q.name).chain([INNOVATIONS]);
                self.settings.plotted = names.map(str::to_owned).collect();
                self.panels.open(Panel::Plots, &mut self.settings);
            }
            Situation::Palette => {
                self.run(Command::Palette, ctx);
                self.palette.iter_mut().for_each(|palette| palette.text = "thresh".into());
            }
            Situation::Circle => self.run(Command::Circle, ctx),
            Situation::Ground => {
                self.settings.show(Layer::Grid, true);
                self.settings.show(Layer::Vertical, true);
            }
            Situation::Replace => {
                let dialog = |s: &Session| PathDialog::new(Purpose::SaveSensor, s.home());
                self.path_dialog = self.session.as_ref().map(dialog);
                self.accept_path();
            }
            Situation::Space => self.run(Command::Space, ctx),
            Situation::Sigmas => {
                self.settings.plotted = ["σ budget", "Error over σ (truth)"].map(str::to_owned).to_vec();
                self.panels.open(Panel::Plots, &mut self.settings);
            }
            Situation::Board => self.ask_board(),
            Situation::Calibrated => self.calibrate(Kind::Noise),
            Situation::Changed => self.changes.of_file = Some(FileChange::Changed),
        }
    }
}
