//! The dialog for paths: a line to type a path into, and a button that opens the dialog of the system.

use std::path::{Path, PathBuf};

use crossbeam_channel::{Receiver, bounded};
use egui::{Key, RichText};

use super::viewer::Viewer;
use crate::model::sheet::Sheet;

/// Purpose of the path that the user enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Purpose {
    Open,
    SaveSensor,
    Compare,
    Picture,
    Video,
    Table,
    Rerun,
}

impl Purpose {
    fn title(self) -> &'static str {
        match self {
            Self::Open => "Open",
            Self::SaveSensor => "Save sensor.toml as",
            Self::Compare => "Compare with",
            Self::Picture => "Save picture with overlays",
            Self::Video => "Save video with overlays",
            Self::Table => "Save results",
            Self::Rerun => "Run all frames into a new recording",
        }
    }
    fn hint(self) -> &'static str {
        match self {
            Self::Open => "A recording (.mcap), a folder of pictures, a picture, a video, or a sensor.toml",
            Self::SaveSensor => "Comments are kept",
            Self::Compare => "Another sensor.toml for the same camera",
            Self::Picture => "PNG in the picture's own size",
            Self::Video => "The ending sets the format: .mp4, .mkv, .webm; needs ffmpeg on PATH",
            Self::Table => ".csv or .jsonl, with the results that are shown",
            Self::Rerun => ".mcap with the current parameters",
        }
    }
    fn writes(self) -> bool {
        !matches!(self, Self::Open | Self::Compare)
    }
}

/// The dialog while the user enters a path.
pub(super) struct Asking {
    purpose: Purpose,
    text: String,
    /// Receives the answer of the system's dialog while that is open.
    browsing: Option<Receiver<Option<PathBuf>>>,
    focus: bool,
}

impl Asking {
    pub(super) fn new(purpose: Purpose, start: &Path) -> Self {
        Self { purpose, text: start.display().to_string(), browsing: None, focus: true }
    }

    /// Opens the system's dialog on a separate thread, because it stays open as long as the user wants.
    fn browse(&mut self, folder: bool) {
        let (send, receive) = bounded(1);
        let (purpose, text) = (self.purpose, PathBuf::from(&self.text));
        std::thread::spawn(move || {
            let start = if text.is_dir() { Some(text.as_path()) } else { text.parent() };
            let mut dialog = rfd::FileDialog::new().set_title(purpose.title());
            if let Some(start) = start.filter(|p| p.is_dir()) {
                dialog = dialog.set_directory(start);
            }
            let picked = match (purpose.writes(), folder) {
                (true, _) => {
                    let name = text.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                    dialog.set_file_name(name).save_file()
                }
                (false, true) => dialog.pick_folder(),
                (false, false) => dialog.pick_file(),
            };
            let _ = send.send(picked);
        });
        self.browsing = Some(receive);
    }
}

/// Takes the answer of the system's dialog.
pub(super) fn poll(viewer: &mut Viewer) {
    let Some(asking) = &mut viewer.asking else { return };
    let Some(answer) = asking.browsing.as_ref().and_then(|b| b.try_recv().ok()) else { return };
    asking.browsing = None;
    if let Some(path) = answer {
        asking.text = path.display().to_string();
        // A file that is chosen for reading is opened at once. A path for writing is shown first, so that the user can
        // check it.
        if !asking.purpose.writes() {
            accept(viewer);
        }
    }
}

