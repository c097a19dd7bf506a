//! A lens as a file of another tool has it.

use hzn_core::camera::Config;

use super::omni::Omni;

/// A lens that a file has: one of hzn's, or one that only a fit turns into one of hzn's.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one value for a file")]
pub enum Loaded {
    /// A lens that hzn has.
    Lens(Config),
    /// Kalibr's `omni` with distortion.
    Omni(Omni),
}
