//! Tests of camera files and of sensor.toml.

mod camera_files;
mod further_tools;
mod presets;
