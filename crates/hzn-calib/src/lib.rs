//! Descriptions of a horizon sensor as they stand on disk.
//!
//! | file | read by | gives |
//! |---|---|---|
//! | `sensor.toml` | [`sensor::load`] | [`hzn_core::Config`], checked |
//! | Kalibr camchain, OpenCV YAML, EuRoC `sensor.yaml` | [`camera_file::load`] | [`hzn_core::camera::Config`] |
//! | `frames.csv` | [`frames::load`] | time, altitude, position, attitude of every picture |
//!
//! [`document`] reads TOML files of other crates, such as scene.toml, in the same way.
//!
//! [`start`] writes a sensor.toml for a camera that nobody calibrated.
//!
//! Whatever is wrong with a file comes back as a [`Problem`]: which file, which line, which field, what was expected
//! and, for a misspelt name, the nearest valid one. [`template`] writes a commented sensor.toml to start from; [`keys`]
//! is what every key of it means. [`noise`] measures limb height and noise on the pictures of a flight.

pub mod camera_file;
pub mod document;
pub mod frames;
pub mod keys;
mod located;
mod nearest;
pub mod noise;
pub mod plausible;
mod problem;
pub mod sensor;
pub mod start;
pub mod template;
pub mod time;

pub use frames::{FrameData, Frames};
pub use nearest::nearest;
pub use problem::Problem;
pub use sensor::Sensor;
