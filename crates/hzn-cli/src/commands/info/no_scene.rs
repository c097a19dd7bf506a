//! Stands for `scene` where the simulator is left out, as for a flight computer: a scene is known, but not read.

use std::path::Path;

use super::facts::Facts;
use crate::exit::{Stop, failed};

/// Says that this program has no simulator.
pub(super) fn describe(_: &str, file: &Path) -> Result<Facts, Stop> {
    Err(failed(format!(
        "{}: this is a scene, and this hzn was built without the feature `simulator`, so it cannot be read; the whole \
         command is built by cargo install --locked --path crates/hzn-cli",
        file.display()
    )))
}
