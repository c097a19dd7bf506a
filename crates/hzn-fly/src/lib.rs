//! The flight software of [`hzn_flight`] on a Linux computer, and the line between it and the ground.
//!
//! | module | idea |
//! |---|---|
//! | [`link`] | the line over UDP, TCP or a serial port; the ground uses it too |
//! | `start` | the start of a flight, of one camera or of a rig |
//! | [`flight`] | the flight of one camera: preparation, loop, end |
//! | `rig` | the flight of several cameras (heads) that are one sensor |
//! | `prepare` | the parameters of a head before the flight |
//! | `board` | Linux as the board of the flight software |
//! | `head` | a camera of the board: its pictures, its parameters, its counts |
//! | [`joint`] | the joint answer of a rig as a row |
//! | [`camera`] | pictures from a pipe, a camera of Video4Linux 2, or a recording |
//! | [`flash`] | the files that hold parameters and survive a crash |
//! | [`log`] | the answers as recordings, within a share of the disk |
//! | `keeper` | pictures that are kept with their answers |
//! | `log_clock` | the time of the log |
//! | `notify` | messages to systemd |
//! | `signals` | the lines of the vehicle, and the wish to stop |
//! | [`latency`] | the time from the last byte of a picture to its packet |
//!
//! Only [`link`], [`joint`], [`latency`] and [`tell`] exist on other systems.
#![forbid(unsafe_code)]
#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library prints nothing; the caller does")]

#[cfg(target_os = "linux")]
mod board;
#[cfg(target_os = "linux")]
pub mod camera;
mod error;
#[cfg(target_os = "linux")]
pub mod flash;
#[cfg(target_os = "linux")]
pub mod flight;
#[cfg(target_os = "linux")]
mod head;
pub mod joint;
#[cfg(target_os = "linux")]
mod keeper;
pub mod key_file;
pub mod latency;
pub mod link;
#[cfg(target_os = "linux")]
pub mod log;
#[cfg(target_os = "linux")]
mod log_clock;
#[cfg(target_os = "linux")]
mod notify;
#[cfg(target_os = "linux")]
mod prepare;
#[cfg(target_os = "linux")]
mod rig;
#[cfg(target_os = "linux")]
mod signals;
#[cfg(target_os = "linux")]
mod start;
pub mod tell;

pub use error::Error;
#[cfg(target_os = "linux")]
pub use head::Counts;
#[cfg(target_os = "linux")]
pub use keeper::Which;
#[cfg(target_os = "linux")]
pub use start::fly;
