//! Reads and writes the files that describe a horizon sensor.
//!
//! | file | read by | gives |
//! |---|---|---|
//! | `sensor.toml` | [`sensor::load`] | [`hzn_core::Config`], checked |
//! | Kalibr camchain, OpenCV YAML, EuRoC `sensor.yaml` | [`camera_file::load`] | [`hzn_core::camera::Config`] |
//! | `frames.csv` | [`frames::load`] | time, altitude, position, attitude of every picture |
//! | `residuals.csv` | [`residual_table::read`] | residuals of a lens calibration |
//!
//! [`document`] reads TOML files of other crates with the same checks, for example scene.toml.
//!
//! [`start`] writes a sensor.toml for a camera without a calibration.
//!
//! Every error is a [`Problem`]: it names the file, the line, the field and what was expected. For a misspelt name it
//! suggests the nearest valid one. [`template`] is a commented sensor.toml to start from; [`keys`] describes every key.
//! [`noise`] measures limb height and noise on the pictures of a flight.

mod adjust;
pub mod board;
mod body_defaults;
mod calibrated;
pub mod camera_file;
mod camera_section;
pub mod conversion;
pub mod corners;
pub mod document;
#[cfg(test)]
mod draws;
mod finish;
pub mod frames;
mod ideal;
pub mod keys;
pub mod lens_error;
pub mod limited;
mod located;
mod merge;
pub mod migrate;
mod nearest;
pub mod noise;
pub mod plausible;
pub mod points;
mod problem;
pub mod residual_table;
mod robust;
pub mod sensor;
pub mod sky;
mod staged;
pub mod start;
pub mod template;
pub mod time;

pub use camera_section::named_camera_file;
pub use frames::{FrameData, Frames, Orientation};
pub use nearest::nearest;
pub use problem::Problem;
pub use sensor::Sensor;
