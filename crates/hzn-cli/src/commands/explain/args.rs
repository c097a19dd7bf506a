//! The arguments of `hzn explain`.

use std::path::PathBuf;

use crate::setup::{InputArgs, SensorArgs};

/// Show what happens to one picture: what is kept, what is dropped, and why
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A picture; or a folder, video or MCAP together with --index; or a rig.toml, of which one epoch is explained
    pub(super) frame: PathBuf,
    /// Number of the picture in a sequence, or of the epoch of a rig, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) index: u64,
    #[command(flatten)]
    pub(super) sensor: SensorArgs,
    #[command(flatten)]
    pub(super) source: InputArgs,
    /// Draw the result over the picture, into this PNG; of a rig, the pictures of all heads side by side
    #[arg(long, value_name = "PNG")]
    pub(super) overlay: Option<PathBuf>,
    /// Draw the overlay as a pinhole would see it, without the distortion of the lens: the limb is a conic section, and
    /// is drawn beyond the picture, too. A direction down within 75 degrees of the optical axis is in view
    #[arg(long, requires = "overlay")]
    pub(super) undistorted: bool,
    /// Replace the PNG if it exists
    #[arg(long, requires = "overlay")]
    pub(super) force: bool,
}
