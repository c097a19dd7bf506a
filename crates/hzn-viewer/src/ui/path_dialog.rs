//! The dialog for paths: a line to type a path into, and a button that opens the dialog of the system.

use std::path::{Path, PathBuf};

use crossbeam_channel::{Receiver, bounded};

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
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Open => "Open",
            Self::SaveSensor => "Save sensor.toml as",
            Self::Compare => "Compare with",
            Self::Picture => "Save picture with overlays",
            Self::Video => "Save video with overlays",
            Self::Table => "Save results",
            Self::Rerun => "Run all pictures into a new recording",
        }
    }
    pub(super) fn hint(self) -> &'static str {
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
    /// Returns true if the path is written to.
    pub(super) fn writes(self) -> bool {
        !matches!(self, Self::Open | Self::Compare)
    }
}

/// The dialog while the user enters a path.
pub(super) struct PathDialog {
    pub(super) purpose: Purpose,
    /// The path as it is typed.
    pub(super) text: String,
    /// Receives the answer of the system's dialog while that is open.
    pub(super) browsing: Option<Receiver<Option<PathBuf>>>,
    /// The field of the path takes the focus when it is drawn next.
    pub(super) focus: bool,
}

impl PathDialog {
    pub(super) fn new(purpose: Purpose, start: &Path) -> Self {
        Self { purpose, text: start.display().to_string(), browsing: None, focus: true }
    }

    /// Opens the system's dialog on a separate thread, because it stays open as long as the user wants.
    pub(super) fn browse(&mut self, folder: bool) {
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

    /// Takes the answer of the system's dialog into the text. Returns true if there is a path that can be used at once:
    /// a path for writing is shown first, so that the user can check it.
    pub(super) fn take_answer(&mut self) -> bool {
        let Some(answer) = self.browsing.as_ref().and_then(|b| b.try_recv().ok()) else { return false };
        self.browsing = None;
        let Some(path) = answer else { return false };
        self.text = path.display().to_string();
        !self.purpose.writes()
    }
}
