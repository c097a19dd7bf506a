//! The start of a flight, of one camera or of a rig.

use crate::error::Error;
use crate::flight::{self, Settings, Source, Summary};
use crate::rig;
use crate::signals::Lines;
use crate::tell::Tell;

/// Flies until the pictures end or a signal stops the program.
///
/// In the mode shut-down the log is closed and the loop waits: power may be cut, and only another start ends the mode.
///
/// # Errors
/// The flight cannot start: no parameters, no camera, a line or a folder that cannot be used.
pub fn fly(settings: &Settings, tell: Tell) -> Result<Summary, Error> {
    // First of all, because the other threads inherit it.
    let lines = Lines::listen().map_err(|e| Error::failed(format!("signals: {e}")))?;
    match &settings.source {
        Source::Rig(path) => rig::fly(path, settings, lines, &tell),
        Source::Stdin | Source::Device(_) => flight::fly(settings, lines, tell),
    }
}
