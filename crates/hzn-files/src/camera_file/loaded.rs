//! A lens as a file of another tool has it.

use std::path::Path;

use hzn_core::camera::Config;

use super::foreign::Foreign;
use crate::Problem;

/// A lens that a file has: one of hzn's, or one that only a fit turns into one of hzn's.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one value for a file")]
pub enum Loaded {
    /// A lens that hzn has.
    Lens(Config),
    /// A lens that hzn does not have.
    Foreign(Foreign),
}

/// A camera file: its lens, and what is doubtful about it.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFile {
    /// The lens.
    pub lens: Loaded,
    /// Doubts about the calibration, which a user should see.
    pub warnings: Vec<Problem>,
}

/// What the user says about a camera file.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Choice<'a> {
    /// The name of the camera, in a file of several.
    pub camera: Option<&'a str>,
    /// Width and height of the picture in pixels, for a file that does not have them.
    pub size_px: Option<[u16; 2]>,
}

impl CameraFile {
    /// Returns the lens as one of hzn's, and the warnings; `path` is only used in messages.
    ///
    /// # Errors
    /// Hzn does not have the lens exactly.
    pub fn exact(self, path: &Path) -> Result<(Config, Vec<Problem>), Problem> {
        match self.lens {
            Loaded::Lens(config) => Ok((config, self.warnings)),
            Loaded::Foreign(lens) => {
                let what = format!(
                    "{} is a lens that hzn does not have. Fit one of hzn's to it:  hzn camera convert FILE --model {} \
                     -o sensor.toml  states the error",
                    lens.name(),
                    lens.closest().name()
                );
                Err(Problem::new(path, what))
            }
        }
    }
}
