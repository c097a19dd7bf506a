//! The ground station: the other end of a flight computer's line.
//!
//! | module | idea |
//! |---|---|
//! | [`mod@encode`] | the text of a command as packets |
//! | [`mod@alarms`] | what an operator should look at |
//! | [`commander`] | commands, each with its acknowledgement |
//! | [`incoming`] | bytes that come, commands that go |
//! | [`station`] | packets on their way from bytes to files |
//! | [`stream`] | packets in words, and as rows |
//! | `outcome` | the outcome of a telecommand in words |
//! | `outputs` | the files that telemetry becomes |
//! | [`tai`] | the time of the packets, and UTC |
//! | [`xtce`] | the dictionary of the packets, for other ground systems |
//! | `xtce_commands`, `xtce_text` | its telecommands, and what both halves share |
//!
//! The crate prints nothing: whoever makes a [`Station`] or a [`Commander`] gives it a
//! [`Tell`](hzn_fly::tell::Tell), which shows the messages.

#![deny(clippy::print_stdout, clippy::print_stderr, reason = "a library prints nothing; the caller does")]

pub mod alarms;
pub mod commander;
pub mod encode;
mod error;
pub mod incoming;
mod outcome;
mod outputs;
pub mod station;
pub mod stream;
pub mod tai;
pub mod xtce;
mod xtce_commands;
mod xtce_text;

pub use alarms::{SILENT_AFTER, alarms};
pub use commander::{Answered, Commander};
pub use encode::{encode, loaded_files, write_packet};
pub use error::Error;
pub use incoming::{Came, Incoming};
pub use station::Station;
pub use stream::{Seen, StreamCounts};
