//! Reads and writes the files that describe a horizon sensor and its pictures.
//!
//! | file | read by | gives |
//! |---|---|---|
//! | `sensor.toml` | [`sensor::load`] | [`hzn_core::Config`], checked |
//! | `rig.toml` | [`rig::load`] | the heads of a rig, checked |
//! | Kalibr camchain, OpenCV YAML, EuRoC `sensor.yaml` | [`camera_file::load`] | [`hzn_core::camera::Config`] |
//! | `frames.csv` | [`frames::load`] | time, altitude, position, attitude of every picture |
//! | `truth.csv` | [`truth::load`] | the truth about every picture of a simulation |
//! | `vehicle.csv` | serde, row by row | the truth about the vehicle of a simulation ([`vehicle`]) |
//!
//! [`png`] leaves colour profiles and texts out of PNG files.
//!
//! [`document`] reads TOML files of other crates with the same checks, for example scene.toml.
//!
//! [`start`] writes a sensor.toml for a camera without a calibration; [`migrate`] rewrites a file with old names.
//!
//! Every error is a [`Problem`]: it names the file, the line, the field and what was expected. For a misspelt name it
//! suggests the nearest valid one. [`template`] is a commented sensor.toml to start from; [`keys`] describes every key.

mod body_defaults;
pub mod camera_file;
mod camera_section;
pub mod document;
pub mod features;
pub mod frames;
pub mod keys;
pub mod limited;
mod located;
mod merge;
pub mod migrate;
mod nearest;
pub mod plausible;
pub mod png;
mod problem;
mod quoted;
pub mod rig;
pub mod rotations;
pub mod sensor;
mod separator;
pub mod shapes;
pub mod start;
pub mod template;
pub mod time;
pub mod truth;
pub mod unix_lines;
pub mod utc;
pub mod vehicle;

pub use camera_section::{files_of_sensor, named_camera_file};
pub use frames::{FrameData, Frames, Orientation};
pub use nearest::{nearest, suggestion};
pub use problem::Problem;
pub use quoted::quoted;
pub use sensor::Sensor;
pub use separator::separator_hint;
