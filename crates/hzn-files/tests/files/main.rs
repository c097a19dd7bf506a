//! Tests of camera files and of sensor.toml.

mod camera_files;
mod foreign_lenses;
mod further_tools;
mod presets;
