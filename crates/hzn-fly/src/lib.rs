//! The flight software of [`hzn_flight`] on a Linux computer, and the line between it and the ground.
//!
//! | module | idea |
//! |---|---|
//! | [`link`] | the line over UDP, TCP or a serial port; the ground uses it too |
//! | [`flight`] | the flight: preparation, loop, end |
//! | `board` | Linux as the board of the flight software |
//! | [`camera`] | pictures from a pipe or a camera of Video4Linux 2 |
//! | [`flash`] | the files that hold parameters and survive a crash |
//! | [`log`] | the answers as recordings, within a share of the disk |
//! | `log_clock` | the time of the log |
//! | `notify` | messages to systemd |
//! | `signals` | the lines of the vehicle, and the wish to stop |
//! | [`latency`] | the time from the last byte of a picture to its packet |
//!
//! Only [`link`], [`latency`] and [`tell`] exist on other systems.
#![forbid(unsafe_code)]
#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library prints nothing; the caller does")]

#[cfg(target_os = "linux")]
mod board;
#[cfg(target_os = "linux")]
pub mod camera;
#[cfg(target_os = "linux")]
mod error;
#[cfg(target_os = "linux")]
pub mod flash;
#[cfg(target_os = "linux")]
pub mod flight;
pub mod latency;
pub mod link;
#[cfg(target_os = "linux")]
pub mod log;
#[cfg(target_os = "linux")]
mod log_clock;
#[cfg(target_os = "linux")]
mod notify;
#[cfg(target_os = "linux")]
mod signals;
pub mod tell;

#[cfg(target_os = "linux")]
pub use board::Counts;
#[cfg(target_os = "linux")]
pub use error::Error;
