//! The sensor.toml that belongs to pictures.

use std::path::{Path, PathBuf};

use crate::model::Fingerprint;

/// A sensor.toml.
#[derive(Debug, Clone)]
pub struct SensorText {
    /// Text of the file, with what the pictures say.
    pub text: String,
    /// Text of the file as it was read.
    pub on_file: String,
    /// Path of the file. A text from a recording has the path at which it would be saved.
    pub home: PathBuf,
    /// Fingerprint of the file; `None` if the text comes from a recording.
    pub as_read: Option<Fingerprint>,
}

impl SensorText {
    /// Returns the text of a file, or of a recording that is saved to `home` at most.
    pub fn new(text: String, home: &Path, is_file: bool) -> Self {
        let as_read = is_file.then(|| Fingerprint::of(&text));
        Self { on_file: text.clone(), text, home: home.to_owned(), as_read }
    }
}
