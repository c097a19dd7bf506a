//! The ground station: the other end of a flight computer's line.
//!
//! | file | idea |
//! |---|---|
//! | `encode` | the text of a command as packets |
//! | `stream` | packets in words, and as rows |
//! | `outputs` | the files that telemetry becomes |
//! | `station` | packets on their way from bytes to files |
//! | `commander` | commands, each with its acknowledgement |
//! | `incoming` | bytes that come, commands that go |
//! | `view` | what the screen shows |
//! | `screen` | the terminal, the keys and the loop |

mod commander;
mod encode;
mod incoming;
mod outputs;
mod screen;
mod station;
mod stream;
mod view;

pub(super) use commander::Commander;
pub(super) use encode::{encode, loaded_files, write_packet};
pub(super) use incoming::Incoming;
pub(super) use screen::show;
pub(super) use station::Station;