pub(super) fn show(viewer: &mut Viewer, ctx: &egui::Context) {
    diff(viewer, ctx);
    let Some(asking) = &mut viewer.asking else { return };
    let (mut accepted, mut closed) = (false, false);
    let response = egui::Modal::new(egui::Id::unique("asking")).show(ctx, |ui| {
        ui.set_width(560.0);
        ui.heading(asking.purpose.title());
        ui.weak(asking.purpose.hint());
        ui.add_space(6.0);
        let label = ui.label("Path");
        let field =
            ui.add(egui::TextEdit::singleline(&mut asking.text).desired_width(f32::INFINITY)).labelled_by(label.id);
        if std::mem::take(&mut asking.focus) {
            field.request_focus();
        }
        accepted |= field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
        let exists = Path::new(asking.text.trim()).exists();
        if asking.purpose.writes() && exists && !Path::new(asking.text.trim()).is_dir() {
            ui.colored_label(ui.visuals().warn_fg_color, "A file of this name exists; it would be replaced.");
        } else {
            ui.label("");
        }
        ui.horizontal(|ui| {
            accepted |= ui.button(if asking.purpose.writes() { "Write" } else { "Open this" }).clicked();
            closed |= ui.button("Cancel").clicked();
            ui.separator();
            let idle = asking.browsing.is_none();
            if ui.add_enabled(idle, egui::Button::new("Browse…")).clicked() {
                asking.browse(false);
            }
            if asking.purpose == Purpose::Open && ui.add_enabled(idle, egui::Button::new("Browse folders…")).clicked()
            {
                asking.browse(true);
            }
        });
    });
    if asking.browsing.is_some() {
        ctx.request_repaint_after(std::time::Duration::from_millis(50));
    }
    if accepted {
        accept(viewer);
    } else if closed || response.should_close() {
        viewer.asking = None;
    }
}

fn accept(viewer: &mut Viewer) {
    let Some(asking) = viewer.asking.take() else { return };
    let path = PathBuf::from(asking.text.trim());
    if path.as_os_str().is_empty() {
        return;
    }
    match asking.purpose {
        Purpose::Open => viewer.open_paths(vec![path]),
        Purpose::SaveSensor => viewer.save_to(&path),
        Purpose::Compare => viewer.compare_with_file(&path),
        Purpose::Picture => viewer.export_picture(path),
        Purpose::Video => viewer.export_video(path),
        Purpose::Table => viewer.export_table(path),
        Purpose::Rerun => viewer.process_all(Some(path)),
    }
}

/// Shows the differences from the saved file.
fn diff(viewer: &mut Viewer, ctx: &egui::Context) {
    if !viewer.showing_diff {
        return;
    }
    let Some(session) = &viewer.session else { return };
    let lines = Sheet::diff(session.sheet(), session.saved());
    let mut open = true;
    egui::Window::new("Changes against the file").open(&mut open).default_width(560.0).show(ctx, |ui| {
        if lines.is_empty() {
            ui.label("Nothing has changed.");
        }
        egui::ScrollArea::vertical().max_height(400.0).show(ui, |ui| {
            for line in &lines {
                let colour = if line.starts_with('+') { super::theme::INLIER } else { super::theme::REJECTED };
                ui.add(egui::Label::new(RichText::new(line).monospace().color(colour)).wrap());
            }
        });
    });
    viewer.showing_diff = open;
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::model::Settings;

    /// Returns a viewer in which the system's dialog has given this answer.
    fn browsed(purpose: Purpose, answer: Option<PathBuf>) -> Viewer {
        let mut viewer = Viewer::new(Settings::default(), None, Arc::new(|| {}));
        let (send, receive) = bounded(1);
        viewer.asking = Some(Asking { browsing: Some(receive), ..Asking::new(purpose, Path::new("/typed")) });
        poll(&mut viewer);
        assert!(viewer.asking.as_ref().is_some_and(|a| a.browsing.is_some()), "the user takes time");
        send.send(answer).unwrap();
        poll(&mut viewer);
        viewer
    }

    #[test]
    fn what_is_picked_is_opened_and_a_name_to_write_is_looked_at_first() {
        let picked = PathBuf::from("/picked/flight.mcap");
        let opened = browsed(Purpose::Open, Some(picked.clone()));
        assert!(opened.asking.is_none() && opened.settings.recent == [picked.clone()]);
        let named = browsed(Purpose::Table, Some(picked.clone()));
        assert!(named.asking.is_some_and(|a| a.text == "/picked/flight.mcap" && a.browsing.is_none()));
        let left = browsed(Purpose::Open, None);
        assert!(left.asking.is_some_and(|a| a.text == "/typed") && left.settings.recent.is_empty());
    }
}
