//! The flight software around [`hzn_core`]: parameters that survive a reset, modes, telecommands and telemetry.
//!
//! There is no heap, no unsafe code, no clock and no hardware. (The crate `hzn-twice`, which compares the bytes of
//! values that are kept twice, has unsafe code.) A board provides clock and hardware (`firmware/` of this
//! project); the tests of this crate have their own board.
//!
//! | module | idea |
//! |---|---|
//! | [`parameters`] | every parameter by number, and its limits |
//! | [`operations`] | the parameters of the flight software itself |
//! | [`bytes`] | conversion of numbers to bytes and back |
//! | [`answer`] | a report as records, with every bit |
//! | [`integrity`] | how far an answer can be trusted, as a record |
//! | [`record`] | the fields of packets, with a table that describes them |
//! | [`layout`] | the packets as lists of records |
//! | [`cuc`] | the time code of packets |
//! | [`assembly`] | the packets of a picture put together on the ground |
//! | [`packet`] | space packets on a serial line |
//! | [`inbox`] | whole packets from a line that is not perfect |
//! | [`joint`] | the joint answer of several heads as a record |
//! | [`messages`] | the contents of packets |
//! | [`navigation`] | the records of position, attitude and Sun among them |
//! | [`attitude`] | the attitude and the Sun, moved to the exposure |
//! | [`board`] | the functions that a board provides |
//! | [`store`] | two copies of the parameters |
//! | [`flight`] | the loop |
//! | [`view`] | the two ways in which a board shows a picture |
//! | [`table`] | the parameters as bytes with a checksum |
//! | [`authentication`] | telecommands that only the owner of a secret can make |

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod answer;
pub mod assembly;
pub mod attitude;
pub mod authentication;
pub mod board;
pub mod bytes;
pub mod cuc;
pub mod flight;
pub mod inbox;
pub mod integrity;
pub mod joint;
pub mod layout;
pub mod messages;
pub mod navigation;
mod numbered;
pub mod operations;
pub mod packet;
pub mod parameters;
pub mod record;
pub mod store;
pub mod table;
pub mod view;

pub use parameters::Parameters;

/// Version of this crate: major, minor and patch in one byte each, from the second byte on.
// The major version is in the highest byte in use, so that a later version is a larger number.
pub const VERSION: u32 = number(env!("CARGO_PKG_VERSION_MAJOR")) << 16
    | number(env!("CARGO_PKG_VERSION_MINOR")) << 8
    | number(env!("CARGO_PKG_VERSION_PATCH"));

const fn number(digits: &str) -> u32 {
    let mut rest = digits.as_bytes();
    let mut value = 0;
    while let [digit, after @ ..] = rest {
        value = value * 10 + (*digit - b'0') as u32;
        rest = after;
    }
    value
}
