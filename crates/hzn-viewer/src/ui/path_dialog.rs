//! The dialog for paths: the dialog of the system, or a line to type a path into.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, bounded};

use crate::model::autosave::absolute;

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
    Boards,
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
            Self::Boards => "Pictures of the board",
        }
    }
    pub(super) fn hint(self) -> &'static str {
        match self {
            Self::Open => "A recording (.mcap), a folder of pictures, a picture, a video, or a sensor.toml",
            Self::SaveSensor => "Comments are kept",
            Self::Compare => "Another sensor.toml for the same camera",
            Self::Picture => {
                "PNG: the picture in its own pixels, from the top left corner, and a caption below it, which makes \
                 the file higher"
            }
            Self::Video => "The ending sets the format: .mp4, .mkv, .webm, .mov or .avi; needs ffmpeg on PATH",
            Self::Table => ".csv or .jsonl, with the results that are shown",
            Self::Plots => {
                ".svg, or .png with 2700 pixels across: the plots over time that are chosen below the picture"
            }
            Self::Rerun => ".mcap with the current parameters",
            Self::Boards => "A folder with pictures of a chessboard",
        }
    }
    /// Returns true if the path is written to.
    pub(super) fn writes(self) -> bool {
        !matches!(self, Self::Open | Self::Compare | Self::Boards)
    }
    /// Returns the endings that the file may have; none if every file is possible.
    fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Open | Self::Boards => &[],
            Self::SaveSensor | Self::Compare => &["toml"],
            Self::Picture => &["png"],
            Self::Video => &["mp4", "mkv", "webm", "mov", "avi"],
            Self::Table => &["csv", "jsonl"],
            Self::Plots => &["svg", "png"],
            Self::Rerun => &["mcap"],
        }
    }
    /// Returns the reason why no file of this path may be written: its ending belongs to another kind of file, or the
    /// path is a folder.
    pub(super) fn refuse(self, path: &Path) -> Option<String> {
        if !self.endings().contains(&hzn_run::source::ending(path).as_str()) {
            let endings: Vec<String> = self.endings().iter().map(|e| format!(".{e}")).collect();
            return Some(format!("The file name must end in {}.", endings.join(" or ")));
        }
        path.is_dir().then(|| "This is a folder; add the name of a file.".to_owned())
    }
}

/// The dialog while the user enters a path.
pub(super) struct PathDialog {
    pub(super) purpose: Purpose,
    /// The path as it is typed.
    pub(super) text: String,
    /// Reason why the path was refused, until it is changed.
    pub(super) refused: Option<String>,
    /// The user is asked whether the file of this path is replaced.
    pub(super) replaces: bool,
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
        let text = start.display().to_string();
        Self { purpose, text, refused: None, replaces: false, browsing: None, focus: true, native: None }
    }

    /// Returns the path that is typed. A path to write is absolute, so that messages show where the file is.
    pub(super) fn path(&self) -> PathBuf {
        let typed = Path::new(self.text.trim());
        if self.purpose.writes() { absolute(typed) } else { typed.to_owned() }
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
            if !purpose.endings().is_empty() {
                dialog = dialog.add_filter(purpose.title(), purpose.endings());
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
    /// shown first, so that the user can check it.
    pub(super) fn take_answer(&mut self) -> Answer {
        let Some(answer) = self.browsing.as_ref().and_then(|b| b.try_recv().ok()) else { return Answer::Open };
        self.browsing = None;
        let native = self.native.take();
        match (answer, native) {
            (Some(path), _) => {
                (self.text, self.refused) = (path.display().to_string(), None);
                if native.is_some() || !self.purpose.writes() { Answer::Accepted } else { Answer::Open }
            }
            (None, Some(since)) if since.elapsed() > NO_DIALOG => Answer::Cancelled,
            (None, _) => Answer::Open,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_file_has_its_own_endings() {
        let endings = ["toml", "png", "mp4", "mkv", "webm", "mov", "avi", "csv", "jsonl", "svg", "mcap", "bak"];
        let allowed = |purpose: Purpose| {
            let allows = |ending: &&str| purpose.refuse(Path::new(&format!("/none/a.{ending}"))).is_none();
            endings.into_iter().filter(allows).collect::<Vec<_>>()
        };
        assert_eq!(allowed(Purpose::SaveSensor), ["toml"]);
        assert_eq!(allowed(Purpose::Picture), ["png"]);
        assert_eq!(allowed(Purpose::Video), ["mp4", "mkv", "webm", "mov", "avi"]);
        assert_eq!(allowed(Purpose::Table), ["csv", "jsonl"]);
        assert_eq!(allowed(Purpose::Plots), ["png", "svg"]);
        assert_eq!(allowed(Purpose::Rerun), ["mcap"]);
        let refuse = |name: &str| Purpose::SaveSensor.refuse(Path::new(name));
        assert_eq!(refuse("/none/A.TOML"), None);
        for name in ["", "/none/a", "/none/.toml", "/none/a.toml.bak", "/none/a.toml.part"] {
            assert_eq!(refuse(name).as_deref(), Some("The file name must end in .toml."), "{name}");
        }
        let folder = tempfile::Builder::new().suffix(".toml").tempdir().unwrap();
        assert!(Purpose::SaveSensor.refuse(folder.path()).is_some_and(|why| why.contains("folder")));
    }
}
