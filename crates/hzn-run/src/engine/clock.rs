//! The clock that measures the times of processing.

use std::time::Instant;

/// Returns the time. There is none in a browser, where the clock of the standard library panics; the times are then
/// zero.
pub(super) fn now() -> Option<Instant> {
    (!cfg!(all(target_family = "wasm", target_os = "unknown"))).then(Instant::now)
}
