//! Shared code for the tests of the whole chain: sensors in both precisions, comparison of answers with the truth,
//! tallies, the accuracy table, and photographs.
//!
//! | module | idea |
//! |---|---|
//! | [`sensors`] | both precisions of the sensor behind one call |
//! | [`tally`] | errors, sigmas and NEES of many answers |
//! | [`table`] | accuracy by altitude, noise, visible arc and lens |
//! | [`artefact`] | pictures with flares, windows, panels or ground instead of a limb |
//! | [`disc`] | discs of Sun and Moon |
//! | [`emulated`] | the firmware in QEMU |
//! | [`flight_image`] | the flight image in QEMU, with its camera, its flash and its serial line |
//! | [`stack_bound`] | a bound of a firmware image's stack, from its disassembly |
//! | [`real`] | photographs with their sensor.toml, and the fitted limb drawn over them |

pub mod artefact;
pub mod disc;
pub mod emulated;
pub mod flight_image;
pub mod real;
pub mod sensors;
pub mod stack_bound;
pub mod table;
pub mod tally;

pub use sensors::{Answer, Sensors, prior_of_scene};
pub use tally::Tally;
