//! The dialog for paths: the dialog of the system, or a line to type a path into.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
    Plots,
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
            Self::Plots => "Save plots",
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
            Self::Plots => {
                ".svg, or .png with 2700 pixels across: the plots over time that are chosen below the picture"
            }
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
    /// The system's dialog is the only one: the field of the path is not drawn.
    pub(super) native: Option<Instant>,
}

/// Answer of the system's dialog.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// There is none yet, or the path is in the field and the user checks it.
    Open,
    /// The path can be used at once.
    Accepted,
    /// The user left the dialog.
    Cancelled,
}

/// Time below which no person leaves a dialog: the system has no dialog, so the path is typed.
const NO_DIALOG: Duration = Duration::from_millis(300);

impl PathDialog {
    pub(super) fn new(purpose: Purpose, start: &Path) -> Self {
        Self { purpose, text: start.display().to_string(), browsing: None, focus: true, native: None }
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

    /// Opens the system's dialog without the field of the path.
    pub(super) fn browse_only(&mut self, folder: bool) {
        self.native = Some(Instant::now());
        self.browse(folder);
    }

    /// Returns true while only the system's dialog is open.
    pub(super) fn is_hidden(&self) -> bool {
        self.native.is_some() && self.browsing.is_some()
    }

    /// Takes the answer of the system's dialog into the text. Without the system's dialog alone, a path for writing is
    /// shown first, so that the user can check it; the system's dialog itself asks before it replaces a file.
    pub(super) fn take_answer(&mut self) -> Answer {
        let Some(answer) = self.browsing.as_ref().and_then(|b| b.try_recv().ok()) else { return Answer::Open };
        self.browsing = None;
        let native = self.native.take();
        match (answer, native) {
            (Some(path), _) => {
                self.text = path.display().to_string();
                if native.is_some() || !self.purpose.writes() { Answer::Accepted } else { Answer::Open }
            }
            (None, Some(since)) if since.elapsed() > NO_DIALOG => Answer::Cancelled,
            (None, _) => Answer::Open,
        }
    }
}
