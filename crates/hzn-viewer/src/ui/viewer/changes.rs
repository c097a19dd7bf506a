//! The state of changes that are not saved.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::model::sheet::Sheet;
use crate::model::view::Point;
use crate::model::{Autosave, FileChange, Fingerprint, Session, Unsaved};
use crate::work::open::Request;

/// What the user wants to do, and what would lose the changes.
#[derive(Debug, Clone)]
pub(in crate::ui) enum Leave {
    /// Close the window.
    Window,
    /// Open another sequence.
    Sequence(Box<Request>),
    /// Use another sensor.toml.
    Sensor(Box<Session>),
    /// Make a new sensor.toml for the pictures.
    NewSensor,
}

/// A sensor.toml outside the folder that is open, which the user is asked about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::ui) struct Outside {
    /// The file that would be written.
    pub(in crate::ui) path: PathBuf,
    /// The folder of the pictures.
    pub(in crate::ui) folder: PathBuf,
    /// The file can be saved into this folder instead.
    pub(in crate::ui) has_choice: bool,
}

/// The state of changes that are not saved.
#[derive(Debug, Default)]
pub(in crate::ui) struct Changes {
    /// What waits for the answer to the question.
    pub(in crate::ui) question: Option<Leave>,
    /// What follows once the sensor.toml is saved under a path that the user is asked for.
    pub(in crate::ui) after_save: Option<Leave>,
    /// Another program changed the file that is to be saved, and the user is asked what to do.
    pub(in crate::ui) of_file: Option<FileChange>,
    /// The question about this file also shows how its text differs.
    pub(in crate::ui) shows_difference: bool,
    /// The file that is to be saved lies outside the folder of the pictures, and the user is asked about it.
    pub(in crate::ui) outside: Option<Outside>,
    /// The file that the user wants to be written while these pictures are open.
    pub(in crate::ui) agreed: Option<PathBuf>,
    /// The sensor was opened for other pictures, and the user has not said yet whether it is used for these.
    pub(in crate::ui) is_sensor_kept: bool,
    /// The window may close: there is nothing to lose, or the user answered.
    pub(in crate::ui) may_close: bool,
    /// Corners of a mask polygon that was not closed, and the text at that time.
    pub(in crate::ui) dropped_corners: Option<(Vec<Point>, Sheet)>,
    /// A session of a window that ended with changes, and its file.
    pub(in crate::ui) lost: Option<(Unsaved, PathBuf)>,
    pub(in crate::ui) autosave: Option<Autosave>,
    /// Version and text that were autosaved, and the time of the writing.
    pub(in crate::ui) autosaved: Option<((u64, Fingerprint), Instant)>,
}

impl Changes {
    /// Returns true while the user is asked about changes.
    pub(in crate::ui) fn is_asking(&self) -> bool {
        self.question.is_some() || self.of_file.is_some() || self.outside.is_some() || self.lost.is_some()
    }

    /// Prepares the autosaving into the folder of the settings file.
    pub(in crate::ui) fn new(store: Option<&Path>) -> Self {
        let folder = store.and_then(Path::parent);
        Self {
            lost: folder.and_then(Autosave::find_lost),
            autosave: folder.map(Autosave::in_folder),
            ..Self::default()
        }
    }
}
