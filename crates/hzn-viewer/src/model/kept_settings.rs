//! The settings as they are in the file.

use std::time::Instant;

use super::Settings;

/// The settings as they were stored, and as they were seen last.
#[derive(Debug, Default)]
pub struct KeptSettings {
    /// The settings in the file.
    pub stored: Option<Settings>,
    /// Settings that differ from the file, and since when they have not changed.
    pub seen: Option<(Settings, Instant)>,
}
