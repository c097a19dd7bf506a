//! Calibration of a camera from pictures of a chessboard.
//!
//! ```text
//! corners ─► guess: one focal length, poses ─► robust adjustment, stage by stage ─► without outliers ─► Calibrated
//! ```

mod bow;
mod calibrate;
mod fit;
mod layout;
mod mount;
mod pictures;
mod pose;
#[cfg(test)]
mod tests;
mod write;

pub use crate::calibrated::{Bow, Calibrated, Dropped, Refusal, Residual, ViewResult, Warning};
pub use calibrate::{calibrate, calibrate_planar};
pub use layout::{Board, Corner, PlanarPoint, PlanarView, View};
pub use mount::{BoardMount, MIN_TILTS, MountRefusal, Tilt, mount};
pub use pictures::{NoPictures, Pictures, Searched};
pub use write::into_sensor_toml;
