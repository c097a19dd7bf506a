//! What flies around [`hzn_core`]: parameters that survive a reset, modes, telecommands and telemetry.
//!
//! No heap, no unsafe code, no clock and no hardware: a board brings those (`firmware/` of this project), and the tests
//! of this crate bring their own.
//!
//! | module | idea |
//! |---|---|
//! | [`parameters`] | every parameter by number, and its limits |
//! | [`bytes`] | numbers into bytes and back |
//! | [`answer`] | a report with every bit |
//! | [`table`] | the parameters as bytes with a checksum |

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod answer;
pub mod bytes;
pub mod parameters;
pub mod table;

pub use parameters::Parameters;
