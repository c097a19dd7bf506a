//! Tests of the command `hzn`, through the binary.

mod bad_input;
mod bodies;
mod calibrate;
mod calibrate_lens;
mod calibrate_sky;
mod camera;
mod campaign;
mod commands;
mod common;
mod corners;
mod evaluate;
mod faults;
mod fly;
mod fuse;
mod gates;
mod outputs;
mod pictures;
mod position_input;
mod power_cut;
mod rerun;
mod resume;
mod run;
mod sensitivity;
mod simulate;
mod telemetry;
mod video;
